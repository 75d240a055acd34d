"""Replays a recording's inputs in simulation, coupled to the observed markers.

Folding cloth is chaotic: a replay of the inputs alone soon diverges. So a soft spring and a damper
pull the simulation toward the markers (an observer, as in state estimation):

    f = M W (ω² (y − ŷ) + 2 ω (ẏ − ŷ̇)),

with y and ŷ the observed and simulated markers, W a smooth interpolation over the garment and M its
mass. If the simulation is right, the innovations y − ŷ are the markers' noise. A missing
acceleration a leaves a steady innovation near a / ω². With ω = 0 this is the plain replay.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import numpy.typing as npt
import scipy.sparse as sp
import scipy.sparse.linalg as sparse_linalg

from drake_dress.discrepancy.lab import SimulatedLab
from drake_dress.discrepancy.recording import Recording, smoothed
from drake_dress.models.arrays import BoolArray, FloatArray
from drake_dress.models.cloth.contact.obstacles import Obstacles
from drake_dress.models.cloth.influences import Influences
from drake_dress.models.cloth.material import Material
from drake_dress.models.cloth.matrices import stretch_matrix
from drake_dress.models.cloth.state import ClothState
from drake_dress.models.effects.composition import (
    GarmentWithEffects,
    seen_points,
    true_times,
    world_points,
    world_rates,
)
from drake_dress.models.effects.effect import Effect
from drake_dress.models.effects.mounts import Mounts, MountState
from drake_dress.models.garment.transfer import attach

# Correlation length ℓ of the interpolation of innovations, m.
_REACH = 0.07
# Noise variance of a marker relative to the variance of the garment, for the interpolation.
_MARKER_SHARE = 0.3
# Damping while the garment settles before a recording: of the fabric, s, and of all motion, 1/s.
_SETTLE_DAMPING, _SETTLE_DRAG = 0.05, 6.0


@dataclass(frozen=True)
class _Settling:
    """One phase of settling: its duration, s, time step, s, and gain ω, 1/s.

    `person` is the share of their radius that the person's capsules have at its start; they grow to
    full size. None: without the person.
    """

    duration: float
    time_step: float
    gain: float
    person: float | None = 1.0


# From rest, the garment is first pulled to the markers without the person. Then the person grows
# to full size, so that the cloth ends up on the side where it was observed. Then it hangs.
_TO_MARKERS = (_Settling(1.0, 0.01, 20.0, None), _Settling(1.5, 0.005, 60.0, None))
_FROM_REST = (_Settling(1.0, 0.005, 60.0, 0.0), _Settling(1.0, 0.01, 8.0))
_AGAIN = _Settling(0.4, 0.01, 8.0)


@dataclass(frozen=True)
class Prediction:
    """A simulation's prediction of a recording, at the recording's times.

    Attributes:
        marker_position: (T,m,3) markers as the cameras would report them, m.
        gripper_force: (T,2,3) force of the garment on the grippers, N.
        contact: (T,) share of the nodes that touch the person.
        position, velocity: (K,n,3) nodes of the garment at the requested times, m, m/s.
    """

    marker_position: FloatArray
    gripper_force: FloatArray
    contact: FloatArray
    position: FloatArray
    velocity: FloatArray


class Replayer:
    """Replays one recording in a lab.

    Args:
        lab: garment, person and numerical settings.
        recording: inputs and markers.
    """

    def __init__(self, lab: SimulatedLab, recording: Recording) -> None:
        self.lab, self.recording = lab, recording
        r = recording
        self._map = sp.csr_array(attach(lab.garment, r.marker_rest_position))
        self._interpolation = _interpolation(lab, self._map)
        self._seen = smoothed(r.time, r.marker_position)
        self._held, self._side = lab.held
        rest = lab.garment.rest_position
        middle = np.stack([rest[lab.garment.grasp[s]].mean(axis=0) for s in ("left", "right")])
        self._offset = rest[self._held] - middle[self._side]
        self._path = r.gripper_path
        self._start: FloatArray | None = None

    def settled(self, near: FloatArray | None = None) -> FloatArray:
        """Returns (n,3) the settled garment at the start without further effects, m; cached.

        Args:
            near: (n,3) initial guess, m.
        """
        if self._start is None and near is not None:
            x = near.copy()
            x[self._held] = self._path(self.recording.time[0])[self._side] + self._offset
            self._start = self._settle([], x, _FROM_REST[-1])
        elif self._start is None:
            rest = self.lab.garment.rest_position
            held = self._path(self.recording.time[0])[self._side] + self._offset
            x = rest + (held - rest[self._held]).mean(axis=0)
            x[self._held] = held
            unseen = not self._seen[2][0].any()
            for settling in _FROM_REST if unseen else (*_TO_MARKERS, *_FROM_REST):
                x = self._settle([], x, settling)
            self._start = x
        return self._start

    def start_from(self, position: FloatArray) -> None:
        """Sets the settled garment (n,3) at the start, m."""
        self._start = position

    def run(
        self,
        effects: Sequence[Effect] = (),
        gain: float = 6.0,
        start: tuple[FloatArray, FloatArray] | None = None,
        begin: float | None = None,
        end: float | None = None,
        keep: FloatArray | None = None,
    ) -> Prediction:
        """Simulates the recording and returns its prediction.

        Args:
            effects: effects in addition to the lab's.
            gain: ω, 1/s; with 0 the markers are used only to settle the garment at the start.
            start: positions and velocities (n,3) at `begin`, m, m/s; settled by default.
            begin: start of the replayed part, s; by default the recording's.
            end: end of the replayed part, s; by default the recording's.
            keep: (K,) times at which the whole garment is kept, s.
        """
        effects = self.lab.with_effects(effects)
        cloth, person = self.lab.cloth(effects), self.lab.person(effects)
        h = cloth.time_step
        clock = self._clock(h, begin, end)
        inputs = self._inputs(clock, effects, person.posed)
        state = self._state_at_begin(effects, start)
        mounts = Mounts(effects)
        mount = mounts.loaded(self._off_grippers(state.x, inputs.held[0]), person.LIMBS)
        moved = mounts.moved_mass(cloth, self._side)
        trace = _Trace.empty(inputs.seen.shape, state.x.shape, _steps_at(keep, clock[0], h))
        trace.note(0, state, self._map @ state.x, self._forces(state))

        before = state.v
        static = not inputs.joint_rate.any() and mounts.rigid
        bodies = person.obstacles(inputs.joints[0], inputs.joint_rate[0])
        for k in range(len(clock) - 1):
            if not static:
                bodies = person.obstacles(inputs.joints[k], inputs.joint_rate[k])
            if not mounts.rigid:
                limbs = person.limb_forces(state.owner, state.reaction)
                mount = mounts.step(mount, self._forces(state), limbs, h, moved)
                bodies = person.displaced(bodies, mount.limb, mount.limb_rate)
            target = inputs.held[k + 1] + mount.held[self._side]
            pull = Influences()
            if gain > 0.0:
                pull = Influences(force=self._pull(cloth, state, *inputs.targets(k), gain))
            velocity = (target - state.x[self._held]) / h
            # first guess of the solve: the acceleration of the last step continues
            ahead, before = 2.0 * state.v - before, state.v
            state, _ = cloth.step(state, bodies, velocity, pull, ahead)
            trace.note(k + 1, state, self._map @ state.x, self._forces(state))
        return self._prediction(trace, clock, h, effects)

    def error(self, rng: np.random.Generator) -> FloatArray:
        """Returns (n,3) a random displacement of the garment that matches the markers' noise, m."""
        r = self.recording
        noise = r.marker_noise * rng.standard_normal(r.marker_rest_position.shape)
        off: FloatArray = self._interpolation @ noise
        return off

    def _clock(self, time_step: float, begin: float | None, end: float | None) -> FloatArray:
        """Returns (N+1,) the times of N steps from `begin` to at least `end`, s."""
        r = self.recording
        begin = float(r.time[0]) if begin is None else begin
        end = float(r.time[-1]) if end is None else end
        steps = max(1, int(np.ceil((end - begin) / time_step - 1e-9)))
        clock: FloatArray = begin + time_step * np.arange(steps + 1, dtype=np.float64)
        return clock

    def _inputs(self, clock: FloatArray, effects: Sequence[Effect], posed: FloatArray) -> _Inputs:
        """Returns the recording's inputs at times (N,); joints are `posed` if not measured."""
        held = self._held_at(clock, effects)
        return _Inputs(held, *self._targets(clock, effects), *self._joints(clock, effects, posed))

    def _state_at_begin(
        self, effects: Sequence[Effect], start: tuple[FloatArray, FloatArray] | None
    ) -> ClothState:
        """Returns the garment with positions and velocities `start`; settled by default."""
        if start is not None:
            return replace(ClothState.at_rest(start[0]), v=start[1])
        return ClothState.at_rest(self._settle(effects, self.settled(), _AGAIN))

    def _off_grippers(self, x: FloatArray, held: FloatArray) -> FloatArray:
        """Returns (2,3) the mean offset of each gripper's nodes in `x` from `held` (k,3), m."""
        away = x[self._held] - held
        return np.stack([away[self._side == i].mean(axis=0) for i in (0, 1)])

    def _prediction(
        self, trace: _Trace, clock: FloatArray, time_step: float, effects: Sequence[Effect]
    ) -> Prediction:
        """Returns the states simulated at times `clock` as a prediction of the recording."""
        r = self.recording
        # no force is known before the first step
        trace.force[0] = trace.force[1]
        when = true_times(r.time, effects, "time_offset")
        return Prediction(
            seen_points(_at(when, clock, trace.marker), effects),
            # a step's force is its value at the middle of the step
            _at(r.time, clock - 0.5 * time_step, trace.force),
            _at(r.time, clock, trace.touching),
            trace.position,
            trace.velocity,
        )

    def _forces(self, state: ClothState) -> FloatArray:
        """Returns (2,3) the force of the garment on the grippers, N."""
        reaction = state.reaction[self._held]
        return np.stack([-reaction[self._side == i].sum(axis=0) for i in (0, 1)])

    def _held_at(self, clock: FloatArray, effects: Sequence[Effect]) -> FloatArray:
        """Returns (N,k,3) the positions of the held nodes at times (N,), m."""
        t = true_times(clock, effects, "gripper_latency")
        t = np.clip(t, self.recording.time[0], self.recording.time[-1])
        held: FloatArray = self._path(t)[:, self._side] + self._offset
        return held

    def _targets(
        self, clock: FloatArray, effects: Sequence[Effect]
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Returns markers, (N,m,3) m and m/s, and whether they were seen, (N,m), at times (N,)."""
        x, v, known = self._seen
        stamped = true_times(self.recording.time, effects, "time_offset")
        position = world_points(x, effects)
        rate = world_rates(v, effects)
        # a marker is known only between two frames in which it is known
        share = np.floor(_at(clock, stamped, known.astype(np.float64)) + 1e-9)
        share[(clock < stamped[0]) | (clock > stamped[-1])] = 0.0
        return _at(clock, stamped, position), _at(clock, stamped, rate), share

    def _joints(
        self, clock: FloatArray, effects: Sequence[Effect], posed: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Returns joints (N,6,3), m, and their velocities, m/s, at times (N,)."""
        measured = self.recording.joint_position
        if measured is None:
            return np.broadcast_to(posed, (len(clock), 6, 3)), np.zeros((len(clock), 6, 3))
        stamped = true_times(self.recording.time, effects, "time_offset")
        x, v, _ = self._joint_track
        return (
            _at(clock, stamped, world_points(x, effects)),
            _at(clock, stamped, world_rates(v, effects)),
        )

    @cached_property
    def _joint_track(self) -> tuple[FloatArray, FloatArray, BoolArray]:
        measured = self.recording.joint_position
        assert measured is not None
        if np.ptp(measured, axis=0).max() < 1e-6:
            return measured, np.zeros_like(measured), np.ones(measured.shape[:2], dtype=np.bool_)
        return smoothed(self.recording.time, measured)

    def _pull(
        self,
        cloth: GarmentWithEffects,
        state: ClothState,
        seen: FloatArray,
        rate: FloatArray,
        known: FloatArray,
        gain: float,
    ) -> FloatArray:
        """Returns (n,3) the observer's force toward the observed markers, N."""
        away = gain**2 * (seen - self._map @ state.x) + 2.0 * gain * (rate - self._map @ state.v)
        pull: FloatArray = cloth.mass[:, None] * (self._interpolation @ (known[:, None] * away))
        return pull

    def _settle(
        self,
        effects: Sequence[Effect],
        x: FloatArray,
        how: _Settling,
    ) -> FloatArray:
        """Returns (n,3) the garment settled from `x`, pulled to the first frame's markers, m."""
        effects = self.lab.with_effects(effects)
        h = how.time_step
        cloth = self.lab.cloth(effects, _SETTLE_DAMPING, h)
        person = self.lab.person(effects)
        clock = self.recording.time[:1]
        seen, _, known = (a[0] for a in self._targets(clock, effects))
        joints, _ = self._joints(clock, effects, person.posed)
        bodies = person.obstacles(joints[0], np.zeros((6, 3)))
        if how.person is None:
            bodies = Obstacles.none()
        held = self._held_at(clock, effects)[0]
        mounts, mount = Mounts(effects), MountState.at_rest(person.LIMBS)
        moved = mounts.moved_mass(cloth, self._side)
        state = ClothState.at_rest(x)
        steps = round(how.duration / h)
        for k in range(steps):
            around = bodies
            if how.person is not None and how.person < 1.0:
                grown = min(1.0, how.person + (1.0 - how.person) * 1.5 * k / steps)
                around = replace(bodies, radius=grown * bodies.radius)
            if not mounts.rigid and how.person == 1.0:
                limbs = person.limb_forces(state.owner, state.reaction)
                mount = mounts.step(mount, self._forces(state), limbs, h, moved)
                around = person.displaced(bodies, mount.limb, mount.limb_rate)
            target = held + mount.gripper[self._side]
            pull = self._pull(cloth, state, seen, np.zeros_like(seen), known, how.gain)
            pull -= _SETTLE_DRAG * cloth.mass[:, None] * state.v
            velocity = (target - state.x[self._held]) / h
            state, _ = cloth.step(state, around, velocity, Influences(force=pull))
        return state.x


@dataclass(frozen=True)
class _Inputs:
    """Inputs of a replay at its N times.

    Attributes:
        held: (N,k,3) positions of the held nodes, m.
        seen, seen_rate: (N,m,3) positions and velocities of the markers, m, m/s.
        known: (N,m) whether they were seen, 1 or 0.
        joints, joint_rate: (N,6,3) positions and velocities of the person's joints, m, m/s.
    """

    held: FloatArray
    seen: FloatArray
    seen_rate: FloatArray
    known: FloatArray
    joints: FloatArray
    joint_rate: FloatArray

    def targets(self, k: int) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Returns the markers at time k, their velocities, and whether they were seen."""
        return self.seen[k], self.seen_rate[k], self.known[k]


@dataclass(frozen=True)
class _Trace:
    """Record of the N states of a replay.

    Attributes:
        marker: (N,m,3) markers, m.
        force: (N,2,3) force of the garment on the grippers, N.
        touching: (N,) share of the nodes that touch the person.
        kept: (K,) indices of the states of which the whole garment is kept.
        position, velocity: (K,n,3) nodes in these states, m, m/s.
    """

    marker: FloatArray
    force: FloatArray
    touching: FloatArray
    kept: npt.NDArray[np.int_]
    position: FloatArray
    velocity: FloatArray

    @staticmethod
    def empty(
        markers: tuple[int, ...], garment: tuple[int, ...], kept: npt.NDArray[np.int_]
    ) -> _Trace:
        """Returns an empty trace for markers of shape (N,m,3) and a garment of shape (n,3)."""
        count = markers[0]
        position, velocity = np.empty((len(kept), *garment)), np.empty((len(kept), *garment))
        return _Trace(
            np.empty(markers), np.zeros((count, 2, 3)), np.zeros(count), kept, position, velocity
        )

    def note(self, k: int, state: ClothState, marker: FloatArray, force: FloatArray) -> None:
        """Records state k with its markers (m,3), m, and forces (2,3), N."""
        self.marker[k], self.force[k] = marker, force
        self.touching[k] = np.count_nonzero(state.owner >= 0) / len(state.x)
        now = self.kept == k
        self.position[now], self.velocity[now] = state.x, state.v


def _steps_at(time: FloatArray | None, begin: float, time_step: float) -> npt.NDArray[np.int_]:
    """Returns (K,) the steps from `begin` nearest to times (K,), s; none by default."""
    if time is None:
        return np.array([], dtype=int)
    return np.array(np.rint((np.asarray(time) - begin) / time_step), dtype=int)


def _interpolation(lab: SimulatedLab, markers: sp.csr_array) -> FloatArray:
    """Returns W (n,m), which spreads markers' innovations over the garment; zero at held nodes.

    Optimal interpolation with the covariance (A + ℓ² L)⁻¹ A (A + ℓ² L)⁻¹, with A the node areas and
    L the Laplacian of the rest shape: the influence of a marker decays over ℓ.
    """
    elements = lab.cloth([]).elements
    area = elements.node_area
    laplacian = stretch_matrix(elements, Material(stretch_stiffness=1.0))
    factor = sparse_linalg.splu(sp.csc_matrix(sp.diags(area) + _REACH**2 * laplacian))
    spread = factor.solve(area[:, None] * factor.solve(markers.toarray().T))
    spread[lab.held[0]] = 0.0
    covariance = markers @ spread
    noise = _MARKER_SHARE * np.mean(np.diag(covariance))
    gain: FloatArray = spread @ np.linalg.inv(covariance + noise * np.eye(len(covariance)))
    return gain


def _at(time: FloatArray, clock: FloatArray, values: FloatArray) -> FloatArray:
    """Returns values (N,…), given at `clock` (N,), interpolated linearly at `time` (T,).

    Beyond the ends of `clock` they are constant.
    """
    j = np.clip(np.searchsorted(clock, time, side="right") - 1, 0, max(len(clock) - 2, 0))
    if len(clock) == 1:
        return np.broadcast_to(values[0], (len(time), *values.shape[1:])).copy()
    w = np.clip((time - clock[j]) / (clock[j + 1] - clock[j]), 0.0, 1.0)
    w = w.reshape(-1, *[1] * (values.ndim - 1))
    mixed: FloatArray = (1.0 - w) * values[j] + w * values[j + 1]
    return mixed
