"""Where links are, and how they move: against finite differences and known poses."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from drake_dress.models.arm.chain import moved_by, rotation_error
from drake_dress.models.arm.panda import FINGERTIPS, FLANGE, LIMITS, panda

ARM = panda(np.eye(4))


def drawn(seed: int) -> np.ndarray:
    return np.random.default_rng(seed).uniform(LIMITS.lower, LIMITS.upper)


def rotation(seed: int, angle: float | None = None) -> tuple[np.ndarray, np.ndarray]:
    """Returns a rotation vector and its matrix."""
    rng = np.random.default_rng(seed)
    axis = rng.normal(size=3)
    axis /= np.linalg.norm(axis)
    angle = rng.uniform(0.0, np.pi) if angle is None else angle
    k = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    return angle * axis, np.eye(3) + np.sin(angle) * k + (1.0 - np.cos(angle)) * k @ k


def test_stretched_upward_it_is_as_high_as_its_maker_says() -> None:
    flange = ARM.links(np.zeros(7))[-2] @ np.array([0.0, 0.0, FLANGE, 1.0])
    np.testing.assert_allclose(flange[:3], [0.088, 0.0, 0.333 + 0.316 + 0.384 - FLANGE], atol=1e-12)
    down = ARM.links(np.zeros(7))[-1]
    np.testing.assert_allclose(down[:3, 2], [0.0, 0.0, -1.0], atol=1e-12)
    np.testing.assert_allclose(down[2, 3], flange[2] - FINGERTIPS, atol=1e-12)


@given(seed=st.integers(0, 2**31))
def test_the_jacobian_is_what_finite_differences_say(seed: int) -> None:
    q, e = drawn(seed), 1e-6
    links = ARM.links(q)
    jacobian = ARM.tool_jacobian(links)
    for j in range(7):
        ahead, behind = (ARM.links(q + s * e * np.eye(7)[j])[-1] for s in (1.0, -1.0))
        np.testing.assert_allclose(
            jacobian[:3, j], (ahead[:3, 3] - behind[:3, 3]) / (2 * e), atol=1e-8
        )
        turned = rotation_error(behind[:3, :3], ahead[:3, :3]) / (2 * e)
        np.testing.assert_allclose(jacobian[3:, j], turned, atol=1e-8)


def test_a_point_moves_with_the_joints_before_it_alone() -> None:
    q = drawn(3)
    links = ARM.links(q)
    owner = np.arange(8)
    points = links[owner, :3, 3] + [0.03, -0.02, 0.05]
    moved = np.zeros((len(owner), 3, 7))
    for k, i in enumerate(owner):
        moved_by(links, points[k], i, moved[k])
        assert (moved[k, :, i:] == 0.0).all()
    local = np.linalg.inv(links[4]) @ np.append(points[4], 1.0)
    e = 1e-6
    ahead = (ARM.links(q + e * np.eye(7)[1])[4] @ local)[:3]
    behind = (ARM.links(q - e * np.eye(7)[1])[4] @ local)[:3]
    np.testing.assert_allclose(moved[4, :, 1], (ahead - behind) / (2 * e), atol=1e-8)


def test_where_it_stands_moves_all_of_it() -> None:
    _, r = rotation(5)
    base = np.eye(4)
    base[:3, :3], base[:3, 3] = r, [1.0, -2.0, 0.5]
    q = drawn(1)
    np.testing.assert_allclose(panda(base).links(q), base @ ARM.links(q), atol=1e-12)


@given(seed=st.integers(0, 2**31), angle=st.sampled_from([None, 0.0, 1e-9, np.pi - 1e-7, np.pi]))
def test_a_rotation_error_is_the_way_there(seed: int, angle: float | None) -> None:
    _, start = rotation(seed + 1)
    vector, turn = rotation(seed, angle)
    found = rotation_error(start, turn @ start)
    if angle is not None and angle > 3.0:
        # half a turn, either way round
        vector = vector * np.sign(vector @ found)
    np.testing.assert_allclose(found, vector, atol=1e-6)
