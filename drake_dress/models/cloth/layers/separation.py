"""Keeps the layers of a garment apart by correcting the displacement of a time step.

Any scheme may propose a displacement; the corrected one crosses nothing that it did not cross
before. The steps are: find the pairs that may come near (`neighbours`), remove their approach by
impulses (`passes`), move what would still cross as rigid bodies (`impact_zones`).

A displacement with relative motion that is large against the mesh is divided into parts. Within a
part the motion is linear; between parts, pairs and planes are computed anew. The path is then a
polygon along which nothing crosses. A node's displacement in a part is what the earlier parts have
left of it, as after an inelastic collision.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from drake_dress.models.arrays import BoolArray, FloatArray, IntArray
from drake_dress.models.cloth.elements import Elements
from drake_dress.models.cloth.layers.impact_zones import Union, Zone, make_zone
from drake_dress.models.cloth.layers.motion import Motion, relative_motion
from drake_dress.models.cloth.layers.neighbours import PairFinder, Pairs, Passing
from drake_dress.models.cloth.layers.passes import (
    CROSSING,
    THIN,
    run_passes,
    transpose_impulses,
)
from drake_dress.models.cloth.layers.topology import make_topology
from drake_dress.models.cloth.vectors import largest_length

# Largest relative motion in one part of a step, in mean edge lengths.
_LONGEST_PART = 1.0
_MOST_PARTS = 64
# Angle, rad, or relative motion, in mean edge lengths, above which the garment's rotation is
# subtracted exactly.
_TURN = 0.05
_FAR = 4.0
# Corrections that the search for pairs allows for before it is repeated, in mean edge lengths.
_SLACK = 0.15
# Share of the thickness that pairs outside the search may lose by such corrections.
_UNSEEN = 0.5
_PASSES = 64
_PASSES_AT_ONCE = 4
# First passes, which take needless impulses back.
_TAKE_BACK = 8
_ROUNDS = 6
_ZONE_ROUNDS = 40
# How often nodes that would still cross are made to yield, since yielding moves their neighbours.
_YIELDS = 3


@dataclass(frozen=True)
class Impulses:
    """Impulses in order of application.

    Attributes:
        node: (K,4); weights: (K,4) signed, of the closest points or of two corners.
        direction: (K,3) unit; scale: (K,) 1 / Σ c² n·W n, kg.
        slot: (K,) which accumulated impulse it adds to, -1 for none.
        release: (K,) whether it takes the whole accumulated impulse back.
        slots: number of accumulated impulses.
    """

    node: IntArray
    weights: FloatArray
    direction: FloatArray
    scale: FloatArray
    slot: IntArray
    release: BoolArray
    slots: int


@dataclass(frozen=True)
class SeparationRecord:
    """Record of a correction, sufficient to run its transpose.

    Attributes:
        parts: the impulses and zones of each part of the step, in order of application.
        rate_change: (n,3) change of the displacement per step after the last collision, m. With one
            part it is dx' − dx; divided by the time step it is the change of velocity.
        frame: (3,3) axes in which directions and barred directions are expressed, as columns. They
            rotate with the garment if it rotates far.
        inverse_mass: (n,) as given, or that of yielding nodes; barred: (n,3) likewise, in the
            frame's axes.
        thin: number of pairs left closer than the thickness requires, after the last part.
        crossing: number of pairs that could not be kept apart, over all parts: above 0 only if
            prescribed motions make crossing unavoidable. unparted: (4 crossing,) their nodes.
        zones: number of rigid zones over all parts.
        pairs: number of pairs examined in the last part.
    """

    parts: tuple[tuple[Impulses | Zone, ...], ...]
    rate_change: FloatArray
    frame: FloatArray
    inverse_mass: FloatArray
    barred: FloatArray
    thin: int
    crossing: int
    unparted: IntArray
    zones: int
    pairs: int

    @property
    def impulse_count(self) -> int:
        """Number of impulses."""
        return sum(len(s.scale) for p in self.parts for s in p if isinstance(s, Impulses))


@dataclass
class _Counts:
    thin: int = 0
    unparted: IntArray = field(default_factory=lambda: np.empty(0, dtype=np.int32))
    zones: int = 0
    pairs: int = 0
    stages: list[Impulses | Zone] = field(default_factory=list)
    passing: Passing | None = None


class _Work:
    """Arrays that passes keep between calls, for P pairs, n nodes and K impulses."""

    def __init__(self, pairs: int, nodes: int, room: int) -> None:
        self.take_back = False
        self.evaluated = np.full(pairs, -1, dtype=np.int64)
        self.changed = np.zeros(nodes, dtype=np.int64)
        self.active = np.zeros(pairs, dtype=np.bool_)
        self.total = np.zeros(pairs)
        self.wanted = np.empty(pairs)
        self.plane_weights = np.empty((pairs, 4))
        self.plane_direction = np.empty((pairs, 3))
        self.state = np.zeros(pairs, dtype=np.int32)
        self.applied = (
            np.empty((room, 4), dtype=np.int32),
            np.empty((room, 4)),
            np.empty((room, 3)),
            np.empty(room),
            np.empty(room, dtype=np.int32),
            np.empty(room, dtype=np.bool_),
        )


class LayerSeparation:
    """Corrects displacements so that a garment does not pass through itself.

    The object keeps work space only: a new one returns the same. A scheme with a velocity beside
    its displacement gives the nodes with a `rate_change` the velocity (dx + rate_change) / h and
    leaves the others unchanged. Adding rate_change / h to a velocity other than dx / h fed energy
    into a sheet that rests on another.

    Limitations: layers slide on each other without friction; nodes and edges that are joined by
    `rings` edges or fewer are not kept apart (a fold may close on itself there); layers that cross
    at the start stay crossed; the person enters only through inverse masses and barred directions;
    yielding nodes enter the person, and contact has to push them out again.

    Args:
        elements: the mesh.
        thickness: distance kept between layers, m; layers that start closer come no closer.
        rings: nodes joined by this many edges or fewer count as one layer.

    Raises:
        ValueError: the thickness is not a positive number, or `rings` is below 1.
    """

    def __init__(self, elements: Elements, thickness: float = 2e-3, rings: int = 1) -> None:
        if not (np.isfinite(thickness) and thickness > 0.0):
            raise ValueError(f"thickness is {thickness} m, expected a number above 0")
        if rings < 1:
            raise ValueError(f"rings is {rings}, expected 1 or more")
        self.thickness = float(thickness)
        self._n = elements.node_count
        self._topology = make_topology(elements, rings)
        self._edge = float(elements.edge_rest_length.mean())
        self._slack = max(self.thickness, _SLACK * self._edge)
        self._near = self.thickness + self._slack
        self._finder = PairFinder(self._topology, self._edge, self._near)
        self._nothing_barred = np.zeros((self._n, 3))

    def pairs(self, x: FloatArray, dx: FloatArray, within: float) -> Pairs:
        """Returns the pairs that may come within a distance, m, in a displacement `dx` (n,3), m.

        Args:
            x: (n,3) positions at the start of the step, m.
            dx: (n,3) displacement, m.
            within: distance, m.
        """
        return self._finder.find(x, relative_motion(self._topology, x, dx), within)

    def correct(
        self,
        x: FloatArray,
        dx: FloatArray,
        inverse_mass: FloatArray,
        barred: FloatArray | None = None,
        passing: Passing | None = None,
        yielding: FloatArray | None = None,
    ) -> tuple[FloatArray, SeparationRecord]:
        """Returns the corrected displacement (n,3), m, and the record of the correction.

        Args:
            x: (n,3) positions at the start of the step, m.
            dx: (n,3) displacement that a scheme proposes, m; not changed.
            inverse_mass: (n,) 1/kg, 0 for nodes whose motion is prescribed. A scheme that solves a
                stiff system P Δx = … spreads a push over many nodes; at large steps the diagonal of
                P⁻¹ is better than 1/m.
            barred: (n,3) unit direction along which a node may not be moved (the normal where it
                slips on the person), zero for the others; None for no such node.
            passing: layers that may pass through each other; None for none.
            yielding: (n,) 1/kg of nodes without constraints, 0 for those whose motion stays
                prescribed in any case. Nodes that would still cross get this inverse mass: a fold
                pinched between an arm and a chest presses into the flesh, and slips where it stuck.
                None if nothing yields.

        Raises:
            ValueError: an array has another shape.
        """
        x, dx = (np.ascontiguousarray(k, dtype=np.float64) for k in (x, dx))
        w = np.ascontiguousarray(inverse_mass, dtype=np.float64)
        m = self._nothing_barred if barred is None else np.ascontiguousarray(barred, np.float64)
        free = np.zeros(self._n) if yielding is None else np.ascontiguousarray(yielding, np.float64)
        for name, array, shape in (
            ("x", x, (self._n, 3)),
            ("dx", dx, (self._n, 3)),
            ("inverse_mass", w, (self._n,)),
            ("barred", m, (self._n, 3)),
            ("yielding", free, (self._n,)),
        ):
            if array.shape != shape:
                raise ValueError(f"{name} has shape {array.shape}, expected {shape}")
        corrected, record = self._correct(x, dx, w, m, passing)
        given = np.zeros(self._n, dtype=np.bool_)
        for _ in range(_YIELDS):
            crossing = record.unparted
            crossing = crossing[(free[crossing] > 0.0) & ~given[crossing]]
            if not len(crossing):
                break
            given[crossing] = True
            w, m = np.where(given, free, w), np.where(given[:, None], 0.0, m)
            corrected, record = self._correct(x, dx, w, m, passing)
        return corrected, record

    def _correct(
        self,
        x: FloatArray,
        dx: FloatArray,
        w: FloatArray,
        m: FloatArray,
        passing: Passing | None,
    ) -> tuple[FloatArray, SeparationRecord]:
        """Returns the result of `correct` if nothing yields."""
        proposed, frame = dx, np.eye(3)
        motion = relative_motion(self._topology, x, dx)
        furthest = 2.0 * float(motion.reach.max())
        # The twist of a rotation by half a turn has no angle, but leaves a large motion.
        turned = motion.turn > _TURN or furthest > _FAR * self._edge
        if turned:
            # Straight paths of a rotating garment approach each other, but not in a frame that
            # rotates with it; paths that do not cross in one frame do not cross in the other.
            frame, dx = _seen_by_a_turning_observer(x, dx)
            m = m @ frame
            motion = relative_motion(self._topology, x, dx)
            furthest = 2.0 * float(motion.reach.max())
        count = min(max(1, int(np.ceil(furthest / (_LONGEST_PART * self._edge)))), _MOST_PARTS)
        counts = _Counts(passing=passing)
        parts = []
        rate, lag = dx.copy(), np.zeros((1, 3))
        for k in range(count):
            counts.stages = []
            part = rate / count if count > 1 else rate
            start = x + (k / count) * dx + lag if k else x
            self._correct_part(start, part, w, m, counts, motion if count == 1 else None)
            if counts.stages:
                if count > 1:
                    moved = np.any(part != rate / count, axis=1)
                    rate[moved] = count * part[moved]
                parts.append(tuple(counts.stages))
            else:
                parts.append(())
            if count > 1:
                lag = lag + (rate - dx) / count
        # Nodes that were not corrected come back bit for bit.
        corrected, rate_change = proposed.copy(), np.zeros((self._n, 3))
        if any(parts):
            rate_change = (rate - dx) @ frame.T
            change = rate_change if count == 1 else lag @ frame.T
            np.add(proposed, change, out=corrected, where=change != 0.0)
        record = SeparationRecord(
            tuple(parts),
            rate_change,
            frame,
            w,
            m,
            counts.thin,
            len(counts.unparted) // 4,
            counts.unparted,
            counts.zones,
            counts.pairs,
        )
        return corrected, record

    def correct_vjp(self, record: SeparationRecord, bar: FloatArray) -> FloatArray:
        """Returns ∂L/∂dx (n,3) from `bar` (n,3) = ∂L/∂dx'.

        Pairs, weights, directions, the frame, and which impulses act are held fixed.
        """
        count = len(record.parts)
        turned = bar @ record.frame
        back = np.zeros_like(turned)
        for part in reversed(record.parts):
            back += turned / count
            _transpose(part, record, back)
        return back @ record.frame.T

    def rate_vjp(self, record: SeparationRecord, bar: FloatArray) -> FloatArray:
        """Returns ∂L/∂dx (n,3) from `bar` (n,3) = ∂L/∂(dx + rate_change); see `correct_vjp`."""
        back = bar @ record.frame
        for part in reversed(record.parts):
            _transpose(part, record, back)
        return back @ record.frame.T

    def _correct_part(
        self,
        x: FloatArray,
        dx: FloatArray,
        w: FloatArray,
        barred: FloatArray,
        counts: _Counts,
        motion: Motion | None,
    ) -> None:
        """Corrects `dx` in place and records the result in `counts`."""
        counts.thin = 0
        for _ in range(_ROUNDS):
            pairs = self._find(x, dx, counts.passing, motion)
            motion = None
            counts.pairs = len(pairs.kind)
            if counts.pairs == 0:
                return
            before = dx.copy()
            state = self._impulses(x, dx, w, barred, pairs, counts, _PASSES)
            # Pairs outside the search are still apart after corrections this small.
            complete = 2.0 * largest_length(dx - before) <= self._slack + _UNSEEN * self.thickness
            if complete:
                break
        counts.thin = int(np.count_nonzero(state == THIN))
        if complete and not np.any(state >= CROSSING):
            return
        self._join(x, dx, w, barred, pairs, state, complete, counts)

    def _find(
        self, x: FloatArray, dx: FloatArray, passing: Passing | None, motion: Motion | None = None
    ) -> Pairs:
        if motion is None:
            motion = relative_motion(self._topology, x, dx)
        return self._finder.find(x, motion, self._near).without(passing)

    def _impulses(
        self,
        x: FloatArray,
        dx: FloatArray,
        w: FloatArray,
        barred: FloatArray,
        pairs: Pairs,
        counts: _Counts,
        passes: int,
    ) -> IntArray:
        """Runs passes on `dx` in place and returns the state of each pair (P,)."""
        work = _Work(len(pairs.kind), self._n, 5 * len(pairs.kind) + 8)
        clock, due = 1, True
        done: list[tuple[np.ndarray, ...]] = []
        for k in range(0, passes, _PASSES_AT_ONCE):
            work.take_back = k < _TAKE_BACK
            written, clock, due = self._run(x, dx, w, barred, pairs, work, clock, _PASSES_AT_ONCE)
            if written:
                done.append(tuple(k[:written].copy() for k in work.applied))
            if not due:
                break
        if done:
            node, weights, direction, scale, slot, release = (
                np.concatenate(k) for k in zip(*done, strict=True)
            )
            counts.stages.append(
                Impulses(node, weights, direction, scale, slot, release, len(pairs.kind))
            )
        return self._judge(x, dx, w, barred, pairs) if due else work.state

    def _judge(
        self, x: FloatArray, dx: FloatArray, w: FloatArray, barred: FloatArray, pairs: Pairs
    ) -> IntArray:
        work = _Work(len(pairs.kind), self._n, 0)
        self._run(x, dx, w, barred, pairs, work, 1, 0)
        return work.state

    def _run(
        self,
        x: FloatArray,
        dx: FloatArray,
        w: FloatArray,
        barred: FloatArray,
        pairs: Pairs,
        work: _Work,
        clock: int,
        passes: int,
    ) -> tuple[int, int, bool]:
        result: tuple[int, int, bool] = run_passes(
            x,
            pairs.node,
            pairs.kind,
            pairs.weights,
            pairs.direction,
            pairs.distance,
            w,
            barred,
            self.thickness,
            passes,
            work.take_back,
            clock,
            work.evaluated,
            work.changed,
            work.active,
            work.total,
            work.wanted,
            work.plane_weights,
            work.plane_direction,
            dx,
            work.state,
            *work.applied,
        )
        return result

    def _join(
        self,
        x: FloatArray,
        dx: FloatArray,
        w: FloatArray,
        barred: FloatArray,
        pairs: Pairs,
        state: IntArray,
        complete: bool,
        counts: _Counts,
    ) -> None:
        """Moves what would cross as rigid zones, until no avoidable crossing is left."""
        union = Union()
        zone = np.full(self._n, -1, dtype=np.int32)
        if not complete:
            pairs = self._find(x, dx, counts.passing)
            state = self._judge(x, dx, w, barred, pairs)
        for _ in range(_ZONE_ROUNDS):
            crossing = state == CROSSING
            # A zone that moves rigidly is safe, unless prescribed motions differ in it.
            one = zone[pairs.node]
            together = (one[:, 0] >= 0) & np.all(one == one[:, :1], axis=1)
            new = np.flatnonzero(crossing & ~together)
            if not len(new):
                break
            for nodes in pairs.node[new].tolist():
                union.link(nodes)
            for number, members in enumerate(union.sets()):
                zone[members] = number
                stage = make_zone(members, x, w, barred)
                stage.apply(dx)
                counts.stages.append(stage)
                counts.zones += 1
            pairs = self._find(x, dx, counts.passing)
            state = self._judge(x, dx, w, barred, pairs)
        else:
            together = np.zeros(len(state), dtype=np.bool_)
        stuck = (w == 0.0) | np.any(barred != 0.0, axis=1)
        safe = together & ~np.any(stuck[pairs.node], axis=1)
        unparted = pairs.node[(state >= CROSSING) & ~safe].ravel()
        counts.unparted = np.concatenate([counts.unparted, unparted])


def _transpose(
    part: tuple[Impulses | Zone, ...], record: SeparationRecord, back: FloatArray
) -> None:
    for stage in reversed(part):
        if isinstance(stage, Zone):
            stage.transpose(back)
        else:
            transpose_impulses(
                stage.node,
                stage.weights,
                stage.direction,
                stage.scale,
                stage.slot,
                stage.release,
                record.inverse_mass,
                record.barred,
                np.zeros(stage.slots),
                back,
            )


def _seen_by_a_turning_observer(x: FloatArray, dx: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Returns the best-fitting rotation Q (3,3) and Qᵀ(x + dx) − x about the centres, (n,3), m."""
    start = x - x.mean(axis=0)
    end = x + dx
    end = end - end.mean(axis=0)
    u, _, vt = np.linalg.svd(end.T @ start)
    u[:, 2] *= np.linalg.det(u @ vt)
    rotation = u @ vt
    return rotation, end @ rotation - start
