"""The plan delay measured on this machine, kept in the user's cache."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from drake_dress.caches import user_cache
from drake_dress.file_output import write_text
from drake_dress.models.arrays import FloatArray

# Share of the plans that are ready within the kept time.
SHARE = 0.95
_FILE = "plan_delay.json"
# Least number of solves for a meaningful quantile.
LEAST = 40


def keep_plan_delay(solve_time: FloatArray) -> tuple[float, Path]:
    """Keeps the `SHARE` quantile of the solve times, s; returns it and the path of the file.

    Args:
        solve_time: (k,) solve times of a run on this machine without other load, s.

    Raises:
        ValueError: There are too few solves, or no cache folder is writable.
    """
    if len(solve_time) < LEAST:
        raise ValueError(f"{len(solve_time)} solves, expected {LEAST} at least")
    folder = user_cache()
    if folder is None:
        raise ValueError("no folder for caches can be written to")
    seconds = float(np.quantile(solve_time, SHARE))
    path = folder / _FILE
    kept = {"seconds": seconds, "share": SHARE, "solves": len(solve_time)}
    write_text(path, json.dumps(kept) + "\n")
    return seconds, path


def kept_plan_delay() -> float | None:
    """Returns the delay measured on this machine, s; None if it was not measured."""
    folder = user_cache()
    if folder is None:
        return None
    try:
        seconds = json.loads((folder / _FILE).read_text(encoding="utf-8"))["seconds"]
        return float(seconds) if 0.0 < float(seconds) < np.inf else None
    except (OSError, ValueError, KeyError, TypeError):
        return None
