"""Contact with dry friction in one linearly implicit step, found by an active-set iteration.

The unknowns are the mean velocities u over the step, for bound nodes also those at its end. With
w = u − u_surface, r the impulse of contact, r_N along the normal n, and u_N* the normal velocity
that brings a node onto its margin,

    free     w_N ≥ u_N*,  r = 0
    stick    w_N = u_N*,  w_T = 0,  ‖r_T‖ ≤ μ r_N
    slip     w_N = u_N*,  r_T = −μ r_N w_T / ‖w_T‖
    rail     between two bodies: w only along the line where their surfaces meet, with friction

Modes start from those of the previous step. Friction of slipping nodes enters as a resistance
c w_T, c = μ r_N / ‖w_T‖ of the last pass or step, which cannot reverse a node's motion. A fixed
impulse, ten times the momentum of a light node, did: nodes stuck, left and came back, the tension
around a drum was 21 % too small at μ = 0.5, and a sleeve over an arm pulled a third too little.
"""

from __future__ import annotations

import numba as nb
import numpy as np

from drake_dress.models.arrays import FloatArray, IntArray
from drake_dress.models.cloth.contact.detection import Proximity, surfaces_of
from drake_dress.models.cloth.contact.distance import distance_to, nearest_obstacle
from drake_dress.models.cloth.contact.modes import FREE, HELD, RAIL, SLIP, STICK
from drake_dress.models.cloth.contact.obstacles import Obstacles
from drake_dress.models.cloth.filtered_cg import Bound
from drake_dress.models.cloth.influences import ContactLaw
from drake_dress.models.cloth.state import ClothState

# Largest velocity that pushes a node out to its margin, m/s; a larger one would throw it.
_LARGEST_PUSH = 0.2
# Tangential speed above which a node lands sliding, m/s.
_LANDING_SLIP_SPEED = 5e-3
# A slipping node that is slower than this, m/s, or slows to this share in a pass, is tried as
# sticking: as slipping it would come to rest only in the limit.
_SLOWEST, _STOPPING = 2e-4, 0.7
# Gap up to which a node keeps the contact of the previous step, m.
_KEPT_GAP = 1e-3
# Gap within which a node may land during a step, m.
_NEAR = 0.05
# Depth within its margin, m, at which a node that comes from outside has to be stopped.
_ENTERED = 1.5e-3
# Cosine between two surface normals, of either sign, above which the surfaces form no corner.
_FACING = 0.97
# Tolerated sum of friction beyond the cone, relative to what the cone allows.
_TOLERATED_EXCESS = 0.02


class ImplicitContact:
    """The contacts of one step.

    Args:
        near: nearest surfaces of the nodes at the start of the step.
        state: state of the garment at that time.
        held: (k,) nodes whose motion is prescribed; they feel no contact.
        time_step: h, s.
        gravity: (3,) m/s².
        law: friction and adhesion.

    Attributes:
        mode: (n,) FREE, STICK, SLIP, RAIL or HELD, current. For a node on a rail, `normal` is the
            rail's direction.
        resistance: (n,) c of nodes that slip or are on a rail, kg.
    """

    def __init__(
        self,
        near: Proximity,
        state: ClothState,
        held: IntArray,
        time_step: float,
        gravity: FloatArray,
        law: ContactLaw,
    ) -> None:
        v, h = state.v, time_step
        n = len(v)
        self._h = h
        self._near, self._mu, self._adhesion = near, law.friction, h * law.adhesion
        self.mode = np.empty(n, dtype=np.int32)
        _initial_modes(
            near.gap,
            near.normal,
            near.surface_velocity,
            v,
            h * gravity,
            h,
            state.mode,
            near.owner,
            self.mode,
        )
        self.mode[held] = HELD
        # normal velocity, relative to the surface, that brings a node onto its margin
        self._push = _push_out(near.gap, h)
        # impulse on nodes that are about to slip; tangential speeds of the last pass
        self._friction, self._speed = np.zeros((n, 3)), np.zeros(n)
        self.resistance = np.zeros(n)
        _initial_friction(
            state.reaction,
            v,
            near.surface_velocity,
            near.normal,
            h,
            law.friction,
            law.adhesion,
            self.mode,
            self._friction,
            self.resistance,
            self._speed,
        )

    @property
    def is_near(self) -> bool:
        """Whether any node may land."""
        return bool(np.any(self._near.gap < _NEAR))

    def bound(self) -> Bound:
        """Returns the constraints on the nodes' motion, for the linear solver."""
        resistance = self.resistance if self.resistance.any() else None
        return Bound(self.mode, self._near.normal, resistance)

    def prescribe(self, velocity: FloatArray) -> None:
        """Writes the velocities that contact prescribes into `velocity` (n,3), m/s."""
        _prescribe(self.mode, self._near.normal, self._near.surface_velocity, self._push, velocity)

    def drive(self) -> FloatArray:
        """Returns (n,3) the impulses of friction that do not depend on velocities, N s."""
        return self._friction + self.resistance[:, None] * self._near.surface_velocity

    def update(self, velocity: FloatArray, residual: FloatArray) -> int:
        """Updates modes and friction after a pass; returns the number of nodes that changed.

        Args:
            velocity: (n,3) m/s.
            residual: (n,3) residual of the equations of motion without contact, N s.
        """
        return int(
            _update_modes(
                self._near.gap,
                self._near.normal,
                self._near.surface_velocity,
                self._push,
                velocity,
                residual,
                self._mu,
                self._adhesion,
                self.mode,
                self._friction,
                self.resistance,
                self._speed,
            )
        )

    def slip_out_of_cone(self, velocity: FloatArray, residual: FloatArray) -> bool:
        """Lets nodes beyond the friction cone slip if their total excess matters; returns whether.

        Args:
            velocity: (n,3) m/s.
            residual: (n,3) residual of the equations of motion without contact, N s.
        """
        return bool(
            _slip_out_of_cone(
                self._near.normal,
                self._near.surface_velocity,
                velocity,
                residual,
                self._mu,
                self._adhesion,
                self.mode,
                self._friction,
                self.resistance,
            )
        )

    def stop_entering(
        self,
        x: FloatArray,
        velocity: FloatArray,
        residual: FloatArray,
        obstacles: Obstacles,
        margin: float,
    ) -> bool:
        """Binds nodes that would end deeper inside a body; returns whether there are any.

        A free node lands on that body. A bound node moves to the line where the surfaces of both
        bodies meet, and slides along it with friction.

        Args:
            x: (n,3) at the start of the step, m.
            velocity: (n,3) mean over the step, m/s.
            residual: (n,3) residual of the equations of motion without contact, N s.
            obstacles: bodies.
            margin: distance to keep, m.
        """
        near, h, shapes = self._near, self._h, obstacles.packed
        distance, owner = np.empty(len(x)), np.empty(len(x), dtype=np.int32)
        nearest_obstacle(x + h * (velocity - near.surface_velocity), shapes, distance, owner)
        bound = (self.mode == STICK) | (self.mode == SLIP)
        end = distance - margin
        entered = (end < -_ENTERED) & (self.mode != HELD) & (self.mode != RAIL)
        # nodes that were as deep in that body before are on their way out
        leaving = (near.owner == owner) & (end > near.gap - _ENTERED)
        rows = np.flatnonzero(entered & ~leaving)
        if not len(rows):
            return False
        normal, _, moving = surfaces_of(x[rows], obstacles, owner[rows])
        gap = np.empty(len(rows))
        distance_to(x[rows], shapes, owner[rows], gap)
        gap -= margin
        for k, i in enumerate(rows):
            if bound[i]:
                self._put_on_rail(
                    int(i), velocity[i], residual[i], normal[k], moving[k], float(gap[k])
                )
                continue
            near.gap[i], near.owner[i] = gap[k], owner[i]
            near.normal[i], near.surface_velocity[i] = normal[k], moving[k]
            self._push[i] = _push_out(near.gap[i : i + 1], h)[0]
            self.mode[i] = _landing_mode(velocity, near.surface_velocity, near.normal, i)
        return True

    def _put_on_rail(
        self,
        i: int,
        velocity: FloatArray,
        residual: FloatArray,
        normal: FloatArray,
        moving: FloatArray,
        gap: float,
    ) -> None:
        """Restricts node `i`, already bound, to the line where a second surface meets its own.

        Surfaces that are nearly parallel have no such line: between them a node slips.

        Args:
            i: the node.
            velocity: (3,) velocity of the node, m/s.
            residual: (3,) residual at the node, N s.
            normal: (3,) normal of the second surface.
            moving: (3,) velocity of the second surface, m/s.
            gap: gap to the second surface, less the margin, m.
        """
        near = self._near
        own, c = near.normal[i].copy(), float(near.normal[i] @ normal)
        between = 0.5 * (near.surface_velocity[i] + moving)
        self._push[i], self._friction[i] = 0.0, 0.0
        if abs(c) < _FACING:
            first, second = float(near.gap[i]), gap
            way = ((c * second - first) * own + (c * first - second) * normal) / (1.0 - c * c)
            between += way / self._h
            line = np.cross(own, normal)
            near.normal[i], self.mode[i] = line / np.linalg.norm(line), RAIL
            slid = abs(float(near.normal[i] @ (velocity - between)))
        else:
            self.mode[i] = SLIP
            w = velocity - between
            slid = float(np.linalg.norm(w - (own @ w) * own))
        near.surface_velocity[i] = between
        # the load on the first surface so far gives the size of friction
        pressure = max(float(own @ residual) + float(self._adhesion[i]), 0.0)
        self.resistance[i] = self._mu[i] * pressure / max(slid, _SLOWEST)

    def impulse(self, velocity: FloatArray, residual: FloatArray) -> FloatArray:
        """Returns (n,3) the impulse of person and grippers at a solution, N s.

        It excludes the residual that conjugate gradients leave along the slip direction.
        """
        out = np.empty_like(residual)
        _impulse(
            self.mode,
            self._near.normal,
            self._near.surface_velocity,
            velocity,
            residual,
            self._friction,
            self.resistance,
            out,
        )
        return out


def _push_out(gap: FloatArray, h: float) -> FloatArray:
    """Returns the normal velocity (k,), m/s, that moves nodes with gaps (k,), m, to the margin."""
    push: FloatArray = np.where(gap > 0.0, -gap / h, np.minimum(-0.5 * gap / h, _LARGEST_PUSH))
    return push


@nb.njit(cache=True, nogil=True)
def _impulse(  # type: ignore[no-untyped-def]
    mode, normal, surface_velocity, velocity, residual, friction, resistance, out
):
    for i in range(mode.shape[0]):
        if mode[i] == FREE:
            for c in range(3):
                out[i, c] = 0.0
        elif mode[i] == SLIP:
            pressure = 0.0
            away = 0.0
            for c in range(3):
                pressure += residual[i, c] * normal[i, c]
                away += (velocity[i, c] - surface_velocity[i, c]) * normal[i, c]
            for c in range(3):
                w = velocity[i, c] - surface_velocity[i, c] - away * normal[i, c]
                out[i, c] = pressure * normal[i, c] + friction[i, c] - resistance[i] * w
        elif mode[i] == RAIL:
            along, slid = 0.0, 0.0
            for c in range(3):
                along += residual[i, c] * normal[i, c]
                slid += (velocity[i, c] - surface_velocity[i, c]) * normal[i, c]
            for c in range(3):
                out[i, c] = residual[i, c] - (along + resistance[i] * slid) * normal[i, c]
        else:
            for c in range(3):
                out[i, c] = residual[i, c]


@nb.njit(cache=True, nogil=True)
def _initial_modes(  # type: ignore[no-untyped-def]
    gap, normal, surface_velocity, v, gravity_step, h, old_mode, owner, mode
):
    for i in range(gap.shape[0]):
        mode[i] = FREE
        if owner[i] < 0:
            continue
        approach = 0.0
        for c in range(3):
            approach += normal[i, c] * (v[i, c] + gravity_step[c] - surface_velocity[i, c])
        was_touching = old_mode[i] == STICK or old_mode[i] == SLIP
        if was_touching and gap[i] < _KEPT_GAP:
            mode[i] = old_mode[i]
        elif gap[i] + h * approach < 0.0:
            mode[i] = _landing_mode(v, surface_velocity, normal, i)


@nb.njit(cache=True, nogil=True)
def _landing_mode(v, surface_velocity, normal, i):  # type: ignore[no-untyped-def]
    """Returns SLIP if the node slides as it lands: sticking would take its momentum."""
    sliding = _tangential_speed(v, surface_velocity, normal, i) > _LANDING_SLIP_SPEED
    return SLIP if sliding else STICK


@nb.njit(cache=True, nogil=True)
def _tangential_speed(velocity, surface_velocity, normal, i):  # type: ignore[no-untyped-def]
    along = 0.0
    for c in range(3):
        along += normal[i, c] * (velocity[i, c] - surface_velocity[i, c])
    speed2 = 0.0
    for c in range(3):
        w = velocity[i, c] - surface_velocity[i, c] - along * normal[i, c]
        speed2 += w * w
    return np.sqrt(speed2)


@nb.njit(cache=True, nogil=True)
def _initial_friction(  # type: ignore[no-untyped-def]
    reaction,
    v,
    surface_velocity,
    normal,
    h,
    mu,
    adhesion,
    mode,
    friction,
    resistance,
    speed,
):
    """Initialises friction of slipping nodes from the normal force of the previous step."""
    for i in range(mode.shape[0]):
        if mode[i] != SLIP:
            continue
        along = 0.0
        for c in range(3):
            along += reaction[i, c] * normal[i, c]
        speed[i] = _tangential_speed(v, surface_velocity, normal, i)
        if speed[i] > _SLOWEST:
            resistance[i] = h * mu[i] * max(along + adhesion[i], 0.0) / speed[i]
            continue
        size = 0.0
        for c in range(3):
            t = reaction[i, c] - along * normal[i, c]
            friction[i, c] = t
            size += t * t
        size = np.sqrt(size)
        scale = 0.0
        along += adhesion[i]
        if size > 0.0 and along > 0.0:
            scale = h * mu[i] * along / size
        for c in range(3):
            friction[i, c] *= scale


@nb.njit(cache=True, nogil=True)
def _prescribe(mode, normal, surface_velocity, push, velocity):  # type: ignore[no-untyped-def]
    for i in range(mode.shape[0]):
        if mode[i] == STICK:
            for c in range(3):
                velocity[i, c] = surface_velocity[i, c] + push[i] * normal[i, c]
        elif mode[i] == SLIP:
            along = push[i]
            for c in range(3):
                along += normal[i, c] * (surface_velocity[i, c] - velocity[i, c])
            for c in range(3):
                velocity[i, c] += along * normal[i, c]
        elif mode[i] == RAIL:
            along = 0.0
            for c in range(3):
                along += normal[i, c] * (velocity[i, c] - surface_velocity[i, c])
            for c in range(3):
                velocity[i, c] = surface_velocity[i, c] + along * normal[i, c]


@nb.njit(cache=True, nogil=True)
def _slip_out_of_cone(  # type: ignore[no-untyped-def]
    normal, surface_velocity, velocity, impulse, mu, adhesion, mode, friction, resistance
):
    """Lets sticking nodes beyond the cone slip if their excess matters; returns whether it does."""
    excess = 0.0
    bound = 0.0
    for i in range(mode.shape[0]):
        if mode[i] != STICK and mode[i] != SLIP:
            continue
        pressure = 0.0
        for c in range(3):
            pressure += impulse[i, c] * normal[i, c]
        most = mu[i] * max(pressure + adhesion[i], 0.0)
        pressure = max(pressure, 0.0)
        bound += most
        if mode[i] == SLIP:
            continue
        tangential = 0.0
        for c in range(3):
            tangential += (impulse[i, c] - pressure * normal[i, c]) ** 2
        tangential = np.sqrt(tangential)
        if tangential > most:
            excess += tangential - most
    if excess <= _TOLERATED_EXCESS * bound:
        return False
    for i in range(mode.shape[0]):
        if mode[i] != STICK and mode[i] != SLIP:
            continue
        pressure = 0.0
        for c in range(3):
            pressure += impulse[i, c] * normal[i, c]
        most = mu[i] * max(pressure + adhesion[i], 0.0)
        pressure = max(pressure, 0.0)
        if mode[i] == SLIP:
            size = 0.0
            for c in range(3):
                size += friction[i, c] ** 2
            size = np.sqrt(size)
            if size > 0.0:
                for c in range(3):
                    friction[i, c] *= most / size
            elif resistance[i] > 0.0:
                slid = _tangential_speed(velocity, surface_velocity, normal, i)
                resistance[i] = most / max(slid, _SLOWEST)
            continue
        tangential = 0.0
        for c in range(3):
            tangential += (impulse[i, c] - pressure * normal[i, c]) ** 2
        tangential = np.sqrt(tangential)
        if tangential > most:
            mode[i] = SLIP
            for c in range(3):
                t = impulse[i, c] - pressure * normal[i, c]
                friction[i, c] = most * t / tangential
    return True


@nb.njit(cache=True, nogil=True)
def _update_modes(  # type: ignore[no-untyped-def]
    gap,
    normal,
    surface_velocity,
    push,
    velocity,
    impulse,
    mu,
    adhesion,
    mode,
    friction,
    resistance,
    speed,
):
    """Runs one round of the active set; returns how many nodes changed their constraint."""
    changed = 0
    for i in range(mode.shape[0]):
        m = mode[i]
        if m == HELD:
            continue
        if m == FREE:
            along = 0.0
            for c in range(3):
                along += normal[i, c] * (velocity[i, c] - surface_velocity[i, c])
                friction[i, c] = 0.0
            if gap[i] < _NEAR and along < push[i] - 1e-6 and (gap[i] > 0.0 or along < -1e-6):
                mode[i] = _landing_mode(velocity, surface_velocity, normal, i)
                changed += 1
            continue
        pressure = 0.0
        for c in range(3):
            pressure += impulse[i, c] * normal[i, c]
        most = mu[i] * max(pressure + adhesion[i], 0.0)
        if pressure < -adhesion[i]:
            mode[i] = FREE
            resistance[i] = 0.0
            for c in range(3):
                friction[i, c] = 0.0
            changed += 1
            continue
        if m == STICK:
            tangential = 0.0
            for c in range(3):
                t = impulse[i, c] - pressure * normal[i, c]
                tangential += t * t
            tangential = np.sqrt(tangential)
            if tangential > most:
                mode[i] = SLIP
                for c in range(3):
                    t = impulse[i, c] - pressure * normal[i, c]
                    friction[i, c] = most * t / tangential
                changed += 1
            continue
        slid = 0.0
        work = 0.0
        old = 0.0
        for c in range(3):
            w = velocity[i, c] - surface_velocity[i, c] - push[i] * normal[i, c]
            slid += w * w
            work += w * friction[i, c]
            old += friction[i, c] ** 2
        slid = np.sqrt(slid)
        stopping = slid < _SLOWEST or slid < _STOPPING * speed[i]
        speed[i] = slid
        if work > 0.0 or stopping:
            # friction has stopped the node, or will
            mode[i] = STICK
            resistance[i] = 0.0
            for c in range(3):
                friction[i, c] = 0.0
            changed += 1
            continue
        if abs(np.sqrt(old) + resistance[i] * slid - most) > 0.1 * most + 1e-12:
            changed += 1
        resistance[i] = most / slid
        for c in range(3):
            friction[i, c] = 0.0
    return changed
