"""Whether a garment file was read as what it is, or refused for the right reason."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter

import numpy as np
from scipy.spatial import KDTree

from benchmarks.files.cases import Trial
from benchmarks.files.garments import Made
from drake_dress.errors import UserError
from drake_dress.models.garment.fit import garment_sizes, judge, person_girths
from drake_dress.models.garment.load import MeshOptions, WholeGarment, read_garment
from drake_dress.models.garment.mesh import face_areas, loop_length
from drake_dress.models.human.measures import BodyMeasures
from drake_dress.models.sides import SIDES

MOST_KEYS = 3
# What may differ: places of the cloth, m; its area and the cuffs' girth, as shares; places of the
# openings, m.
_OFF, _AREA, _GIRTH, _PLACE = 0.01, 0.03, 0.03, 0.03
# Farthest place of an armhole from where the sleeve leaves the trunk, m.
_ARMHOLE = 0.2


@dataclass(frozen=True)
class Result:
    """What became of a file.

    Attributes:
        name: kind of file; seed: of its measures.
        wrong: what is wrong with that; empty if nothing is.
        silent: whether it was read without a word and is wrong.
        seconds: how long it took.
    """

    name: str
    seed: int
    wrong: str
    silent: bool
    seconds: float


def carried_out(
    make: Callable[[np.random.Generator, Path], Trial], seed: int, folder: Path
) -> Result:
    """Returns what becomes of a kind of file with the measures of a seed."""
    trial = make(np.random.default_rng(seed), folder)
    start = perf_counter()
    wrong, silent = _wrong(trial)
    return Result(make.__name__, seed, wrong, silent, perf_counter() - start)


def _wrong(trial: Trial) -> tuple[str, bool]:
    if len(trial.keys) > MOST_KEYS:
        return f"takes {len(trial.keys)} keys", False
    try:
        whole = read_garment(trial.path, MeshOptions(**trial.keys))
    except UserError as error:
        told = str(error)
        if "\n" in told:
            return f"is told in several lines: {told!r}", False
        if trial.made is not None:
            return f"is refused: {told}", False
        return ("" if re.search(trial.refusal, told) else f"is refused otherwise: {told}"), False
    if trial.made is None:
        return "is read, though it is none", True
    off = unlike(whole, trial.made)
    if off:
        return off, True
    if trial.note and not any(re.search(trial.note, note) for note in whole.notes):
        return f"is read without the note {trial.note!r}", True
    if trial.judged:
        fit = judge(garment_sizes(whole.mesh()), person_girths(BodyMeasures()))
        told = "; ".join(finding.text for finding in fit.impossible)
        if not re.search(trial.judged, told):
            return f"is judged otherwise: {told!r}", True
    return "", False


def unlike(whole: WholeGarment, made: Made) -> str:
    """Returns in what a garment that was read differs from what is true; empty if in nothing."""
    corner = [(x.min(axis=0) + x.max(axis=0)) / 2 for x in (whole.position, made.x)]
    x = whole.position - corner[0] + corner[1]
    for these, others in ((x, made.x), (made.x, x)):
        off = float(np.percentile(KDTree(others).query(these)[0], 99))
        if off > _OFF:
            return f"cloth is {off:.3f} m from its place"
    area = face_areas(x, whole.faces).sum() / face_areas(made.x, made.faces).sum()
    if abs(area - 1.0) > _AREA:
        return f"the area is {area:.3f} of the right one"
    for side in SIDES:
        cuff, armhole = whole.loops[f"{side}_cuff"], whole.loops[f"{side}_armhole"]
        girth = loop_length(x, cuff)
        if abs(girth / made.cuff_girths[side] - 1.0) > _GIRTH:
            return f"the {side} cuff is {girth:.3f} m around, not {made.cuff_girths[side]:.3f} m"
        away = np.linalg.norm(x[cuff].mean(axis=0) - made.cuffs[side])
        if away > _PLACE:
            return f"the {side} cuff is {away:.3f} m from its place"
        along = made.cuffs[side] - made.armholes[side]
        length = float(np.linalg.norm(along))
        offset = x[armhole].mean(axis=0) - made.armholes[side]
        out = float(offset @ along / length)
        aside = float(np.linalg.norm(offset - out * along / length))
        if not -_PLACE < out < min(_ARMHOLE, 0.8 * length) or aside > 2 * _PLACE:
            return f"the {side} armhole is {out:.3f} m along the sleeve, {aside:.3f} m aside"
    return "" if whole.front == made.front else f"opens {whole.front}, not {made.front}"
