"""Choice of the scheme that steps a plant's garment, with its solver settings."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

from drake_dress.models.arrays import FloatArray, IntArray
from drake_dress.models.cloth.elements import Elements
from drake_dress.models.cloth.implicit.implicit_cloth import ImplicitCloth, ImplicitSettings
from drake_dress.models.cloth.layered import Integrator
from drake_dress.models.cloth.material import Material
from drake_dress.models.cloth.mujoco.mujoco_cloth import MujocoCloth
from drake_dress.models.cloth.mujoco.settings import MujocoSettings
from drake_dress.models.cloth.projective.projective_dynamics import (
    ProjectiveDynamicsCloth,
    ProjectiveSettings,
)
from drake_dress.models.cloth.state import Additions

# Maps elements, fabric, gravity (3,) and additions to an integrator.
MakeIntegrator = Callable[[Elements, Material, FloatArray, Additions], Integrator]


@dataclass(frozen=True)
class Scheme:
    """A `MakeIntegrator`: makes an integrator when called with a garment.

    Attributes:
        held: (k,) nodes whose motion is prescribed.
        time_step: duration of a step, s.
        settings: settings of the linearly implicit scheme, of Projective Dynamics or of MuJoCo;
            their type selects the scheme.
        damping: replaces the fabric's damping time, s; None keeps the fabric's.
    """

    held: IntArray
    time_step: float
    settings: ImplicitSettings | ProjectiveSettings | MujocoSettings = ImplicitSettings()
    damping: float | None = None

    def __call__(
        self, elements: Elements, material: Material, gravity: FloatArray, additions: Additions
    ) -> Integrator:
        """Returns the integrator of a garment."""
        if self.damping is not None:
            material = replace(material, damping=self.damping)
        given = (elements, material, self.time_step, self.held, gravity, additions)
        if isinstance(self.settings, ProjectiveSettings):
            return ProjectiveDynamicsCloth(*given, self.settings)
        if isinstance(self.settings, MujocoSettings):
            return MujocoCloth(*given, self.settings)
        return ImplicitCloth(*given, self.settings)
