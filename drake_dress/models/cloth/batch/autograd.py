"""A batch's step as a torch function, with its adjoint as the backward pass."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import torch
import warp as wp

from drake_dress.models.cloth.batch.bodies import Bodies
from drake_dress.models.cloth.batch.cloth import BatchCloth, Fabric
from drake_dress.models.cloth.contact.obstacles import Obstacles
from drake_dress.models.cloth.differentiable_once import differentiable_once


def torch_step(
    cloth: BatchCloth,
    x: torch.Tensor,
    v: torch.Tensor,
    held_motion: torch.Tensor,
    obstacles: Obstacles | Sequence[Obstacles] | Bodies,
    fabric: Fabric | None = None,
) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
    """Returns position (B,n,3), velocity (B,n,3) and reaction at the held nodes (B,k,3).

    Differentiable by `x`, `v`, `held_motion` and the tensors of `fabric`, once: a second derivative
    raises RuntimeError. Tensors are float64 on the cloth's device and are not copied: a backward
    pass after one was written to in place raises RuntimeError, too.

    Args:
        cloth: steps them.
        x: (B,n,3) positions, m.
        v: (B,n,3) velocities, m/s.
        held_motion: (B,k,3) displacement of the held nodes over this step, m.
        obstacles: see `BatchCloth.step`.
        fabric: tensors (B,), or None for the cloth's materials.

    Raises:
        ValueError: a tensor has a wrong shape, type or device.
    """
    f = fabric or Fabric()
    values = (f.stretch_stiffness, f.bending_stiffness, f.surface_density, f.friction)
    result: tuple[torch.Tensor, torch.Tensor, torch.Tensor] = _Step.apply(
        cloth, obstacles, x, v, held_motion, *values
    )
    return result


class _Step(torch.autograd.Function):
    @staticmethod
    def forward(
        ctx: Any,
        cloth: BatchCloth,
        obstacles: Obstacles | Sequence[Obstacles] | Bodies,
        x: torch.Tensor,
        v: torch.Tensor,
        held_motion: torch.Tensor,
        *fabric: torch.Tensor | None,
    ) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
        with _on_stream(cloth):
            x_next, v_next, reaction, tape = cloth.step(
                x, v, held_motion, obstacles, fabric=Fabric(*fabric) if _given(fabric) else None
            )
        ctx.cloth, ctx.tape = cloth, tape
        # The tape shares their memory: torch then notices if they are written to before backward.
        ctx.save_for_backward(x, v, held_motion, *(f for f in fabric if f is not None))
        held = torch.as_tensor(cloth.held, dtype=torch.int64, device=reaction.device)
        return x_next, v_next, reaction[:, held]

    @staticmethod
    def backward(ctx: Any, *bars: torch.Tensor) -> tuple[Any, ...]:
        inputs = ctx.saved_tensors  # raises if one was written to since
        with _on_stream(ctx.cloth):
            g = ctx.cloth.vector_jacobian_product(
                ctx.tape, *bars, by_fabric=any(ctx.needs_input_grad[5:])
            )
        by_fabric = (g.stretch_stiffness, g.bending_stiffness, g.surface_density, g.friction)
        gradients = (None, None, g.x, g.v, g.held_motion, *by_fabric)
        needed = zip(gradients, ctx.needs_input_grad, strict=True)
        wanted = [gradient if need else None for gradient, need in needed]
        return differentiable_once(wanted, (*inputs, *bars), "torch_step")


def _given(values: Sequence[torch.Tensor | None]) -> bool:
    """Returns whether any is."""
    return any(value is not None for value in values)


@contextmanager
def _on_stream(cloth: BatchCloth) -> Iterator[None]:
    """Runs Warp on torch's current stream, so that neither reads what the other still writes."""
    if not cloth.device.is_cuda:
        yield
        return
    stream = torch.cuda.current_stream(wp.device_to_torch(cloth.device))
    with wp.ScopedStream(wp.stream_from_torch(stream)):
        yield
