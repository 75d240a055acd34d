"""The seeds of a study: given ones, or ones drawn for a purpose (`drake_dress/seeds.py`).

The root of a draw is printed, so that it can be repeated.
"""

from __future__ import annotations

import argparse
import secrets
from collections.abc import Sequence
from dataclasses import dataclass

from benchmarks.kept import seed_range
from benchmarks.parser import seed_number
from drake_dress.errors import UserError
from drake_dress.seeds import PURPOSES, drawn_seeds

_ROOTS = 10**6


@dataclass(frozen=True)
class Draw:
    """A number of seeds to draw for a purpose in `PURPOSES`."""

    purpose: str
    count: int


def draw_seeds(draw: Draw, root: int) -> list[int]:
    """Returns distinct, sorted seeds for a purpose; equal roots give equal seeds.

    A larger draw with the same root contains the smaller one, so that a study can be extended.
    """
    return sorted(drawn_seeds(draw.purpose, draw.count, root))


def draw_of(text: str) -> Draw:
    """Parses PURPOSE:N; an argparse type."""
    purpose, _, count = text.partition(":")
    if purpose not in PURPOSES or not count.isdecimal():
        raise argparse.ArgumentTypeError(
            f"{text!r} is no draw, expected {', '.join(f'{p}:N' for p in PURPOSES)}"
        )
    most = min(len(PURPOSES[purpose]), 10**5)
    if not 1 <= int(count) <= most:
        raise argparse.ArgumentTypeError(f"{text!r}: expected 1 to {most} seeds")
    return Draw(purpose, int(count))


def add_seed_options(parser: argparse.ArgumentParser, default: Sequence[int]) -> None:
    """Adds `--seeds`, `--draw` and `--root`."""
    named = parser.add_mutually_exclusive_group()
    named.add_argument(
        "--seeds",
        type=seed_range,
        default=default,
        metavar="A-B",
        help=f"default {default[0]}-{default[-1]}: seeds that the rules were made on",
    )
    named.add_argument(
        "--draw",
        type=draw_of,
        metavar="PURPOSE:N",
        help="seeds drawn to develop (0-99), choose (100-999) or report (1000 and above)",
    )
    parser.add_argument("--root", type=seed_number, help="of the draw; a new one by default")


def chosen_seeds(options: argparse.Namespace) -> tuple[Sequence[int], str]:
    """Returns the seeds of a study, and a sentence on them to print above its tables.

    Raises:
        UserError: A root is given without a draw.
    """
    if options.draw is None:
        if options.root is not None:
            raise UserError("bench", "--root", "is of a draw, expected --draw PURPOSE:N with it")
        first, last = options.seeds[0], options.seeds[-1]
        return options.seeds, f"Seeds {first} to {last}."
    root = root_of(options)
    seeds = draw_seeds(options.draw, root)
    said = f"Seeds drawn with `--draw {options.draw.purpose}:{len(seeds)} --root {root}`."
    return seeds, said


def root_of(options: argparse.Namespace) -> int:
    """Returns the root given with `--root`, or a new one."""
    given: int | None = options.root
    return secrets.randbelow(_ROOTS) if given is None else given
