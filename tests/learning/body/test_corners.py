import numpy as np
import pytest

from drake_dress.learning.body.corners import corner_shapes
from drake_dress.models.human.skin.macro import Macro, corner_weights
from tests.learning.body.model import small_model


def test_corner_sums_up_all_shapes_that_have_their_whole_weight_there() -> None:
    source = small_model()
    shape = dict(zip(source.labels, source.shapes, strict=True))
    corners = corner_shapes(source)
    name = "female-young-averagemuscle-maxweight"
    expected = shape[f"universal:{name}"] + shape[f"breast:{name}-averagecup-averagefirmness"]
    expected += sum(
        shape[f"race:{origin}-female-young"] / 3 for origin in ("african", "asian", "caucasian")
    )
    for kind, ends in (("height", ("min", "max")), ("proportions", ("ideal", "uncommon"))):
        low, high = (shape[f"{kind}:{name}-{end}{kind}"] for end in ends)
        expected += 0.5 * (low + high)
        assert corners[kind][1, 2, 1, 2] == pytest.approx(high - low)
    assert corners["base"][1, 2, 1, 2] == pytest.approx(expected)


def test_babies_have_no_proportions() -> None:
    assert not corner_shapes(small_model())["proportions"][:, 0].any()


def test_shapes_interpolate_between_corners() -> None:
    base = corner_shapes(small_model())["base"]
    between = np.tensordot(corner_weights(Macro(0.0, 2.0 / 3.0, 0.5, 0.75)), base, 4)
    assert between == pytest.approx(0.5 * (base[0, 2, 1, 1] + base[0, 2, 1, 2]))
