"""Grippers and limbs that yield to the garment's pull.

A yielding mount follows u'' = (c f − u) / τ² − 2 u' / τ: critically damped about its rest
deflection c f, with a time constant τ that stands for its mass and damping. It is integrated
implicitly in u, and in the force as far as that is known: with S the garment mass that a gripper
moves within a step, the pull falls by S times the gripper's acceleration in excess of the previous
one. With the force of the previous step alone, a garment heavier than the mount, τ² / c, would be
unstable for any time step. Cloth that slips in a gripper is displaced further, at a speed that
depends on the pull.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as sparse_linalg

from drake_dress.models.arrays import FloatArray, IntArray
from drake_dress.models.cloth.contact.obstacles import Obstacles
from drake_dress.models.cloth.layered import Integrator
from drake_dress.models.cloth.matrices import bending_bound, stretch_matrix
from drake_dress.models.effects.effect import Effect, MountEffect
from drake_dress.models.effects.grip import GripperCompliance, GripperSlip
from drake_dress.models.effects.person import LimbCompliance

# τ of grippers and limbs, s.
GRIPPER_TIME, LIMB_TIME = 0.03, 0.05


@dataclass(frozen=True)
class MountState:
    """Deflections of the mounts.

    Attributes:
        gripper, gripper_rate: (2,3) deflections of the left and the right gripper, m, m/s.
        gripper_change: (2,3) change of that rate in the last step, m/s.
        slip: (2,3) displacement of the cloth in the grippers, m.
        limb, limb_rate: (b,3) deflections of the limbs, m, m/s.
    """

    gripper: FloatArray
    gripper_rate: FloatArray
    gripper_change: FloatArray
    slip: FloatArray
    limb: FloatArray
    limb_rate: FloatArray

    @staticmethod
    def at_rest(limbs: int) -> MountState:
        """Returns unloaded mounts with `limbs` limbs."""
        z, b = np.zeros((2, 3)), np.zeros((limbs, 3))
        return MountState(z, z, z, z, b, b)

    def flat(self) -> FloatArray:
        """Returns the state as one vector (24 + 6b,)."""
        grippers = (self.gripper, self.gripper_rate, self.gripper_change, self.slip)
        return np.concatenate([p.ravel() for p in (*grippers, self.limb, self.limb_rate)])

    @staticmethod
    def of(flat: FloatArray) -> MountState:
        """Returns the state from the vector that `flat` returned."""
        return MountState(*flat[:24].reshape(4, 2, 3), *flat[24:].reshape(2, -1, 3))

    @property
    def held(self) -> FloatArray:
        """Displacement (2,3) of the held cloth from the reported gripper positions, m."""
        return self.gripper + self.slip


class Mounts:
    """Yielding grippers and limbs, from the given effects; other effects are ignored."""

    def __init__(self, effects: Sequence[Effect]) -> None:
        self._gripper: GripperCompliance | None = None
        self._limb: MountEffect | None = None
        self._slip: MountEffect | None = None
        for effect in effects:
            if effect.is_off:
                continue
            if isinstance(effect, GripperCompliance):
                self._gripper = effect
            elif isinstance(effect, LimbCompliance):
                self._limb = effect
            elif isinstance(effect, GripperSlip):
                self._slip = effect

    @property
    def rigid(self) -> bool:
        """Whether nothing yields."""
        return self._gripper is None and self._limb is None and self._slip is None

    def loaded(self, displacement: FloatArray, limbs: int) -> MountState:
        """Returns mounts at rest whose held cloth is displaced from the reported grippers (2,3), m.

        The displacement counts as deflection if the grippers yield, else as slip if there is slip.
        """
        state = MountState.at_rest(limbs)
        if self._gripper is not None:
            return replace(state, gripper=displacement)
        return state if self._slip is None else replace(state, slip=displacement)

    def moved_mass(self, cloth: Integrator, side: IntArray) -> FloatArray:
        """Returns (2,) upper bounds of the garment's mass that each gripper moves in a step, kg.

        That is 1ᵀ(P_hh − P_hf P_ff⁻¹ P_fh) 1 with P ≥ M + h² K, h held and f free nodes; zeros
        if the grippers do not yield.

        Args:
            cloth: the garment.
            side: (k,) gripper of each held node.
        """
        moved = np.zeros(2)
        if self._gripper is None:
            return moved
        scale = cloth.time_step * (cloth.time_step + cloth.material.damping)
        stiffness = stretch_matrix(cloth.elements, cloth.material)
        stiffness = stiffness + bending_bound(cloth.elements, cloth.material)
        p = sp.csc_matrix(sp.diags(cloth.mass) + scale * stiffness)
        free = np.setdiff1d(np.arange(p.shape[0]), cloth.held)
        factor = sparse_linalg.splu(p[np.ix_(free, free)])
        for i in (0, 1):
            unit = np.zeros(p.shape[0])
            unit[cloth.held[side == i]] = 1.0
            unit[free] = -factor.solve((p @ unit)[free])
            moved[i] = unit @ (p @ unit)
        return moved

    def step(
        self,
        state: MountState,
        gripper_force: FloatArray,
        limb_force: FloatArray,
        h: float,
        moved_mass: FloatArray | None = None,
    ) -> MountState:
        """Returns the state `h` s later.

        Args:
            state: current state.
            gripper_force: (2,3) force of the garment on the grippers, N.
            limb_force: (b,3) force of the garment on the limbs, N.
            h: time step, s.
            moved_mass: (2,) garment mass that each gripper moves, kg; none by default.
        """
        gripper, gripper_rate = state.gripper, state.gripper_rate
        if self._gripper is not None:
            rest = self._gripper.apply(gripper_force)
            inertia = np.zeros((2, 1))
            if moved_mass is not None:
                inertia = self._gripper.compliance * moved_mass[:, None] / GRIPPER_TIME**2
            ahead = gripper_rate + state.gripper_change
            gripper, gripper_rate = _settle(
                gripper, gripper_rate, rest, GRIPPER_TIME, h, inertia, ahead
            )
        limb, limb_rate = state.limb, state.limb_rate
        if self._limb is not None:
            limb, limb_rate = _settle(limb, limb_rate, self._limb.apply(limb_force), LIMB_TIME, h)
        slip = state.slip
        if self._slip is not None:
            slip = slip + h * self._slip.apply(gripper_force)
        change = gripper_rate - state.gripper_rate
        return MountState(gripper, gripper_rate, change, slip, limb, limb_rate)


def limb_forces(limb: IntArray, count: int, owner: IntArray, reaction: FloatArray) -> FloatArray:
    """Returns (count,3) the force of the garment on each limb, N.

    Args:
        limb: (c,) limb that each body belongs to, −1 for none.
        count: number of limbs.
        owner: (n,) body that each node touches, −1 for none.
        reaction: (n,3) force of the bodies on the nodes, N.
    """
    force = np.zeros((count, 3))
    rows = np.flatnonzero(owner >= 0)
    which = limb[owner[rows]]
    np.subtract.at(force, which[which >= 0], reaction[rows[which >= 0]])
    return force


def displaced(
    bodies: Obstacles, limb: IntArray, displacement: FloatArray, rate: FloatArray
) -> Obstacles:
    """Returns the bodies, those of limb k displaced by row k of (b,3), m, with rate (b,3), m/s."""
    rows = limb >= 0
    u, w = np.zeros_like(bodies.a), np.zeros_like(bodies.a)
    u[rows], w[rows] = displacement[limb[rows]], rate[limb[rows]]
    return replace(bodies, a=bodies.a + u, b=bodies.b + u, velocity=bodies.velocity + w)


def _settle(
    u: FloatArray,
    rate: FloatArray,
    rest: FloatArray,
    tau: float,
    h: float,
    inertia: FloatArray | float = 0.0,
    ahead: FloatArray | float = 0.0,
) -> tuple[FloatArray, FloatArray]:
    """Returns displacement and rate one step later.

    Args:
        u: displacement, m.
        rate: rate of the displacement, m/s.
        rest: displacement at rest under the force of the previous step, m.
        tau: time constant, s.
        h: time step, s.
        inertia: moved mass over the mass of the mount.
        ahead: rate at the end of this step for which the previous force would hold, m/s.
    """
    a = h / tau
    after = (rate + inertia * ahead + a / tau * (rest - u)) / (1.0 + inertia + 2.0 * a + a * a)
    return u + h * after, after
