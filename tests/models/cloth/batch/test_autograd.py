"""The step as a torch function, and arrays of all three libraries."""

import numpy as np
import pytest
import torch
import warp as wp

from drake_dress.models.cloth.batch.autograd import torch_step
from drake_dress.models.cloth.batch.cloth import Fabric
from tests.models.cloth.batch.scenes import FABRICS, on_limbs


def _tensor(array: np.ndarray, device: str) -> torch.Tensor:
    return torch.tensor(array, dtype=torch.float64, device=device)


def test_backward_through_two_steps_matches_finite_differences(device: str) -> None:
    """Friction and stiffness per garment, as for finding a fabric by what it did."""
    scene = on_limbs(0.01)
    cloth = scene.cloth(device, FABRICS)
    bodies = cloth.bodies(scene.obstacles)
    state = [_tensor(a, device) for a in (scene.x, scene.v, scene.motion)]
    weight = _tensor(np.random.default_rng(3).normal(size=scene.x.shape), device)

    def loss(stretch: torch.Tensor, friction: torch.Tensor) -> torch.Tensor:
        x, v, motion = state
        fabric = Fabric(stretch_stiffness=stretch, friction=friction)
        for _ in range(2):
            x, v, _ = torch_step(cloth, x, v, motion, bodies, fabric)
        return (weight * x).sum() + 0.1 * (weight * v).sum()

    values = [
        _tensor(np.array([getattr(m, name) for m in FABRICS]), device).requires_grad_()
        for name in ("stretch_stiffness", "friction")
    ]
    loss(*values).backward()
    for i, value in enumerate(values):
        small = 1e-6 * value.detach()
        ends = []
        for sign in (1.0, -1.0):
            at = [w.detach() for w in values]
            at[i] = at[i] + sign * small
            ends.append(float(loss(*at)))
        assert value.grad is not None
        exact = float((value.grad * small).sum())
        assert exact == pytest.approx(0.5 * (ends[0] - ends[1]), rel=1e-3)


def test_backward_is_the_adjoint_of_the_step(device: str) -> None:
    scene = on_limbs(0.02)
    cloth = scene.cloth(device)
    leaves = [_tensor(a, device).requires_grad_() for a in (scene.x, scene.v, scene.motion)]
    outputs = torch_step(cloth, *leaves, scene.obstacles)
    rng = np.random.default_rng(6)
    bars = [rng.normal(size=tuple(o.shape)) for o in outputs]
    torch.autograd.backward(outputs, [_tensor(b, device) for b in bars])
    *_, tape = cloth.step(scene.x, scene.v, scene.motion, scene.obstacles)
    expected = cloth.vector_jacobian_product(tape, *bars)
    for leaf, slope in zip(leaves, (expected.x, expected.v, expected.held_motion), strict=True):
        assert leaf.grad is not None
        np.testing.assert_array_equal(leaf.grad.cpu().numpy(), slope)


def _leaves(scene, device: str) -> list[torch.Tensor]:  # type: ignore[no-untyped-def]
    """State, motion, and a stretch stiffness of each garment."""
    stiffness = np.array([m.stretch_stiffness for m in FABRICS])
    arrays = (scene.x, scene.v, scene.motion, stiffness)
    return [_tensor(a, device).requires_grad_() for a in arrays]


@pytest.mark.parametrize("which", range(4))
def test_an_input_written_to_before_backward_is_noticed(device: str, which: int) -> None:
    scene = on_limbs(0.02)
    leaves = _leaves(scene, device)
    x1, *_ = torch_step(
        scene.cloth(device, FABRICS), *leaves[:3], scene.obstacles, Fabric(leaves[3])
    )
    with torch.no_grad():
        leaves[which] += 1.0
    with pytest.raises(RuntimeError, match="modified by an inplace operation"):
        x1.sum().backward()


def test_the_adjoint_of_a_step_notices_tensors_written_to(device: str) -> None:
    scene = on_limbs(0.02)
    cloth = scene.cloth(device)
    x, v, motion = (_tensor(a, device) for a in (scene.x, scene.v, scene.motion))
    *_, tape = cloth.step(x, v, motion, scene.obstacles)
    bars = [torch.ones_like(t) for t in (x, v, motion)]
    cloth.vector_jacobian_product(tape, *bars)
    v.mul_(2.0)
    with pytest.raises(RuntimeError, match="v was modified by an inplace operation"):
        cloth.vector_jacobian_product(tape, *bars)


def test_steps_and_writes_to_results_do_not_change_an_earlier_gradient(device: str) -> None:
    scene = on_limbs(0.02)
    cloth = scene.cloth(device, FABRICS)
    leaves = _leaves(scene, device)
    found = []
    for disturbed in (False, True):
        results = torch_step(cloth, *leaves[:3], scene.obstacles, Fabric(leaves[3]))
        loss = sum(r.sum() for r in results)
        if disturbed:
            copies = [t.detach().clone() + 0.001 for t in leaves[:3]]
            torch_step(cloth, *copies, scene.obstacles)
            for array in (*copies, *results):
                array.detach().fill_(7.0)
        found.append(torch.autograd.grad(loss, leaves))
    for calm, after in zip(*found, strict=True):
        assert torch.equal(calm, after)


@pytest.mark.parametrize("which", range(4))
def test_a_second_derivative_is_refused(device: str, which: int) -> None:
    """Also where what comes in, here that of a sum, needs no gradient of its own."""
    scene = on_limbs(0.02)
    leaves = _leaves(scene, device)
    x1, *_ = torch_step(
        scene.cloth(device, FABRICS), *leaves[:3], scene.obstacles, Fabric(leaves[3])
    )
    (slope,) = torch.autograd.grad(x1.sum(), leaves[which], create_graph=True)
    penalty = (slope**2).sum() + (leaves[which] ** 2).sum()
    with pytest.raises(RuntimeError, match="torch_step has no second derivative"):
        penalty.backward()


def test_arrays_of_all_libraries_give_the_same_and_share_their_memory(device: str) -> None:
    scene = on_limbs(0.02)
    cloth = scene.cloth(device)
    inputs = (scene.x, scene.v, scene.motion)
    numpy_x, *_ = cloth.step(*inputs, scene.obstacles)
    tensors = [_tensor(a, device) for a in inputs]
    torch_x, _, _, tape = cloth.step(*tensors, scene.obstacles)
    assert tape.x.ptr == tensors[0].data_ptr()
    assert torch_x.shape == scene.x.shape
    arrays = [wp.array(a, dtype=wp.vec3d, device=cloth.device) for a in inputs]
    warp_x, _, _, tape = cloth.step(*arrays, scene.obstacles)
    assert tape.x is arrays[0]
    assert isinstance(warp_x, wp.array)
    np.testing.assert_array_equal(torch_x.cpu().numpy(), numpy_x)
    np.testing.assert_array_equal(warp_x.numpy(), numpy_x)


def test_single_precision_is_refused(device: str) -> None:
    scene = on_limbs(0.02)
    x, v, motion = (_tensor(a, device).float() for a in (scene.x, scene.v, scene.motion))
    with pytest.raises(ValueError, match=r"x is torch.float32, expected torch.float64"):
        scene.cloth(device).step(x, v, motion, scene.obstacles)
