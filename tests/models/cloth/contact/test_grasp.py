"""What grippers hold against bodies."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from drake_dress.models.cloth.contact.detection import find_proximity
from drake_dress.models.cloth.contact.grasp import press
from drake_dress.models.cloth.contact.obstacles import Obstacles

STIFFNESS = 2500.0
SIDE = np.repeat([0, 1], [5, 7])


def _held(rng: np.random.Generator) -> np.ndarray:
    """Returns two patches of 3 cm, half a metre apart."""
    return rng.uniform(-0.03, 0.03, (len(SIDE), 3)) + np.where(SIDE[:, None], 0.5, 0.0)


@given(st.integers(0, 10**6), st.floats(-0.05, 0.02))
def test_what_is_held_comes_out_of_a_body_and_presses_on_it(seed: int, depth: float) -> None:
    rng = np.random.default_rng(seed)
    x = _held(rng)
    # a limb that reaches `depth` over the first gripper's outermost node
    way, along = np.linalg.qr(rng.normal(size=(3, 2)))[0].T
    radius = rng.uniform(0.03, 0.08)
    # thicker or thinner at one end, the same in the middle
    taper = rng.choice([0.0, 0.03]) * np.array([[1.0, -1.0]])
    height = (x[SIDE == 0] @ way).max() + radius - depth
    middle = x[SIDE == 0].mean(axis=0)
    middle = middle + (height - middle @ way) * way
    ends = np.array([middle - 0.3 * along, middle + 0.3 * along])
    limb = Obstacles.resting(ends[:1], ends[1:], radius + taper)
    pressing = press(x, SIDE, limb, STIFFNESS)
    np.testing.assert_allclose(
        [pressing.force[SIDE == i].sum(axis=0) for i in (0, 1)],
        STIFFNESS * pressing.displacement,
        atol=1e-9,
    )
    after = x + pressing.displacement[SIDE]
    assert find_proximity(after, limb, 0.0).gap.min() > -2e-6
    np.testing.assert_array_equal(pressing.owner >= 0, np.any(pressing.force != 0.0, axis=1))
    assert not pressing.displacement[1].any()
    inside = -find_proximity(x, limb, 0.0).gap.min()
    if inside <= 0.0:
        assert not pressing.displacement.any()
    else:
        # no less than the deepest node lacks, and it is pushed out, not through
        assert np.linalg.norm(pressing.displacement[0]) >= inside - 2e-6
        rows = pressing.owner >= 0
        outward = find_proximity(x, limb, 0.0).normal[rows]
        assert np.einsum("ij,ij->i", pressing.force[rows], outward).min() > 0.0


def test_one_body_is_left_by_the_shortest_way() -> None:
    x = np.array([[0.0, 0.0, 0.04], [0.01, 0.0, 0.045], [0.5, 0.0, 0.0]])
    side = np.array([0, 0, 1])
    limb = Obstacles.resting(np.array([[0.0, -1.0, 0.0]]), np.array([[0.0, 1.0, 0.0]]), np.r_[0.05])
    pressing = press(x, side, limb, STIFFNESS)
    np.testing.assert_allclose(pressing.displacement[0], [0.0, 0.0, 0.01], atol=1e-12)
    np.testing.assert_array_equal(pressing.owner, [0, -1, -1])


def test_nothing_is_pressed_where_nobody_is() -> None:
    x = _held(np.random.default_rng(0))
    pressing = press(x, SIDE, Obstacles.none(), STIFFNESS)
    assert not pressing.displacement.any()
    assert not pressing.force.any()
