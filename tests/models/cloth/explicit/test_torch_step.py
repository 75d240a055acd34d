from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
import torch

from drake_dress.models.cloth.contact.obstacles import Obstacles
from drake_dress.models.cloth.explicit.explicit_bias import (
    INNER,
    ExplicitBiasCloth,
    ExplicitSettings,
)
from drake_dress.models.cloth.explicit.torch_step import MATERIAL as NAMES
from drake_dress.models.cloth.explicit.torch_step import cloth_step, material_tensor
from tests.models.cloth.explicit.inner.test_inner import HELD, MATERIAL, draped, limb, make
from tests.present import present


def _scene() -> tuple[ExplicitBiasCloth, torch.Tensor, torch.Tensor, torch.Tensor]:
    e, x, v, motion = draped(0.02)
    cloth = ExplicitBiasCloth(e, MATERIAL, 0.02, HELD, settings=ExplicitSettings(tolerance=1e-12))
    return cloth, torch.from_numpy(x), torch.from_numpy(v), torch.from_numpy(motion)


def test_torch_gradient_is_that_of_the_adjoint() -> None:
    """Through two steps, by state, grippers, bodies and material."""
    cloth, x, v, motion = _scene()
    bodies = torch.zeros((2, 4, 3), dtype=torch.float64)
    material = material_tensor(MATERIAL)
    inputs = [x, v, motion, bodies, material]
    for t in inputs:
        t.requires_grad_(True)
    x1, v1, _ = cloth_step(cloth, x, v, motion, limb(), bodies, material)
    x2, v2, r2 = cloth_step(cloth, x1, v1, motion, limb(), bodies, material)
    weight = torch.from_numpy(np.random.default_rng(2).normal(size=tuple(x.shape)))
    ((weight * x2).sum() + 0.01 * (weight * v2).sum() + 1e-3 * r2.sum()).backward()

    a = [t.detach().numpy() for t in inputs]
    y1, u1, _, first = cloth.step(a[0], a[1], a[2], limb())
    _, _, _, second = cloth.step(y1, u1, a[2], limb())
    w = weight.numpy()
    g2 = cloth.vector_jacobian_product(second, w, 0.01 * w, np.full((4, 3), 1e-3), True)
    g1 = cloth.vector_jacobian_product(first, g2.x, g2.v, np.zeros((4, 3)), True)
    for found, expected in (
        (x.grad, g1.x),
        (v.grad, g1.v),
        (motion.grad, g1.held_motion + g2.held_motion),
        (present(bodies.grad)[:, 1], g1.rotation + g2.rotation),
        (material.grad, [g1.material[n] + g2.material[n] for n in NAMES]),
    ):
        np.testing.assert_allclose(present(found).numpy(), expected, rtol=1e-12, atol=1e-15)


def test_displaced_bodies_are_where_they_are_said_to_be() -> None:
    cloth, x, v, motion = _scene()
    bodies = torch.zeros((2, 4, 3), dtype=torch.float64)
    bodies[:, 0, 2] = 0.004
    moved, _, _ = cloth_step(cloth, x, v, motion, limb(), bodies)
    expected, *_ = cloth.step(x.numpy(), v.numpy(), motion.numpy(), limb().moved(bodies.numpy()))
    np.testing.assert_array_equal(moved.numpy(), expected)


def test_wrong_tensors_are_refused() -> None:
    cloth, x, v, motion = _scene()
    with pytest.raises(ValueError, match=r"x is torch\.float32, expected torch\.float64"):
        cloth_step(cloth, x.float(), v, motion, limb())
    with pytest.raises(ValueError, match=r"material has shape \(4,\), expected \(5,\)"):
        cloth_step(cloth, x, v, motion, limb(), material=torch.ones(4, dtype=torch.float64))
    wrong = material_tensor(MATERIAL)
    wrong[NAMES.index("stretch_stiffness")] = -1.0
    with pytest.raises(ValueError, match="stretch_stiffness is -1"):
        cloth_step(cloth, x, v, motion, limb(), material=wrong)


def test_a_fabric_of_other_values_is_what_a_cloth_made_with_them_is() -> None:
    cloth, x, v, motion = _scene()
    other = (1.1 * material_tensor(MATERIAL)).requires_grad_()
    x1, _, _ = cloth_step(cloth, x, v, motion, limb(), material=other)
    x1.square().sum().backward()
    fabric = dict(zip(NAMES, other.tolist(), strict=True))
    made = cloth.with_material(replace(MATERIAL, **fabric))
    expected, _, _, tape = made.step(x.numpy(), v.numpy(), motion.numpy(), limb())
    np.testing.assert_array_equal(x1.detach().numpy(), expected)
    bar = 2.0 * expected
    g = made.vector_jacobian_product(tape, bar, np.zeros_like(bar), np.zeros((4, 3)), True)
    np.testing.assert_allclose(
        present(other.grad).numpy(), [g.material[n] for n in NAMES], rtol=1e-12
    )


def _leaves() -> tuple[ExplicitBiasCloth, list[torch.Tensor]]:
    """x, v, motion, bodies, material."""
    cloth, x, v, motion = _scene()
    bodies = torch.zeros((2, 4, 3), dtype=torch.float64)
    material = material_tensor(MATERIAL)
    return cloth, [t.requires_grad_() for t in (x, v, motion, bodies, material)]


def _run(
    cloth: ExplicitBiasCloth, leaves: Sequence[torch.Tensor], obstacles: Obstacles
) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
    x, v, motion, bodies, material = leaves
    return cloth_step(cloth, x, v, motion, obstacles, bodies, material)


@pytest.mark.parametrize("which", range(5))
def test_an_input_written_to_before_backward_is_noticed(which: int) -> None:
    cloth, leaves = _leaves()
    x1, _, _ = _run(cloth, leaves, limb())
    with torch.no_grad():
        leaves[which].mul_(1.5)
    with pytest.raises(RuntimeError, match="modified by an inplace operation"):
        x1.sum().backward()


@pytest.mark.parametrize("inner", INNER)
def test_what_is_written_elsewhere_does_not_change_a_gradient(inner: str) -> None:
    """Not to results, nor to obstacles, nor to memory behind torch's back, nor by other steps."""
    _, leaves = _leaves()
    e, *_ = draped(0.02)
    cloth = make(e, 0.02, inner, {"stationary": 3, "conjugate_gradients": 20}.get(inner, 1))
    if inner == "stationary":  # has no derivative where nodes slip
        leaves[0] = (leaves[0].detach() + 10.0).requires_grad_()
    found = []
    for disturbed in (False, True):
        obstacles = limb()
        results = _run(cloth, leaves, obstacles)
        loss = results[0].sum() + results[1].sum() + results[2].sum()
        before = [t.detach().clone() for t in leaves]
        if disturbed:
            other = [(t.detach() + 0.001).requires_grad_() for t in leaves[:3]]
            x, v, motion = other
            cloth_step(cloth, x, v, motion, limb())[0].sum().backward()
            for array in (obstacles.a, obstacles.b, obstacles.velocity, obstacles.angular_velocity):
                array += 0.01
            for tensor in (*leaves, *results):
                tensor.detach().numpy()[...] = 7.0
        found.append(torch.autograd.grad(loss, leaves))
        for tensor, old in zip(leaves, before, strict=True):
            tensor.detach().numpy()[...] = old.numpy()
    for calm, after in zip(*found, strict=True):
        assert torch.equal(calm, after)


@pytest.mark.parametrize("which", range(5))
def test_a_second_derivative_is_refused(which: int) -> None:
    """Also where what comes in, here that of a sum, needs no gradient of its own."""
    cloth, leaves = _leaves()
    x1, _, _ = _run(cloth, leaves, limb())
    (slope,) = torch.autograd.grad(x1.sum(), leaves[which], create_graph=True)
    penalty = (slope**2).sum() + (leaves[which] ** 2).sum()
    with pytest.raises(RuntimeError, match="cloth_step has no second derivative"):
        penalty.backward()
