"""Laying the coat on the shoulders, as part of a plan: the cost, its target, and the way back."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from drake_dress.models.arrays import FloatArray
from drake_dress.models.cloth.contact.detection import find_proximity
from drake_dress.models.cloth.contact.obstacles import Obstacles
from drake_dress.models.control.costs import PlannedStep, Slope
from drake_dress.models.control.person_model import PersonModel, person_capsules
from drake_dress.models.control.situation import LayingTarget
from drake_dress.models.control.task_parameters import unit
from drake_dress.models.dressing.finish import FinishParameters
from drake_dress.models.garment.nape import Nape
from drake_dress.models.human.heading import Heading, heading
from drake_dress.models.human.neck import NAPE_LENGTH, nape

# Returns the heading that targets refer to, from joints (6,3), m.
Toward = Callable[[FloatArray], Heading]


@dataclass(frozen=True)
class CollarPosition:
    """w ‖p − p̄‖²: draws the middle of the collar's back to its target.

    That is on the nape while the coat is laid, and beside a hanging arm while an armhole comes to
    its hand.
    """

    weight: float
    collar: Nape | None
    leading_weight: float = 0.0

    def value(self, step: PlannedStep) -> float:
        """See `GarmentCost`."""
        off = self._off(step)
        return 0.0 if off is None else self._weight(step) * float(np.sum(off**2))

    def add_slope(self, step: PlannedStep, slope: Slope) -> None:
        """See `GarmentCost`."""
        off = self._off(step)
        if off is not None and self.collar is not None:
            pull = 2.0 * self._weight(step) * off
            np.add.at(slope.x, self.collar.nodes, self.collar.weights[:, None] * pull)

    def _off(self, step: PlannedStep) -> FloatArray | None:
        laying, leading = step.situation.laying, step.situation.leading
        target = leading if laying is None else laying.collar
        if target is None or self.collar is None:
            return None
        off: FloatArray = self.collar.at(step.x) - target[step.index]
        return off

    def _weight(self, step: PlannedStep) -> float:
        return self.leading_weight if step.situation.laying is None else self.weight


@dataclass(frozen=True)
class GrippersAsWorn:
    """w (‖d − d̄‖² + e²): keeps the grippers to each other as they hold the coat when it is worn.

    d runs from the right to the left gripper, and e, m, is the height of their middle above its
    target. With the collar alone drawn to the nape, one gripper went ahead of the other, and its
    sleeve up while the other sleeve slid down; and grippers that stayed 9 cm above the shoulders
    drew the armholes into the armpits. How far in front they are follows from the collar.
    """

    weight: float

    def value(self, step: PlannedStep) -> float:
        """See `GarmentCost`."""
        apart, above = self._off(step)
        return self.weight * (float(np.sum(apart**2)) + above**2)

    def add_slope(self, step: PlannedStep, slope: Slope) -> None:
        """See `GarmentCost`."""
        apart, above = self._off(step)
        slope.grippers[0] += 2.0 * self.weight * apart
        slope.grippers[1] -= 2.0 * self.weight * apart
        slope.grippers[:, 2] += self.weight * above

    def _off(self, step: PlannedStep) -> tuple[FloatArray, float]:
        """Returns d − d̄ (3,), m, and e, m; zero before the coat is laid."""
        laying = step.situation.laying
        if laying is None:
            return np.zeros(3), 0.0
        left, right = step.grip.centers(step.x)
        above = 0.5 * (left[2] + right[2]) - laying.height[step.index]
        return left - right - laying.between[step.index], float(above)


@dataclass(frozen=True)
class WornCoat:
    """Where a coat that is worn has its collar and the grippers that hold it.

    Attributes:
        collar: the middle of its back.
        grippers: (2,3) grasps of left and right gripper from there at rest, m: forward, left, up.
        margin: distance kept between cloth and skin, m.
        height: of the grippers above the skin, m.
    """

    collar: Nape
    grippers: FloatArray
    margin: float
    height: float

    def target(
        self, person: PersonModel, joints: FloatArray, toward: Toward = heading
    ) -> LayingTarget:
        """Returns where the coat is laid on a person at N times.

        Args:
            person: shape of the person.
            joints: (N,6,3) shoulder, elbow, hand of left, then right arm, m.
            toward: returns the heading that targets refer to.
        """
        collars, held = [], []
        for q in joints:
            collars.append(self.collar_target(person, q, toward))
            held.append(self._gripped(person, q, collars[-1]))
        grippers = np.stack(held)
        between = grippers[:, 0] - grippers[:, 1]
        return LayingTarget(np.stack(collars), between, grippers[:, :, 2].mean(axis=1))

    def collar_target(
        self, person: PersonModel, joints: FloatArray, toward: Toward = heading
    ) -> FloatArray:
        """Returns the place (3,), m, of the middle of the collar's back on a person.

        It is as far above the shoulders as the collar is high, at most the nape's length.

        Args:
            person: shape of the person.
            joints: (6,3) shoulder, elbow, hand of left, then right arm, m.
            toward: returns the heading that targets refer to.
        """
        to = toward(joints)
        low, high = nape(joints, person.shoulder_radius, person.neck_radius, to)
        share = min(1.0, self.collar.height / NAPE_LENGTH)
        place: FloatArray = low + share * (high - low) - self.margin * to.front
        return place

    def _gripped(self, person: PersonModel, joints: FloatArray, collar: FloatArray) -> FloatArray:
        """Returns the grippers (2,3), m, at `height` above the skin or farther from it."""
        places = collar + self.grippers @ heading(joints).rotation.T
        shape = Obstacles.resting(*person_capsules(person, joints))
        near = find_proximity(places, shape, self.height)
        moved: FloatArray = places - np.minimum(near.gap, 0.0)[:, None] * near.normal
        return moved


def way_back(
    parameters: FinishParameters,
    to: Heading,
    grippers: FloatArray,
    joints: FloatArray,
    count: int,
    elapsed: float,
    time_step: float,
) -> FloatArray:
    """Returns the velocities (N,2,3), m/s, at which open grippers move away from the person.

    Above the shoulders they move backward and upward, the way they came, because the head is
    between them. From in front of the person they move straight away from the neck.

    Args:
        parameters: settings.
        to: heading that targets refer to.
        grippers: (2,3) of left and right gripper, m.
        joints: (6,3) shoulder, elbow, hand of left, then right arm, m.
        count: N.
        elapsed: time since the grippers opened, s.
        time_step: of the plan, s.
    """
    p = parameters
    lasting = p.away_distance / p.away_speed
    moving = elapsed + time_step * np.arange(count) < lasting
    from_neck = (grippers - 0.5 * (joints[0] + joints[3])) * np.array([1.0, 1.0, 0.0])
    back = (np.array([0.0, 0.0, 1.0]) - to.front) / np.sqrt(2.0)
    in_front = from_neck @ to.front > p.front_distance
    way = np.where(in_front[:, None], unit(from_neck), back)
    velocity: FloatArray = np.where(moving, p.away_speed, 0.0)[:, None, None] * way
    return velocity
