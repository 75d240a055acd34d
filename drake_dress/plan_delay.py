"""How long plans take on this machine, as it was measured once."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from drake_dress.caches import user_cache
from drake_dress.file_output import write_text
from drake_dress.models.arrays import FloatArray

# Share of the plans that are there within the time that is kept.
SHARE = 0.95
_FILE = "plan_delay.json"
# Solves from which their quantile says something.
LEAST = 40


def keep_plan_delay(solve_time: FloatArray) -> tuple[float, Path]:
    """Keeps within which time `SHARE` of the solves ended, s; returns it, and where it is kept.

    Args:
        solve_time: (k,) s, of a run on this machine with nothing beside it.

    Raises:
        ValueError: they are too few, or nothing can be kept here.
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
    """Returns what was measured on this machine, s; None where nothing was."""
    folder = user_cache()
    if folder is None:
        return None
    try:
        seconds = json.loads((folder / _FILE).read_text(encoding="utf-8"))["seconds"]
        return float(seconds) if 0.0 < float(seconds) < np.inf else None
    except (OSError, ValueError, KeyError, TypeError):
        return None
