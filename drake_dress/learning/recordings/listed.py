"""Recordings as they are listed on the command line, each with settings of its own."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from drake_dress.errors import UserError
from drake_dress.learning.recordings.reading import UPS, RecordingOptions, read_recording
from drake_dress.learning.timed_motion import TimedMotion

# Smallest and largest rate, Hz, and unit, m, that are taken.
RATES, UNITS = (1.0, 2000.0), (1e-6, 10.0)
_LIMITS = {"rate": RATES, "unit": UNITS}
FORM = "FILE[:KEY=VALUE,…]"
_UNSAID = RecordingOptions()
_EXPECTED = "expected up, rate or unit, such as walk.csv:up=y,rate=30"


@dataclass(frozen=True)
class Listed:
    """A recording that was listed.

    Attributes:
        path: of the file.
        how: what the user says of it.
    """

    path: Path
    how: RecordingOptions


def listed(text: str, common: RecordingOptions = _UNSAID) -> Listed:
    """Returns what `FILE` or `FILE:up=y,rate=30,unit=0.01` says.

    Args:
        text: of the command line.
        common: what is said of all files; what a file's own text says comes first.

    Raises:
        UserError: a setting is unknown or out of range.
    """
    name, colon, settings = text.rpartition(":")
    if not colon or "=" not in settings or Path(text).exists():
        return Listed(Path(text), common)
    said: dict[str, Any] = {}
    for setting in settings.split(","):
        key, _, value = setting.partition("=")
        if key == "up":
            if value not in UPS:
                raise UserError(text, key, f"is {value!r}, expected one of {', '.join(UPS)}")
            said[key] = value
        elif key in _LIMITS:
            said[key] = _between(text, key, value, _LIMITS[key])
        else:
            raise UserError(text, key, f"is no setting of a recording, {_EXPECTED}")
    return Listed(Path(name), replace(common, **said))


def read_all(
    files: Sequence[Listed], told: Callable[[str], None] = lambda _: None
) -> list[TimedMotion]:
    """Returns the motions in files; two have the same name only if a file is listed twice.

    Args:
        files: of people.
        told: called with what was found, and with what is wrong if it is so with several files.

    Raises:
        UserError: files cannot be used; all are looked at before.
    """
    found: list[TimedMotion] = []
    wrong: list[UserError] = []
    for file in files:
        try:
            found.append(read_recording(file.path, file.how, told))
        except UserError as error:
            wrong.append(error)
    if len(wrong) == 1:
        raise wrong[0]
    if wrong:
        for each in wrong:
            told(str(each))
        message = f"of {len(files)} cannot be used; settings of one file are given as {FORM}"
        raise UserError("--recordings", str(len(wrong)), message)
    names = _names([file.path for file in files])
    return [replace(motion, name=name) for motion, name in zip(found, names, strict=True)]


def _names(paths: Sequence[Path]) -> list[str]:
    """Returns names of files, with as many folders as tell each from all others."""
    parts = [(*path.resolve().parent.parts, path.stem) for path in paths]
    names = [part[-1] for part in parts]
    depth = 1
    while depth < max(map(len, parts), default=0):
        count = Counter(names)
        if max(count.values()) == 1:
            break
        depth += 1
        names = [
            "/".join(part[-depth:]) if count[name] > 1 else name
            for part, name in zip(parts, names, strict=True)
        ]
    return names


def _between(text: str, key: str, value: str, limits: tuple[float, float]) -> float:
    try:
        number = float(value)
    except ValueError:
        number = float("nan")
    if not limits[0] <= number <= limits[1]:
        expected = f"expected a number from {limits[0]:g} to {limits[1]:g}"
        raise UserError(text, key, f"is {value!r}, {expected}")
    return number
