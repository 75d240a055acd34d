"""Contact with dry friction, detected at every iterate of an implicit step.

Everything is evaluated at the end of the step: obstacles have moved with their velocities, and gaps
and normals are those of the iterate. The displacement w of a node relative to the surface starts
where the surface has carried the node. For a node that lands, it starts where its path enters the
surface. The modes are

    free     gap ≥ 0,  r = 0
    stick    gap = 0,  w_T = 0,  ‖r_T‖ ≤ μ r_N
    slip     gap = 0,  r_T = −μ r_N w_T / ‖w_T‖

with r the residual of the equations of motion. Each iteration applies one round of an active set:
nodes that have entered a surface are put onto it, nodes that it would have to pull take off, and
nodes with friction beyond the cone slip. Friction of slipping nodes enters as a resistance c w_T,
c = μ r_N / ‖w_T‖ of the last iterate. For a given r_N its energy lies above that of dry friction
and touches it there (as in Weiszfeld's iteration), so that the iteration descends and does not
oscillate, however small w_T is.

An iterate may be far from the last one, so free nodes that move far are followed on their path, in
the frame of the body that was nearest. If a node sits between two bodies that move apart by more
than their own size in a step, contact with the second may be missed.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from drake_dress.models.arrays import BoolArray, FloatArray, IntArray
from drake_dress.models.cloth.contact.detection import find_proximity
from drake_dress.models.cloth.contact.modes import FREE, HELD, SLIP, STICK
from drake_dress.models.cloth.contact.obstacles import Obstacles
from drake_dress.models.cloth.influences import ContactLaw
from drake_dress.models.cloth.projective import active_set
from drake_dress.models.cloth.state import ClothState

# Largest velocity that pushes a node out to its margin, m/s; a larger one would throw it.
_LARGEST_PUSH = 0.2
# Tangential speed above which a node lands sliding, m/s.
_LANDING_SLIP_SPEED = 5e-3
# Gap up to which a node keeps the contact of the previous step, m.
_KEPT_GAP = 1e-3
# Motion in an iteration, m, below which a free node cannot leap over anything.
_LARGEST_LEAP = 5e-3
# Maximum number of legs in which a leap is followed; surfaces within one leg may be missed.
_LEGS = 32


class IteratedContact:
    """The contacts of one step.

    Args:
        state: state of the garment before the step.
        held: (k,) nodes whose motion is prescribed; they feel no contact.
        obstacles: obstacles at the start of the step, with velocities.
        mass: (n,) kg.
        time_step: h, s.
        law: friction and adhesion.
        margin: (n,) distance to keep, m.
        tolerance: wanted accuracy of positions, m.

    Attributes:
        mode: (n,) FREE, STICK, SLIP or HELD, current.
        owner: (n,) nearest obstacle, -1 without one.
        normal: (n,3) normal of the surface there.
        resistance: (n,) c of slipping nodes, h² N/m.
        friction: (n,3) friction on slipping nodes, h² N.
    """

    def __init__(
        self,
        state: ClothState,
        held: IntArray,
        obstacles: Obstacles,
        mass: FloatArray,
        time_step: float,
        law: ContactLaw,
        margin: FloatArray,
        tolerance: float,
    ) -> None:
        n = len(state.x)
        self.mode = np.full(n, FREE, dtype=np.int32)
        self.mode[held] = HELD
        self.owner = np.full(n, -1, dtype=np.int32)
        self.normal = np.zeros((n, 3))
        self.resistance = np.zeros(n)
        self.friction = np.zeros((n, 3))
        self._mu = law.friction
        self._adhesion = time_step**2 * law.adhesion
        self._margin = margin
        self._tolerance = tolerance
        self._weight = tolerance * mass
        self.active = obstacles.count > 0
        if not self.active:
            return
        self._after, self._rotation = advanced(obstacles, time_step)
        self._before = obstacles.origins()
        self._gap = np.empty(n)
        self._slope = np.ones(n)
        self._checked = np.full((n, 3), np.inf)
        self._fresh = np.zeros(n, dtype=np.bool_)
        self._flips = np.zeros(n, dtype=np.int32)
        self._landings = np.zeros(n, dtype=np.int32)
        self._stopped = np.zeros(n, dtype=np.bool_)
        self._slid = np.zeros((n, 3))
        self._last_slid = np.zeros(n)
        self._h = time_step
        self.carried = self._carry(state.x, obstacles)
        self.refresh(self.carried)
        self._base = self.carried.copy()
        self._height = np.maximum(self._gap, 0.0)
        self._target = np.minimum(self._gap, 0.0)
        self._target += np.minimum(-0.5 * self._target, _LARGEST_PUSH * time_step)
        self._take_up(state, law)

    def _take_up(self, state: ClothState, law: ContactLaw) -> None:
        """Keeps the contacts of the previous step that still exist, with their friction."""
        touching = (state.mode == STICK) | (state.mode == SLIP)
        same = self.owner == state.owner
        kept = touching & (self._gap < _KEPT_GAP) & (self.mode == FREE) & same
        self.mode[kept] = state.mode[kept]
        slip = self.mode == SLIP
        if slip.any():
            r, normal = state.reaction[slip], self.normal[slip]
            pressure = np.einsum("ij,ij->i", r, normal)
            along = r - pressure[:, None] * normal
            size = np.maximum(np.linalg.norm(along, axis=1), 1e-300)
            holds = np.maximum(pressure + law.adhesion[slip], 0.0)
            bound = self._h**2 * law.friction[slip] * holds
            self.friction[slip] = (bound / size)[:, None] * along

    def place(self, guess: FloatArray, steady: FloatArray) -> FloatArray:
        """Returns the initial iterate (n,3): on the path to `guess`, before any surface.

        Nodes that a surface could reach are carried with it first. Slipping nodes start at `steady`
        (n,3), with unchanged motion.
        """
        if not self.active:
            return guess.copy()
        start = np.where((self.mode == HELD)[:, None], guess, self.carried)
        motion = guess - start
        motion[self.mode == STICK] = 0.0
        # the surface bears gravity, so slipping nodes keep their velocity
        slip = self.mode == SLIP
        motion[slip] = steady[slip] - start[slip]
        self.shorten(start, motion)
        return start + motion

    def shorten(self, x: FloatArray, motion: FloatArray) -> None:
        """Truncates the `motion` (n,3) of free nodes from `x`, in place, at the first surface.

        They land there with the next `bind`.
        """
        if not self.active:
            return
        far = np.flatnonzero(active_set.leaps(self.mode, self._gap, motion, _LARGEST_LEAP))
        if not len(far):
            return
        leap = motion[far]
        length = np.linalg.norm(leap, axis=1)
        ahead = leap / length[:, None]
        way = np.zeros(len(far))
        going = np.arange(len(far))
        for _ in range(_LEGS):
            point = x[far[going]] + way[going, None] * ahead[going]
            near = find_proximity(point, self._after, self._margin[far[going]])
            hit = (near.gap <= 0.0) & (np.einsum("ij,ij->i", near.normal, ahead[going]) < 0.0)
            if hit.any():
                rows = going[hit]
                motion[far[rows]] = way[rows, None] * ahead[rows]
                self._stopped[far[rows]] = True
            # a cubic spline of distances may have a slope above 1: half of the gap is safe
            going, gap = going[~hit], near.gap[~hit]
            way[going] += np.maximum(0.5 * gap, length[going] / _LEGS)
            going = going[way[going] < length[going]]
            if not len(going):
                return

    def refresh(self, x: FloatArray) -> None:
        """Updates gaps and normals of nodes for which the last ones may mislead."""
        due = np.flatnonzero(active_set.due(x, self._checked, self._gap, self.mode))
        if not len(due):
            return
        near = find_proximity(x[due], self._after, self._margin[due])
        self._checked[due] = x[due]
        self._gap[due] = near.gap
        self.normal[due] = near.normal
        self._slope[due] = near.slope
        self.owner[due] = near.owner

    def bind(self, x: FloatArray) -> int:
        """Puts nodes in contact onto their surfaces, in place; returns how many landed."""
        if not self.active:
            return 0
        self.refresh(x)
        return int(
            active_set.bind(
                x,
                self.carried,
                self._height,
                self._gap,
                self._target,
                self._slope,
                self.normal,
                self._tolerance,
                _LANDING_SLIP_SPEED * self._h,
                self.mode,
                self._stopped,
                self._fresh,
                self._base,
                self._slid,
                self._landings,
                self.friction,
            )
        )

    def classify(self, residual: FloatArray) -> int:
        """Sets modes and friction by the required contact force; returns how many changed.

        Args:
            residual: (n,3) residual of the equations of motion without contact, h² N.
        """
        if not self.active:
            return 0
        return int(
            active_set.classify(
                residual,
                self.normal,
                self._mu,
                self._adhesion,
                self._tolerance,
                self._weight,
                self.mode,
                self._fresh,
                self._slid,
                self._last_slid,
                self._flips,
                self._landings,
                self.resistance,
                self.friction,
            )
        )

    def constrained(self) -> BoolArray:
        """Returns (n,) which nodes have no free direction."""
        masked: BoolArray = (self.mode == STICK) | (self.mode == HELD)
        return masked

    def slipping(self) -> bool:
        """Returns whether any node slips."""
        return self.active and bool(np.any(self.mode == SLIP))

    def reaction(self, residual: FloatArray) -> FloatArray:
        """Returns (n,3) the force of obstacles and grippers, h² N, at this residual."""
        out = np.where(self.constrained()[:, None], residual, 0.0)
        slip = self.mode == SLIP
        if slip.any():
            normal = self.normal[slip]
            pressure = np.einsum("ij,ij->i", residual[slip], normal)
            out[slip] = pressure[:, None] * normal + self.friction[slip]
        return out

    def _carry(self, x: FloatArray, obstacles: Obstacles) -> FloatArray:
        """Returns `x` with each node that a surface could reach carried by the nearest one."""
        v, omega = obstacles.twists()
        if not v.any() and not omega.any():
            return x.copy()
        near = find_proximity(x, obstacles, self._margin)
        reach = np.zeros(len(x))
        for i in range(obstacles.count):
            arm = np.linalg.norm(x - self._before[i], axis=1)
            np.maximum(reach, np.linalg.norm(v[i]) + np.linalg.norm(omega[i]) * arm, out=reach)
        carried = x.copy()
        rows = near.gap < self._h * reach
        who = near.owner[rows]
        arm = x[rows] - self._before[who]
        carried[rows] = self._after.origins()[who] + np.einsum(
            "ijk,ik->ij", self._rotation[who], arm
        )
        return carried


def advanced(obstacles: Obstacles, h: float) -> tuple[Obstacles, FloatArray]:
    """Returns the obstacles `h` s later and the rotation of each, (count,3,3)."""
    v, omega = obstacles.twists()
    if not v.any() and not omega.any():
        return obstacles, np.tile(np.eye(3), (len(v), 1, 1))
    turn = np.array([_rotation(h * w) for w in omega]).reshape(-1, 3, 3)
    m, k = len(obstacles.radius), len(obstacles.half_spaces.point)
    a = obstacles.a + h * v[:m]
    b = a + np.einsum("ijk,ik->ij", turn[:m], obstacles.b - obstacles.a)
    plane = obstacles.half_spaces
    planes = replace(
        plane,
        point=plane.point + h * v[m : m + k],
        normal=np.einsum("ijk,ik->ij", turn[m : m + k], plane.normal),
    )
    solids = tuple(
        replace(s, rotation=r @ s.rotation, position=s.position + h * s.velocity)
        for s, r in zip(obstacles.solids, turn[m + k :], strict=True)
    )
    return replace(obstacles, a=a, b=b, half_spaces=planes, solids=solids), turn


def _rotation(vector: FloatArray) -> FloatArray:
    """Returns the rotation (3,3) by the angle ‖vector‖, rad, about `vector`."""
    angle = float(np.linalg.norm(vector))
    x, y, z = vector
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    half = np.sinc(0.5 * angle / np.pi)
    out: FloatArray = np.eye(3) + np.sinc(angle / np.pi) * cross + 0.5 * half**2 * cross @ cross
    return out
