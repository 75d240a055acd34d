"""Laying the coat on the shoulders, as part of a plan: the cost, its target, and the way back."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from drake_dress.models.arrays import FloatArray
from drake_dress.models.control.costs import PlannedStep, Slope
from drake_dress.models.control.person_model import PersonModel
from drake_dress.models.control.situation import LayingTarget
from drake_dress.models.dressing.finish import FinishParameters
from drake_dress.models.garment.nape import Nape
from drake_dress.models.human.heading import Heading, heading
from drake_dress.models.human.neck import NAPE_LENGTH, nape

# Returns the heading that targets refer to, from joints (6,3), m.
Toward = Callable[[FloatArray], Heading]


@dataclass(frozen=True)
class CollarPosition:
    """w ‖p − p̄‖²: draws the middle of the collar's back to its target on the nape."""

    weight: float
    collar: Nape | None

    def value(self, step: PlannedStep) -> float:
        """See `GarmentCost`."""
        off = self._off(step)
        return 0.0 if off is None else self.weight * float(np.sum(off**2))

    def add_slope(self, step: PlannedStep, slope: Slope) -> None:
        """See `GarmentCost`."""
        off = self._off(step)
        if off is not None and self.collar is not None:
            pull = 2.0 * self.weight * off
            np.add.at(slope.x, self.collar.nodes, self.collar.weights[:, None] * pull)

    def _off(self, step: PlannedStep) -> FloatArray | None:
        laying = step.situation.laying
        if laying is None or self.collar is None:
            return None
        off: FloatArray = self.collar.at(step.x) - laying.collar[step.index]
        return off


@dataclass(frozen=True)
class GrippersOverShoulders:
    """w (‖d − (d·l) l‖² + e²): keeps the grippers level across the shoulders, just above them.

    d runs from the right to the left gripper, l is the person's leftward direction, and e, m, is
    the height of their middle above its target. With the collar alone drawn to the nape, one
    gripper went ahead of the other, and its sleeve up while the other sleeve slid down; and
    grippers that stayed 9 cm above the shoulders drew the armholes into the armpits.
    """

    weight: float

    def value(self, step: PlannedStep) -> float:
        """See `GarmentCost`."""
        aside, above = self._off(step)
        return self.weight * (float(np.sum(aside**2)) + above**2)

    def add_slope(self, step: PlannedStep, slope: Slope) -> None:
        """See `GarmentCost`."""
        aside, above = self._off(step)
        slope.grippers[0] += 2.0 * self.weight * aside
        slope.grippers[1] -= 2.0 * self.weight * aside
        slope.grippers[:, 2] += self.weight * above

    def _off(self, step: PlannedStep) -> tuple[FloatArray, float]:
        """Returns d − (d·l) l (3,), m, and e, m; zero before the coat is laid."""
        leftward, laying = step.situation.leftward, step.situation.laying
        if laying is None or leftward is None:
            return np.zeros(3), 0.0
        between, way = step.grip.left_from_right(step.x), leftward[step.index]
        middle = [step.x[step.grip.nodes[of], 2].mean() for of in step.grip.of_side]
        above = 0.5 * (middle[0] + middle[1]) - laying.height[step.index]
        return between - (between @ way) * way, float(above)


def laying_target(
    person: PersonModel,
    collar: Nape,
    margin: float,
    height: float,
    joints: FloatArray,
    toward: Toward = heading,
) -> LayingTarget:
    """Returns where a coat is laid on a person at N times.

    Args:
        person: shape of the person.
        collar: of the garment.
        margin: distance kept between cloth and skin, m.
        height: of the grippers above the shoulders' skin, m.
        joints: (N,6,3) shoulder, elbow, hand of left, then right arm, m.
        toward: returns the heading that targets refer to.
    """
    tops = joints[:, [0, 3], 2].mean(axis=1) + person.shoulder_radius
    places = [collar_target(person, collar, margin, q, toward) for q in joints]
    return LayingTarget(np.stack(places), tops + height)


def collar_target(
    person: PersonModel,
    collar: Nape,
    margin: float,
    joints: FloatArray,
    toward: Toward = heading,
) -> FloatArray:
    """Returns the place (3,), m, of the middle of the collar's back on a person.

    It is as far above the shoulders as the collar is high, at most the nape's length.

    Args:
        person: shape of the person.
        collar: of the garment.
        margin: distance kept between cloth and skin, m.
        joints: (6,3) shoulder, elbow, hand of left, then right arm, m.
        toward: returns the heading that targets refer to.
    """
    to = toward(joints)
    low, high = nape(joints, person.shoulder_radius, person.neck_radius, to)
    share = min(1.0, collar.height / NAPE_LENGTH)
    place: FloatArray = low + share * (high - low) - margin * to.front
    return place


def way_back(
    parameters: FinishParameters, to: Heading, count: int, elapsed: float, time_step: float
) -> FloatArray:
    """Returns the velocities (N,2,3), m/s, at which open grippers move away from the person.

    They move backward and upward, the way they came, because the head is between them.

    Args:
        parameters: settings.
        to: heading that targets refer to.
        count: N.
        elapsed: time since the grippers opened, s.
        time_step: of the plan, s.
    """
    p = parameters
    lasting = p.away_distance / p.away_speed
    moving = elapsed + time_step * np.arange(count) < lasting
    way = (np.array([0.0, 0.0, 1.0]) - to.front) / np.sqrt(2.0)
    velocity: FloatArray = np.where(moving, p.away_speed, 0.0)[:, None, None] * np.stack([way, way])
    return velocity
