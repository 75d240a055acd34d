"""`python -m benchmarks.cloth`: measures the cloth schemes and prints tables."""

from __future__ import annotations

import argparse
import importlib.metadata
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from benchmarks.cloth import limbs
from benchmarks.cloth.comparison import figures_beside_peers
from benchmarks.cloth.measure import Session
from benchmarks.cloth.processes import measure_at_once, measure_in_turn, scene_module
from benchmarks.figures import machine, write_figures
from benchmarks.parser import OneLineParser, at_least_one, output_file, output_folder
from drake_dress.interrupt import caught_interrupt

# The paper's scenes in its order, then additional ones.
SCENES = (
    "draping",
    "placement",
    "tube",
    "tracking",
    "growth",
    "backward",
    "carrying",
    "layers",
    "limbs",
)
_PACKAGES = ("numba", "numpy", "scipy", "mujoco-core", "mujoco", "newton", "warp-lang")
_QUICK_LIMIT = 1.0


def main(arguments: Sequence[str] | None = None) -> int:
    """Measures and prints; returns 0, 2 on bad arguments, 130 after Ctrl-C."""
    options = _parser().parse_args(arguments)
    names = options.only or list(SCENES)
    about = _about()
    print("\n".join(f"{key}: {value}" for key, value in about.items()), flush=True)
    results: dict[str, Any] = {}
    begin = time.perf_counter()

    def finish(name: str, result: dict[str, Any]) -> None:
        results[name] = result
        for table in scene_module(name).tables(result):
            if table.rows:
                print(f"\n{table.text()}\n", flush=True)

    with caught_interrupt() as stop:
        settings = (
            names,
            options.quick,
            _limit(options),
            options.cache,
            tuple(options.engine),
            stop,
            finish,
        )
        if options.jobs == 1:
            measure_in_turn(*settings)
        else:
            measure_at_once(options.jobs, *settings)
        interrupted = stop.is_set()
    wall = time.perf_counter() - begin
    print(f"{wall:.0f} s in all" + (", interrupted" if interrupted else ""))
    if options.json:
        write_figures(
            options.json,
            [*figures_beside_peers(results), *limbs.figures(results.get("limbs"))],
            [],
            about=about,
            quick=options.quick,
            wall_s=wall,
            scenes=results,
        )
        print(f"wrote {options.json}")
    if options.png:
        for name in names:
            if name in results:
                for file in scene_module(name).write_figures(results[name], options.png):
                    print(f"wrote {file}")
    return stop.status if interrupted else 0


def _parser() -> argparse.ArgumentParser:
    parser = OneLineParser(prog="drake-dress bench cloth", description=__doc__.splitlines()[0])
    parser.add_argument("--json", type=output_file, metavar="FILE", help="write all figures here")
    parser.add_argument(
        "--png", type=output_folder, metavar="DIR", help="write plots as cloth_*.png"
    )
    parser.add_argument(
        "--only", type=_names, metavar="NAME,…", help=f"of {', '.join(SCENES)} (default: all)"
    )
    parser.add_argument(
        "--engine",
        action="append",
        default=[],
        metavar="TEXT",
        help="only engines with this in their names; may be given again",
    )
    parser.add_argument("--quick", action="store_true", help="small meshes, within a minute")
    parser.add_argument(
        "--jobs",
        type=at_least_one,
        default=1,
        metavar="N",
        help="scenes at once; 2 and more disturb times",
    )
    parser.add_argument(
        "--limit",
        type=_seconds,
        metavar="S",
        help="wall time that one engine may take for one run (default 10, quick 1)",
    )
    parser.add_argument(
        "--cache",
        type=output_folder,
        default=Path("out/cloth_bench"),
        metavar="DIR",
        help="where fine references are kept",
    )
    parser.add_argument(
        "--no-reference",
        action="store_const",
        const=None,
        dest="cache",
        help="costs alone: do without fine references, which take minutes",
    )
    return parser


def _names(text: str) -> list[str]:
    names = [name for name in text.split(",") if name]
    unknown = [name for name in names if name not in SCENES]
    if unknown or not names:
        raise argparse.ArgumentTypeError(
            f"{', '.join(unknown) or text!r} is no scene, expected some of {', '.join(SCENES)}"
        )
    return [name for name in SCENES if name in names]


def _seconds(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is not a number") from None
    if not 0.0 < value < float("inf"):
        raise argparse.ArgumentTypeError(f"{text} is out of range, expected a number above 0")
    return value


def _limit(options: argparse.Namespace) -> float:
    return options.limit or (_QUICK_LIMIT if options.quick else Session.limit)


def _about() -> dict[str, Any]:
    """Returns versions, processor and threads."""
    about = machine()
    about["threads"] = "one for every engine; peers on the CPU"
    for package in _PACKAGES:
        about[package] = _version(package)
    return {"drake_dress": _version("drake_dress")} | about


def _version(package: str) -> str:
    try:
        return importlib.metadata.version(package)
    except importlib.metadata.PackageNotFoundError:
        return "not installed"


if __name__ == "__main__":
    sys.exit(main())
