"""Target of a sleeve that is about to be pulled over a hand (Eq. Jpi)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from drake_dress.models.arrays import FloatArray
from drake_dress.models.control.task_parameters import Approach, TaskParameters, unit
from drake_dress.models.dressing.sleeve import SleeveState
from drake_dress.models.dressing.stages import SleeveFacts
from drake_dress.models.garment.mesh import Hold
from drake_dress.models.human.heading import Heading


def choose_approach(
    p: TaskParameters,
    forearm: FloatArray,
    to: Heading,
    side: int,
    attempts: int,
    tethered: bool,
    hold: Hold = "shoulders",
) -> Approach:
    """Returns the approach to a hand after `attempts` misses, for the current `forearm` (3,).

    An approach that misses a hand once mostly misses it again, so the next attempt uses another
    one. A flat forearm enters an armhole that is turned toward it about the vertical, a steep
    forearm one that comes from the side. An armhole from the side that misses a compliant arm also
    pushes it further inward each time, in the end behind the back. The first sleeve therefore
    approaches an adducted arm along the forearm in every second attempt after `led_after` misses.
    """
    level = float(np.hypot(forearm[0], forearm[1]))
    if hold == "edges":
        if level > p.steep:
            return _in_turn(p.edge_approaches, 0, attempts)
        # every second attempt is in the first one's way, with the armhole lifted over the hand
        turn = 0 if attempts % 2 == 1 else attempts // 2
        return _in_turn(p.edge_approaches, len(p.edge_approaches) - 1, turn)
    if tethered:
        return p.tethered_approaches[attempts % len(p.tethered_approaches)]
    led = opening(forearm, to, side) < p.led_inward
    if led and attempts >= p.led_after and (attempts - p.led_after) % 2 == 0:
        return p.led_approach
    best = 1 if level >= p.flat else 2 if level <= p.steep else 0
    return _in_turn(p.approaches, best, attempts)


def lifts(p: TaskParameters, forearm: FloatArray, tethered: bool, missed: int, hold: Hold) -> bool:
    """Returns whether an armhole is lifted over a hand that hangs, in every second attempt.

    Args:
        p: settings.
        forearm: (3,) unit, from hand to elbow.
        tethered: whether the other sleeve is on its arm; it keeps the armhole from coming below.
        missed: how often the armhole has missed the hand.
        hold: where the garment is held; one that is held at its shoulders hangs between both.
    """
    level = float(np.hypot(forearm[0], forearm[1]))
    return hold == "edges" and not tethered and missed % 2 == 1 and level <= p.steep


def _in_turn(ways: Sequence[Approach], best: int, attempts: int) -> Approach:
    """Returns the way of an attempt: the best one comes first, the others keep their order."""
    turn = attempts % len(ways)
    return ways[best if turn == 0 else turn - 1 if turn <= best else turn]


def opening(forearm: FloatArray, to: Heading, side: int) -> float:
    """Returns the inward component of a forearm's direction (3,) from hand to elbow."""
    return float(forearm @ to.inward(side))


def distance_aside(offset: FloatArray, direction: FloatArray) -> FloatArray:
    """Returns the lengths (…) of `offset` (…,3) normal to unit vectors `direction` (…,3)."""
    along = np.einsum("...i,...i->...", offset, direction)
    across = offset - direction * along[..., None]
    return np.sqrt(np.einsum("...i,...i->...", across, across))


@dataclass(frozen=True)
class Preparation:
    """A sleeve that is about to be pulled over its hand.

    The opening is drawn over the hand mostly from outside inward. Before that, it waits outside the
    hand at the upper bound of l_h, and further back (against v_f) until it is aligned, so that the
    hand enters through the open front. An arm from anywhere else meets the outside of the front
    panel: the armhole's centre is at the hand, but the hand is not inside. An opening that the hand
    does not see therefore stays outside. A sleeve that missed the hand moves to where the hand sees
    its opening. With the other sleeve on an arm the garment does not reach that far, and the second
    sleeve goes around the hand. An opening that faces the hand is drawn along its own normal, and
    along the forearm once the hand is inside. Drawn further inward, it would pass the hand.

    Attributes:
        parameters: settings.
        side: side of the sleeve.
        fact: facts about the sleeve.
        way: its approach to the hand.
        tethered: whether the other sleeve is on its arm.
        attempts: how often the sleeve has missed the hand.
        outlook: place relative to the hand at which the hand sees the armhole, (3,) m.
        retreat: whether the sleeve stays away from the hand.
        hold: where the garment is held.
        radius: of the armhole at rest, m.
    """

    parameters: TaskParameters
    side: int
    fact: SleeveFacts
    way: Approach
    tethered: bool
    attempts: int
    outlook: FloatArray | None
    retreat: bool = False
    hold: Hold = "shoulders"
    radius: float = 0.0

    def places(
        self, hand: FloatArray, forearm: FloatArray, to: Heading, sleeve: SleeveState
    ) -> FloatArray:
        """Returns the targets of the armhole's centre at N times, (N,3) m.

        Args:
            hand: (N,3) m.
            forearm: (N,3) unit, from hand to elbow.
            to: heading of the person at these times.
            sleeve: its current state.
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
        # Depth of the hand behind the opening, and its distance from the opening's normal axis.
        depth = (offset @ -sleeve.v_c)[:, None]
        beside = distance_aside(offset, sleeve.v_c)[:, None]
        facing = self._facing(beside)
        inside = facing * _ramp(depth, -0.02, 0.02)
        # the opening is aligned first and drawn over the hand only then
        more = max(0.0, self.radius - p.funnel_radius)
        aligned = _ramp(beside - more, p.funnel_wide, p.funnel_narrow)
        ahead = np.where(depth < 0.0, aligned, 1.0)
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

    def lifts(self, forearm: FloatArray) -> bool:
        """Returns whether the armhole is lifted over the hand; see the function `lifts`."""
        return lifts(self.parameters, forearm, self.tethered, self.attempts, self.hold)

    def through(self, hand: FloatArray, forearm: FloatArray, sleeve: SleeveState) -> FloatArray:
        """Returns the targets (N,3), m, of an armhole at which a hand is about to enter.

        Its centre comes to the hand first, then on along its normal, and along the forearm once the
        hand is inside. An armhole that is drawn along the forearm at once catches the hand with its
        lower rim, and takes the arm along.

        Args:
            hand: (N,3) m.
            forearm: (N,3) unit, from hand to elbow.
            sleeve: its current state.
        """
        p = self.parameters
        offset = hand - sleeve.p_c
        beside = distance_aside(offset, sleeve.v_c)[:, None]
        more = max(0.0, self.radius - p.funnel_radius)
        aligned = _ramp(beside - more, p.funnel_wide, p.funnel_narrow)
        inside = _ramp((offset @ -sleeve.v_c)[:, None], 0.0, 2.0 * p.aside_free)
        onward = (1.0 - inside) * aligned * unit(sleeve.v_c + forearm) + inside * forearm
        place: FloatArray = hand + p.overshoot * onward
        return place

    def _around(self, offset: FloatArray, back: FloatArray, to: Heading) -> FloatArray:
        """Returns places (N,3), m, relative to the hand, of a tethered armhole hidden from it.

        The armhole moves outward and back first, then forward beside the hand, because the panel in
        front of it has to pass on the hand's outer side.

        Args:
            offset: (N,3) hand relative to the armhole's current centre, m.
            back: (N,3) place outward and back, relative to the hand, m.
            to: heading of the person.
        """
        p, inward = self.parameters, to.inward(self.side)
        outward = _along(offset, inward)
        if self.hold == "edges":
            return self._behind_first(offset, outward, back, to)
        passing = _ramp(outward, p.passing_from, p.passing_beside)
        beside = -p.passing_outward * inward - p.passing_behind * to.front
        way: FloatArray = (1.0 - passing) * back + passing * beside
        return way

    def _behind_first(
        self, offset: FloatArray, outward: FloatArray, back: FloatArray, to: Heading
    ) -> FloatArray:
        """Returns places (N,3), m, of the armhole of a garment that is held at its edges.

        In front of the hand it moves straight back, on the side where it is, and only behind the
        hand across to it. No panel has to be led around the hand.

        Args:
            offset: as of `_around`.
            outward: (N,1) distance of the armhole outward of the hand, m.
            back: as of `_around`.
            to: heading of the person.
        """
        p, inward = self.parameters, to.inward(self.side)
        ahead = -_along(offset, to.front)
        straight = -p.edge_back * to.front - outward * inward
        across = back + (-_along(back, inward) - p.edge_outward) * inward
        first = _ramp(ahead, -0.75 * p.edge_back, -0.25 * p.edge_back)
        way: FloatArray = first * straight + (1.0 - first) * across
        return way

    @property
    def _seeks_sight(self) -> bool:
        """Whether the sleeve moves to where its hand sees the opening."""
        return self.tethered or self.outlook is not None

    @property
    def _barred(self) -> float:
        """How far the garment blocks the hand's sight of the opening, 0 to 1."""
        stages = self.parameters.stages
        return float(_ramp(self.fact.sight, stages.least_sight, stages.lost_sight))

    def _facing(self, beside: FloatArray) -> FloatArray:
        """Returns how far, 0 to 1, the opening may be drawn straight at the hand, (N,1).

        Args:
            beside: (N,1) distance of the hand from the opening's normal axis, m.
        """
        p = self.parameters
        facing = (1.0 - self._barred) * _ramp(beside, 1.5 * p.inside_radius, p.inside_radius)
        if not self._seeks_sight:
            return facing
        return np.maximum(facing, _ramp(self.fact.sight, p.stages.least_sight, p.clear_sight))

    def _behind(self, sleeve: SleeveState, outside: FloatArray, to: Heading) -> FloatArray:
        """Returns places behind `outside` (N,3), further behind for a larger lateral error."""
        p = self.parameters
        error = distance_aside(sleeve.p_c - outside, to.front)[:, None]
        wait = p.approach_slope * np.maximum(0.0, error - 2.0 * p.aside_free)
        place: FloatArray = outside - np.minimum(wait, p.behind_distance) * to.front
        return place


def _along(vectors: FloatArray, direction: FloatArray) -> FloatArray:
    """Returns the components (N,1) of vectors (N,3) along unit vectors (N,3)."""
    along: FloatArray = np.einsum("ij,ij->i", vectors, direction)[:, None]
    return along


def _ramp(value: float | FloatArray, zero: float, one: float) -> FloatArray:
    """Returns a linear ramp from 0 at `zero` to 1 at `one`, clipped to [0, 1]."""
    ramp: FloatArray = np.minimum(1.0, np.maximum(0.0, (value - zero) / (one - zero)))
    return ramp
