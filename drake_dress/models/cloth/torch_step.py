"""A step of the garment inside PyTorch's automatic differentiation.

    x, v, reaction = cloth_step(cloth, x, v, held_motion, obstacles)

are tensors that know how to go backward. `bodies` and `material` let gradients flow to where the
obstacles are and to what the garment is made of. Torch is imported with this module only.

The step keeps copies of its inputs, and torch keeps their version numbers: an input that is written
to before the backward pass raises RuntimeError there. So does a second derivative.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import torch

from drake_dress.models.cloth.contact.obstacles import Obstacles
from drake_dress.models.cloth.differentiable_once import differentiable_once
from drake_dress.models.cloth.explicit_bias import ExplicitBiasCloth

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
        inputs = ctx.saved_tensors  # raises if one was written to since
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

    All tensors are float64 on the CPU. Differentiable once: a second derivative raises
    RuntimeError, and so does a backward pass after an input was written to in place.

    Args:
        cloth: the garment.
        x: (n,3) positions, m.
        v: (n,3) velocities, m/s.
        held_motion: (k,3) displacement of the held nodes over the step, m.
        obstacles: at the start of the step.
        bodies: (m,4,3) how they are displaced, turned and sped up; see `Obstacles.moved`.
        material: (5,) the values of `MATERIAL` that the cloth was made with. Gradients flow to
            them; for other values make another cloth.

    Raises:
        ValueError: a tensor is not float64, or `material` is not what the cloth was made with.
    """
    for name, tensor in (("x", x), ("v", v), ("held_motion", held_motion)):
        if tensor.dtype != torch.float64:
            raise ValueError(f"{name} is {tensor.dtype}, expected torch.float64")
    own = torch.tensor([getattr(cloth.material, n) for n in MATERIAL], dtype=torch.float64)
    if bodies is None:
        bodies = torch.zeros((obstacles.count, 4, 3), dtype=torch.float64)
    if material is None:
        material = own
    elif not torch.allclose(material.detach(), own, rtol=1e-12, atol=0.0):
        raise ValueError(
            f"material is {material.tolist()}, the cloth was made with {own.tolist()}: "
            "make another cloth for other values"
        )
    return ClothStep.apply(cloth, obstacles, x, v, held_motion, bodies, material)  # type: ignore[no-any-return]


def _array(tensor: torch.Tensor) -> np.ndarray[Any, np.dtype[np.float64]]:
    return np.ascontiguousarray(tensor.detach().numpy())
