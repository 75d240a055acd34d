"""A tape around a limb or a section of the trunk is as long as the girth."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial import ConvexHull

from drake_dress.models.human.girths import TRUNK_GIRTHS, girth_of, radius_of, section_of
from drake_dress.models.human.measures import BodyMeasures

SIZES = st.floats(0.08, 0.7)


@given(SIZES, SIZES)
def test_girth_is_the_length_of_the_hull_of_the_circles(width: float, depth: float) -> None:
    angle = np.linspace(0.0, 2.0 * np.pi, 720, endpoint=False)
    radius = 0.5 * min(width, depth)
    circle = radius * np.column_stack([np.cos(angle), np.sin(angle)])
    off = np.array([0.5 * depth - radius, 0.5 * width - radius])
    hull = ConvexHull(np.concatenate([circle - off, circle, circle + off]))
    # the area of a hull in the plane is its perimeter
    assert girth_of(width, depth) == pytest.approx(hull.area, rel=1e-4)


@given(SIZES, SIZES)
def test_width_follows_from_girth_and_depth(width: float, depth: float) -> None:
    found = section_of(girth_of(width, depth), depth, 0.6)
    assert found == pytest.approx((width, depth), abs=1e-9)


@given(st.floats(0.4, 2.0), st.sampled_from(sorted(TRUNK_GIRTHS)))
def test_depth_is_a_share_of_the_width_where_it_is_not_given(girth: float, name: str) -> None:
    width, depth = section_of(girth, None, TRUNK_GIRTHS[name])
    assert girth_of(width, depth) == pytest.approx(girth)
    assert depth == pytest.approx(TRUNK_GIRTHS[name] * width)


def test_chest_of_the_default_person_has_the_proportion_of_chests() -> None:
    m = BodyMeasures()
    girth = girth_of(m.chest_width, m.chest_depth)
    sizes = section_of(girth, None, TRUNK_GIRTHS["chest_girth"])
    assert sizes == pytest.approx((m.chest_width, m.chest_depth))


def test_radius_of_a_circle() -> None:
    assert radius_of(2.0 * np.pi) == pytest.approx(1.0)


def test_girth_too_small_for_its_depth_is_told() -> None:
    with pytest.raises(ValueError, match="more than twice the depth"):
        section_of(0.4, 0.2, 0.6)
