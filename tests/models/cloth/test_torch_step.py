import numpy as np
import pytest
import torch

from drake_dress.models.cloth.explicit_bias import ExplicitBiasCloth
from drake_dress.models.cloth.torch_step import MATERIAL as NAMES
from drake_dress.models.cloth.torch_step import cloth_step
from tests.models.cloth.inner.test_inner import HELD, MATERIAL, draped, limb


def _scene():  # type: ignore[no-untyped-def]
    e, x, v, motion = draped(0.02)
    cloth = ExplicitBiasCloth(e, MATERIAL, 0.02, HELD, tolerance=1e-12)
    return cloth, *(torch.from_numpy(a) for a in (x, v, motion))


def test_torch_gradient_is_that_of_the_adjoint() -> None:
    """Through two steps, by state, grippers, bodies and material."""
    cloth, x, v, motion = _scene()
    bodies = torch.zeros((2, 4, 3), dtype=torch.float64)
    material = torch.tensor([getattr(MATERIAL, n) for n in NAMES], dtype=torch.float64)
    inputs = [x, v, motion, bodies, material]
    for t in inputs:
        t.requires_grad_(True)
    x1, v1, _ = cloth_step(cloth, x, v, motion, limb(), bodies, material)
    x2, v2, r2 = cloth_step(cloth, x1, v1, motion, limb(), bodies, material)
    weight = torch.from_numpy(np.random.default_rng(2).normal(size=tuple(x.shape)))
    ((weight * x2).sum() + 0.01 * (weight * v2).sum() + 1e-3 * r2.sum()).backward()

    a = [t.detach().numpy() for t in inputs]
    y1, u1, _, first = cloth.step(a[0], a[1], a[2], limb())
    _, _, r, second = cloth.step(y1, u1, a[2], limb())
    w = weight.numpy()
    g2 = cloth.vector_jacobian_product(second, w, 0.01 * w, np.full((4, 3), 1e-3), True)
    g1 = cloth.vector_jacobian_product(first, g2.x, g2.v, np.zeros((4, 3)), True)
    for found, expected in (
        (x.grad, g1.x),
        (v.grad, g1.v),
        (motion.grad, g1.held_motion + g2.held_motion),
        (bodies.grad[:, 1], g1.rotation + g2.rotation),
        (material.grad, [g1.material[n] + g2.material[n] for n in NAMES]),
    ):
        np.testing.assert_allclose(found.numpy(), expected, rtol=1e-12, atol=1e-15)


def test_displaced_bodies_are_where_they_are_said_to_be() -> None:
    cloth, x, v, motion = _scene()
    bodies = torch.zeros((2, 4, 3), dtype=torch.float64)
    bodies[:, 0, 2] = 0.004
    moved, _, _ = cloth_step(cloth, x, v, motion, limb(), bodies)
    expected, *_ = cloth.step(x.numpy(), v.numpy(), motion.numpy(), limb().moved(bodies.numpy()))
    np.testing.assert_array_equal(moved.numpy(), expected)


def test_wrong_tensors_are_refused() -> None:
    cloth, x, v, motion = _scene()
    with pytest.raises(ValueError, match="x is torch.float32, expected torch.float64"):
        cloth_step(cloth, x.float(), v, motion, limb())
    other = torch.tensor([getattr(MATERIAL, n) for n in NAMES], dtype=torch.float64) * 1.1
    with pytest.raises(ValueError, match="the cloth was made with"):
        cloth_step(cloth, x, v, motion, limb(), material=other)
