"""When an arm moves by the person's own will, and how."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drake_dress.learning.motion.arms import MovingArm
from drake_dress.learning.motion.movements import SHARES, Armhole, MovementKind, Movements

_DWELL = 5.0  # s, mean time between two movements
# Reach for an armhole: time of reaction to its coming near, and least time until the next, s.
_REACTION, _AGAIN = (0.15, 0.45), 3.0


@dataclass
class Will:
    """The will that moves an arm: now and then, and when the armhole comes near.

    Attributes:
        arm: that it moves.
        movements: draws what the arm does.
        next_at: time of the next movement, s.
        helps_within: distance of the armhole from the hand at which the person reaches for it, m.
        sleeve_at: time at which the next reach for the armhole begins, s.
        not_before: earliest time of the next reach for the armhole, s.
    """

    arm: MovingArm
    movements: Movements
    next_at: float
    helps_within: float = 0.0
    sleeve_at: float = np.inf
    not_before: float = 0.0

    def due(self, time: float, armhole: Armhole | None) -> MovementKind | None:
        """Returns the kind of movement that begins now; None if none does.

        Args:
            time: s.
            armhole: of the arm's sleeve; None while the arm is in it, or without a garment.
        """
        if self.arm.is_willed(time):
            return None
        rng = self.movements.rng
        self._see(time, armhole, rng)
        if time >= self.sleeve_at:
            self.sleeve_at, self.not_before = np.inf, time + _AGAIN
            return "sleeve"
        if time < self.next_at:
            return None
        kinds = list(SHARES)
        return kinds[rng.choice(len(kinds), p=list(SHARES.values()))]

    def begin(
        self,
        time: float,
        kind: MovementKind,
        armhole: Armhole | None,
        slower: float = 1.0,
        rest: float = _DWELL,
    ) -> bool:
        """Begins a movement; returns whether there is one of this kind.

        Args:
            time: s.
            kind: of the movement.
            armhole: as in `due`.
            slower: factor on its duration.
            rest: mean time until the next movement, s.
        """
        movement = self.movements.draw(kind, time, self.arm.hand, armhole, slower)
        if movement is None:
            return False
        self.arm.movement = movement
        self.next_at = movement.end + self.movements.rng.exponential(rest)
        return True

    def _see(self, time: float, armhole: Armhole | None, rng: np.random.Generator) -> None:
        """Decides on a reach for the armhole if that has come near."""
        if armhole is None:
            self.sleeve_at = np.inf
            return
        near = np.linalg.norm(armhole.center - self.arm.hand) < self.helps_within
        if near and not np.isfinite(self.sleeve_at) and time >= self.not_before:
            self.sleeve_at = time + rng.uniform(*_REACTION)
