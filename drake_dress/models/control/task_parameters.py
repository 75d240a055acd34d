"""Approach strategies, and all settings of the sleeve targets."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from drake_dress.models.arrays import FloatArray
from drake_dress.models.dressing.stages import StageParameters
from drake_dress.models.human.heading import Heading

# Least number of approaches: the best one for the first hand depends on the forearm.
LEAST_APPROACHES = {"approaches": 3, "tethered_approaches": 1, "edge_approaches": 1}


@dataclass(frozen=True)
class Approach:
    """A way to approach a hand; shares run from inward across the body (0) to the forearm (1).

    Attributes:
        share: direction in which the armhole is drawn over the hand: 0 is inward across the body, 1
            is along the forearm.
        orientation: direction from the armhole to the garment's entry, on the same scale.
        emphasis: factor on the weight Q of the direction.
        tilt: share of the forearm's slope that the direction to the entry has. The garment turns
            about the vertical axis as far as requested; tilted up toward a steep forearm, it hangs
            on edge.
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
        """Returns the target unit vector (…,3) from an armhole to the garment's entry.

        Args:
            forearm: (…,3) unit, from hand to elbow.
            to: heading, or one for each forearm.
            side: of the arm.
        """
        tilted = unit(forearm * np.array([1.0, 1.0, self.tilt]))
        return _between(to.inward(side), tilted, self.orientation)


@dataclass(frozen=True)
class TaskParameters:
    """Settings of the sleeve targets.

    Attributes:
        progress_rate: target rate of the dressing coordinate s, 1/s (k per step of the prediction).
        approach_distance: upper bound of l_h, m.
        tethered_approach_distance: the same while the other sleeve is on, m.
        approach_slope: l_h per lateral distance from the line of approach; 1 in the paper.
        approaches: ways to approach a hand. After each attempt that missed the hand the next one is
            used, in turn. The first attempt uses the first, but the second for a flat forearm and
            the third for a steep one.
        tethered_approaches: the same while the other sleeve is on, starting with the first.
        edge_approaches: ways to approach a hand with a garment that is held at the edges of its
            opening, in turn: mostly from behind, along the forearm. A steep forearm begins with the
            last one, and has it in every second attempt, with the armhole lifted over the hand.
        led_inward: inward component of the forearm's direction, from hand to elbow, below which the
            hand counts as pulled inward.
        led_after: number of misses after which the first sleeve uses `led_approach` for such a
            hand.
        led_approach: way to approach a hand that was pulled inward.
        flat: horizontal part of the forearm's direction above which the forearm is flat.
        steep: horizontal part of the forearm's direction below which the forearm is steep.
        behind_distance: greatest distance behind the hand at which a sleeve waits until it is
            aligned, m.
        retreat_distance: how much further back a sleeve goes after it missed the hand, m.
        passing_back: the same of a tethered sleeve, m. The front panel needs this distance to pass
            behind the hand; further back, the sleeve pulls the first one off its arm.
        withdrawal_distance: distance behind the shoulders to which both sleeves withdraw, m.
        swing_reach: distance from the first armhole to which the second one swings back, as a share
            of their distance at rest.
        swing_outward: outward part of that motion per backward part.
        widening: relative growth of the bound of l_h with each of the first three misses.
        passing_outward: lateral distance outward of an unseen hand at which a tethered armhole
            ends, m. The panel in front of it is as wide.
        passing_behind: distance behind an unseen hand at which a tethered armhole ends, m.
        passing_from: distance outward of the hand at which a tethered armhole begins to come
            forward, m. Any closer and the panel would get in front of the hand.
        edge_outward: replaces `passing_outward` for a garment that is held at the edges of its
            opening: no panel hangs in front of the armhole, m.
        edge_back: distance behind the hand to which the armhole of such a garment moves straight
            back first, if it is in front of the hand, m.
        passing_beside: distance outward of the hand at which that armhole is all the way forward,
            beside the hand, m.
        outlook_distance: distance from the hand within which a sleeve that missed it moves to where
            the hand sees the opening, m.
        leading_distance: distance of the armhole from a hand that hangs below which the collar of a
            garment that is held at its edges is led beside the arm, m.
        leading_behind: distance of the collar behind the forearm's line there, m.
        longest_reach: assumed greatest distance between the armholes, as a share of their distance
            at rest.
        clear_sight: share of the opening that the hand must see for a tethered sleeve, or one that
            missed the hand, to be drawn straight at the hand.
        funnel_wide: lateral distance of the hand from the normal of a clearly seen opening above
            which the opening is aligned first, m.
        funnel_narrow: lateral distance below which the aligned opening is drawn on, m.
        funnel_radius: radius of the armhole at rest that both distances are for, m. That by which
            an armhole is wider is added to them.
        funnel_distance: distance before the hand at which the opening is aligned, m.
        aside_free: lateral distance that is ignored, m.
        overshoot: distance past the hand at which the target of an aligned armhole lies, m.
        inside_radius: distance from the armhole's centre within which a hand beyond the armhole's
            plane counts as inside, m.
        touch_distance: distance of a hand from the surface that spans the armhole below which the
            hand is about to enter, m. The armhole is then drawn along the forearm, even if cloth
            hides it from the hand.
        edge_touch: replaces `touch_distance` for a garment that is held at the edges of its
            opening, m. Its armhole stands open before a hand, and no panel comes in between.
        near_distance: distance from the hand below which the armhole's position counts more than
            its direction, m.
        near_position: factor on W below `near_distance`.
        near_direction: factor on Q below `near_distance`.
        dressing_direction: factor on Q while a sleeve is drawn up its arm.
        elbow_outward: distance by which an armhole that passes a bent elbow aims away from the
            inside of the bend, m, for a bend that folds the arm; less for a smaller one. The arm's
            axis and a taut sleeve cut that corner, and the rim stays hooked behind the elbow.
        elbow_lead: how far ahead of the armhole, in s, its target is at an elbow that folds the
            arm; further for a smaller bend. A target further up would outweigh `elbow_outward`.
        dressing_position: factor on W once both sleeves are on their arms. Without it the last
            centimetres cost less than the tilt of the armhole on the shoulder. Also used for a
            waiting sleeve that may slip off.
        waiting_reach: share of the armholes' rest distance that a waiting sleeve leaves to the
            other one.
        largest_aside: greatest lateral motion of a waiting sleeve, m. Hands that hang 0.58 m apart
            come 0.15 m nearer at forces of 12 N.
        final_progress: final target of the progress s. At 2 the armhole would be drawn into the
            armpit, and both sleeves would pull against each other. A sleeve that waits for the
            other one there stays where it just counts as done.
        held_progress: progress s up to which a slipped sleeve is drawn again while both are held.
            Targets are reached to within 0.03, and forces depend on the place of the sleeve.
        settling_speed: greatest speed of the grippers once both sleeves are at the shoulders, m/s.
            A plan is based on observations up to 0.9 s old; at full speed the grippers oscillated
            by 4 cm once a second.
        largest_lead: greatest lead in s of one sleeve over the other when both are on their arms.
        stages: thresholds between the stages.

    Raises:
        ValueError: there are fewer approaches than `LEAST_APPROACHES`.
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
    edge_approaches: tuple[Approach, ...] = (
        Approach(0.75, 0.85, 3.0),
        Approach(0.5, 0.75, 3.0),
        Approach(0.9, 0.9, 3.0),
        Approach(0.25, 0.6, tilt=0.3),
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
    edge_outward: float = 0.04
    edge_back: float = 0.18
    outlook_distance: float = 0.35
    leading_distance: float = 0.35
    leading_behind: float = 0.03
    longest_reach: float = 1.04
    clear_sight: float = 0.9
    funnel_wide: float = 0.07
    funnel_narrow: float = 0.03
    funnel_radius: float = 0.095
    funnel_distance: float = 0.08
    aside_free: float = 0.02
    overshoot: float = 0.12
    inside_radius: float = 0.08
    touch_distance: float = 0.03
    edge_touch: float = 0.07
    near_distance: float = 0.2
    near_position: float = 3.0
    near_direction: float = 0.3
    dressing_direction: float = 0.1
    elbow_outward: float = 0.04
    elbow_lead: float = 0.15
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
    """Returns vectors (…,3) scaled to length one."""
    shortened: FloatArray = v / np.sqrt(np.einsum("...i,...i->...", v, v))[..., None]
    return shortened


def _between(a: FloatArray, b: FloatArray, share: float) -> FloatArray:
    """Returns the unit vectors between unit vectors `a` (share 0) and `b` (share 1), (…,3)."""
    return unit((1.0 - share) * a + share * b)
