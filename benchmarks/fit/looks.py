"""What the look says of pairs before they are run (`drake_dress/diagrams/garment_fit.py`)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, astuple
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.dressing.cases import SCENARIOS
from benchmarks.fit.drawing import Case, body_of, coat_of, scenario_of, size_for
from benchmarks.kept import read_results, write_results
from drake_dress.diagrams.garment_fit import judged
from drake_dress.errors import UserError
from drake_dress.interrupt import Interrupt, caught_interrupt
from drake_dress.models.garment.fit import Fit
from drake_dress.models.garment.fit.judge import ARMHOLE_AT_EDGES, BACK, CUFF
from drake_dress.side_by_side import completed

# What the look calls a garment, in order of the verdict.
CALLED = ("fits", "tight", "too tight", "cannot go on", "not judged", "cannot be cut")
FITTING, TOO_TIGHT = CALLED[:2], CALLED[2]
# Of which the tightest is looked for: key of a coat, or `back_width`.
MEASURES = ("cuff_girth", "armhole_girth", "back_width")
# The limits that verdicts follow from; verdicts by other limits are made anew.
_LIMITS = [list(astuple(limits)) for limits in (CUFF, ARMHOLE_AT_EDGES, BACK)]
_TOLD = 30  # looks between two lines of progress

Looks = Mapping[str, dict[str, Any]]


def looks_file(results: Path) -> Path:
    """Returns the file that keeps the verdicts beside a study's results."""
    return results.with_name(f"{results.stem}_looks{results.suffix}")


def look_at(case: Case) -> dict[str, Any]:
    """Returns what is drawn of a pair, and what the look says of it.

    `called` is one of `CALLED`, `ratios` has the smaller of left and right of each of `MEASURES`
    to the person's, `tightest` is the one nearest to its limit or furthest below it.
    """
    person, coat = body_of(case.body), coat_of(case)
    found: dict[str, Any] = {
        "preset": coat.preset,
        "size_table": coat.size_table,
        "size": coat.size,
        "own_size": size_for(case.body, coat.size_table),
    }
    found |= {key: getattr(person, key) for key in ("sex", "age", "height", "weight")}
    scenario = scenario_of(case)
    spacings = (scenario.plant.spacing, scenario.controller.spacing)
    try:
        fit = judged(scenario.garment, scenario.person, spacings, SCENARIOS).fit
    except UserError:
        # drawn measures fit each other in one size, and may not in another
        return found | {"called": CALLED[5], "tightest": None, "ratios": {}}
    return found | {"called": _called(fit), **_tightness(fit)}


def all_looks(cases: Sequence[Case], file: Path | None) -> tuple[Looks, Interrupt]:
    """Returns the looks at pairs by name, and the signal that ended them early, if it is set.

    Args:
        cases: pairs.
        file: keeps the looks, and has those of earlier studies; None to keep none. Those by other
            limits than now are made anew.

    Raises:
        UserError: the file has other content.
    """
    found = {} if file is None else read_results(file, lambda case: Case(**case).name, "fit")
    kept = {name: each for name, each in found.items() if each.get("limits") == _LIMITS}
    missing = [case for case in cases if case.name not in kept]
    with caught_interrupt() as stop:
        for number, (case, look) in enumerate(completed(look_at, missing, 1, stop), 1):
            kept[case.name] = {"case": asdict(case), "limits": _LIMITS, "look": look}
            if number % _TOLD == 0 or number == len(missing):
                print(f"looked at {number} of {len(missing)} pairs", flush=True)
                _keep(file, kept)
    _keep(file, kept)
    return {case.name: kept[case.name]["look"] for case in cases if case.name in kept}, stop


def chosen(cases: Sequence[Case], looks: Looks, fitting: int, tight: int, root: int) -> list[Case]:
    """Returns the pairs to run: drawn from the fitting and from the too tight ones.

    Both are evenly spread, so that any first part has as many of each as its share of all.

    Args:
        cases: all pairs.
        looks: at them, by name.
        fitting: largest number of those that fit or are tight.
        tight: largest number of those called too tight.
        root: of the draw.
    """
    order = np.random.default_rng([root, len(cases)]).permutation(len(cases))
    shuffled = [cases[k] for k in order if cases[k].name in looks]
    groups = (
        [c for c in shuffled if looks[c.name]["called"] in FITTING][:fitting],
        [c for c in shuffled if looks[c.name]["called"] == TOO_TIGHT][:tight],
    )
    placed = [((k + 0.5) / len(group), case) for group in groups for k, case in enumerate(group)]
    return [case for _, case in sorted(placed, key=lambda pair: pair[0])]


def _keep(file: Path | None, kept: Looks) -> None:
    if file is not None and kept:
        write_results(file, kept)


def _called(fit: Fit) -> str:
    if fit.impossible:
        return CALLED[3]
    if fit.fits is None:
        return CALLED[4]
    if not fit.fits:
        return TOO_TIGHT
    return CALLED[1] if fit.reasons else CALLED[0]


def _tightness(fit: Fit) -> dict[str, Any]:
    ratios: dict[str, float] = {}
    margins: dict[str, float] = {}
    for row in fit.comparisons:
        if row.measure in MEASURES and row.ratio is not None:
            ratios[row.measure] = min(round(row.ratio, 4), ratios.get(row.measure, np.inf))
            margins[row.measure] = ratios[row.measure] / row.limits.wanted
    return {"tightest": min(margins, key=lambda name: margins[name]), "ratios": ratios}
