"""`python -m benchmarks.explain`: hides effects, explains the data, and counts what was right.

Each case's result is kept as JSON and is not run again, so that a long study may be interrupted and
resumed; remove the files to run it with other code.
"""

from __future__ import annotations

import argparse
import dataclasses
import io
import itertools
import json
import os
import sys
import threading
import time
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure

from benchmarks.cloth.table import Table
from benchmarks.explain.cases import COARSE, Case, cases, make
from benchmarks.parser import INTERRUPTED, UNUSABLE, OneLineParser
from drake_dress.diagrams.scenario import load_scenario
from drake_dress.discrepancy.experiment import Experiment
from drake_dress.discrepancy.explanation import DISCRETISATION, Explanation, explain
from drake_dress.discrepancy.results import write_json
from drake_dress.errors import UserError
from drake_dress.interrupt import caught_interrupt
from drake_dress.models.effects.effect import Effect

GROUPS = ("effect", "nothing", "pair", "coarse", "outside")
_DRAWS = {"effect": 4, "nothing": 40, "pair": 20, "coarse": 10, "outside": 4}
_ASKED = {"effect": 90, "nothing": 95, "pair": 75, "coarse": 90, "outside": 100}
_CONFIDENCES = (0.0, 0.5, 0.7, 0.8, 0.9, 0.95, 1.0)
# Confidence below which a kin of what was hidden may be named.
_LOW = 0.7
_SCENARIO = Path(__file__).parents[2] / "scenarios" / "measured.yaml"


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs all cases and prints tables; returns 0, 2 for bad arguments, 130 after Ctrl-C."""
    options = _parser().parse_args(arguments)
    draws = {g: options.draws or _DRAWS[g] for g in GROUPS}
    chosen = cases(options.only, draws, options.seed, options.size, options.noise)
    workers = max(1, (os.cpu_count() or 1) // options.jobs)
    results: list[dict[str, Any]] = []
    print(f"seed {options.seed}, {len(chosen)} cases, results in {options.cache}", flush=True)
    with caught_interrupt() as stop:
        for number, result in enumerate(
            _all(chosen, options.cache, options.jobs, workers, stop), 1
        ):
            results.append(result)
            print(f"{number}/{len(chosen)} {_line(result)}", flush=True)
    for table in tables(results):
        if table.rows:
            print(f"\n{table.text()}", flush=True)
    if options.json:
        options.json.write_text(json.dumps(results, indent=1) + "\n", encoding="utf-8")
    if options.plot:
        options.plot.write_text(reliability_plot(results), encoding="utf-8")
    return INTERRUPTED if stop.is_set() else 0


def _all(
    chosen: Sequence[Case], cache: Path, jobs: int, workers: int, stop: threading.Event
) -> Iterator[dict[str, Any]]:
    """Yields the results in the order of the cases; after Ctrl-C no new case is begun."""
    if jobs == 1:
        for case in chosen:
            if stop.is_set():
                return
            yield _run(case, cache, workers)
        return
    # nobody waits for a case that has not begun, and what is done is kept
    with ProcessPoolExecutor(jobs) as pool:
        futures = [pool.submit(_run, case, cache, workers) for case in chosen]
        for future in futures:
            while not future.done():
                if stop.wait(1.0):
                    pool.shutdown(cancel_futures=True)
                    return
            yield future.result()


def _run(case: Case, cache: Path, workers: int) -> dict[str, Any]:
    path = cache / f"{case.name}.json"
    if path.exists():
        kept: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
        return kept
    plain = load_scenario(_SCENARIO)
    hidden, recordings = make(case, plain, _SCENARIO.parent, cache, workers)
    scenario = load_scenario(_SCENARIO, COARSE) if case.group == "coarse" else plain
    begin = time.perf_counter()
    with Experiment(scenario, _SCENARIO.parent, recordings, workers=workers) as experiment:
        found = explain(experiment, case.seed)
    result = _result(case, hidden, found, time.perf_counter() - begin, workers)
    cache.mkdir(parents=True, exist_ok=True)
    write_json(path, result)
    return result


def _result(
    case: Case, hidden: Sequence[Effect], found: Explanation, seconds: float, workers: int
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
        "workers": workers,
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
        rows.append(
            [
                name,
                len(mine),
                sum(map(right, mine)),
                sum(map(unsure, mine)),
                100.0 * float(np.median(errors)) if errors else None,
                float(np.median([r["gain"][0] for r in mine])),
                float(np.median([r["loss"]["refined"] for r in mine])),
            ]
        )
    header = ["hidden", "draws", "right", "ambiguous", "parameter error, %", "gain", "loss before"]
    whole = []
    for group, asked in _ASKED.items():
        mine = [r for r in results if r["case"]["group"] == group]
        if not mine:
            continue
        errors = [e for r in mine if (e := parameter_error(r)) is not None]
        gains = [r["gain"][0] for r in mine if r["hidden"]]
        times = [r["seconds"] for r in mine if r["workers"] > 1]
        whole.append(
            [
                group,
                len(mine),
                100.0 * float(np.mean([right(r) for r in mine])),
                asked,
                100.0 * float(np.mean([unsure(r) for r in mine])),
                100.0 * float(np.median(errors)) if errors else None,
                float(np.median(gains)) if gains else None,
                float(np.median(times)) if times else None,
            ]
        )
    return [
        Table("Each effect", header, rows),
        Table(
            "All",
            ["group", "draws", "right, %", "asked, %", "ambiguous, %"]
            + ["parameter error, %", "gain", "time, s"],
            whole,
        ),
        Table(
            "Confidence",
            ["said", "causes", "right, %"],
            [
                [f"{100 * low:.0f} to {100 * high:.0f} %", len(hits), 100.0 * float(np.mean(hits))]
                for low, high, hits in reliability(results)
                if hits
            ],
        ),
    ]


def unsure(result: dict[str, Any]) -> bool:
    """Returns whether the verdict is ambiguous with the right cause among two."""
    named = {c["effect"] for c in result["causes"]}
    return result["verdict"] == "ambiguous" and bool(named & set(result["hidden"]))


def reliability(results: Sequence[dict[str, Any]]) -> list[tuple[float, float, list[bool]]]:
    """Returns for ranges of confidence whether each cause that was given it is right."""
    found = []
    for low, high in itertools.pairwise(_CONFIDENCES):
        hits = [
            _hidden_there(r, c["effect"])
            for r in results
            for c in r["causes"]
            if low <= c["confidence"] < high or (high == 1.0 and c["confidence"] == 1.0)
        ]
        found.append((low, high, hits))
    return found


def _hidden_there(result: dict[str, Any], name: str) -> bool:
    return name in result["hidden"] or (
        name == DISCRETISATION and result["case"]["group"] == "coarse"
    )


def reliability_plot(results: Sequence[dict[str, Any]]) -> str:
    """Returns an SVG: how often causes of a given confidence are right."""
    figure = Figure(figsize=(4.5, 4.0), layout="constrained")
    FigureCanvasSVG(figure)
    ax = figure.subplots()
    ax.plot([0.0, 1.0], [0.0, 1.0], color="#66727f", ls=":")
    for low, high, hits in reliability(results):
        if not hits:
            continue
        share, count = float(np.mean(hits)), len(hits)
        # Wilson's interval, 90 %
        z = 1.645
        middle = (share + z * z / (2 * count)) / (1 + z * z / count)
        spread = z / (1 + z * z / count)
        spread *= np.sqrt(share * (1 - share) / count + z * z / (4 * count * count))
        at = 0.5 * (low + high)
        ax.plot([at, at], [middle - spread, middle + spread], color="#0b7a5e")
        ax.plot(at, share, "o", color="#0b7a5e")
        ax.annotate(str(count), (at, share), (5, -10), textcoords="offset points", fontsize=8)
    ax.set_xlabel("confidence given")
    ax.set_ylabel("share that is right")
    ax.spines[["top", "right"]].set_visible(False)
    with io.StringIO() as text:
        figure.savefig(text, format="svg")
        return text.getvalue()


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
    parser.add_argument("--jobs", type=int, default=1, metavar="N", help="cases side by side")
    parser.add_argument("--plot", type=Path, metavar="FILE", help="reliability, SVG")
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
