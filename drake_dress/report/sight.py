"""How far the estimate of the garment was from the truth, from the log of a run."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import h5py
import numpy as np

from drake_dress.models.arrays import FloatArray, IndexArray, IntArray
from drake_dress.models.garment.transfer import barycentric_transfer
from drake_dress.models.sides import SIDES
from drake_dress.report.log import RunLog
from drake_dress.report.log_schema import LOOPS

# Most samples that are compared, evenly spread.
_SAMPLES = 300


@dataclass(frozen=True)
class _Mesh:
    """The estimated garment at rest."""

    rest_position: FloatArray
    faces: IntArray
    loops: dict[str, IndexArray]

    @staticmethod
    def of(group: h5py.Group) -> _Mesh:
        loops = {name: np.asarray(group[f"loops/{name}"], dtype=np.int64) for name in LOOPS}
        rest = np.asarray(group["rest_position"], dtype=np.float64)
        return _Mesh(rest, np.asarray(group["faces"], dtype=np.int32), loops)

    @property
    def armholes(self) -> list[IndexArray]:
        return [self.loops[f"{side}_armhole"] for side in SIDES]


def sees_with_cameras(log: RunLog) -> bool:
    """Returns whether the controllers of a simulated run saw the garment with cameras."""
    try:
        kind = log.scenario["perception"]["kind"]
    except (KeyError, TypeError):
        return False
    return kind == "cameras" and not log.estimated


def sight_figures(log: RunLog) -> dict[str, Any]:
    """Returns `estimate_garment_rms_m` and `estimate_armhole_median_m`, if cameras are used.

    The first is the root mean square, over samples and nodes, of the distance of the estimated
    nodes to where they are on the true garment; the second the median, over samples and sides, of
    the distance between the middles of an armhole.
    """
    if not sees_with_cameras(log):
        return {}
    group = log.file["/estimate/garment"]
    mesh = _Mesh.of(group)
    transfer = barycentric_transfer(log, mesh)
    squares, armholes = [], []
    for k in np.unique(np.linspace(0, len(log) - 1, _SAMPLES).astype(int)):
        true = np.asarray(transfer @ log.garment_position(int(k)))
        off = np.asarray(group["position"][k], dtype=np.float64) - true
        squares.append(np.square(off).sum(axis=1).mean())
        armholes += [np.linalg.norm(off[loop].mean(axis=0)) for loop in mesh.armholes]
    return {
        "estimate_garment_rms_m": float(np.sqrt(np.mean(squares))),
        "estimate_armhole_median_m": float(np.median(armholes)),
    }
