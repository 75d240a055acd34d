"""Governs the velocities of two grippers that hold one garment on a person.

Whatever a controller asks for, the position commands that leave `step` obey limits. A controller
asks by velocities, with the time at which it made them. Velocities have no jumps and do not wind
up: what was held back is gone, and the controller need not know of it. `step` integrates its own
position commands from them.

The new velocity v of a gripper is the point nearest to the request in an intersection of

    speed          |v| ≤ max_speed
    acceleration   |v - v_last| ≤ max_acceleration dt, or max_braking dt (below)
    force          n·v ≤ c(force, request), n the direction that pulls against the garment
    person         not nearer to the skin than a distance: slower toward it, or away from it
    distance       of both grippers, least and largest: each closes or opens it by half at most
    workspace      a box
    lead           of the command before the measured gripper

All are balls and half-spaces, and the nearest point is found exactly (`projection.py`). Limits of
place are kept by stopping in time. Along a direction that stays (workspace, least distance, a
person who is still) v obeys v dt + v² / (2 max_acceleration) ≤ d, d being what is left, and
keeping it never needs more than ordinary braking. Where direction turns (lead, largest distance)
the whole way to rest is in the ball: |p + τ v| ≤ radius, τ = dt + v̂ / (2 max_acceleration),
v̂ = |v_last| + max_acceleration dt being the largest speed of this step. Braking straight at
3 max_acceleration keeps that from one step to the next: the factor of v falls from τ to
dt + (1.5 dt + v / 2a) (1 - 3 a dt / v) < τ.

Speed and max_braking are never exceeded, whatever the rest asks: v_last is in both balls, so both
always meet. Beyond max_acceleration, up to max_braking, a gripper brakes only where the limits
cannot be kept together otherwise, or where it must stop. If even that is not enough, limits are
kept as far as it goes in the order above: a person who is pulled counts more than a workspace.

The pull at which the garment is held back fades between the soft and the hard limit, as the force
rises (low-passed, for a gripper shall not answer to the garment's flutter); beyond, the gripper
gives way along the force. A force at the hard limit or beyond is taken as measured, at once: no
filter hides it, and n·v falls to 0 by max_braking dt a step.

    What fails                                      Then
    force over the hard limit for stop_time         both grippers stop: latched
    force or position that is no number             both stop, until measured again
    request that is no number, or 10 × max_speed    both come to rest by max_acceleration
    request older than stale_time, made later than
      now, or before one that was obeyed            the same
    no permission of the station                    the same

A latched stop ends by itself once the force on both grippers is under the soft limit; until then
the gripper that is pulled gives way, so that it ends and nobody is left held fast. It needs no
reset by hand: nothing is wrong but the force, which is measured to be gone. Giving way under the
hard limit comes last in the order above: it leaves no workspace.

Both stop where one must: they hold one garment on one person.

What presses cloth into a person is a gripper, mostly one that a hand reaches for. How the person
moves is not known here: who comes nearer is let come, and the gripper gives way.
"""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from enum import IntFlag
from functools import cached_property
from typing import NamedTuple

import numba as nb
import numpy as np

from drake_dress.models.arrays import FloatArray
from drake_dress.models.control.projection import BALL, HALF_SPACE, excess, find_nearest
from drake_dress.models.vector3 import dot, length

# A request this many times faster than allowed was not meant: it is in mm/s, or garbage.
_ABSURD = 10.0
# Time in which a limit of distance that is broken is made good again, s, no faster than relaxing,
# or yielding where it is the person's.
_RETURN_TIME = 0.1
# Stamps may be off by this, s: rounding of clocks that count periods.
_CLOCK_ROUNDING = 1e-6
# Numbers beyond this are over any limit, and their squares must not overflow.
_LARGEST = 1e6
# Of the force, the person, both distances, six walls, the lead.
_MOST_SPACES = 11


class Verdict(IntFlag):
    """What was cut from a request, and why."""

    NONE = 0
    SPEED = 1  # request over max_speed
    ACCELERATION = 2  # velocity has not caught up with what is allowed
    FORCE = 4  # pulls against a force over the soft limit
    LEAD = 8  # command too far before the gripper
    WORKSPACE = 16  # at the workspace's border
    DISTANCE = 32  # grippers too near to each other, or too far
    STALE = 64  # request too old, from the future, or before one that was obeyed
    INVALID = 128  # request is no number, or absurd
    UNMEASURED = 256  # force or position of a gripper is no number
    STOPPED = 512  # force was over the hard limit too long
    BRAKING = 1024  # more than max_acceleration was needed
    HELD = 2048  # the station does not permit motion: something it needs is not there
    PERSON = 4096  # too near to the person's skin


@dataclass(frozen=True)
class SafetyLimits:
    """Limits of each gripper; SI units.

    Attributes:
        max_speed: m/s.
        max_acceleration: ordinary, m/s².
        max_braking: never exceeded, m/s²; used where the other limits need it. With three times
            max_acceleration these can always be kept.
        soft_force: from here on pulling fades, N.
        hard_force: from here on there is no pulling, N; beyond, the gripper gives way.
        filter_time: time constant of the force's low-pass, s.
        yield_rate: speed of giving way per force over the hard limit, m/s/N.
        yield_speed: of giving way at most, to a force or a person, m/s.
        relax_speed: of giving way while stopped, and of going back into a distance, m/s.
        stop_time: over the hard limit after which both stop, s.
        max_lead: of the command before the measured position, m, braking included.
        stale_time: age at which a request is not obeyed any more, s.
        person_distance: of a gripper's command to the person's skin, m. 0: any.
        held_distance: of the cloth that it holds to the person's skin, m.
        least_distance: of the grippers' commands, m: hands must not hit each other. 0: any.
        largest_distance: of the same, m, for a garment that may not be drawn wider even if the
            force is measured wrong; inf: any.
        workspace: (2,3) low and high corner of the box for p_WG, m; None: everywhere.

    Raises:
        ValueError: limits that contradict each other.
    """

    max_speed: float = 0.25
    max_acceleration: float = 2.0
    max_braking: float = 6.0
    soft_force: float = 8.5
    hard_force: float = 17.0
    filter_time: float = 0.05
    yield_rate: float = 0.005
    yield_speed: float = 0.1
    relax_speed: float = 0.02
    stop_time: float = 0.5
    max_lead: float = 0.02
    stale_time: float = 0.1
    person_distance: float = 0.03
    held_distance: float = 0.008
    least_distance: float = 0.08
    largest_distance: float = np.inf
    workspace: FloatArray | None = None

    def __post_init__(self) -> None:
        positive = ("max_speed", "max_acceleration", "hard_force", "max_lead", "stale_time")
        for name in positive:
            if not getattr(self, name) > 0.0:
                raise ValueError(f"{name} is {getattr(self, name)}, expected more than 0")
        if not self.max_braking >= self.max_acceleration:
            raise ValueError(
                f"max_braking is {self.max_braking} m/s², "
                f"expected max_acceleration, {self.max_acceleration} m/s², at least"
            )
        if not 0.0 <= self.soft_force < self.hard_force:
            raise ValueError(
                f"soft_force is {self.soft_force} N, expected less than {self.hard_force} N"
            )
        if not 0.0 <= self.least_distance < self.largest_distance:
            raise ValueError(
                f"least_distance is {self.least_distance} m, "
                f"expected less than largest_distance, {self.largest_distance} m"
            )
        if self.workspace is not None and not np.all(self.workspace[0] < self.workspace[1]):
            raise ValueError("workspace's low corner is not below its high corner")

    @cached_property
    def compiled(self) -> Limits:
        """As kernels take them."""
        workspace = self.workspace
        if workspace is None:
            workspace = np.array([[-np.inf] * 3, [np.inf] * 3])
        scalars = [float(getattr(self, f.name)) for f in fields(self) if f.name != "workspace"]
        return Limits._make([*scalars, np.ascontiguousarray(workspace, dtype=np.float64)])

    def broken_at(self, position: FloatArray) -> str | None:
        """Returns what is wrong with grippers at `position` (2,3), m; None if nothing is."""
        apart = float(np.linalg.norm(position[0] - position[1]))
        if not self.least_distance <= apart <= self.largest_distance:
            low, high = self.least_distance, self.largest_distance
            return f"grippers are {apart:.3f} m apart, expected {low:g} to {high:g} m"
        if self.workspace is not None:
            low_corner, high_corner = self.workspace
            for p in position:
                if not np.all((low_corner <= p) & (p <= high_corner)):
                    return f"gripper at {np.round(p, 3).tolist()} m is outside the workspace"
        return None


class Limits(NamedTuple):
    """`SafetyLimits` as kernels take them; a workspace without borders is infinite."""

    max_speed: float
    max_acceleration: float
    max_braking: float
    soft_force: float
    hard_force: float
    filter_time: float
    yield_rate: float
    yield_speed: float
    relax_speed: float
    stop_time: float
    max_lead: float
    stale_time: float
    person_distance: float
    held_distance: float
    least_distance: float
    largest_distance: float
    workspace: FloatArray


@dataclass(frozen=True)
class Request:
    """What a controller asks for: velocity (2,3) of left and right, m/s, made at `stamp`, s."""

    velocity: FloatArray
    stamp: float


@dataclass(frozen=True)
class Measurement:
    """Of left and right: position (2,3), m, and force (2,3) of the garment on the gripper, N.

    A gripper with any entry that is not finite counts as unmeasured.
    """

    position: FloatArray
    force: FloatArray


@dataclass(frozen=True)
class Skin:
    """The person next to the commands of left and right gripper.

    Attributes:
        distance: (2,) m, negative inside.
        away: (2,3) unit vectors from the nearest point of the skin.
    """

    distance: FloatArray
    away: FloatArray


@dataclass(frozen=True)
class GovernorState:
    """What the governor remembers; always finite but for a stamp of -inf.

    Attributes:
        position: (2,3) command p_WG, m.
        velocity: (2,3) of the command, m/s.
        force: (2,3) low-passed, N.
        over: (2,) time for which the force was over the hard limit, less that under it, s.
        stopped: whether the stop is latched.
        stamp: of the newest request obeyed, s.
    """

    position: FloatArray
    velocity: FloatArray = field(default_factory=lambda: np.zeros((2, 3)))
    force: FloatArray = field(default_factory=lambda: np.zeros((2, 3)))
    over: FloatArray = field(default_factory=lambda: np.zeros(2))
    stopped: bool = False
    stamp: float = -np.inf

    SIZE = 22

    def packed(self) -> FloatArray:
        """Returns the state as (22,) numbers."""
        return np.concatenate(
            [
                self.position.ravel(),
                self.velocity.ravel(),
                self.force.ravel(),
                self.over,
                [float(self.stopped), self.stamp],
            ]
        )

    @staticmethod
    def unpacked(values: FloatArray) -> GovernorState:
        """Returns the state of (22,) numbers."""
        position, velocity, force = np.array(values[:18]).reshape(3, 2, 3)
        return GovernorState(
            position, velocity, force, np.array(values[18:20]), values[20] > 0.5, float(values[21])
        )


def step(
    state: GovernorState,
    request: Request,
    measured: Measurement,
    limits: SafetyLimits,
    now: float,
    dt: float,
    permitted: bool = True,
    skin: Skin | None = None,
) -> tuple[GovernorState, tuple[Verdict, Verdict]]:
    """Returns the state after `dt`, whose position is the command, and what was cut.

    Args:
        state: of the step before.
        request: any numbers, NaN and infinite ones too.
        measured: any numbers, NaN and infinite ones too.
        limits: which are kept.
        now: s; must not go back.
        dt: since the step before, s.
        permitted: whether the station lets grippers move; they yield to force in any case.
        skin: where the person is seen; finite. None: not seen.
    """
    distance = np.full(2, np.nan) if skin is None else skin.distance
    away = np.zeros((2, 3)) if skin is None else skin.away
    after = np.empty(GovernorState.SIZE)
    verdicts = np.empty(2, dtype=np.int64)
    _govern(
        state.packed(),
        _plain(request.velocity),
        float(request.stamp),
        _plain(measured.position),
        _plain(measured.force),
        limits.compiled,
        float(now),
        float(dt),
        bool(permitted),
        _plain(distance),
        _plain(away),
        after,
        verdicts,
    )
    return GovernorState.unpacked(after), (Verdict(int(verdicts[0])), Verdict(int(verdicts[1])))


def _plain(values: FloatArray) -> FloatArray:
    """Returns a copy with the one layout in memory for which kernels are compiled."""
    return np.array(values, dtype=np.float64, order="C")


# Compiled code knows flags as numbers.
_SPEED, _ACCELERATION, _FORCE, _LEAD, _WORKSPACE, _DISTANCE = (
    int(v)
    for v in (
        Verdict.SPEED,
        Verdict.ACCELERATION,
        Verdict.FORCE,
        Verdict.LEAD,
        Verdict.WORKSPACE,
        Verdict.DISTANCE,
    )
)
_STALE, _INVALID, _UNMEASURED, _STOPPED, _BRAKING, _HELD, _PERSON = (
    int(v)
    for v in (
        Verdict.STALE,
        Verdict.INVALID,
        Verdict.UNMEASURED,
        Verdict.STOPPED,
        Verdict.BRAKING,
        Verdict.HELD,
        Verdict.PERSON,
    )
)


@nb.njit(cache=True, nogil=True)
def _govern(  # type: ignore[no-untyped-def]
    state,
    asked,
    stamp,
    measured_position,
    measured_force,
    limits,
    now,
    dt,
    permitted,
    skin_distance,
    skin_away,
    after,
    verdicts,
):
    """Writes the packed state `after` (22,) and verdicts (2,); the rest as of `step`.

    A skin_distance (2,) that is NaN tells nothing.
    """
    position, last = state[:6].reshape(2, 3), state[6:12].reshape(2, 3)
    force = state[12:18].reshape(2, 3).copy()
    over, stopped = state[18:20].copy(), state[20] > 0.5
    seen, size = np.empty(2, dtype=np.bool_), np.empty(2)
    relaxed = True
    for i in range(2):
        seen[i] = np.isfinite(measured_position[i]).all() and np.isfinite(measured_force[i]).all()
        if seen[i]:
            _low_pass(force[i], measured_force[i], limits, dt)
        size[i] = length(force[i])
        relaxed = relaxed and size[i] < limits.soft_force
        if seen[i]:
            # counted down as it is counted up: a force that chatters about the limit counts, too
            over[i] = max(0.0, over[i] + (dt if size[i] > limits.hard_force else -dt))
        stopped = stopped or over[i] >= limits.stop_time
    both_seen = seen[0] and seen[1]
    if both_seen and relaxed:
        stopped = False

    fault = _request_fault(state[21], asked, stamp, limits, now)
    if not permitted:
        fault |= _HELD
    must_stop = stopped or not both_seen
    sets, kinds = np.empty((_MOST_SPACES + 2, 5)), np.empty(_MOST_SPACES, dtype=np.int64)
    for i in range(2):
        verdict = fault | (_STOPPED if stopped else 0) | (0 if seen[i] else _UNMEASURED)
        wanted = np.zeros(3)
        if fault == 0 and not must_stop:
            wanted[:] = asked[i]
        reach = _time_to_rest(last[i], limits, dt)
        # two balls stand before what follows (`_governed`)
        spaces, count = sets[2:], 0
        pulled = seen[i] and size[i] > limits.soft_force
        relaxing = stopped and size[i] < limits.hard_force
        if pulled and not relaxing:
            _limit_force(force[i], size[i], wanted, limits, stopped, spaces[count])
            kinds[count] = _FORCE
            count += 1
        if limits.person_distance > 0.0 and not np.isnan(skin_distance[i]):
            room = skin_distance[i] - limits.person_distance
            spaces[count, 0], spaces[count, 1:4] = HALF_SPACE, -skin_away[i]
            spaces[count, 4] = (
                _returning(room, limits.yield_speed) if room < 0.0 else _stoppable(room, limits, dt)
            )
            kinds[count] = _PERSON
            count += 1
        before = count
        count = _limit_distance(position[i], position[1 - i], reach, limits, dt, spaces, count)
        kinds[before:count] = _DISTANCE
        before = count
        count = _limit_place(position[i], limits, dt, spaces, count)
        kinds[before:count] = _WORKSPACE
        if seen[i]:
            lead = position[i] - np.minimum(np.maximum(measured_position[i], -_LARGEST), _LARGEST)
            _keep_within(limits.max_lead, lead, reach, limits, spaces[count])
            kinds[count] = _LEAD
            count += 1
        if pulled and relaxing:
            _limit_force(force[i], size[i], wanted, limits, stopped, spaces[count])
            kinds[count] = _FORCE
            count += 1
        velocity = after[6 + 3 * i : 9 + 3 * i]
        verdicts[i] = verdict | _governed(
            wanted, last[i], sets[: 2 + count], kinds, limits, dt, must_stop, velocity
        )
        after[3 * i : 3 * i + 3] = position[i] + dt * velocity
        after[12 + 3 * i : 15 + 3 * i] = force[i]
        after[18 + i] = over[i]
    after[20] = 1.0 if stopped else 0.0
    after[21] = state[21] if fault != 0 else max(state[21], stamp)


@nb.njit(cache=True, nogil=True)
def _request_fault(obeyed, velocity, stamp, limits, now):  # type: ignore[no-untyped-def]
    fault = 0
    largest = _ABSURD * limits.max_speed
    for v in velocity.flat:
        # compared entry by entry: squares of large numbers overflow; NaN is no number
        if not abs(v) <= largest:
            fault |= _INVALID
    age = now - stamp
    in_time = age >= -_CLOCK_ROUNDING and age <= limits.stale_time + _CLOCK_ROUNDING
    if not (in_time and stamp >= obeyed - _CLOCK_ROUNDING):
        fault |= _STALE
    return fault


@nb.njit(cache=True, nogil=True)
def _low_pass(force, measured, limits, dt):  # type: ignore[no-untyped-def]
    """Updates the force (3,) that is answered to, N: as measured where it is over the limit."""
    share = min(1.0, dt / limits.filter_time) if limits.filter_time > 0.0 else 1.0
    bounded = np.minimum(np.maximum(measured, -_LARGEST), _LARGEST)
    if length(bounded) >= limits.hard_force:
        share = 1.0
    for a in range(3):
        force[a] = bounded[a] if share == 1.0 else force[a] + share * (bounded[a] - force[a])


@nb.njit(cache=True, nogil=True)
def _limit_force(force, size, wanted, limits, stopped, space):  # type: ignore[no-untyped-def]
    """Writes the half-space (5,) of a force (3,) over the soft limit."""
    pull = -force / size
    giving_way = min(limits.yield_speed, limits.yield_rate * max(0.0, size - limits.hard_force))
    space[0], space[1:4] = HALF_SPACE, pull
    if stopped:
        space[4] = -max(limits.relax_speed, giving_way)
        return
    left = max(0.0, (limits.hard_force - size) / (limits.hard_force - limits.soft_force))
    space[4] = left * max(0.0, dot(pull, wanted)) - giving_way


@nb.njit(cache=True, nogil=True)
def _limit_distance(position, other, reach, limits, dt, spaces, count):  # type: ignore[no-untyped-def]
    """Writes the limits of one gripper against the other: each has half of what is left.

    Returns how many spaces there are then.
    """
    away = position - other
    apart = length(away)
    if limits.least_distance > 0.0 and apart > 1e-9:
        closing = _stoppable(apart - limits.least_distance, limits, dt)
        spaces[count, 0], spaces[count, 1:4] = HALF_SPACE, -away / apart
        spaces[count, 4] = 0.5 * closing
        count += 1
    if np.isfinite(limits.largest_distance):
        # both within half of it from their middle
        _keep_within(0.5 * limits.largest_distance, 0.5 * away, reach, limits, spaces[count])
        count += 1
    return count


@nb.njit(cache=True, nogil=True)
def _limit_place(position, limits, dt, spaces, count):  # type: ignore[no-untyped-def]
    """Writes the half-spaces of the workspace; returns how many spaces there are then."""
    for axis in range(3):
        for sign in (1.0, -1.0):
            border = limits.workspace[1 if sign > 0.0 else 0, axis]
            if not np.isfinite(border):
                continue
            spaces[count, 0], spaces[count, 1:4] = HALF_SPACE, 0.0
            spaces[count, 1 + axis] = sign
            spaces[count, 4] = _stoppable(sign * (border - position[axis]), limits, dt)
            count += 1
    return count


@nb.njit(cache=True, nogil=True)
def _keep_within(radius, offset, reach, limits, space):  # type: ignore[no-untyped-def]
    """Writes the limit by which an offset (3,), m, stays in a ball until it has come to rest.

    Outside, back into it, slowly.
    """
    distance = length(offset)
    if distance <= radius:
        space[0], space[1:4], space[4] = BALL, -offset / reach, radius / reach
    else:
        space[0], space[1:4] = HALF_SPACE, offset / distance
        space[4] = _returning(radius - distance, limits.relax_speed)


@nb.njit(cache=True, nogil=True)
def _time_to_rest(velocity, limits, dt):  # type: ignore[no-untyped-def]
    """Returns τ, s: a command that brakes after this step moves on by τ v at most."""
    slowed = limits.max_acceleration * dt
    fastest = min(limits.max_speed, length(velocity) + slowed)
    return dt + fastest / (2.0 * limits.max_acceleration)


@nb.njit(cache=True, nogil=True)
def _stoppable(room, limits, dt):  # type: ignore[no-untyped-def]
    """Returns the speed from which one stops within `room`, m/s; negative to go back into it."""
    if room < 0.0:
        return _returning(room, limits.relax_speed)
    slowed = limits.max_acceleration * dt
    return np.sqrt(slowed**2 + 2.0 * limits.max_acceleration * room) - slowed


@nb.njit(cache=True, nogil=True)
def _returning(room, speed):  # type: ignore[no-untyped-def]
    return max(room / _RETURN_TIME, -speed)


@nb.njit(cache=True, nogil=True)
def _governed(wanted, last, sets, kinds, limits, dt, must_stop, out):  # type: ignore[no-untyped-def]
    """Writes the velocity (3,) nearest to `wanted` within all limits to `out`; returns the cuts.

    last (3,) is of the step before; sets (2+S,5) are rows of `projection.find_nearest`, of which
    the first two are written here; kinds (S,) flags of the others.
    """
    cut = 0
    slowed, braked = limits.max_acceleration * dt, limits.max_braking * dt
    if length(wanted) > limits.max_speed * (1.0 + 1e-9):
        cut |= _SPEED
    if length(wanted - last) > slowed * (1.0 + 1e-9):
        cut |= _ACCELERATION
    for k in range(2, len(sets)):
        if excess(sets[k], wanted) > 1e-9:
            cut |= kinds[k - 2]

    sets[:2, 0] = BALL
    sets[0, 1:4], sets[0, 4] = 0.0, limits.max_speed
    sets[1, 1:4], sets[1, 4] = last, slowed
    if must_stop or not find_nearest(wanted, sets, out):
        sets[1, 4] = braked
        if not find_nearest(wanted, sets, out):
            _go_as_far_as_it_goes(wanted, last, sets, out)
        if length(out - last) > slowed * (1.0 + 1e-9):
            cut |= _BRAKING
    _draw_within(out, last, limits.max_speed, braked)
    return cut


@nb.njit(cache=True, nogil=True)
def _go_as_far_as_it_goes(wanted, last, sets, out):  # type: ignore[no-untyped-def]
    """Writes the best velocity (3,) where not all limits can be kept; the first counts most.

    Each is moved just so far that it meets the sets before it; a ball is replaced by the half-space
    that faces `last`. `last` is in the first two.
    """
    kept, witness, lowest = sets.copy(), last.copy(), np.empty(3)
    for k in range(2, len(sets)):
        if sets[k, 0] == BALL:
            _face(sets[k], last, kept[k])
        normal = kept[k, 1:4]
        # the nearest point to one far down the normal is the lowest along it
        far = witness - normal * (100.0 * sets[1, 4])
        if not find_nearest(far, kept[:k], lowest):
            lowest[:] = witness
        kept[k, 4] = max(kept[k, 4], dot(normal, lowest))
        if not find_nearest(witness, kept[: k + 1], witness):
            witness[:] = lowest
    if not find_nearest(wanted, kept, out):
        out[:] = witness


@nb.njit(cache=True, nogil=True)
def _face(ball, point, half_space):  # type: ignore[no-untyped-def]
    """Writes the half-space that holds the ball and touches it on the side of `point` (3,)."""
    toward = point - ball[1:4]
    size = length(toward)
    half_space[0] = HALF_SPACE
    if size > 1e-12:
        half_space[1:4] = toward / size
    else:
        half_space[1:3], half_space[3] = 0.0, 1.0
    half_space[4] = dot(half_space[1:4], ball[1:4]) + ball[4]


@nb.njit(cache=True, nogil=True)
def _draw_within(velocity, last, speed, change):  # type: ignore[no-untyped-def]
    """Keeps both hard limits of the velocity (3,) in spite of rounding; `last` keeps them.

    Drawing back toward the origin does not lead away from `last`: both are in the ball of speed.
    """
    moved = velocity - last
    size = length(moved)
    if size > change:
        velocity[:] = last + moved * (change / size)
    size = length(velocity)
    if size > speed:
        velocity *= speed / size
