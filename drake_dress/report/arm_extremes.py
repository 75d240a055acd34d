"""Extremes of an arm's joints between two samples of the log."""

from __future__ import annotations

import numpy as np

from drake_dress.models.arrays import FloatArray

_JOINTS = 7


class ArmExtremes:
    """Least and largest position, largest speed and torque of each joint since the last reset."""

    def __init__(self) -> None:
        self._forget()

    def see(self, q: FloatArray, v: FloatArray, torque: FloatArray) -> None:
        """Adds an observation: position, velocity, torque (7,), rad, rad/s, N·m; ignores NaN."""
        np.fmin(self._least, q, out=self._least)
        np.fmax(self._most, q, out=self._most)
        np.fmax(self._speed, np.abs(v), out=self._speed)
        np.fmax(self._torque, np.abs(torque), out=self._torque)

    def taken(self) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """Returns least and largest q, largest |v| and |torque|, (7,) each, and resets them.

        Values without any observation are NaN.
        """
        taken = (self._least, self._most, self._speed, self._torque)
        self._forget()
        return taken

    def _forget(self) -> None:
        self._least, self._most, self._speed, self._torque = np.full((4, _JOINTS), np.nan)
