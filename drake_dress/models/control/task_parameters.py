"""How sleeves are asked to go about hands, and all settings of where they are asked to go."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from drake_dress.models.arrays import FloatArray
from drake_dress.models.dressing.stages import StageParameters
from drake_dress.models.human.heading import Heading

# How many ways there must be: the first hand's best one depends on the forearm.
LEAST_APPROACHES = {"approaches": 3, "tethered_approaches": 1}


@dataclass(frozen=True)
class Approach:
    """A way to go about a hand; shares are between inward across the body (0) and forearm (1).

    Attributes:
        share: of the direction in which an armhole is drawn over the hand.
        orientation: of the direction from the armhole to the garment's entry.
        emphasis: factor on Q.
        tilt: how much of the forearm's slope the latter direction has. The garment turns about the
            vertical as far as it is asked to; turned up toward a steep forearm it hangs on edge.
    """

    share: float = 0.25
    orientation: float = 0.6
    emphasis: float = 1.0
    tilt: float = 1.0

    def direction(self, forearm: FloatArray, to: Heading, side: int) -> FloatArray:
        """Returns the unit vector (…,3) along which an armhole is drawn over the hand.

        Args:
            forearm: (…,3) unit, from hand to elbow.
            to: heading, or one for each forearm.
            side: of the arm.
        """
        return _between(to.inward(side), forearm, self.share)

    def entry(self, forearm: FloatArray, to: Heading, side: int) -> FloatArray:
        """Returns the unit vector (…,3) from an armhole to the garment's entry, as it is asked for.

        Args:
            forearm: (…,3) unit, from hand to elbow.
            to: heading, or one for each forearm.
            side: of the arm.
        """
        tilted = unit(forearm * np.array([1.0, 1.0, self.tilt]))
        return _between(to.inward(side), tilted, self.orientation)


@dataclass(frozen=True)
class TaskParameters:
    """Where sleeves are asked to go.

    Attributes:
        progress_rate: advance of s asked for, 1/s (k in a step of the prediction).
        approach_distance: cap of l_h, m.
        tethered_approach_distance: the same with the other sleeve on, m.
        approach_slope: l_h per distance beside the line of approach; 1 as printed.
        approaches: how a hand is gone about; after each attempt that missed it the next, in turn.
            The first is tried first, but the second for a flat forearm, the third for a steep one.
        tethered_approaches: the same with the other sleeve on, begun with the first.
        flat, steep: level part of a forearm's direction from which on it is flat; up to which it
            is steep.
        led_inward: inward part of a forearm's direction, hand to elbow, below which the hand has
            been led inward. led_approach: to such an arm, if it is the first one, from `led_after`
            misses on.
        behind_distance: cap of how far behind the hand a sleeve that is not in line yet waits, m.
        retreat_distance: how much further back a sleeve goes that missed the hand, m.
        passing_back: the same of a tethered one, m: as far back as the panel before it needs to
            pass behind the hand. Drawn further back, it pulls the first sleeve off its arm.
        withdrawal_distance: behind the shoulders, to where both sleeves are taken back, m.
        swing_reach: how far from the first armhole the second one is swung back, as a share of the
            distance between both at rest.
        swing_outward: outward part of the way there, for each part backward.
        widening: growth of the cap of l_h with each attempt that missed the hand.
        passing_outward, passing_behind: how far outward of a hand that does not see it, and behind
            it, a tethered armhole is asked to be in the end, m: the panel before it is as wide.
        passing_from, passing_beside: so far outward of the hand it begins to come forward, and is
            asked to be that far forward, m; from less the panel would come before the hand.
        outlook_distance: from the hand, within which a sleeve that missed it goes where it is seen,
            m.
        longest_reach: share of the distance between both armholes at rest to which the garment is
            taken to be drawn out.
        clear_sight: share from which on a tethered sleeve is drawn straight at the hand, wherever
            the hand is before the opening.
        funnel_wide: hand this far beside the normal of an opening that it sees clearly: the opening
            is brought in line first, `funnel_distance` before the hand, m.
        funnel_narrow: this far beside it is drawn on, m.
        funnel_distance: m.
        aside_free: distance beside that does not count, m.
        overshoot: how far past the hand an armhole in line is asked to go, m.
        inside_radius: a hand beyond an armhole's plane and this close to its centre is in it, m.
        touch_distance: a hand this close to the surface that spans an armhole is about to go in:
            the armhole is drawn along the forearm, whatever bars the hand's sight of it, m.
        near_distance: from the hand, from which on an armhole's place counts more than its
            direction, m.
        near_position, near_direction: factors on W and Q then.
        dressing_direction: factor on Q while a sleeve is drawn up its arm.
        dressing_position: factor on W once both are: the last centimetres cost less than what the
            armhole lies askew on the shoulder. Also of a waiting sleeve that may slip off.
        waiting_reach: share of the distance between both armholes at rest that a waiting sleeve
            lets the other one use.
        largest_aside: how far a waiting sleeve is drawn aside at most, m: hands that hang 0.58 m
            apart come 0.15 m nearer at forces of 12 N.
        final_progress: s that is asked for in the end; at 2 the armhole would be drawn into the
            armpit, and both sleeves would pull against each other. A sleeve whose other one is not
            there yet stays where it just counts as done, and leaves the garment to it.
        held_progress: s up to which a sleeve that has slipped is drawn again while both are held:
            what is asked for is reached but for 0.03, and forces follow where it is.
        settling_speed: of grippers once both sleeves are at the shoulders, m/s. A plan answers what
            was seen up to 0.9 s before: with all the speed there is, grippers went up and down by
            4 cm once a second.
        largest_lead: advance of s that one of two sleeves on their arms may have on the other.
        stages: thresholds of the switching.

    Raises:
        ValueError: there are fewer ways to go about a hand than `LEAST_APPROACHES`.
    """

    progress_rate: float = 0.4
    approach_distance: float = 0.20
    tethered_approach_distance: float = 0.15
    approach_slope: float = 3.0
    approaches: tuple[Approach, ...] = (
        Approach(0.25, 0.6),
        Approach(0.5, 1.0, 3.0),
        Approach(0.25, 0.6, tilt=0.3),
        Approach(0.25, 0.75, 3.0),
        Approach(0.5, 0.85, 3.0),
    )
    tethered_approaches: tuple[Approach, ...] = (
        Approach(0.25, 0.75, 3.0),
        Approach(0.25, 0.6),
        Approach(0.25, 0.85, 3.0),
        Approach(0.5, 0.85, 3.0),
    )
    led_inward: float = -0.03
    led_after: int = 3
    led_approach: Approach = Approach(0.9, 0.9, 3.0)
    flat: float = 0.65
    steep: float = 0.47
    behind_distance: float = 0.30
    retreat_distance: float = 0.15
    passing_back: float = 0.08
    withdrawal_distance: float = 0.65
    swing_reach: float = 0.9
    swing_outward: float = 0.5
    widening: float = 0.1
    passing_outward: float = 0.15
    passing_behind: float = 0.05
    passing_from: float = 0.08
    passing_beside: float = 0.12
    outlook_distance: float = 0.35
    longest_reach: float = 1.04
    clear_sight: float = 0.9
    funnel_wide: float = 0.07
    funnel_narrow: float = 0.03
    funnel_distance: float = 0.08
    aside_free: float = 0.02
    overshoot: float = 0.12
    inside_radius: float = 0.08
    touch_distance: float = 0.03
    near_distance: float = 0.2
    near_position: float = 3.0
    near_direction: float = 0.3
    dressing_direction: float = 0.1
    dressing_position: float = 4.0
    waiting_reach: float = 0.9
    largest_aside: float = 0.15
    final_progress: float = 1.99
    held_progress: float = 1.95
    settling_speed: float = 0.03
    largest_lead: float = 0.6
    stages: StageParameters = field(default_factory=StageParameters)

    def __post_init__(self) -> None:
        for name, least in LEAST_APPROACHES.items():
            count = len(getattr(self, name))
            if count < least:
                raise ValueError(f"{name} has {count} entries, expected {least} or more")


def unit(v: FloatArray) -> FloatArray:
    """Returns vectors (…,3) with length one."""
    shortened: FloatArray = v / np.sqrt(np.einsum("...i,...i->...", v, v))[..., None]
    return shortened


def _between(a: FloatArray, b: FloatArray, share: float) -> FloatArray:
    """Returns the unit vectors between unit vectors `a` (share 0) and `b` (share 1), (…,3)."""
    return unit((1.0 - share) * a + share * b)
