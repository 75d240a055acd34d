"""A step of the garment inside PyTorch's automatic differentiation.

    x, v, reaction = cloth_step(cloth, x, v, held_motion, obstacles)

The results are tensors with a backward pass. `bodies` and `material` let gradients flow to the
obstacles' poses and to the material's values, which may differ from those of `cloth`, so that
fabrics can be fitted. Torch is imported with this module only.

The step keeps copies of its inputs, and torch keeps their version numbers. If an input is modified
before the backward pass, that pass raises RuntimeError. So does a second derivative.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np
import torch

from drake_dress.models.cloth.contact.obstacles import Obstacles
from drake_dress.models.cloth.explicit.differentiable_once import differentiable_once
from drake_dress.models.cloth.explicit.explicit_bias import ExplicitBiasCloth
from drake_dress.models.cloth.material import Material

MATERIAL = ("surface_density", "stretch_stiffness", "bending_stiffness", "friction", "margin")


class ClothStep(torch.autograd.Function):
    """`ExplicitBiasCloth.step`, differentiable; call it through `cloth_step`."""

    @staticmethod
    def forward(
        ctx: Any,
        cloth: ExplicitBiasCloth,
        obstacles: Obstacles,
        x: torch.Tensor,
        v: torch.Tensor,
        held_motion: torch.Tensor,
        bodies: torch.Tensor,
        material: torch.Tensor,
    ) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
        """Runs the step; see `cloth_step`."""
        offset = _array(bodies)
        moved = obstacles.moved(offset) if offset.any() else obstacles.copy()
        x1, v1, reaction, tape = cloth.step(_array(x), _array(v), _array(held_motion), moved)
        ctx.cloth, ctx.tape = cloth, tape
        ctx.by_material = ctx.needs_input_grad[6]
        ctx.save_for_backward(x, v, held_motion, bodies, material)
        return tuple(torch.from_numpy(a) for a in (x1, v1, reaction[cloth.held]))  # type: ignore[return-value]

    @staticmethod
    def backward(ctx: Any, *bars: torch.Tensor) -> tuple[torch.Tensor | None, ...]:
        """Runs the adjoint."""
        inputs = ctx.saved_tensors  # raises if one was modified since
        g = ctx.cloth.vector_jacobian_product(ctx.tape, *map(_array, bars), ctx.by_material)
        bodies = np.stack([g.origin, g.rotation, g.velocity, g.angular_velocity], axis=1)
        material = None
        if ctx.by_material:
            material = torch.tensor([g.material[name] for name in MATERIAL], dtype=torch.float64)
        back = [torch.from_numpy(a) for a in (g.x, g.v, g.held_motion, bodies)]
        return (
            None,
            None,
            *differentiable_once((*back, material), (*inputs, *bars), "cloth_step"),
        )


def cloth_step(
    cloth: ExplicitBiasCloth,
    x: torch.Tensor,
    v: torch.Tensor,
    held_motion: torch.Tensor,
    obstacles: Obstacles,
    bodies: torch.Tensor | None = None,
    material: torch.Tensor | None = None,
) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
    """Returns positions (n,3), velocities (n,3) and reactions of the held nodes (k,3) after a step.

    All tensors are float64 on the CPU. The step is differentiable once: a second derivative raises
    RuntimeError, and so does a backward pass after an input was modified in place.

    Args:
        cloth: garment.
        x: (n,3) positions, m.
        v: (n,3) velocities, m/s.
        held_motion: (k,3) displacement of the held nodes over the step, m.
        obstacles: obstacles at the start of the step.
        bodies: (m,4,3) changes of the obstacles' poses and velocities; see `Obstacles.moved`.
        material: (5,) the values of `MATERIAL`; by default those of `cloth`. The garment with the
            last values is cached, so a rollout with one fabric makes it once.

    Raises:
        ValueError: a tensor is not float64, or a value of `material` is outside its range.
    """
    for name, tensor in (("x", x), ("v", v), ("held_motion", held_motion)):
        if tensor.dtype != torch.float64:
            raise ValueError(f"{name} is {tensor.dtype}, expected torch.float64")
    if bodies is None:
        bodies = torch.zeros((obstacles.count, 4, 3), dtype=torch.float64)
    if material is None:
        material = material_tensor(cloth.material)
    made = _made_of(cloth, material)
    return ClothStep.apply(made, obstacles, x, v, held_motion, bodies, material)


def material_tensor(material: Material) -> torch.Tensor:
    """Returns (5,) the values of `MATERIAL` of a fabric, float64."""
    return torch.tensor([getattr(material, n) for n in MATERIAL], dtype=torch.float64)


# For each garment, the one last used with another fabric.
_last: WeakKeyDictionary[ExplicitBiasCloth, ExplicitBiasCloth] = WeakKeyDictionary()


def _made_of(cloth: ExplicitBiasCloth, material: torch.Tensor) -> ExplicitBiasCloth:
    """Returns the garment with the values of `material`."""
    if material.shape != (len(MATERIAL),):
        raise ValueError(f"material has shape {tuple(material.shape)}, expected (5,)")
    values = dict(zip(MATERIAL, material.detach().tolist(), strict=True))
    for made in (cloth, _last.get(cloth)):
        if made is not None and all(getattr(made.material, n) == v for n, v in values.items()):
            return made
    _last[cloth] = cloth.with_material(replace(cloth.material, **values))
    return _last[cloth]


def _array(tensor: torch.Tensor) -> np.ndarray[Any, np.dtype[np.float64]]:
    return np.ascontiguousarray(tensor.detach().numpy())
