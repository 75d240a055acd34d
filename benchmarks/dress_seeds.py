"""Dresses one scenario with many seeds and prints the result of each run.

    python -m benchmarks.dress_seeds scenarios/dummy_varied.yaml --seeds 0-9

Every run is a separate `drake-dress run`; its log, report and replay stay in OUT/seed_N. After
Ctrl-C the table contains the finished runs. The exit status is 1 if a run gave no result.
"""

from __future__ import annotations

import argparse
import json
import sys
from concurrent.futures import ThreadPoolExecutor, as_completed
from pathlib import Path
from typing import Any

from benchmarks.kept import seed_range
from benchmarks.parser import output_file
from benchmarks.scenario_run import run_scenario
from drake_dress.file_output import write_text
from drake_dress.report.summary import read_summary

_COLUMNS = (
    ("success", "{}"),
    ("s_left", "{:.2f}"),
    ("s_right", "{:.2f}"),
    ("dressing_time_s", "{:.1f}"),
    ("max_gripper_force_N", "{:.1f}"),
    ("max_edge_strain", "{:.3f}"),
    ("max_penetration_m", "{:.4f}"),
    ("simulated_time_s", "{:.1f}"),
    ("wall_time_s", "{:.0f}"),
)


def main() -> int:
    """Runs the seeds; returns the exit status."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scenario", type=Path)
    parser.add_argument("--seeds", type=seed_range, default=range(10), metavar="A-B")
    parser.add_argument("--jobs", type=int, default=2, help="runs at once (default 2)")
    parser.add_argument("--out", type=Path, default=Path("out/seeds"))
    parser.add_argument("--json", type=output_file, help="write all summaries here")
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE")
    options = parser.parse_args()
    results: dict[int, dict[str, Any]] = {}
    pool = ThreadPoolExecutor(options.jobs)
    pending = {pool.submit(_dress, options, seed): seed for seed in options.seeds}
    try:
        for future in as_completed(pending):
            seed = pending[future]
            results[seed] = future.result()
            print(f"seed {seed}: {results[seed].get('reason') or 'both sleeves on'}", flush=True)
    except KeyboardInterrupt:
        pool.shutdown(wait=False, cancel_futures=True)
    _print_table(results)
    if options.json:
        write_text(options.json, json.dumps(results, indent=2, sort_keys=True) + "\n")
    return int(any("success" not in result for result in results.values()))


def _dress(options: argparse.Namespace, seed: int) -> dict[str, Any]:
    out = options.out / f"seed_{seed}"
    _, problem = run_scenario(options.scenario, out, options.set, seed)
    if problem:
        return {"reason": problem}
    return read_summary(out / "summary.json")


def _print_table(results: dict[int, dict[str, Any]]) -> None:
    print("| seed | " + " | ".join(name for name, _ in _COLUMNS) + " | reason |")
    print("| --- " * (len(_COLUMNS) + 2) + "|")
    for seed in sorted(results):
        values = [_shown(results[seed].get(name), form) for name, form in _COLUMNS]
        print(f"| {seed} | " + " | ".join(values) + f" | {results[seed].get('reason') or ''} |")
    dressed = sum(bool(result.get("success")) for result in results.values())
    print(f"dressed: {dressed} of {len(results)}")


def _shown(value: Any, form: str) -> str:
    return "–" if value is None else form.format(value)


if __name__ == "__main__":
    sys.exit(main())
