"""The lab as a scenario describes it: garment, person and numerical settings."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from drake_dress.diagrams.garment import build_garment
from drake_dress.diagrams.integrator import check_explained
from drake_dress.diagrams.scenario import Scenario
from drake_dress.diagrams.sections.effects import effects
from drake_dress.diagrams.sections.person import arms, chair, measures, posture
from drake_dress.models.arrays import FloatArray, IntArray
from drake_dress.models.cloth.contact.obstacles import Obstacles
from drake_dress.models.cloth.implicit.implicit_cloth import ImplicitSettings
from drake_dress.models.cloth.material import Material
from drake_dress.models.cloth.projective.projective_dynamics import ProjectiveSettings
from drake_dress.models.cloth.scheme import Scheme
from drake_dress.models.effects.composition import GarmentWithEffects, body_with_effects
from drake_dress.models.effects.effect import Effect
from drake_dress.models.effects.mounts import displaced, limb_forces
from drake_dress.models.garment.grain import grain
from drake_dress.models.garment.mesh import GarmentMesh
from drake_dress.models.human.body import (
    ArmPose,
    BodyMeasures,
    Posture,
    arm_points,
    capsule_arrays,
)
from drake_dress.models.human.wheelchair import Wheelchair, seated_capsules
from drake_dress.models.sides import SIDES, Side

# Distance to the fixed point at which Projective Dynamics stops, m.
_ACCURACY = 2e-5


@dataclass(frozen=True)
class Numerics:
    """Numerical settings of the garment's simulation.

    Attributes:
        spacing: spacing of the mesh, m.
        time_step: time step, s.
        integrator: "implicit" or "projective_dynamics".
        iterations: iterations of the linear solver, at most.
        tolerance: relative residual at which it stops.
    """

    spacing: float
    time_step: float
    integrator: str = "implicit"
    iterations: int = 40
    tolerance: float = 5e-3


@dataclass(frozen=True)
class SimulatedLab:
    """Everything that does not change between recordings.

    Attributes:
        garment: mesh of the garment.
        material: fabric of the garment.
        numerics: numerical settings of its simulation.
        measures, posture, arms: sizes, posture and arm poses of the person.
        effects: effects that the scenario switches on.
        chair: wheelchair that the person sits in, if any.
    """

    garment: GarmentMesh
    material: Material
    numerics: Numerics
    measures: BodyMeasures
    posture: Posture
    arms: dict[Side, ArmPose]
    effects: tuple[Effect, ...] = ()
    chair: Wheelchair | None = None

    @staticmethod
    def of(scenario: Scenario, base: Path, numerics: Numerics | None = None) -> SimulatedLab:
        """Returns the lab of a scenario.

        Args:
            scenario: its plant is the simulation that is compared with data.
            base: directory that a mesh file's name is relative to.
            numerics: settings in place of the scenario's.

        Raises:
            UserError: the integrator is MuJoCo.
        """
        p = scenario.plant
        numerics = numerics or Numerics(
            p.spacing, p.time_step, p.integrator, p.iterations, p.tolerance
        )
        check_explained("scenario", numerics.integrator)
        return SimulatedLab(
            build_garment(scenario.garment, numerics.spacing, base),
            Material(**vars(p.material)),
            numerics,
            measures(scenario.person),
            posture(scenario.person),
            arms(scenario.person),
            effects(scenario.effects),
            chair(scenario.person),
        )

    @property
    def held(self) -> tuple[IntArray, IntArray]:
        """Held nodes (k,), and the gripper that holds each (k,): 0 left, 1 right."""
        parts = [self.garment.grasp[side] for side in SIDES]
        return (
            np.concatenate(parts).astype(np.int32),
            np.repeat([0, 1], [len(p) for p in parts]).astype(np.int32),
        )

    def with_effects(self, further: Sequence[Effect]) -> list[Effect]:
        """Returns the lab's effects and further ones, which replace those of the same name."""
        return list({e.NAME: e for e in (*self.effects, *further)}.values())

    def cloth(
        self,
        further: Sequence[Effect],
        damping: float | None = None,
        time_step: float | None = None,
    ) -> GarmentWithEffects:
        """Returns an integrator of the garment with the lab's effects and further ones.

        Args:
            further: further effects.
            damping: damping in place of the fabric's, s.
            time_step: time step in place of that of `numerics`, s.
        """
        n = self.numerics
        settings: ImplicitSettings | ProjectiveSettings
        if n.integrator == "projective_dynamics" and damping is None:
            settings = ProjectiveSettings(
                _ACCURACY, quasi_newton=True, predicted=True, sample_elements=True
            )
        else:
            settings = ImplicitSettings(n.tolerance, n.iterations)
        scheme = Scheme(self.held[0], time_step or n.time_step, settings, damping)
        return GarmentWithEffects(
            self.garment.rest_position,
            self.garment.faces,
            grain(self.garment),
            self.material,
            self.with_effects(further),
            scheme,
        )

    def person(self, further: Sequence[Effect]) -> PersonShape:
        """Returns the person with the lab's effects and further ones."""
        sizes = body_with_effects(self.measures, self.with_effects(further))
        return PersonShape(sizes, self.posture, self.arms, self.chair)


class PersonShape:
    """The person's capsules, placed by measured joints or as posed.

    Attributes:
        limb: (c,) index in `LIMB_NAMES` of each capsule's limb, −1 for none.
    """

    LIMB_NAMES = tuple(f"{side}_{part}" for side in SIDES for part in ("upper_arm", "forearm"))
    LIMBS = len(LIMB_NAMES)

    def __init__(
        self,
        sizes: BodyMeasures,
        stance: Posture,
        arms: dict[Side, ArmPose],
        chair: Wheelchair | None = None,
    ) -> None:
        capsules = seated_capsules(sizes, stance, chair)
        names = self.LIMB_NAMES
        self.limb = np.array([names.index(c.body) if c.body in names else -1 for c in capsules])
        self.posed = np.concatenate([arm_points(sizes, stance, side, arms[side]) for side in SIDES])
        self._a, self._b, self._radius = capsule_arrays(capsules)
        # a hand is a sphere of the forearm's limb: both ends of its axis coincide
        self._hand = np.array([np.array_equal(c.a_B, c.b_B) for c in capsules]) & (self.limb >= 0)

    def obstacles(self, joints: FloatArray, joint_velocity: FloatArray) -> Obstacles:
        """Returns the person's capsules from joints (6,3), m, and their velocities (6,3), m/s."""
        a, b = self._a.copy(), self._b.copy()
        velocity, omega = np.zeros_like(a), np.zeros_like(a)
        for k in range(self.LIMBS):
            start = 3 * (k // 2) + k % 2
            rows = self.limb == k
            a[rows], b[rows] = joints[start], joints[start + 1]
            velocity[rows] = joint_velocity[start]
            axis = joints[start + 1] - joints[start]
            turn = np.cross(axis, joint_velocity[start + 1] - joint_velocity[start])
            omega[rows] = turn / max(float(axis @ axis), 1e-12)
            hand = rows & self._hand
            a[hand] = b[hand] = joints[start + 1]
            velocity[hand] = joint_velocity[start + 1]
        return Obstacles(a, b, self._radius, velocity, omega)

    def displaced(self, bodies: Obstacles, displacement: FloatArray, rate: FloatArray) -> Obstacles:
        """Returns the capsules with limbs displaced by (4,3), m, with velocities (4,3), m/s."""
        return displaced(bodies, self.limb, displacement, rate)

    def limb_forces(self, owner: IntArray, reaction: FloatArray) -> FloatArray:
        """Returns (4,3) the force of the garment on the limbs, N.

        Args:
            owner: (n,) capsule that each node touches, −1 for none.
            reaction: (n,3) force of the person on the nodes, N.
        """
        return limb_forces(self.limb, self.LIMBS, owner, reaction)
