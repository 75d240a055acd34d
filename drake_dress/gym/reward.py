"""The reward of a control step: change of a progress potential, forces, and outcome."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields

import numpy as np

from drake_dress.errors import UserError
from drake_dress.models.arrays import FloatArray
from drake_dress.models.dressing.progress import SleeveProgress


@dataclass(frozen=True)
class RewardWeights:
    """Weights of the reward's terms; all are 0 or more, and a weight of 0 leaves its term out.

    The potential of a state is

        Φ = Σ progress · s - Σ approach · d,

    over both sleeves. s is the progress of a sleeve that covers its arm (0 hand, 1 elbow,
    2 shoulder) and 0 for one that does not. d is the distance from the armhole's centre to the hand
    for a sleeve that does not cover its arm, and 0 for one that does. A step is rewarded by the
    change of Φ, so the sum over an episode is Φ at its end minus Φ at its start, on any path.

    Attributes:
        progress: weight of s, for each sleeve.
        approach: weight of the distance d, 1/m.
        gripper_force: weight of the impulse of the garment on the grippers beyond `free_force`,
            1/(N·s).
        person_force: weight of the contact impulse on the person, summed over the magnitudes of the
            nodes' forces, 1/(N·s).
        free_force: largest force of the garment on a gripper without cost, N. The default is the
            governor's soft limit, from which pulling is reduced.
        success: bonus, given once when both sleeves have stayed on.
        failure: penalty, given once when the governor stops the grippers or the simulation breaks
            down.
    """

    progress: float = 1.0
    approach: float = 0.5
    gripper_force: float = 0.02
    person_force: float = 0.0005
    free_force: float = 8.5
    success: float = 5.0
    failure: float = 5.0

    def __post_init__(self) -> None:
        for entry in fields(self):
            value = getattr(self, entry.name)
            good = isinstance(value, int | float) and not isinstance(value, bool)
            if not (good and math.isfinite(value) and value >= 0.0):
                raise UserError(
                    "reward", entry.name, f"is {value!r}, expected a finite number, 0 or more"
                )

    @staticmethod
    def of(given: RewardWeights | Mapping[str, float] | None) -> RewardWeights:
        """Returns given weights, or the defaults with those of a mapping replaced.

        Raises:
            UserError: a name or a value cannot be used.
        """
        if isinstance(given, RewardWeights):
            return given
        if given is None:
            return RewardWeights()
        if not isinstance(given, Mapping):
            raise UserError("reward", "", f"is {given!r}, expected RewardWeights or a mapping")
        known = [entry.name for entry in fields(RewardWeights)]
        for name in given:
            if name not in known:
                raise UserError(
                    "reward", str(name), f"is no weight, expected one of {', '.join(known)}"
                )
        return RewardWeights(**given)


@dataclass(frozen=True)
class Loads:
    """Forces during a control step, sampled at each step of the plant.

    Attributes:
        gripper_force: (k,2) magnitude of the garment's force on left and right gripper, N.
        contact_force: (k,) sum of the magnitudes of the nodes' forces on the person, N.
        period: time between samples, s.
    """

    gripper_force: FloatArray
    contact_force: FloatArray
    period: float


def reward_terms(
    weights: RewardWeights,
    before: SleeveProgress,
    after: SleeveProgress,
    loads: Loads,
    succeeded: bool,
    failed: bool,
) -> dict[str, float]:
    """Returns the terms of the reward by name; the reward is their sum.

    Args:
        weights: weights of the terms.
        before: progress at the start of the control step.
        after: progress at its end.
        loads: forces during the step.
        succeeded: whether both sleeves have stayed on.
        failed: whether the grippers were stopped, or the simulation broke down.
    """
    excess = np.maximum(loads.gripper_force - weights.free_force, 0.0)
    return {
        "progress": weights.progress * (_covered(after) - _covered(before)),
        "approach": weights.approach * (_distance(before) - _distance(after)),
        "gripper_force": -weights.gripper_force * loads.period * float(excess.sum()),
        "person_force": -weights.person_force * loads.period * float(loads.contact_force.sum()),
        "success": weights.success if succeeded else 0.0,
        "failure": -weights.failure if failed else 0.0,
    }


def _covered(progress: SleeveProgress) -> float:
    return float(progress.s.sum())


def _distance(progress: SleeveProgress) -> float:
    return float(np.where(progress.linking != 0, 0.0, progress.hand_distance).sum())
