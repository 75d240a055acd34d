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
        projective: Projective Dynamics instead of the linearly implicit scheme.
        tolerance: relative residual of the implicit scheme's solver.
        iterations: of it, at most.
        accuracy: distance to the fixed point at which Projective Dynamics stops, m.
        predicted: whether it starts from the linearly implicit step.
        damping: in place of the fabric's, s.
        implicitness: θ of the implicit scheme.
        buckling_wavelength: of it, in spacings of the mesh; 0: compression never gives way.
        sampled: whether Projective Dynamics has contact between nodes too.
    """

    held: IntArray
    time_step: float
    projective: bool = False
    tolerance: float = 5e-3
    iterations: int = 40
    accuracy: float = 1e-5
    predicted: bool = False
    damping: float | None = None
    sampled: bool = False
    implicitness: float = 1.0
    buckling_wavelength: float = 0.0

    def __call__(
        self, elements: Elements, material: Material, gravity: FloatArray, additions: Additions
    ) -> Integrator:
        """Returns what steps the garment."""
        if self.damping is not None:
            material = replace(material, damping=self.damping)
        if self.projective:
            iterated = ProjectiveSettings(
                tolerance=self.accuracy,
                quasi_newton=True,
                predicted=self.predicted,
                sample_elements=self.sampled,
            )
            return ProjectiveDynamicsCloth(
                elements, material, self.time_step, self.held, gravity, additions, iterated
            )
        settings = ImplicitSettings(
            tolerance=self.tolerance,
            max_iterations=self.iterations,
            implicitness=self.implicitness,
            buckling_wavelength=self.buckling_wavelength,
        )
        return ImplicitCloth(
            elements, material, self.time_step, self.held, gravity, additions, settings
        )
