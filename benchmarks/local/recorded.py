"""Reads and writes files of local problems, for `drake-dress bench local --recorded`."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from drake_dress.errors import UserError
from drake_dress.models.control.local_problem import LocalProblem
from drake_dress.models.control.norm_bounds import NormBounds

_PLAIN = tuple(f.name for f in dataclasses.fields(LocalProblem) if not f.name.endswith("_bounds"))
_PARTS = tuple(f.name for f in dataclasses.fields(NormBounds))


def write_problems(path: Path, problems: Sequence[LocalProblem]) -> None:
    """Writes problems of equal size, stacked, as NPZ."""
    stacked = {name: np.stack([getattr(p, name) for p in problems]) for name in _PLAIN}
    for bounds in ("state_bounds", "input_bounds"):
        for part in _PARTS:
            stacked[f"{bounds}.{part}"] = np.stack(
                [getattr(getattr(p, bounds), part) for p in problems]
            )
    with path.open("wb") as file:
        np.savez_compressed(file, allow_pickle=False, **stacked)


def read_problems(path: Path) -> list[LocalProblem]:
    """Returns the problems of a file.

    Raises:
        UserError: The file cannot be read, or has other content.
    """
    try:
        with np.load(path, allow_pickle=False) as file:
            arrays = dict(file)
        return [_problem(arrays, i) for i in range(len(arrays["start"]))]
    except OSError as error:
        raise UserError(str(path), "", f"cannot be read: {error.strerror or error}") from None
    except (ValueError, KeyError, IndexError, EOFError) as error:
        raise UserError(str(path), "", f"expected local problems as NPZ: {error}") from None


def _problem(arrays: Mapping[str, Any], i: int) -> LocalProblem:
    fields: dict[str, Any] = {name: arrays[name][i] for name in _PLAIN}
    for bounds in ("state_bounds", "input_bounds"):
        fields[bounds] = NormBounds(*(arrays[f"{bounds}.{part}"][i] for part in _PARTS))
    return LocalProblem(**fields)
