"""Motions of the held nodes, without jumps, so that the first step does not decide the accuracy.

Each function returns a motion: time, s → (k,3) positions, m.
"""

from __future__ import annotations

import numpy as np

from benchmarks.cloth.scene import Motion
from drake_dress.models.arrays import FloatArray


def at_rest(held: FloatArray) -> Motion:
    """Returns a motion that keeps the nodes at `held` (k,3)."""
    return lambda time: held


def carried(held: FloatArray, velocity: FloatArray) -> Motion:
    """Returns a motion at constant `velocity` (3,), m/s."""
    return lambda time: held + time * velocity


def _eased(share: float) -> float:
    """Returns a quintic from 0 to 1 with zero velocity and acceleration at both ends."""
    s = min(max(share, 0.0), 1.0)
    return s**3 * (10.0 - 15.0 * s + 6.0 * s**2)


def pulled(held: FloatArray, way: FloatArray, duration: float) -> Motion:
    """Returns an eased straight motion by `way` (3,), m, of `duration`, s."""
    return lambda time: held + _eased(time / duration) * way


def laid_down(
    held: FloatArray, table: float, length: float, down_time: float, fold_time: float
) -> Motion:
    """Returns a motion that lays a hanging garment on a table and folds it over.

    The shoulders move down and forward on a quarter ellipse until the lowest held node is on the
    table, so that the hem touches first. Then they move back in an arc by a third of the length.
    The held patches keep their shape: flattened, they would strain.

    Args:
        held: (k,3) initial positions, m.
        table: Height of nodes that lie on the table, m.
        length: Length of the garment from shoulder to hem, by which the shoulders move forward, m.
        down_time: Duration of laying down, s.
        fold_time: Duration of folding over, s.
    """
    drop = float(held[:, 2].min()) - table

    def motion(now: float) -> FloatArray:
        angle = 0.5 * np.pi * _eased(now / down_time)
        back = _eased((now - down_time) / fold_time)
        forward = length * (np.sin(angle) - back / 3.0)
        height = 0.25 * length * np.sin(np.pi * back) - drop * (1.0 - np.cos(angle))
        return held + np.array([forward, 0.0, height])

    return motion
