"""Checks that a scenario's integrator of the garment can simulate the scenario."""

from __future__ import annotations

from collections.abc import Sequence

from drake_dress.errors import UserError
from drake_dress.models.cloth.mujoco.settings import import_mujoco
from drake_dress.models.effects.effect import (
    AdhesionEffect,
    Effect,
    FibreEffect,
    FrictionEffect,
    StretchEffect,
)

MUJOCO = "mujoco"
# Why MuJoCo's garment cannot have effects of some kinds.
_REASONS: dict[type[Effect], str] = {
    FrictionEffect: "MuJoCo's cloth has one coefficient of friction at all nodes and times",
    AdhesionEffect: "MuJoCo's contact between cloth and bodies bears no pull",
    StretchEffect: "the stiffness of MuJoCo's cloth does not depend on its strain",
    FibreEffect: "MuJoCo's cloth is equally stiff in all directions",
}


def check_integrator(source: str, integrator: str, effects: Sequence[Effect]) -> None:
    """Checks that MuJoCo, where it is asked for, is installed and can express all effects.

    Args:
        source: name of the scenario in messages.
        integrator: `plant.integrator`.
        effects: those that are switched on.

    Raises:
        UserError: it is not installed, or an effect is beyond it.
    """
    if integrator != MUJOCO:
        return
    for effect in effects:
        for kind, reason in _REASONS.items():
            if isinstance(effect, kind):
                raise UserError(
                    source,
                    f"effects.{effect.NAME}",
                    f"is on with plant.integrator: mujoco ({reason}), "
                    "expected it off or another integrator",
                )
    import_mujoco()


def check_explained(source: str, integrator: str) -> None:
    """Checks that the integrator is one that `explain` and its data can use.

    Raises:
        UserError: it is MuJoCo, whose steps have no effects' derivatives and no finer reference.
    """
    if integrator == MUJOCO:
        raise UserError(
            source,
            "plant.integrator",
            "is mujoco, which only runs have, expected implicit or projective_dynamics",
        )
