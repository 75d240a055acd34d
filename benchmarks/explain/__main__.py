"""`python -m benchmarks.explain`: hides effects, explains the data, counts correct answers.

The result of each case is kept and not run again, so that a long study can be interrupted and
resumed. It is kept in the cache with the simulated data, and in the file of `--json`, which does
not need the cache. Remove both before running the study with changed code.
"""

from __future__ import annotations

import argparse
import dataclasses
import json
import threading
import time
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

from benchmarks.explain.cases import COARSE, Case, make, study
from benchmarks.explain.tables import figures, reliability_plot, right, tables
from benchmarks.kept import read_results, write_results
from benchmarks.parser import (
    OneLineParser,
    at_least_one,
    exit_with,
    output_file,
    output_folder,
    seed_number,
    some_of,
)
from benchmarks.section import add_into_option, around, write_between
from drake_dress.diagrams.scenario import load_scenario
from drake_dress.discrepancy.experiment import Experiment
from drake_dress.discrepancy.explanation import Explanation, explain
from drake_dress.discrepancy.results import write_json
from drake_dress.file_output import write_text
from drake_dress.interrupt import caught_interrupt
from drake_dress.machine import worker_count
from drake_dress.models.effects.effect import Effect

GROUPS = ("effect", "nothing", "pair", "coarse", "outside")
_DRAWS = {"effect": 4, "nothing": 40, "pair": 20, "coarse": 10, "outside": 4}
_NAME = "explain"
_SCENARIO = Path(__file__).parents[2] / "scenarios" / "measured.yaml"


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs all cases and prints tables; returns 0, 2 for bad arguments, 130 after Ctrl-C."""
    options = _parser().parse_args(arguments)
    if options.into:
        around(options.into, _NAME)
    draws = {g: options.draws or _DRAWS[g] for g in GROUPS}
    chosen = study(options.only, draws, options.seed, options.size, options.noise, options.beside)
    workers = max(1, worker_count() // options.jobs)
    kept = {} if options.json is None else read_results(options.json, name_of, _NAME)
    new = [case for case in chosen if case.name not in kept]
    if options.kept:
        chosen, new = [case for case in chosen if case.name in kept], []
    print(f"seed {options.seed}, {len(chosen)} cases, {len(new)} of them not run yet", flush=True)
    with caught_interrupt() as stop:
        for number, result in enumerate(_all(new, options.cache, options.jobs, workers, stop), 1):
            kept[name_of(result["case"])] = result
            if options.json is not None:
                write_results(options.json, kept)
            print(f"{number}/{len(new)} {_line(result)}", flush=True)
    results = [kept[case.name] for case in chosen if case.name in kept]
    if options.json is not None and not options.kept:
        write_results(options.json, kept, figures(results))
    shown = "\n\n".join(t.text() for t in tables(results) if t.rows)
    print(f"\n{shown}", flush=True)
    if options.into:
        write_between(options.into, _NAME, shown)
    if options.plot:
        write_text(options.plot, reliability_plot(results))
    return stop.status if stop.is_set() else 0


def name_of(case: dict[str, Any]) -> str:
    """Returns the name of a kept case."""
    return Case(**case).name


def _all(
    chosen: Sequence[Case], cache: Path, jobs: int, workers: int, stop: threading.Event
) -> Iterator[dict[str, Any]]:
    """Yields the results in the order of the cases; after Ctrl-C no new case starts."""
    if jobs == 1:
        for case in chosen:
            if stop.is_set():
                return
            yield _run(case, cache, workers)
        return
    # on interruption, cases that have not started are cancelled; finished ones are kept
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


def _line(result: dict[str, Any]) -> str:
    case = result["case"]
    named = ", ".join(f"{c['effect']} ({c['gain']:.2f})" for c in result["causes"])
    mark = "right" if right(result) else "WRONG"
    return f"{mark} {case['group']} {case['hide']} {case['seed']}: {result['verdict']} {named}"


def _parser() -> argparse.ArgumentParser:
    parser = OneLineParser(prog="drake-dress bench explain", description=__doc__)
    parser.add_argument(
        "--only",
        type=some_of(GROUPS),
        default=list(GROUPS),
        metavar="GROUP,…",
        help=", ".join(GROUPS),
    )
    parser.add_argument("--draws", type=at_least_one, help="of each; default 4, 40, 20, 10 and 4")
    parser.add_argument("--seed", type=seed_number, default=1000, help="of the first draw")
    parser.add_argument(
        "--size",
        type=_numbers,
        default=[1.0],
        metavar="S,…",
        help="of effects, times what matters; the first one for all groups, the others for effects",
    )
    parser.add_argument(
        "--noise", type=_numbers, default=[1e-3], metavar="M,…", help="of markers, m; as --size"
    )
    parser.add_argument(
        "--beside",
        type=at_least_one,
        default=1,
        metavar="N",
        help="draws at further sizes and noises",
    )
    add_into_option(parser, _NAME)
    parser.add_argument(
        "--cache", type=output_folder, default=Path("out/bench-explain"), metavar="DIR"
    )
    parser.add_argument(
        "--jobs", type=at_least_one, default=1, metavar="N", help="cases side by side"
    )
    parser.add_argument("--plot", type=output_file, metavar="FILE", help="reliability, SVG")
    parser.add_argument(
        "--kept", action="store_true", help="run nothing; tables of what the file of --json holds"
    )
    parser.add_argument(
        "--json",
        type=output_file,
        metavar="FILE",
        help="results; what is there already is not run again",
    )
    return parser


def _numbers(text: str) -> list[float]:
    try:
        values = [float(t) for t in text.split(",")]
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is no list of numbers") from None
    if not all(0.0 < v < float("inf") for v in values):
        raise argparse.ArgumentTypeError(f"{text} is out of range, expected more than 0")
    return values


if __name__ == "__main__":
    exit_with(main)
