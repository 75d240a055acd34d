"""Inputs of the global controller: targets, garment and predicted person."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from drake_dress.models.arrays import FloatArray, IntArray
from drake_dress.models.cloth.contact.obstacles import Obstacles
from drake_dress.models.control.corridor import Corridor
from drake_dress.models.dressing.sleeve import Entry


@dataclass(frozen=True)
class SleeveTarget:
    """Target of one sleeve at each of the N steps.

    Attributes:
        position: (N,3) m; direction: (N,3) unit vectors.
        position_weight, direction_weight: factors on W and Q; 0 leaves the sleeve free.
        entering: whether `direction` applies to the vector from the armhole to the garment's entry,
            not to the armhole's own direction.
        corridor: ahead of the hand that is about to enter; None if it is not near.
        passage: (N,3) unit vectors from elbow to hand of the arm that is about to enter.
    """

    position: FloatArray
    direction: FloatArray
    position_weight: float = 1.0
    direction_weight: float = 1.0
    entering: bool = False
    corridor: Corridor | None = None
    passage: FloatArray | None = None


@dataclass(frozen=True)
class LayingTarget:
    """Where the coat is laid, at each of the N steps.

    Attributes:
        collar: (N,3) of the middle of the collar's back, m.
        between: (N,3) from the right to the left gripper, m.
        height: (N,) of the middle between the grippers, m.
    """

    collar: FloatArray
    between: FloatArray
    height: FloatArray


@dataclass(frozen=True)
class Situation:
    """The garment now, its targets, and the predicted person.

    Attributes:
        x: (n,3) nodes of the garment now, m.
        v: (n,3) their velocities, m/s.
        targets: of left and right sleeve.
        obstacles: the predicted person at the start of each of the N steps.
        laying: where the coat is laid; None before both sleeves are on.
        kept_away: the person as grippers keep away from it, wider where it is uncertain; None: as
            in `obstacles`.
        leading: (N,3) target of the middle of the collar's back while the first armhole comes to a
            hand that hangs, m; None: anywhere.
        leftward: (N,3) horizontal unit vectors to the person's left. None disables the cost of the
            grippers' level.
    """

    x: FloatArray
    v: FloatArray
    targets: tuple[SleeveTarget, SleeveTarget]
    obstacles: Sequence[Obstacles]
    leftward: FloatArray | None = None
    kept_away: Sequence[Obstacles] | None = None
    laying: LayingTarget | None = None
    leading: FloatArray | None = None


@dataclass(frozen=True)
class HeldGarment:
    """Grasp and openings of the controller's garment.

    Attributes:
        held_count: number of nodes held by left and by right gripper.
        armholes: loop nodes of left and right armhole.
        signs: orientation signs of the loops (see `loop_orientation`).
        span: largest distance between the grippers, m.
        entry: where arms enter the garment.
    """

    held_count: tuple[int, int]
    armholes: tuple[IntArray, IntArray]
    signs: tuple[float, float]
    span: float
    entry: Entry
