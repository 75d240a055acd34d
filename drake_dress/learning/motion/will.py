"""When an arm moves by the person's own will, and how."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drake_dress.learning.motion.arms import MovingArm
from drake_dress.learning.motion.movements import SHARES, Armhole, MovementKind, Movements

_DWELL = 5.0  # s, mean time between two movements
# Reach for an armhole: time of reaction to its coming near, and least time until the next, s.
_REACTION, _AGAIN = (0.15, 0.45), (0.5, 4.0)
# Time between corrections of such a reach, and after which it is given up, s.
_CORRECTS, _GIVES_UP = (0.3, 0.8), 5.0


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
        dwell: mean time between two movements, s.
        corrects: times of the next and of the last correction of a reach for the armhole, s.
    """

    arm: MovingArm
    movements: Movements
    next_at: float
    helps_within: float = 0.0
    sleeve_at: float = np.inf
    not_before: float = 0.0
    dwell: float = _DWELL
    corrects: tuple[float, float] = (0.0, 0.0)

    def due(self, time: float, armhole: Armhole | None) -> MovementKind | None:
        """Returns the kind of movement that begins now, None if none does; corrects a reach.

        Args:
            time: s.
            armhole: of the arm's sleeve; None while the arm is in it, or without a garment.
        """
        rng = self.movements.rng
        if self.arm.is_willed(time):
            self._correct(time, armhole, rng)
            return None
        self._see(time, armhole, rng)
        if time >= self.sleeve_at:
            self.sleeve_at, self.not_before = np.inf, time + rng.uniform(*_AGAIN)
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
    ) -> bool:
        """Begins a movement; returns whether there is one of this kind.

        Args:
            time: s.
            kind: of the movement.
            armhole: as in `due`.
            slower: factor on its duration.
        """
        movement = self.movements.draw(kind, time, self.arm.hand, armhole, slower)
        if movement is None:
            return False
        self.arm.movement = movement
        self.corrects = (time + _CORRECTS[1], time + _GIVES_UP) if kind == "sleeve" else (0.0, 0.0)
        self.next_at = movement.end + self.movements.rng.exponential(self.dwell)
        return True

    def _correct(self, time: float, armhole: Armhole | None, rng: np.random.Generator) -> None:
        """Leads a reach on to where its armhole has moved."""
        when, last = self.corrects
        if armhole is None or self.arm.movement is None or not when <= time < last:
            return
        self.arm.movement = self.movements.corrected(self.arm.movement, time, armhole)
        self.corrects = time + rng.uniform(*_CORRECTS), last

    def _see(self, time: float, armhole: Armhole | None, rng: np.random.Generator) -> None:
        """Decides on a reach for the armhole if that has come near."""
        if armhole is None:
            self.sleeve_at = np.inf
            return
        near = np.linalg.norm(armhole.center - self.arm.hand) < self.helps_within
        if near and not np.isfinite(self.sleeve_at) and time >= self.not_before:
            self.sleeve_at = time + rng.uniform(*_REACTION)
