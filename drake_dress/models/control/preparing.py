"""Where a sleeve goes that is to go over a hand (Eq. Jpi)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drake_dress.models.arrays import FloatArray
from drake_dress.models.control.task_parameters import Approach, TaskParameters
from drake_dress.models.dressing.sleeve import SleeveState
from drake_dress.models.dressing.stages import SleeveFacts
from drake_dress.models.human.heading import Heading


def choose_approach(
    p: TaskParameters, forearm: FloatArray, to: Heading, side: int, attempts: int, tethered: bool
) -> Approach:
    """Returns how to go about a hand that was missed so often, with `forearm` (3,) as it is now.

    What misses a hand once mostly misses it again: an arm that another approach suits gets it. A
    flat forearm goes into an armhole that is turned toward it about the vertical, a steep one into
    one that comes from the side. From the side an armhole that misses also pushes an arm that
    follows further inward each time, where it is led behind the back in the end: such an arm is
    gone about along its forearm every other time, once it was missed a few times as the first one.
    """
    if tethered:
        return p.tethered_approaches[attempts % len(p.tethered_approaches)]
    led = opening(forearm, to, side) < p.led_inward
    if led and attempts >= p.led_after and (attempts - p.led_after) % 2 == 0:
        return p.led_approach
    level = float(np.hypot(forearm[0], forearm[1]))
    best = 1 if level >= p.flat else 2 if level <= p.steep else 0
    turn = attempts % len(p.approaches)
    # the best goes first, the others keep their order
    return p.approaches[best if turn == 0 else turn - 1 if turn <= best else turn]


def opening(forearm: FloatArray, to: Heading, side: int) -> float:
    """Returns the inward part of a forearm's direction (3,) from hand to elbow."""
    return float(forearm @ to.inward(side))


def distance_aside(offset: FloatArray, direction: FloatArray) -> FloatArray:
    """Returns the lengths (…) of `offset` (…,3) across unit vectors `direction` (…,3)."""
    along = np.einsum("...i,...i->...", offset, direction)
    across = offset - direction * along[..., None]
    return np.sqrt(np.einsum("...i,...i->...", across, across))


@dataclass(frozen=True)
class Preparation:
    """One sleeve that is to go over its hand.

    The opening is drawn over the hand mostly from outside inward. Before, it waits a cap of l_h
    outside the hand, and further back (against v_f) until it is in line: so the hand comes in by
    the open front. An arm that comes from anywhere else meets the outside of the front panel, with
    the armhole's centre at the hand and the hand not in it; so an opening that the hand does not
    see stays outside. One that missed the hand goes where the hand comes to see it. The garment
    does not reach that far with its other sleeve on an arm: the second one goes around the hand.
    One that faces the hand is drawn along its own normal, and along the forearm once the hand is
    in it: further inward it would be pulled past it.

    Attributes:
        parameters: settings.
        side: of the sleeve.
        fact: of the sleeve.
        way: how it goes about the hand.
        tethered: the other sleeve is on its arm.
        attempts: how often it has missed the hand.
        outlook: place from the hand at which the hand sees the armhole, (3,) m.
        retreat: it keeps away from the hand.
    """

    parameters: TaskParameters
    side: int
    fact: SleeveFacts
    way: Approach
    tethered: bool
    attempts: int
    outlook: FloatArray | None
    retreat: bool = False

    def places(
        self, hand: FloatArray, forearm: FloatArray, to: Heading, sleeve: SleeveState
    ) -> FloatArray:
        """Returns where the armhole's centre is asked to be at N times, (N,3) m.

        Args:
            hand: (N,3) m.
            forearm: (N,3) unit, from hand to elbow.
            to: heading of the person at these times.
            sleeve: where it is now.
        """
        p = self.parameters
        direction = self.way.direction(forearm, to, self.side)
        cap = p.tethered_approach_distance if self.tethered else p.approach_distance
        cap *= 1.0 + p.widening * min(self.attempts, 3)
        outside = hand - cap * direction
        back: FloatArray = (
            outside - (p.passing_back if self.tethered else p.retreat_distance) * to.front
        )
        if self.retreat:
            return back
        offset = hand - sleeve.p_c
        # Depth of the hand behind the opening, and how far it is beside the opening's normal.
        depth = (offset @ -sleeve.v_c)[:, None]
        beside = distance_aside(offset, sleeve.v_c)[:, None]
        facing = self._facing(beside)
        inside = facing * _ramp(depth, -0.02, 0.02)
        # not over the hand before it is in line: what is beside goes first
        ahead = np.where(depth < 0.0, _ramp(beside, p.funnel_wide, p.funnel_narrow), 1.0)
        if self._seeks_sight:
            onward = (1.0 - inside) * sleeve.v_c + inside * forearm
            onward = ahead * p.overshoot * onward - (1.0 - ahead) * p.funnel_distance * sleeve.v_c
            unseen = self.outlook
            if unseen is None:
                unseen = self._around(offset, back - hand, to)
            there: FloatArray = hand + (1.0 - facing) * unseen + facing * onward
            return there
        barred = self._barred
        aside = (1.0 - facing) * distance_aside(offset, direction)[:, None]
        distance = np.minimum(p.approach_slope * np.maximum(0.0, aside - p.aside_free), cap)
        distance = np.maximum(distance, barred * cap)
        waits = distance == cap
        if waits.all():
            return self._behind(sleeve, outside, to)
        onward = (facing - inside) * sleeve.v_c + inside * forearm
        onward = p.overshoot * ((1.0 - facing) * direction + ahead * onward)
        onward = onward - (1.0 - ahead) * facing * p.funnel_distance * sleeve.v_c
        goal: FloatArray = hand - distance * direction + (1.0 - barred) * onward
        if not waits.any():
            return goal
        return np.where(waits, self._behind(sleeve, outside, to), goal)

    def _around(self, offset: FloatArray, back: FloatArray, to: Heading) -> FloatArray:
        """Returns the way (N,3) of a tethered armhole that its hand does not see, from the hand, m.

        Outward and back first, then forward beside the hand: the panel in front of the armhole has
        to pass on the hand's outer side.

        Args:
            offset: (N,3) of the hand from the armhole's centre now, m.
            back: (N,3) of the place outward and back, from the hand, m.
            to: heading of the person.
        """
        p, inward = self.parameters, to.inward(self.side)
        outward = np.einsum("ij,ij->i", offset, inward)[:, None]
        passing = _ramp(outward, p.passing_from, p.passing_beside)
        beside = -p.passing_outward * inward - p.passing_behind * to.front
        way: FloatArray = (1.0 - passing) * back + passing * beside
        return way

    @property
    def _seeks_sight(self) -> bool:
        """Whether it goes to where its hand comes to see it."""
        return self.tethered or self.outlook is not None

    @property
    def _barred(self) -> float:
        """How far the garment bars the hand's sight of the opening, 0 to 1."""
        stages = self.parameters.stages
        return float(_ramp(self.fact.sight, stages.least_sight, stages.lost_sight))

    def _facing(self, beside: FloatArray) -> FloatArray:
        """Returns how far, 0 to 1, the opening is one to be drawn straight at the hand, (N,1).

        Args:
            beside: (N,1) of the hand, from the opening's normal, m.
        """
        p = self.parameters
        facing = (1.0 - self._barred) * _ramp(beside, 1.5 * p.inside_radius, p.inside_radius)
        if not self._seeks_sight:
            return facing
        return np.maximum(facing, _ramp(self.fact.sight, p.stages.least_sight, p.clear_sight))

    def _behind(self, sleeve: SleeveState, outside: FloatArray, to: Heading) -> FloatArray:
        """Returns places behind `outside` (N,3), the further behind the less it is in line."""
        p = self.parameters
        error = distance_aside(sleeve.p_c - outside, to.front)[:, None]
        wait = p.approach_slope * np.maximum(0.0, error - 2.0 * p.aside_free)
        place: FloatArray = outside - np.minimum(wait, p.behind_distance) * to.front
        return place


def _ramp(value: float | FloatArray, zero: float, one: float) -> FloatArray:
    """Returns 0 beyond `zero`, 1 beyond `one`, linear between, for any number of values."""
    ramp: FloatArray = np.minimum(1.0, np.maximum(0.0, (value - zero) / (one - zero)))
    return ramp
