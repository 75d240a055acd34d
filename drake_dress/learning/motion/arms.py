"""Motion of an arm: by will along strokes, or with the sleeve that it is in, by least effort."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from drake_dress.learning.motion.strokes import Stroke, draw_stroke, draw_strokes
from drake_dress.models.arrays import FloatArray
from drake_dress.models.human.arm import Arm
from drake_dress.models.human.hand_tracking import rate_bounds, tracking_rate
from drake_dress.models.human.motions import minimum_jerk

# Fastest hand, m/s, and joint, rad/s, of a movement by will.
_FASTEST, _FASTEST_JOINT = 2.5, 6.0
_DAMPING = 0.03  # of the least effort's inverse, m/rad at unit effort
_LED_FASTEST = 1.2  # rad/s, of a joint that is led
_SMOOTHING = 0.12  # s, of joint rates where an arm is led
_DWELL = 5.0  # mean time between two movements, s
_REACHABLE = 0.35, 0.98  # shell about the shoulder in which targets lie, shares of the arm's length
# Kinds of movements and how often they occur.
KINDS = {
    "reach": 0.45,
    "return": 0.25,
    "fidget": 0.1,
    "withdraw": 0.1,
    "wave": 0.1,
}
# Into the sleeve: begun once the armhole is near, after a time of reaction, s.
INTO_SLEEVE = "sleeve"
_REACTION = 0.15, 0.45
_AGAIN = 3.0  # s, before another attempt at the sleeve


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

    @classmethod
    def drawn(cls, rng: np.random.Generator, clearance: float) -> Following:
        """Returns drawn values; some arms spring back, others stay where they are led."""
        returning = rng.choice([rng.uniform(0.5, 2.0), rng.uniform(3.0, 12.0), 1e6])
        return cls(
            float(rng.uniform(0.05, 0.5)),
            float(rng.uniform(0.0, 0.5)),
            float(returning),
            clearance,
        )


@dataclass
class MovingArm:
    """An arm that moves step by step.

    Attributes:
        arm: kinematics.
        angles: (4,) joints, rad.
        home: (4,) comfortable pose, rad.
        limits: (2,4), rad.
        effort: (4,) of the joints.
        following: how it goes along with a sleeve.
        rng: draws.
        strokes: of the hand in the torso's frame, since `base` (3,), m.
        next_at: time of the next movement by will, s; None: the person is passive.
        helps_within: distance of the armhole from the hand at which the person reaches for it, m.
        sleeve_at: time at which the next reach for the armhole begins, s.
        not_before: earliest time of the next reach for the armhole, s.
    """

    arm: Arm
    angles: FloatArray
    home: FloatArray
    limits: FloatArray
    effort: FloatArray
    following: Following
    rng: np.random.Generator
    next_at: float | None = None
    base: FloatArray = field(default_factory=lambda: np.zeros(3))
    strokes: list[Stroke] = field(default_factory=list)
    rate: FloatArray = field(default_factory=lambda: np.zeros(4))
    rest: FloatArray = field(default_factory=lambda: np.zeros(4))
    wave: tuple[float, float, float, float] | None = None
    helps_within: float = 0.0
    sleeve_at: float = np.inf
    not_before: float = 0.0

    def __post_init__(self) -> None:
        self.rest = self.angles.copy()

    def is_willed(self, time: float) -> bool:
        """Returns whether a movement by will is in progress."""
        waves = self.wave is not None and time < self.wave[1]
        return waves or any(time < s.end for s in self.strokes)

    def due(self, time: float, armhole: tuple[FloatArray, FloatArray] | None) -> str | None:
        """Returns the kind of movement by will that begins now; None if none does.

        Args:
            time: s.
            armhole: as in `begin`.
        """
        if self.next_at is None or self.is_willed(time):
            return None
        if armhole is None:
            self.sleeve_at = np.inf
        elif np.linalg.norm(armhole[0] - self.arm.hand(self.angles)) < self.helps_within:
            if not np.isfinite(self.sleeve_at) and time >= self.not_before:
                self.sleeve_at = time + self.rng.uniform(*_REACTION)
        if time >= self.sleeve_at:
            self.sleeve_at, self.not_before = np.inf, time + _AGAIN
            return INTO_SLEEVE
        if time < self.next_at:
            return None
        return str(self.rng.choice(list(KINDS), p=list(KINDS.values())))

    def begin(
        self,
        time: float,
        kind: str,
        armhole: tuple[FloatArray, FloatArray] | None,
        slower: float = 1.0,
        rest: float = _DWELL,
    ) -> bool:
        """Begins a movement by will; returns whether there is one of this kind.

        Args:
            time: s.
            kind: of `KINDS`, or `INTO_SLEEVE`.
            armhole: its centre (3,), m, and the direction into its sleeve (3,), in the torso's
                frame; None where the arm is in it.
            slower: factor on its duration.
            rest: mean time until the next movement, s.
        """
        hand = self.arm.hand(self.angles)
        wave = None
        if kind == "wave":
            lasts = self.rng.uniform(1.5, 4.0)
            wave = (time, time + lasts, self.rng.uniform(0.03, 0.15), self.rng.uniform(0.5, 1.6))
            strokes: list[Stroke] = []
        else:
            way = self._way(kind, hand, armhole)
            if way is None:
                return False
            strokes = draw_strokes(self.rng, time, way, slower)
            if kind == "reach" and self.rng.random() < 0.2:
                # a change of mind on the way
                other = self._target() - hand - way
                turn = time + self.rng.uniform(0.3, 0.8) * (strokes[-1].end - time)
                strokes.append(draw_stroke(self.rng, turn, other, slower))
            if kind == "withdraw":
                held = strokes[-1].end + self.rng.uniform(0.5, 3.0)
                strokes.append(draw_stroke(self.rng, held, -way, slower))
        self.base, self.strokes, self.wave = hand, strokes, wave
        end = wave[1] if wave is not None else max(s.end for s in strokes)
        self.next_at = end + self.rng.exponential(rest)
        return True

    def move_by_will(self, time: float, step: float) -> None:
        """Moves the arm by one step along its strokes."""
        now, soon = self._reference(time), self._reference(time + step)
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
        wanted = wanted * min(1.0, _LED_FASTEST / size) if size > 0.0 else wanted
        share = 1.0 - np.exp(-step / _SMOOTHING)
        self._turn(self.rate + share * (wanted - self.rate), step)
        if self.following.returning > 1e3:
            self.rest = self.angles.copy()

    def _turn(self, rate: FloatArray, step: float) -> None:
        angles = np.clip(self.angles + step * rate, *self.limits)
        self.rate = (angles - self.angles) / step
        self.angles = angles

    def _reference(self, time: float) -> FloatArray:
        place = self.base.copy()
        for stroke in self.strokes:
            place += stroke.position(time)
        if self.wave is not None:
            place += _waved(self.wave, time)
        return place

    def _way(
        self, kind: str, hand: FloatArray, armhole: tuple[FloatArray, FloatArray] | None
    ) -> FloatArray | None:
        if kind == "reach":
            return self._target() - hand
        if kind == "return":
            way = self.arm.hand(self.home) - hand
            return way if np.linalg.norm(way) > 0.05 else None
        if kind == "fidget":
            return 0.03 * self.rng.normal(size=3)
        if kind == "withdraw":
            back = (self.arm.shoulder - hand) * [1.0, 1.0, 0.2]
            length = max(float(np.linalg.norm(back)), 1e-9)
            drawn: FloatArray = back * min(1.0, self.rng.uniform(0.05, 0.25) / length)
            return drawn
        if armhole is None:
            return None
        center, into = armhole
        through = center + self.rng.uniform(-0.05, 0.2) * into + 0.03 * self.rng.normal(size=3)
        near = np.linalg.norm(through - hand) < 0.6
        within = np.linalg.norm(through - self.arm.shoulder) < self.arm.length
        return through - hand if near and within else None

    def _target(self) -> FloatArray:
        """Returns a place (3,), m, that the hand can reach: of a pose within the joints' limits."""
        low, high = self.limits
        for _ in range(20):
            pose = low + (high - low) * self.rng.beta(1.4, 1.4, 4)
            hand = self.arm.hand(pose)
            away = float(np.linalg.norm(hand - self.arm.shoulder)) / self.arm.length
            # behind the back and inside the trunk is rare
            behind = hand[0] < -0.05 and self.rng.random() < 0.6
            inside = hand[0] < 0.12 and abs(hand[1]) < 0.16
            if _REACHABLE[0] < away < _REACHABLE[1] and not (behind or inside):
                return hand
        return self.arm.hand(self.home)

    def _jacobian(self, progress: float) -> FloatArray:
        """Returns ∂(point of the axis at `progress`)/∂(angles) (3,4), m/rad."""
        of_hand, of_elbow = self.arm.jacobian(self.angles), self.arm.elbow_jacobian(self.angles)
        s = float(np.clip(progress, 0.0, 2.0))
        if s <= 1.0:
            return (1.0 - s) * of_hand + s * of_elbow
        return (2.0 - s) * of_elbow


def _waved(wave: tuple[float, float, float, float], time: float) -> FloatArray:
    """Returns the offset (3,), m, of a waving hand: sideways, with smooth beginning and end."""
    start, end, amplitude, frequency = wave
    if not start < time < end:
        return np.zeros(3)
    fade = min(0.5, 0.25 * (end - start))
    swell = min(minimum_jerk((time - start) / fade)[0], minimum_jerk((end - time) / fade)[0])
    offset = amplitude * swell * np.sin(2.0 * np.pi * frequency * (time - start))
    return np.array([0.0, offset, 0.3 * offset])
