"""Keeps the layers of a garment apart: a correction of the displacement of a time step.

Any scheme may propose a displacement; what comes back crosses nothing that it did not cross
before. The idea, in order: find the pairs that may come near (`neighbours`), take away their
approach by impulses (`passes`), let what would still cross move rigidly (`zones`).

A displacement whose relative motion is large against the mesh is taken in parts: within a part the
motion is linear, between parts pairs and planes are found anew. The path is then a polygon, along
which nothing crosses. A node's displacement in a part starts from what the parts before left of
it, as after an inelastic collision.
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

# Relative motion in one part of a step, by the mean edge length.
_LONGEST_PART = 1.0
_MOST_PARTS = 64
# Angle, rad, or relative motion by the mean edge length, from which the garment's rotation is taken
# off exactly.
_TURN = 0.05
_FAR = 4.0
# Corrections that the search for pairs allows for before it is repeated, by the mean edge length.
_SLACK = 0.15
# Part of the thickness that pairs may lose unseen by such corrections.
_UNSEEN = 0.5
_PASSES = 64
_PASSES_AT_ONCE = 4
# Passes that take needless impulses back.
_TAKE_BACK = 8
_ROUNDS = 6
_ZONE_ROUNDS = 40
# How often those that would still cross are given way to: what yields moves its neighbours.
_YIELDS = 3


@dataclass(frozen=True)
class Impulses:
    """Impulses in order of application.

    Attributes:
        node: (K,4); weights: (K,4) signed, of the closest points or of two corners.
        direction: (K,3) unit; scale: (K,) 1 / Σ c² n·W n, kg.
        slot: (K,) which accumulated impulse it adds to, -1 for none.
        release: (K,) whether it takes the whole of that back.
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
    """How a displacement was corrected; enough to run the correction's transpose.

    Attributes:
        parts: the impulses and zones of each part of the step, in order of application.
        rate_change: (n,3) change of the displacement per step at the end of the step, m: after
            the last collision. With one part it is dx' − dx; divided by the time step it is the
            change of velocity.
        frame: (3,3) axes in which directions and barred directions are expressed, as columns:
            those of an observer who turns with the garment, where it turns far.
        inverse_mass: (n,) as given, or as what yielded has it; barred: (n,3) likewise, in the
            frame's axes.
        thin: pairs left closer than the thickness asks for, after the last part.
        crossing: pairs that could not be kept apart, over all parts: only where motions that are
            prescribed leave no way. unparted: (4 crossing,) their nodes.
        zones: rigid zones over all parts.
        pairs: pairs that were looked at in the last part.
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
    """What passes keep between calls, for P pairs, n nodes and K impulses."""

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

    The object keeps work space only: a fresh one returns the same. A scheme that keeps a velocity
    beside its displacement gives the nodes with a `rate_change` the velocity
    (dx + rate_change) / h and leaves the others: adding rate_change / h to a velocity that differs
    from dx / h fed energy into a sheet that rests on another.

    Limitations: layers slide on each other without friction; nodes and edges that are joined by
    `rings` edges or fewer are not told apart (a fold may close on itself there); layers that cross
    at the start stay crossed; an impulse knows nothing of the person, who has to be given as
    inverse masses and barred directions; what yields enters the person, and contact has to drive
    it out again.

    Args:
        elements: the mesh.
        thickness: distance that layers keep, m; those closer at the start come no closer.
        rings: nodes joined by this many edges or fewer belong together.

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
            dx: (n,3), m.
            within: m.
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
        """Returns the corrected displacement (n,3), m, and how it came about.

        Args:
            x: (n,3) positions at the start of the step, m.
            dx: (n,3) displacement that a scheme proposes, m; not changed.
            inverse_mass: (n,) 1/kg, 0 for nodes whose motion is prescribed. A scheme that solves a
                stiff system P Δx = … shares a push among many nodes; at large steps the diagonal
                of P⁻¹ says better than 1/m which layer yields.
            barred: (n,3) unit direction along which a node may not be moved (the normal where it
                slips on the person), zero for the others; None for no such node.
            passing: who may pass through whom; None for nobody.
            yielding: (n,) 1/kg of nodes where nothing bars them, 0 for those whose motion is
                prescribed whatever it costs. Those that would cross are moved by it: a fold that is
                pinched between an arm and a chest makes room for itself in the flesh, and slips
                where it stuck. None where nothing yields.

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
        """Returns what `correct` does where nothing yields."""
        proposed, frame = dx, np.eye(3)
        motion = relative_motion(self._topology, x, dx)
        furthest = 2.0 * float(motion.reach.max())
        # The twist of a rotation by half a turn has no angle, but leaves much.
        turned = motion.turn > _TURN or furthest > _FAR * self._edge
        if turned:
            # Straight paths of a turning garment close in on each other, those seen by an observer
            # who turns along do not; what crosses nothing for one crosses nothing for the other.
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
        # What was not touched comes back bit for bit.
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

        Pairs, weights, directions, the frame, and which impulses act are held.
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
        """Corrects `dx` in place and notes what was done."""
        counts.thin = 0
        for _ in range(_ROUNDS):
            pairs = self._find(x, dx, counts.passing, motion)
            motion = None
            counts.pairs = len(pairs.kind)
            if counts.pairs == 0:
                return
            before = dx.copy()
            state = self._impulses(x, dx, w, barred, pairs, counts, _PASSES)
            # Pairs that were not looked at are still apart after corrections this small.
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
        """Runs passes on `dx` in place and returns what is left of each pair (P,)."""
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
        """Lets what would cross move rigidly, until nothing crosses that can be helped."""
        union = Union()
        zone = np.full(self._n, -1, dtype=np.int32)
        if not complete:
            pairs = self._find(x, dx, counts.passing)
            state = self._judge(x, dx, w, barred, pairs)
        for _ in range(_ZONE_ROUNDS):
            crossing = state == CROSSING
            # A zone that moves as one is safe, unless prescribed motions differ in it.
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
