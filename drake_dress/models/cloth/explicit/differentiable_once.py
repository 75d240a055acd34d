"""Gradients that raise an error when they are differentiated again.

`torch.autograd.function.once_differentiable` raises only if the incoming gradient itself needs a
gradient. After `x1.sum()` it does not, and a second derivative is then silently left out. Here the
returned gradient always depends on the inputs of the step, through a function whose backward pass
raises.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import torch


def differentiable_once(
    gradients: Sequence[torch.Tensor | None],
    inputs: Sequence[torch.Tensor],
    name: str,
) -> tuple[torch.Tensor | None, ...]:
    """Returns `gradients`; a derivative of them raises RuntimeError.

    Call it at the end of a backward pass that is not made of torch functions.

    Args:
        gradients: those of the forward pass's inputs, None for inputs without one.
        inputs: whatever the gradients depend on: saved inputs, incoming gradients.
        name: name of the function, for the error.
    """
    if not torch.is_grad_enabled():
        return tuple(gradients)
    given = [g for g in gradients if g is not None]
    guarded = iter(_Once.apply(name, len(given), *given, *inputs))
    return tuple(None if g is None else next(guarded) for g in gradients)


class _Once(torch.autograd.Function):
    @staticmethod
    def forward(
        ctx: Any, name: str, count: int, *tensors: torch.Tensor
    ) -> tuple[torch.Tensor, ...]:
        ctx.name = name
        return tuple(t.view_as(t) for t in tensors[:count])

    @staticmethod
    def backward(ctx: Any, *bars: torch.Tensor) -> Any:
        raise RuntimeError(
            f"{ctx.name} has no second derivative: its gradient cannot be differentiated again"
        )
