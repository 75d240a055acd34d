"""Which scheme steps a plant's garment, and how well it solves."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

from drake_dress.models.arrays import FloatArray, IntArray
from drake_dress.models.cloth.elements import Elements
from drake_dress.models.cloth.implicit.implicit_cloth import ImplicitCloth, ImplicitSettings
from drake_dress.models.cloth.layered import Integrator
from drake_dress.models.cloth.material import Material
from drake_dress.models.cloth.projective.projective_dynamics import (
    ProjectiveDynamicsCloth,
    ProjectiveSettings,
)
from drake_dress.models.cloth.state import Additions

# Elements, fabric, gravity (3,) and additions to what steps the garment.
MakeIntegrator = Callable[[Elements, Material, FloatArray, Additions], Integrator]


@dataclass(frozen=True)
class Scheme:
    """Makes an integrator when it is called with a garment; a `MakeIntegrator`.

    Attributes:
        held: (k,) nodes whose motion is prescribed.
        time_step: s.
        settings: of the linearly implicit scheme or of Projective Dynamics, which they choose.
        damping: in place of the fabric's, s.
    """

    held: IntArray
    time_step: float
    settings: ImplicitSettings | ProjectiveSettings = ImplicitSettings()
    damping: float | None = None

    def __call__(
        self, elements: Elements, material: Material, gravity: FloatArray, additions: Additions
    ) -> Integrator:
        """Returns what steps the garment."""
        if self.damping is not None:
            material = replace(material, damping=self.damping)
        given = (elements, material, self.time_step, self.held, gravity, additions)
        if isinstance(self.settings, ProjectiveSettings):
            return ProjectiveDynamicsCloth(*given, self.settings)
        return ImplicitCloth(*given, self.settings)
