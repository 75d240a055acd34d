"""Garments without Drake: make, step, roll out and differentiate them.

    from drake_dress import cloth

    coat = cloth.make_coat(cloth.CoatParameters(), spacing=0.03)
    elements = cloth.make_elements(coat.rest_position, coat.faces)
    plant = cloth.ImplicitCloth(elements, cloth.Material(), 0.01, coat.held)
    state, _ = plant.step(cloth.ClothState.at_rest(coat.rest_position), ...)

`ImplicitCloth` is the accurate scheme, `LayeredCloth` keeps its layers apart, `ExplicitBiasCloth`
has derivatives, and `cloth_step` is its step for torch (the `torch` extra). The names in `__all__`
are public.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from drake_dress.models.cloth.contact.obstacles import HalfSpaces, Obstacles
from drake_dress.models.cloth.elements import Elements, make_elements
from drake_dress.models.cloth.explicit.adjoint import Gradient
from drake_dress.models.cloth.explicit.explicit_bias import ExplicitBiasCloth, ExplicitSettings
from drake_dress.models.cloth.explicit.rollout import Rollout, RolloutGradient, roll_back, roll_out
from drake_dress.models.cloth.implicit.implicit_cloth import ImplicitCloth, ImplicitSettings
from drake_dress.models.cloth.influences import Influences
from drake_dress.models.cloth.layered import LayeredCloth
from drake_dress.models.cloth.material import Material
from drake_dress.models.cloth.projective.projective_dynamics import (
    ProjectiveDynamicsCloth,
    ProjectiveSettings,
)
from drake_dress.models.cloth.state import Additions, ClothState
from drake_dress.models.garment.coat import COATS, CoatParameters, make_coat
from drake_dress.models.garment.load import load_garment
from drake_dress.models.garment.mesh import GarmentMesh

if TYPE_CHECKING:
    from drake_dress.models.cloth.explicit.torch_step import MATERIAL, cloth_step, material_tensor

__all__ = [
    "COATS",
    "MATERIAL",
    "Additions",
    "ClothState",
    "CoatParameters",
    "Elements",
    "ExplicitBiasCloth",
    "ExplicitSettings",
    "GarmentMesh",
    "Gradient",
    "HalfSpaces",
    "ImplicitCloth",
    "ImplicitSettings",
    "Influences",
    "LayeredCloth",
    "Material",
    "Obstacles",
    "ProjectiveDynamicsCloth",
    "ProjectiveSettings",
    "Rollout",
    "RolloutGradient",
    "cloth_step",
    "load_garment",
    "make_coat",
    "make_elements",
    "material_tensor",
    "roll_back",
    "roll_out",
]

_OF_TORCH = ("MATERIAL", "cloth_step", "material_tensor")


def __getattr__(name: str) -> Any:
    """Imports torch when a name first needs it."""
    if name in _OF_TORCH:
        from drake_dress.models.cloth.explicit import torch_step

        return getattr(torch_step, name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
