"""Settings of MuJoCo's garment, and the import of MuJoCo, which is an extra."""

from __future__ import annotations

import importlib
from dataclasses import dataclass
from typing import Any

from drake_dress.libraries import import_problem


@dataclass(frozen=True)
class MujocoSettings:
    """Solver settings of `MujocoCloth`.

    Attributes:
        self_collision: whether layers of the garment collide with each other, without friction.
        iterations: iteration limit of the constraint solver (CG).
        tolerance: relative size of the improvement and of the gradient at which solvers stop. For a
            coat of 3 N that is pushed against a person at 0.3 m/s, outer forces miss the change of
            momentum by 0.6 N at 1e-6, 0.08 N at 1e-7 and 0.04 N at 1e-8, in 48, 81 and 130
            iterations. Newton's method takes three times as long.
    """

    self_collision: bool = True
    iterations: int = 200
    tolerance: float = 1e-7


DEFAULT_SETTINGS = MujocoSettings()


def import_mujoco() -> Any:
    """Returns the module `mujoco`.

    Raises:
        UserError: it is not installed, or cannot be loaded.
    """
    try:
        return importlib.import_module("mujoco")
    # modules built against other versions may raise any exception
    except Exception as error:
        raise import_problem(error, "mujoco") from error
