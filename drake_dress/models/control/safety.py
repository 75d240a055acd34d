"""Safety governor for the velocities of two grippers that hold one garment on a person.

The position commands that `step` returns obey limits, whatever a controller requests. A request
holds velocities and the time at which they were made. Velocity requests cannot jump in position or
wind up: suppressed motion is not made up later, and the controller need not know of it. `step`
integrates its own position commands.

The new velocity v of a gripper is the point nearest to the request in an intersection of

    speed          |v| ≤ max_speed
    acceleration   |v - v_last| ≤ max_acceleration dt, or max_braking dt (below)
    force          n·v ≤ c(force, request), n the direction that pulls against the garment
    person         least distance to the skin: limits the approach, or demands retreat
    distance       least and largest between the grippers: each may use half of the margin
    workspace      a box
    lead           greatest lead of the command over the measured gripper

All are balls and half-spaces, and the nearest point is found exactly (`projection.py`). Position
limits are kept by stopping in time. Along a fixed direction (workspace, least distance, a person
who is still) v obeys v dt + v² / (2 max_acceleration) ≤ d, with d the remaining margin. Keeping it
never needs more than ordinary braking. If the direction turns (lead, largest distance), the whole
stopping path is in the ball: |p + τ v| ≤ radius, τ = dt + v̂ / (2 max_acceleration), with
v̂ = |v_last| + max_acceleration dt, at most max_speed, the largest speed of this step. Braking
straight at 3 max_acceleration keeps that from one step to the next: the factor of v falls from τ to
dt + (1.5 dt + v / 2a) (1 - 3 a dt / v) < τ.

max_speed and max_braking are never exceeded, whatever the other limits demand: v_last is in both
balls, so they always intersect. A gripper brakes harder than max_acceleration, up to max_braking,
only if the limits cannot be kept together otherwise, or if it must stop. If even that is not
enough, limits are kept as far as possible, with priority in the order above: the force on a person
takes priority over the workspace.

Between the soft and the hard force limit, the permitted pulling speed fades to zero as the force
rises. The force is low-pass filtered, so that a gripper does not respond to the garment's flutter.
Above the hard limit the gripper yields along the force. A force at or above the hard limit bypasses
the filter, and n·v falls to 0 by max_braking dt a step.

    Fault                                           Response
    force over the hard limit for stop_time         both grippers stop: latched
    force or position not finite                    both stop, until measured again
    request not finite, or over 10 × max_speed      both come to rest by max_acceleration
    request older than stale_time, made later than
      now, or before one that was obeyed            the same
    no permission from the station                  the same

A latched stop ends by itself once the force on both grippers is under the soft limit. Until then
grippers that are pulled yield, so that the stop ends and no person remains held fast: both, since
the one with the larger force may have the person in its way. No manual
reset is needed: the only fault was the force, and it is measured to be gone. Yielding under the
hard limit has the lowest priority in the order above, so it does not leave the workspace.

If one gripper must stop, both stop, because they hold one garment on one person.

Cloth is pressed into a person by a gripper, mostly one that a hand reaches for. The governor does
not know how the person moves: a person may come nearer, and the gripper yields.
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

# A request this many times faster than allowed is an error: it is in mm/s, or garbage.
_ABSURD = 10.0
# Time in which a violated position limit is restored, s. The speed is at most relax_speed, or
# yield_speed for the person's distance.
_RETURN_TIME = 0.1
# Tolerance of time stamps, s: rounding of clocks that count periods.
_CLOCK_ROUNDING = 1e-6
# While stopped, a gripper yields from this share of the soft limit on: its pull may be what the
# other one feels, which cannot yield itself where the person is in its way.
_SHARED = 0.5
# Larger values are over any limit; they are clipped, so that their squares do not overflow.
_LARGEST = 1e6
# Limits of the force, the person, both distances, six walls, the lead.
_MOST_SPACES = 11


class Verdict(IntFlag):
    """The reasons why a request was changed."""

    NONE = 0
    SPEED = 1  # request over max_speed
    ACCELERATION = 2  # request differs from the last velocity by more than max_acceleration allows
    FORCE = 4  # pulls against a force over the soft limit
    LEAD = 8  # command too far ahead of the gripper
    WORKSPACE = 16  # at the workspace's border
    DISTANCE = 32  # grippers too near to each other, or too far
    STALE = 64  # request too old, from the future, or before one that was obeyed
    INVALID = 128  # request not finite, or absurd
    UNMEASURED = 256  # force or position of a gripper not finite
    STOPPED = 512  # force was over the hard limit too long
    BRAKING = 1024  # more than max_acceleration was needed
    HELD = 2048  # the station does not permit motion: something it needs is missing
    PERSON = 4096  # too near to the person's skin


@dataclass(frozen=True)
class SafetyLimits:
    """Limits of each gripper; SI units.

    Attributes:
        max_speed: speed limit, m/s.
        max_acceleration: limit of ordinary acceleration, m/s².
        max_braking: never exceeded, m/s²; used if the other limits need it. Three times
            max_acceleration always suffices to keep them.
        soft_force: force above which pulling fades, N.
        hard_force: force from which on there is no pulling, N; above it the gripper yields.
        filter_time: time constant of the force's low-pass filter, s.
        yield_rate: yielding speed per force over the hard limit, m/s/N.
        yield_speed: greatest yielding speed, to a force or a person, m/s.
        relax_speed: yielding speed while stopped, and speed of returning into a distance, m/s.
        stop_time: time over the hard limit after which both stop, s.
        max_lead: greatest lead of the command over the measured position, m, braking included.
        stale_time: age above which a request is not obeyed, s.
        person_distance: least distance of a gripper's command from the person's skin, m. 0: any.
        held_distance: least distance of the held cloth from the person's skin, m.
        least_distance: least distance of the grippers' commands, m: the robot hands must not
            collide. 0: any.
        largest_distance: greatest distance of them, m, for a garment that must not be stretched
            further even if the force measurement is wrong; inf: any.
        workspace: (2,3) low and high corner of the box for p_WG, m; None: everywhere.

    Raises:
        ValueError: a limit is out of range, or limits contradict each other.
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
        """The limits as kernels take them."""
        workspace = self.workspace
        if workspace is None:
            workspace = np.array([[-np.inf] * 3, [np.inf] * 3])
        scalars = [float(getattr(self, f.name)) for f in fields(self) if f.name != "workspace"]
        return Limits._make([*scalars, np.ascontiguousarray(workspace, dtype=np.float64)])

    def broken_at(self, position: FloatArray) -> str | None:
        """Returns which limit grippers at `position` (2,3), m, violate; None if they do not."""
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
    """`SafetyLimits` as kernels take them; an unlimited workspace has infinite corners."""

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
    """Request of a controller: velocity (2,3) of left and right, m/s, made at `stamp`, s."""

    velocity: FloatArray
    stamp: float


@dataclass(frozen=True)
class Measurement:
    """Position (2,3), m, of left and right gripper, and force (2,3) of the garment on them, N.

    A gripper with any entry that is not finite counts as unmeasured.
    """

    position: FloatArray
    force: FloatArray


@dataclass(frozen=True)
class Skin:
    """The person's skin next to the commands of left and right gripper.

    Attributes:
        distance: (2,) distance to the skin, m, negative inside.
        away: (2,3) unit vectors from the nearest point of the skin.
    """

    distance: FloatArray
    away: FloatArray


@dataclass(frozen=True)
class GovernorState:
    """State of the governor; always finite except for a stamp of -inf.

    Attributes:
        position: (2,3) command p_WG, m.
        velocity: (2,3) of the command, m/s.
        force: (2,3) low-pass filtered, N.
        over: (2,) time with the force over the hard limit, less the time under it, at least 0, s.
        stopped: whether the stop is latched.
        stamp: time stamp of the newest request obeyed, s.
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
    """Returns the state after `dt`, whose position is the command, and the reasons for changes.

    Args:
        state: state after the preceding step.
        request: any values, including NaN and infinity.
        measured: any values, including NaN and infinity.
        limits: limits to keep.
        now: current time, s; must not decrease.
        dt: time since the preceding step, s.
        permitted: whether the station lets grippers move; they yield to force in any case.
        skin: the person as observed; finite. None: not observed.
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
    """Returns a copy in the memory layout for which kernels are compiled."""
    return np.array(values, dtype=np.float64, order="C")


# Compiled code takes flags as integers.
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
    """Writes the packed state `after` (22,) and verdicts (2,); other arguments as of `step`.

    A NaN in skin_distance (2,) means that the person is not observed.
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
            # counts down as fast as up, so that a force chattering about the limit counts, too
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
        # the first two rows are balls, written by `_governed`
        spaces, count = sets[2:], 0
        enough = limits.soft_force * (_SHARED if stopped else 1.0)
        pulled = seen[i] and size[i] > enough
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
        # compared entry by entry: squares of large numbers overflow; NaN compares false
        if not abs(v) <= largest:
            fault |= _INVALID
    age = now - stamp
    in_time = age >= -_CLOCK_ROUNDING and age <= limits.stale_time + _CLOCK_ROUNDING
    if not (in_time and stamp >= obeyed - _CLOCK_ROUNDING):
        fault |= _STALE
    return fault


@nb.njit(cache=True, nogil=True)
def _low_pass(force, measured, limits, dt):  # type: ignore[no-untyped-def]
    """Updates the filtered force (3,), N; at the hard limit or above, it is the measured one."""
    share = min(1.0, dt / limits.filter_time) if limits.filter_time > 0.0 else 1.0
    bounded = np.minimum(np.maximum(measured, -_LARGEST), _LARGEST)
    if length(bounded) >= limits.hard_force:
        share = 1.0
    for a in range(3):
        force[a] = bounded[a] if share == 1.0 else force[a] + share * (bounded[a] - force[a])


@nb.njit(cache=True, nogil=True)
def _limit_force(force, size, wanted, limits, stopped, space):  # type: ignore[no-untyped-def]
    """Writes the half-space (5,) of velocities that a force (3,) over the soft limit permits."""
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
    """Writes the distance limits of one gripper to the other; each may use half of the margin.

    Returns the new number of spaces.
    """
    away = position - other
    apart = length(away)
    if limits.least_distance > 0.0 and apart > 1e-9:
        closing = _stoppable(apart - limits.least_distance, limits, dt)
        spaces[count, 0], spaces[count, 1:4] = HALF_SPACE, -away / apart
        spaces[count, 4] = 0.5 * closing
        count += 1
    if np.isfinite(limits.largest_distance):
        # both stay within half of it from their midpoint
        _keep_within(0.5 * limits.largest_distance, 0.5 * away, reach, limits, spaces[count])
        count += 1
    return count


@nb.njit(cache=True, nogil=True)
def _limit_place(position, limits, dt, spaces, count):  # type: ignore[no-untyped-def]
    """Writes the half-spaces of the workspace; returns the new number of spaces."""
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
    """Writes the limit that keeps an offset (3,), m, in a ball until it has come to rest.

    An offset outside the ball returns into it slowly.
    """
    distance = length(offset)
    if distance <= radius:
        space[0], space[1:4], space[4] = BALL, -offset / reach, radius / reach
    else:
        space[0], space[1:4] = HALF_SPACE, offset / distance
        space[4] = _returning(radius - distance, limits.relax_speed)


@nb.njit(cache=True, nogil=True)
def _time_to_rest(velocity, limits, dt):  # type: ignore[no-untyped-def]
    """Returns τ, s: a command that brakes after this step moves by at most τ v until rest."""
    slowed = limits.max_acceleration * dt
    fastest = min(limits.max_speed, length(velocity) + slowed)
    return dt + fastest / (2.0 * limits.max_acceleration)


@nb.njit(cache=True, nogil=True)
def _stoppable(room, limits, dt):  # type: ignore[no-untyped-def]
    """Returns the speed that can stop within `room`, m, in m/s; negative to return into it."""
    if room < 0.0:
        return _returning(room, limits.relax_speed)
    slowed = limits.max_acceleration * dt
    return np.sqrt(slowed**2 + 2.0 * limits.max_acceleration * room) - slowed


@nb.njit(cache=True, nogil=True)
def _returning(room, speed):  # type: ignore[no-untyped-def]
    return max(room / _RETURN_TIME, -speed)


@nb.njit(cache=True, nogil=True)
def _governed(wanted, last, sets, kinds, limits, dt, must_stop, out):  # type: ignore[no-untyped-def]
    """Writes the velocity (3,) nearest to `wanted` within all limits to `out`; returns flags.

    `last` (3,) is the velocity of the preceding step. `sets` (2+S,5) are rows for
    `projection.find_nearest`; the first two are written here, and `kinds` (S,) are the flags of the
    others.
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
    """Writes the best velocity (3,) if not all limits can be kept; earlier ones take priority.

    Each limit is relaxed just enough to intersect the sets before it. A ball is replaced by the
    half-space that faces `last`. `last` is in the first two sets.
    """
    kept, witness, lowest = sets.copy(), last.copy(), np.empty(3)
    for k in range(2, len(sets)):
        if sets[k, 0] == BALL:
            _face(sets[k], last, kept[k])
        normal = kept[k, 1:4]
        # the projection of a point far down the normal is the lowest point along it
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
    """Writes the half-space that contains the ball and touches it on the side of `point` (3,)."""
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
    """Enforces both hard limits of the velocity (3,) despite rounding; `last` satisfies them.

    Scaling toward the origin does not increase the distance from `last`, which is in the speed
    ball.
    """
    moved = velocity - last
    size = length(moved)
    if size > change:
        velocity[:] = last + moved * (change / size)
    size = length(velocity)
    if size > speed:
        velocity *= speed / size
