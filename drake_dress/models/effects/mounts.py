"""Grippers and limbs that give way under the garment's pull.

A yielding mount follows u'' = (c f − u) / τ² − 2 u' / τ: critically damped about its rest
deflection c f, with a time constant τ that stands for its mass and damping. Integrated implicitly
in u, and in the force as far as that is known: the garment that a gripper moves within a step, of
mass S, pulls by S times less the more the gripper gives way to it. With the force of the step
before alone a garment heavier than the mount, τ² / c, would swing up however short the steps are.
Cloth that slips in a gripper is displaced further, at a speed that depends on the pull.
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
    """Where mounts are relative to where they should be.

    Attributes:
        gripper, gripper_rate: (2,3) of the left and the right gripper, m, m/s.
        gripper_change: (2,3) of that rate in the last step, m/s.
        slip: (2,3) of the cloth in them, m.
        limb, limb_rate: (b,3) of the limbs, m, m/s.
    """

    gripper: FloatArray
    gripper_rate: FloatArray
    gripper_change: FloatArray
    slip: FloatArray
    limb: FloatArray
    limb_rate: FloatArray

    @staticmethod
    def at_rest(limbs: int) -> MountState:
        """Returns mounts of `limbs` limbs without load."""
        z, b = np.zeros((2, 3)), np.zeros((limbs, 3))
        return MountState(z, z, z, z, b, b)

    def flat(self) -> FloatArray:
        """Returns all as one vector (24 + 6b,)."""
        grippers = (self.gripper, self.gripper_rate, self.gripper_change, self.slip)
        return np.concatenate([p.ravel() for p in (*grippers, self.limb, self.limb_rate)])

    @staticmethod
    def of(flat: FloatArray) -> MountState:
        """Returns what `flat` gave."""
        return MountState(*flat[:24].reshape(4, 2, 3), *flat[24:].reshape(2, -1, 3))

    @property
    def held(self) -> FloatArray:
        """Displacement (2,3) of what grippers hold from where the grippers report to be, m."""
        return self.gripper + self.slip


class Mounts:
    """What of grippers and limbs gives way, by the effects given; all others are passed over."""

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
        """Whether nothing gives way."""
        return self._gripper is None and self._limb is None and self._slip is None

    def loaded(self, displacement: FloatArray, limbs: int) -> MountState:
        """Returns mounts at rest whose grippers hold the garment (2,3) m from where they report."""
        state = MountState.at_rest(limbs)
        if self._gripper is not None:
            return replace(state, gripper=displacement)
        return state if self._slip is None else replace(state, slip=displacement)

    def moved_mass(self, cloth: Integrator, side: IntArray) -> FloatArray:
        """Returns (2,) what each gripper moves of a garment within a step, kg, at most.

        That is 1ᵀ(P_hh − P_hf P_ff⁻¹ P_fh) 1 with P ≥ M + h² K, h held and f free nodes; zeros
        where no gripper gives way.

        Args:
            cloth: the garment.
            side: (k,) gripper of its held nodes.
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
            state: now.
            gripper_force: (2,3) of the garment on the grippers, N.
            limb_force: (b,3) of the garment on the limbs, N.
            h: s.
            moved_mass: (2,) of the garment by each gripper, kg; none by default.
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
        limb: (c,) which limb a body is of, −1 for none.
        count: of limbs.
        owner: (n,) body that a node touches, −1 without.
        reaction: (n,3) of the bodies on the nodes, N.
    """
    force = np.zeros((count, 3))
    rows = np.flatnonzero(owner >= 0)
    which = limb[owner[rows]]
    np.subtract.at(force, which[which >= 0], reaction[rows[which >= 0]])
    return force


def displaced(
    bodies: Obstacles, limb: IntArray, displacement: FloatArray, rate: FloatArray
) -> Obstacles:
    """Returns bodies with those of limb k displaced by row k of (b,3), m, at (b,3), m/s."""
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
    """Returns displacement and rate a step on.

    Args:
        u: displacement, m.
        rate: of it, m/s.
        rest: displacement at rest under the force of the step before, m.
        tau: s.
        h: s.
        inertia: of what is moved over that of the mount.
        ahead: rate with which the force of the step before goes on, m/s.
    """
    a = h / tau
    after = (rate + inertia * ahead + a / tau * (rest - u)) / (1.0 + inertia + 2.0 * a + a * a)
    return u + h * after, after
