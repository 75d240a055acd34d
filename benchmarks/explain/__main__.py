"""`python -m benchmarks.explain`: hides effects, explains the data, and counts what was right.

Each case's result is kept as JSON and is not run again, so that a long study may be interrupted and
resumed; remove the files to run it with other code.
"""

from __future__ import annotations

import argparse
import dataclasses
import json
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.cloth.table import Table
from benchmarks.explain.cases import COARSE, Case, cases, make
from benchmarks.parser import INTERRUPTED, UNUSABLE, OneLineParser
from drake_dress.diagrams.scenario import load_scenario
from drake_dress.discrepancy.experiment import Experiment
from drake_dress.discrepancy.explanation import DISCRETISATION, Explanation, explain
from drake_dress.errors import UserError
from drake_dress.interrupt import caught_interrupt
from drake_dress.models.effects.effect import Effect

GROUPS = ("effect", "nothing", "pair", "coarse", "outside")
_DRAWS = {"effect": 4, "nothing": 40, "pair": 20, "coarse": 10, "outside": 4}
# Confidence below which a kin of what was hidden may be named.
_LOW = 0.7
_SCENARIO = Path(__file__).parents[2] / "scenarios" / "measured.yaml"


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs all cases and prints tables; returns 0, 2 for bad arguments, 130 after Ctrl-C."""
    options = _parser().parse_args(arguments)
    draws = {g: options.draws or _DRAWS[g] for g in GROUPS}
    chosen = cases(options.only, draws, options.seed, options.size, options.noise)
    results: list[dict[str, Any]] = []
    print(f"seed {options.seed}, {len(chosen)} cases, results in {options.cache}", flush=True)
    with caught_interrupt() as stop:
        for number, case in enumerate(chosen, 1):
            if stop.is_set():
                break
            result = _run(case, options.cache)
            results.append(result)
            print(f"{number}/{len(chosen)} {_line(result)}", flush=True)
    for table in tables(results):
        if table.rows:
            print(f"\n{table.text()}", flush=True)
    if options.json:
        options.json.write_text(json.dumps(results, indent=1) + "\n", encoding="utf-8")
    return INTERRUPTED if stop.is_set() else 0


def _run(case: Case, cache: Path) -> dict[str, Any]:
    path = cache / f"{case.name}.json"
    if path.exists():
        kept: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
        return kept
    plain = load_scenario(_SCENARIO)
    hidden, recordings = make(case, plain, _SCENARIO.parent, cache)
    scenario = load_scenario(_SCENARIO, COARSE) if case.group == "coarse" else plain
    begin = time.perf_counter()
    with Experiment(scenario, _SCENARIO.parent, recordings) as experiment:
        found = explain(experiment, case.seed)
    result = _result(case, hidden, found, time.perf_counter() - begin)
    cache.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(result, indent=1) + "\n", encoding="utf-8")
    return result


def _result(
    case: Case, hidden: Sequence[Effect], found: Explanation, seconds: float
) -> dict[str, Any]:
    return {
        "case": dataclasses.asdict(case),
        "hidden": {e.NAME: e.values() for e in hidden},
        "verdict": found.verdict,
        "causes": [
            {
                "effect": c.name,
                "values": {} if c.effect is None else c.effect.values(),
                "std": c.std,
                "gain": c.gain,
                "confidence": c.confidence,
            }
            for c in found.causes
        ],
        "candidates": [[s.name, s.screened, s.fitted] for s in found.scores],
        "gain": found.gain,
        "loss": found.loss,
        "before": found.before,
        "after": found.after,
        "numerics": found.numerics,
        "seconds": seconds,
    }


def right(result: dict[str, Any]) -> bool:
    """Returns whether the verdict is what was hidden, all of it and nothing else.

    What the list of effects lacks must be called unexplained, or named with low confidence.
    """
    named = {c["effect"] for c in result["causes"]}
    wanted = set(result["hidden"])
    if result["case"]["group"] == "coarse":
        return result["verdict"] == "named" and named == {DISCRETISATION}
    if result["case"]["group"] == "outside":
        sure = any(c["confidence"] >= _LOW for c in result["causes"])
        return result["verdict"] == "unexplained" or (result["verdict"] != "nothing" and not sure)
    if not wanted:
        return bool(result["verdict"] == "nothing")
    return bool(result["verdict"] == "named" and named == wanted)


def parameter_error(result: dict[str, Any]) -> float | None:
    """Returns how far the parameters of a cause that was named right are off, relative.

    Of vectors the length of the difference over the length; a place on the garment does not count.
    """
    if len(result["hidden"]) != 1 or not right(result):
        return None
    (name, true), found = next(iter(result["hidden"].items())), result["causes"][0]["values"]
    keys = ["mass"] if name == "local_mass" else ["rate"] if name == "gripper_slip" else list(true)
    a, b = np.array([true[k] for k in keys]), np.array([found[k] for k in keys])
    return float(np.linalg.norm(b - a) / np.linalg.norm(a))


def tables(results: Sequence[dict[str, Any]]) -> list[Table]:
    """Returns the tables of a study."""
    effects = [r for r in results if r["case"]["group"] == "effect"]
    rows = []
    for name in dict.fromkeys(r["case"]["hide"] for r in effects):
        mine = [r for r in effects if r["case"]["hide"] == name]
        errors = [e for r in mine if (e := parameter_error(r)) is not None]
        unsure = [
            r
            for r in mine
            if r["verdict"] == "ambiguous" and name in {c["effect"] for c in r["causes"]}
        ]
        rows.append(
            [
                name,
                len(mine),
                sum(map(right, mine)),
                len(unsure),
                100.0 * float(np.median(errors)) if errors else None,
                float(np.median([r["gain"][0] for r in mine])),
                float(np.median([r["loss"]["refined"] for r in mine])),
            ]
        )
    header = ["hidden", "draws", "right", "ambiguous", "parameter error, %", "gain", "loss before"]
    whole = []
    for group, asked in (
        ("effect", 90),
        ("nothing", 95),
        ("pair", 75),
        ("coarse", 90),
        ("outside", 100),
    ):
        mine = [r for r in results if r["case"]["group"] == group]
        if not mine:
            continue
        share = 100.0 * np.mean([right(r) for r in mine])
        seconds = float(np.median([r["seconds"] for r in mine]))
        whole.append([group, len(mine), float(share), asked, seconds])
    return [
        Table("Each effect", header, rows),
        Table("All", ["group", "draws", "right, %", "asked, %", "time, s"], whole),
    ]


def _line(result: dict[str, Any]) -> str:
    case = result["case"]
    named = ", ".join(f"{c['effect']} ({c['gain']:.2f})" for c in result["causes"])
    mark = "right" if right(result) else "WRONG"
    return f"{mark} {case['group']} {case['hide']} {case['seed']}: {result['verdict']} {named}"


def _parser() -> argparse.ArgumentParser:
    parser = OneLineParser(prog="drake-dress bench explain", description=__doc__)
    parser.add_argument(
        "--only", type=_groups, default=list(GROUPS), metavar="GROUP,…", help=", ".join(GROUPS)
    )
    parser.add_argument("--draws", type=int, help="of each; default 4, 40, 20, 10 and 4")
    parser.add_argument("--seed", type=int, default=1000, help="of the first draw")
    parser.add_argument("--size", type=float, default=1.0, help="of effects, times what matters")
    parser.add_argument("--noise", type=float, default=1e-3, help="of markers, m")
    parser.add_argument("--cache", type=Path, default=Path("out/bench-explain"), metavar="DIR")
    parser.add_argument("--json", type=Path, metavar="FILE")
    return parser


def _groups(text: str) -> list[str]:
    names = text.split(",")
    for name in names:
        if name not in GROUPS:
            raise argparse.ArgumentTypeError(f"{name} is no group, expected {', '.join(GROUPS)}")
    return names


if __name__ == "__main__":
    try:
        sys.exit(main())
    except UserError as error:
        print(f"drake-dress: {error}", file=sys.stderr)
        sys.exit(UNUSABLE)
