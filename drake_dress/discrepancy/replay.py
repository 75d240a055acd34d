"""What the simulation says to the inputs of a recording, kept in step with what was seen.

Folding cloth is chaotic: a replay of the inputs alone soon says nothing. So the simulation is
pulled toward the markers by a soft spring and a damper (an observer, as state estimators have it):

    f = M W (ω² (y − ŷ) + 2 ω (ẏ − ŷ̇)),

y and ŷ the markers seen and simulated, W a smooth interpolation over the garment, M its mass. The
innovations y − ŷ of a simulation that is right are the markers' noise; what is missing in it, an
acceleration a, leaves a steady innovation near a / ω². With ω = 0 this is the plain replay.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import numpy.typing as npt
import scipy.sparse as sp
import scipy.sparse.linalg as sparse_linalg

from drake_dress.discrepancy.lab import Lab
from drake_dress.discrepancy.recording import Recording, smoothed
from drake_dress.models.cloth.contact.obstacles import Obstacles
from drake_dress.models.cloth.implicit import ClothState
from drake_dress.models.cloth.influences import Influences
from drake_dress.models.cloth.material import Material
from drake_dress.models.cloth.matrices import stretch_matrix
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

FloatArray = npt.NDArray[np.float64]

# Length over which a marker's innovation speaks for its surroundings, m.
_REACH = 0.07
# Variance of a marker against that of the garment between markers, for the interpolation.
_MARKER_SHARE = 0.3
# While the garment settles before a recording: damping of the fabric, s, and of all motion, 1/s.
_SETTLE_DAMPING, _SETTLE_DRAG = 0.05, 6.0


@dataclass(frozen=True)
class _Settling:
    """One way to settle: for how long, s, in which steps, s, with which ω, 1/s.

    `person` is the share of their radius that limbs have at its start; they grow to the full one.
    None: nobody is there.
    """

    duration: float
    time_step: float
    gain: float
    person: float | None = 1.0


# From rest the garment is first brought to the markers through everything, then the person grows
# in it, so that it comes to lie on the side where it was seen; then it is let hang.
_TO_MARKERS = (_Settling(1.0, 0.01, 20.0, None), _Settling(1.5, 0.005, 60.0, None))
_FROM_REST = (_Settling(1.0, 0.005, 60.0, 0.0), _Settling(1.0, 0.01, 8.0))
_AGAIN = _Settling(0.4, 0.01, 8.0)


@dataclass(frozen=True)
class Prediction:
    """What a simulation says a recording should hold, at its times.

    Attributes:
        marker_position: (T,m,3) as the cameras would report, m.
        gripper_force: (T,2,3) of the garment on the grippers, N.
        contact: (T,) share of the nodes that touch the person.
        position, velocity: (K,n,3) of the garment at the times asked for, m, m/s.
    """

    marker_position: FloatArray
    gripper_force: FloatArray
    contact: FloatArray
    position: FloatArray
    velocity: FloatArray


class Replayer:
    """Replays one recording in a lab.

    Args:
        lab: garment, person and numerics.
        recording: with inputs and markers.
    """

    def __init__(self, lab: Lab, recording: Recording) -> None:
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
        """Returns (n,3) how the garment hangs at the start without effects, m; remembered.

        Args:
            near: (n,3) about how it hangs, m, if that is known.
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
        """Takes (n,3), m, for how the garment hangs at the start."""
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
        """Returns what the simulation says.

        Args:
            effects: beside those of the lab.
            gain: ω, 1/s; 0 does not look at the markers, but for how the garment hangs at first.
            start: positions and velocities (n,3) at `begin`, m, m/s; settled by default.
            begin: of the part that is replayed, s; the recording's by default.
            end: of it, s.
            keep: (K,) times at which the whole garment is kept, s.
        """
        lab, r = self.lab, self.recording
        effects = lab.with_effects(effects)
        cloth, person = lab.cloth(effects), lab.person(effects)
        h = cloth.time_step
        begin = float(r.time[0]) if begin is None else begin
        end = float(r.time[-1]) if end is None else end
        steps = max(1, int(np.ceil((end - begin) / h - 1e-9)))
        clock: FloatArray = begin + h * np.arange(steps + 1, dtype=np.float64)
        held = self._held_at(clock, effects)
        seen, rate, known = self._targets(clock, effects)
        joints, joint_rate = self._joints(clock, effects, person.posed)
        if start is None:
            x = self._settle(effects, self.settled(), _AGAIN)
            v = np.zeros_like(x)
        else:
            x, v = start
        state = replace(ClothState.at_rest(x), v=v)
        mounts = Mounts(effects)
        away = x[self._held] - held[0]
        given = np.stack([away[self._side == i].mean(axis=0) for i in (0, 1)])
        mount = mounts.loaded(given, person.LIMBS)
        moved = mounts.moved_mass(cloth, self._side)

        markers = np.empty((steps + 1, *seen.shape[1:]))
        force, touching = np.zeros((steps + 1, 2, 3)), np.zeros(steps + 1)
        markers[0] = self._map @ x
        kept = np.array([] if keep is None else np.rint((np.asarray(keep) - begin) / h), dtype=int)
        positions, velocities = np.empty((len(kept), *x.shape)), np.empty((len(kept), *x.shape))
        positions[kept == 0], velocities[kept == 0] = x, v
        before = state.v
        static = not joint_rate.any() and mounts.rigid
        bodies = person.obstacles(joints[0], joint_rate[0])
        for k in range(steps):
            if not static:
                bodies = person.obstacles(joints[k], joint_rate[k])
            if not mounts.rigid:
                limbs = person.limb_forces(state.owner, state.reaction)
                mount = mounts.step(mount, self._forces(state), limbs, h, moved)
                bodies = person.displaced(bodies, mount.limb, mount.limb_rate)
            target = held[k + 1] + mount.held[self._side]
            pull = Influences()
            if gain > 0.0:
                pull = Influences(force=self._pull(cloth, state, seen[k], rate[k], known[k], gain))
            velocity = (target - state.x[self._held]) / h
            # the garment goes on as it has accelerated
            ahead, before = 2.0 * state.v - before, state.v
            state, _ = cloth.step(state, bodies, velocity, pull, ahead)
            markers[k + 1] = self._map @ state.x
            force[k + 1] = self._forces(state)
            touching[k + 1] = np.count_nonzero(state.owner >= 0) / len(x)
            now = kept == k + 1
            positions[now], velocities[now] = state.x, state.v
        force[0] = force[1]
        when = true_times(r.time, effects, "time_offset")
        return Prediction(
            seen_points(_at(when, clock, markers), effects),
            # a step's force is that of its middle
            _at(r.time, clock - 0.5 * h, force),
            _at(r.time, clock, touching),
            positions,
            velocities,
        )

    def error(self, rng: np.random.Generator) -> FloatArray:
        """Returns (n,3) how far off a state is that is as good as the markers' noise, m."""
        r = self.recording
        noise = r.marker_noise * rng.standard_normal(r.marker_rest_position.shape)
        off: FloatArray = self._interpolation @ noise
        return off

    def _forces(self, state: ClothState) -> FloatArray:
        """Returns (2,3) of the garment on the grippers, N."""
        reaction = state.reaction[self._held]
        return np.stack([-reaction[self._side == i].sum(axis=0) for i in (0, 1)])

    def _held_at(self, clock: FloatArray, effects: Sequence[Effect]) -> FloatArray:
        """Returns (N,k,3) where the held nodes are at times (N,), m."""
        t = true_times(clock, effects, "gripper_latency")
        t = np.clip(t, self.recording.time[0], self.recording.time[-1])
        held: FloatArray = self._path(t)[:, self._side] + self._offset
        return held

    def _targets(
        self, clock: FloatArray, effects: Sequence[Effect]
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Returns what was seen, (N,m,3) m and m/s, and whether it was, (N,m), at times (N,)."""
        x, v, known = self._seen
        stamped = true_times(self.recording.time, effects, "time_offset")
        position = world_points(x, effects)
        rate = world_rates(v, effects)
        # between a frame that is known and one that is not, nothing is known
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
    def _joint_track(self) -> tuple[FloatArray, FloatArray, npt.NDArray[np.bool_]]:
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
        """Returns (n,3) the force toward what was seen, N."""
        away = gain**2 * (seen - self._map @ state.x) + 2.0 * gain * (rate - self._map @ state.v)
        pull: FloatArray = cloth.mass[:, None] * (self._interpolation @ (known[:, None] * away))
        return pull

    def _settle(
        self,
        effects: Sequence[Effect],
        x: FloatArray,
        how: _Settling,
    ) -> FloatArray:
        """Returns (n,3) where the garment comes to rest from `x`, pulled to the first markers."""
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


def _interpolation(lab: Lab, markers: sp.csr_array) -> FloatArray:
    """Returns W (n,m): markers' innovations to the whole garment, zero where it is held.

    Optimal interpolation with the covariance (A + ℓ² L)⁻¹ A (A + ℓ² L)⁻¹, A node areas, L the
    Laplacian of the rest shape: what one marker says fades over ℓ.
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
    """Returns values (N,…) given at `clock` (N,) at `time` (T,): linear, constant beyond."""
    j = np.clip(np.searchsorted(clock, time, side="right") - 1, 0, max(len(clock) - 2, 0))
    if len(clock) == 1:
        return np.broadcast_to(values[0], (len(time), *values.shape[1:])).copy()
    w = np.clip((time - clock[j]) / (clock[j + 1] - clock[j]), 0.0, 1.0)
    w = w.reshape(-1, *[1] * (values.ndim - 1))
    mixed: FloatArray = (1.0 - w) * values[j] + w * values[j + 1]
    return mixed
