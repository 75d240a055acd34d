"""Conditions that a directory must fulfil after its last run was ended at any time."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from benchmarks.killed.ended_run import Ended
from drake_dress.errors import UserError
from drake_dress.report.log import RunLog

# Files that runs write.
FILES = ("run.h5", "summary.json", "report.html", "replay.html")
# Signals that a run handles; time within which it then ends, with log, report and replay, s.
_ANSWERED, _SOON = ("terminate", "group"), 60.0
# Greatest loss, s: samples are flushed about once per second, and the last flush may be lost.
_FLUSHED = 3.0
# Output of a run that has written all files.
_WRITTEN = "log, report and replay: "
# Valid exit statuses of a terminated run: 128 + SIGTERM, or those of a run that finished before.
_AFTER_TERMINATION = (143, 0, 1)


def fingerprints(folder: Path) -> dict[str, str]:
    """Returns a digest of each of a run's files in a folder."""
    return {
        name: hashlib.sha256((folder / name).read_bytes()).hexdigest()
        for name in FILES
        if (folder / name).is_file()
    }


def problems(
    folder: Path, earlier: Mapping[str, str], seed: int, how: str, end: Ended
) -> list[str]:
    """Returns the problems of the files left by an ended run.

    Args:
        folder: Folder of the run.
        earlier: Digests of the files that an earlier run had left there.
        seed: Seed of the ended run, different from the earlier run's.
        how: How it was ended.
        end: Result of the ended run.
    """
    wrong = _answer_problems(how, end)
    now = fingerprints(folder)
    old = [name for name, digest in now.items() if earlier.get(name) == digest]
    if old and len(old) < len(now):
        wrong.append(f"mixture: {', '.join(old)} of the earlier run beside the later one's")
    # after old results are removed and before the new log exists, only the old log is there
    if old and "run.h5" not in old:
        wrong.append(f"of the earlier run {', '.join(old)} left without its log")
    if old:
        return wrong
    if "run.h5" not in now:
        wrong.append(f"no log of either run, beside {', '.join(now) or 'nothing'}")
        return wrong
    wrong += _log_problems(folder, seed, end)
    if "summary.json" in now:
        summary = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
        if summary["seed"] != seed:
            wrong.append(f"summary of seed {summary['seed']}, log of {seed}")
    return wrong


def _answer_problems(how: str, end: Ended) -> list[str]:
    """Returns the problems of a run's reaction to being ended."""
    wrong = []
    if "Traceback" in end.words:
        wrong.append("traceback")
    if how in _ANSWERED and end.acted is not None and end.wall - end.acted > _SOON:
        wrong.append(f"ended {end.wall - end.acted:.0f} s after SIGTERM")
    if how in _ANSWERED and end.acted is not None and end.status not in _AFTER_TERMINATION:
        # the default action is valid before the run handles signals and after all is written
        by_the_system = end.status == -15 and (end.told[0] <= 0.0 or _WRITTEN in end.words)
        if not by_the_system:
            wrong.append(f"exit status {end.status} after SIGTERM")
    return wrong


def _log_problems(folder: Path, seed: int, end: Ended) -> list[str]:
    try:
        with RunLog.open(folder / "run.h5") as log:
            time = log.time
            if log.seed != seed:
                return [f"log of seed {log.seed}, expected {seed}"]
            for i in range(0, len(log), max(1, len(log) // 20)):
                if not np.isfinite(log.garment_position(i)).all():
                    return [f"sample {i} is not finite"]
    except UserError as error:
        # an unreadable log is valid if nothing had been written yet
        return [f"log cannot be read: {error}"] if end.told[0] > 0.0 else []
    if len(time) > 1 and np.any(np.diff(time) <= 0.0):
        return ["time does not increase"]
    until = end.wall if end.acted is None else end.acted
    due = end.told[0] > 0.0 and until - end.told[1] > _FLUSHED
    if due and (not len(time) or time[-1] < end.told[0] - 0.1):
        return [f"log ends at {time[-1] if len(time) else 0.0:.1f} s, {end.told[0]:g} s was told"]
    return []
