"""Motion of an arm: along a movement by will, or with the sleeve that it is in, by least effort."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from drake_dress.learning.motion.movements import Movement
from drake_dress.models.arrays import FloatArray
from drake_dress.models.human.arm import Arm
from drake_dress.models.human.hand_tracking import eased, rate_bounds, tracking_rate

# Fastest hand, m/s, and joint, rad/s, of a movement by will.
_FASTEST, _FASTEST_JOINT = 2.5, 6.0
_FASTEST_LED = 1.2  # rad/s, of a joint that is led: who is dressed gives way calmly
_DAMPING = 0.03  # of the least effort's inverse, m/rad at unit effort
_SMOOTHING = 0.12  # s, time constant of joint rates where an arm is led: it has mass
# Ranges of what is drawn of a following arm: lag, s, drag, and the time constants, s, of arms that
# spring back and of arms that return slowly. All others stay where they are led.
_LAG, _DRAG = (0.05, 0.5), (0.0, 0.5)
_SPRINGS_BACK, _RETURNS = (0.5, 2.0), (3.0, 12.0)
_STAYS = 1e6


@dataclass(frozen=True)
class Following:
    """How an arm goes along with a sleeve.

    Attributes:
        lag: time constant of going along, s.
        drag: share of the sleeve's motion along the arm that the arm takes part in.
        returning: time constant of the return to the comfortable pose, s.
        clearance: distance of the armhole's centre from the arm's axis that the arm allows, m.
    """

    lag: float
    drag: float
    returning: float
    clearance: float

    @property
    def stays(self) -> bool:
        """Whether the arm stays where it is led."""
        return self.returning == _STAYS

    @classmethod
    def drawn(cls, rng: np.random.Generator, clearance: float) -> Following:
        """Returns drawn values; some arms spring back, others stay where they are led."""
        returning = rng.choice([rng.uniform(*_SPRINGS_BACK), rng.uniform(*_RETURNS), _STAYS])
        lag, drag = float(rng.uniform(*_LAG)), float(rng.uniform(*_DRAG))
        return cls(lag, drag, float(returning), clearance)


@dataclass
class MovingArm:
    """An arm that moves step by step.

    Attributes:
        arm: kinematics.
        angles: (4,) joints, rad.
        home: (4,) comfortable pose, rad.
        limits: (2,4), rad.
        effort: (4,) relative effort of moving each joint.
        following: how it goes along with a sleeve.
        movement: the last one by will; None before the first.
        rate: (4,) of the joints, rad/s.
        rest: (4,) pose to which it returns, rad.
    """

    arm: Arm
    angles: FloatArray
    home: FloatArray
    limits: FloatArray
    effort: FloatArray
    following: Following
    movement: Movement | None = None
    rate: FloatArray = field(default_factory=lambda: np.zeros(4))
    rest: FloatArray = field(default_factory=lambda: np.zeros(4))

    def __post_init__(self) -> None:
        self.rest = self.angles.copy()

    @property
    def hand(self) -> FloatArray:
        """Returns the hand's place (3,) in the torso's frame, m."""
        return self.arm.hand(self.angles)

    def is_willed(self, time: float) -> bool:
        """Returns whether a movement by will is in progress."""
        return self.movement is not None and time < self.movement.end

    def is_moved(self, time: float) -> bool:
        """Returns whether a movement by will moves the hand to speak of now."""
        return self.movement is not None and self.movement.is_seen(time)

    def move_by_will(self, time: float, step: float) -> None:
        """Moves the arm by one step along its movement."""
        if self.movement is None:
            raise ValueError("the arm has no movement by will")
        now, soon = self.movement.position(time), self.movement.position(time + step)
        rate = tracking_rate(
            self.arm,
            self.angles,
            now,
            (soon - now) / step,
            self.home,
            rate_bounds(self.angles, self.limits, _FASTEST_JOINT),
            _FASTEST,
        )
        self._turn(rate, step)
        self.rest = self.angles.copy()

    def follow(self, led: FloatArray | None, progress: float, step: float) -> None:
        """Moves the arm by one step with what leads it.

        Args:
            led: (3,) displacement in the torso's frame that the arm's point at `progress` has to
                make to be in its sleeve, m; None where nothing leads it.
            progress: 0 hand, 1 elbow, 2 shoulder.
            step: s.
        """
        wanted = (self.rest - self.angles) / self.following.returning
        if led is not None:
            jacobian = self._jacobian(progress)
            soft = jacobian / self.effort
            inverse = soft.T @ np.linalg.inv(soft @ jacobian.T + _DAMPING**2 * np.eye(3))
            wanted = wanted + inverse @ led / max(self.following.lag, step)
        size = float(np.max(np.abs(wanted)))
        wanted = wanted * min(1.0, _FASTEST_LED / size) if size > 0.0 else wanted
        share = 1.0 - np.exp(-step / _SMOOTHING)
        self._turn(self.rate + share * (wanted - self.rate), step)
        if self.following.stays:
            self.rest = self.angles.copy()

    def _turn(self, rate: FloatArray, step: float) -> None:
        """Turns the joints at `rate` (4,), rad/s, as far as limits and accelerations allow."""
        rate = eased(rate, self.rate, step)
        angles = np.clip(self.angles + step * rate, *self.limits)
        self.rate = (angles - self.angles) / step
        self.angles = angles

    def _jacobian(self, progress: float) -> FloatArray:
        """Returns ∂(point of the axis at `progress`)/∂(angles) (3,4), m/rad."""
        of_hand, of_elbow = self.arm.jacobian(self.angles), self.arm.elbow_jacobian(self.angles)
        s = float(np.clip(progress, 0.0, 2.0))
        if s <= 1.0:
            return (1.0 - s) * of_hand + s * of_elbow
        return (2.0 - s) * of_elbow
