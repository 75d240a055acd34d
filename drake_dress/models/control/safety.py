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

from dataclasses import dataclass, field
from enum import IntFlag

import numpy as np
import numpy.typing as npt

from drake_dress.models.control.projection import Ball, HalfSpace, nearest

FloatArray = npt.NDArray[np.float64]

# A request this many times faster than allowed was not meant: it is in mm/s, or garbage.
_ABSURD = 10.0
# Time in which a limit of distance that is broken is made good again, s, no faster than relaxing,
# or yielding where it is the person's.
_RETURN_TIME = 0.1
# Stamps may be off by this, s: rounding of clocks that count periods.
_CLOCK_ROUNDING = 1e-6


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
    person_distance: float = 0.0
    least_distance: float = 0.0
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
    entries = np.hstack([measured.position, measured.force])
    seen: npt.NDArray[np.bool_] = np.asarray(np.isfinite(entries).all(axis=1))
    force = _low_passed(state.force, measured.force, seen, limits, dt)
    size = np.linalg.norm(force, axis=1)
    # counted down as it is counted up: a force that chatters about the limit counts, too
    change = np.where(size > limits.hard_force, dt, -dt)
    over = np.where(seen, np.maximum(0.0, state.over + change), state.over)
    stopped = bool(state.stopped or np.any(over >= limits.stop_time))
    if stopped and np.all(seen) and np.all(size < limits.soft_force):
        stopped = False

    fault = _request_fault(state, request, limits, now)
    if not permitted:
        fault |= Verdict.HELD
    both = fault | (Verdict.STOPPED if stopped else Verdict.NONE)
    velocity = np.empty((2, 3))
    verdicts = []
    for i in (0, 1):
        verdict = both | (Verdict.NONE if seen[i] else Verdict.UNMEASURED)
        must_stop = stopped or not np.all(seen)
        wanted = np.zeros(3) if fault or must_stop else request.velocity[i]
        reach = _time_to_rest(state.velocity[i], limits, dt)
        spaces: list[tuple[Verdict, Ball | HalfSpace | None]] = []
        pull = _force_limit(force[i], wanted, limits, stopped) if seen[i] else None
        relaxing = stopped and size[i] < limits.hard_force
        if not relaxing:
            spaces.append((Verdict.FORCE, pull))
        if skin is not None:
            spaces.append((Verdict.PERSON, _person_limit(skin, i, limits, dt)))
        spaces += _distance_limits(state.position, i, reach, limits, dt)
        spaces += _workspace_limits(state.position[i], limits, dt)
        if seen[i]:
            lead = state.position[i] - np.clip(measured.position[i], -1e6, 1e6)
            spaces.append((Verdict.LEAD, _kept_within(limits.max_lead, lead, reach, limits)))
        if relaxing:
            spaces.append((Verdict.FORCE, pull))
        velocity[i], cut = _governed(
            wanted,
            state.velocity[i],
            [(kind, space) for kind, space in spaces if space is not None],
            limits,
            dt,
            must_stop,
        )
        verdicts.append(verdict | cut)
    after = GovernorState(
        state.position + dt * velocity,
        velocity,
        force,
        over,
        stopped,
        state.stamp if fault else max(state.stamp, request.stamp),
    )
    return after, (verdicts[0], verdicts[1])


def _request_fault(
    state: GovernorState, request: Request, limits: SafetyLimits, now: float
) -> Verdict:
    fault = Verdict.NONE
    largest = _ABSURD * limits.max_speed
    # compared entry by entry: squares of large numbers overflow
    if not np.all(np.isfinite(request.velocity)) or np.abs(request.velocity).max() > largest:
        fault |= Verdict.INVALID
    age = now - request.stamp
    in_order = request.stamp >= state.stamp - _CLOCK_ROUNDING
    if not (-_CLOCK_ROUNDING <= age <= limits.stale_time + _CLOCK_ROUNDING and in_order):
        fault |= Verdict.STALE
    return fault


def _low_passed(
    last: FloatArray,
    measured: FloatArray,
    seen: npt.NDArray[np.bool_],
    limits: SafetyLimits,
    dt: float,
) -> FloatArray:
    """Returns the force (2,3) that is answered to, N: as measured where it is over the limit."""
    force = last.copy()
    share = min(1.0, dt / limits.filter_time) if limits.filter_time > 0.0 else 1.0
    # numbers beyond this are over any limit, and their squares must not overflow
    bounded = np.clip(measured, -1e6, 1e6)
    for i in (0, 1):
        if not seen[i]:
            continue
        if np.linalg.norm(bounded[i]) >= limits.hard_force:
            force[i] = bounded[i]
        else:
            force[i] += share * (bounded[i] - force[i])
    return force


def _force_limit(
    force: FloatArray, wanted: FloatArray, limits: SafetyLimits, stopped: bool
) -> HalfSpace | None:
    size = float(np.linalg.norm(force))
    if size <= limits.soft_force:
        return None
    pull = -force / size
    giving_way = min(limits.yield_speed, limits.yield_rate * max(0.0, size - limits.hard_force))
    if stopped:
        return HalfSpace(pull, -max(limits.relax_speed, giving_way))
    left = max(0.0, (limits.hard_force - size) / (limits.hard_force - limits.soft_force))
    return HalfSpace(pull, left * max(0.0, float(pull @ wanted)) - giving_way)


def _person_limit(skin: Skin, i: int, limits: SafetyLimits, dt: float) -> HalfSpace | None:
    if limits.person_distance <= 0.0:
        return None
    room = float(skin.distance[i]) - limits.person_distance
    if room < 0.0:
        return HalfSpace(-skin.away[i], _returning(room, limits.yield_speed))
    return HalfSpace(-skin.away[i], _stoppable(room, limits, dt))


def _distance_limits(
    position: FloatArray, i: int, reach: float, limits: SafetyLimits, dt: float
) -> list[tuple[Verdict, Ball | HalfSpace | None]]:
    """Returns the limits of one gripper against the other: each has half of what is left."""
    away = position[i] - position[1 - i]
    apart = float(np.linalg.norm(away))
    spaces: list[tuple[Verdict, Ball | HalfSpace | None]] = []
    if limits.least_distance > 0.0 and apart > 1e-9:
        closing = _stoppable(apart - limits.least_distance, limits, dt)
        spaces.append((Verdict.DISTANCE, HalfSpace(-away / apart, 0.5 * closing)))
    if np.isfinite(limits.largest_distance):
        # both within half of it from their middle
        half = 0.5 * limits.largest_distance
        spaces.append((Verdict.DISTANCE, _kept_within(half, 0.5 * away, reach, limits)))
    return spaces


def _workspace_limits(
    position: FloatArray, limits: SafetyLimits, dt: float
) -> list[tuple[Verdict, Ball | HalfSpace | None]]:
    if limits.workspace is None:
        return []
    low, high = limits.workspace
    spaces: list[tuple[Verdict, Ball | HalfSpace | None]] = []
    for axis, unit in enumerate(np.eye(3)):
        for normal, room in (
            (unit, high[axis] - position[axis]),
            (-unit, position[axis] - low[axis]),
        ):
            speed = _stoppable(float(room), limits, dt)
            spaces.append((Verdict.WORKSPACE, HalfSpace(normal, speed)))
    return spaces


def _kept_within(
    radius: float, offset: FloatArray, reach: float, limits: SafetyLimits
) -> Ball | HalfSpace:
    """Returns the limit by which an offset (3,), m, stays in a ball until it has come to rest.

    Outside, back into it, slowly.
    """
    distance = float(np.linalg.norm(offset))
    if distance <= radius:
        return Ball(-offset / reach, radius / reach)
    return HalfSpace(offset / distance, _returning(radius - distance, limits.relax_speed))


def _time_to_rest(velocity: FloatArray, limits: SafetyLimits, dt: float) -> float:
    """Returns τ, s: a command that brakes after this step moves on by τ v at most."""
    slowed = limits.max_acceleration * dt
    fastest = min(limits.max_speed, float(np.linalg.norm(velocity)) + slowed)
    return dt + fastest / (2.0 * limits.max_acceleration)


def _stoppable(room: float, limits: SafetyLimits, dt: float) -> float:
    """Returns the speed from which one stops within `room`, m/s; negative to go back into it."""
    if room < 0.0:
        return _returning(room, limits.relax_speed)
    slowed = limits.max_acceleration * dt
    return float(np.sqrt(slowed**2 + 2.0 * limits.max_acceleration * room) - slowed)


def _returning(room: float, speed: float) -> float:
    return max(room / _RETURN_TIME, -speed)


def _governed(
    wanted: FloatArray,
    last: FloatArray,
    spaces: list[tuple[Verdict, Ball | HalfSpace]],
    limits: SafetyLimits,
    dt: float,
    must_stop: bool,
) -> tuple[FloatArray, Verdict]:
    """Returns the velocity (3,) nearest to `wanted` within all limits, and what they cut."""
    cut = Verdict.NONE
    if np.linalg.norm(wanted) > limits.max_speed * (1.0 + 1e-9):
        cut |= Verdict.SPEED
    if np.linalg.norm(wanted - last) > limits.max_acceleration * dt * (1.0 + 1e-9):
        cut |= Verdict.ACCELERATION
    for kind, space in spaces:
        if space.excess(wanted) > 1e-9:
            cut |= kind

    balls = [s for _, s in spaces if isinstance(s, Ball)]
    half_spaces = [s for _, s in spaces if isinstance(s, HalfSpace)]
    speed = Ball(np.zeros(3), limits.max_speed)
    ordinary = Ball(last, limits.max_acceleration * dt)
    braking = Ball(last, limits.max_braking * dt)
    found = None if must_stop else nearest(wanted, [speed, ordinary, *balls], half_spaces)
    if found is None:
        found = nearest(wanted, [speed, braking, *balls], half_spaces)
        if found is None:
            found = _as_far_as_it_goes(wanted, last, [speed, braking], [s for _, s in spaces])
        if np.linalg.norm(found - last) > ordinary.radius * (1.0 + 1e-9):
            cut |= Verdict.BRAKING
    return _within(found, last, limits.max_speed, braking.radius), cut


def _as_far_as_it_goes(
    wanted: FloatArray, last: FloatArray, hard: list[Ball], limits: list[Ball | HalfSpace]
) -> FloatArray:
    """Returns the best velocity where not all limits can be kept; the first counts most.

    Each is moved just so far that it meets the sets before it; a ball is replaced by the half-space
    that faces `last`. `last` is in all `hard` ones.
    """
    kept: list[HalfSpace] = []
    witness = last
    for limit in limits:
        space = limit if isinstance(limit, HalfSpace) else _facing(limit, last)
        # the nearest point to one far down the normal is the lowest along it
        far = witness - space.normal * (100.0 * hard[-1].radius)
        lowest = nearest(far, hard, kept)
        if lowest is None:
            lowest = witness
        kept.append(HalfSpace(space.normal, max(space.offset, float(space.normal @ lowest))))
        met = nearest(witness, hard, kept)
        witness = lowest if met is None else met
    found = nearest(wanted, hard, kept)
    return witness if found is None else found


def _facing(ball: Ball, point: FloatArray) -> HalfSpace:
    """Returns the half-space that holds the ball and touches it on the side of `point` (3,)."""
    toward = point - ball.center
    size = float(np.linalg.norm(toward))
    normal = toward / size if size > 1e-12 else np.array([0.0, 0.0, 1.0])
    return HalfSpace(normal, float(normal @ ball.center) + ball.radius)


def _within(velocity: FloatArray, last: FloatArray, speed: float, change: float) -> FloatArray:
    """Returns the velocity with both hard limits kept in spite of rounding; `last` keeps them.

    Drawing back toward the origin does not lead away from `last`: both are in the ball of speed.
    """
    moved = velocity - last
    size = float(np.linalg.norm(moved))
    if size > change:
        velocity = last + moved * (change / size)
    size = float(np.linalg.norm(velocity))
    return velocity * (speed / size) if size > speed else velocity
