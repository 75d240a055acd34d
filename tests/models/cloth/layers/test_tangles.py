"""What has crossed is found, and led back."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drake_dress.models.arrays import FloatArray
from drake_dress.models.cloth.contact.obstacles import Obstacles
from drake_dress.models.cloth.elements import Elements, make_elements
from drake_dress.models.cloth.implicit.implicit_cloth import ImplicitCloth
from drake_dress.models.cloth.layered import LayeredCloth
from drake_dress.models.cloth.layers.neighbours import Passing
from drake_dress.models.cloth.layers.piercing import piercing_edges
from drake_dress.models.cloth.layers.separation import LayerSeparation
from drake_dress.models.cloth.layers.tangles import Tangles
from drake_dress.models.cloth.material import Material
from drake_dress.models.cloth.state import ClothState
from tests.models.cloth.layers.scenes import two_sheets
from tests.models.cloth.sheets import sheet

H = 0.01


def crossing_sheets(seed: int) -> tuple[FloatArray, Elements]:
    """Returns two uneven sheets, one upright, that stands in the other one up to a random depth."""
    rng = np.random.default_rng(seed)
    lying, faces = sheet(7, 7, 0.02)
    lying = lying - lying.mean(axis=0)
    turn = rng.uniform(0.0, np.pi)
    along, up = np.array([np.cos(turn), np.sin(turn), 0.0]), np.array([0.0, 0.0, 1.0])
    lean = up + rng.uniform(-0.4, 0.4) * np.cross(up, along) + rng.uniform(-0.3, 0.3) * along
    standing = 0.5 * (lying[:, :1] * along + lying[:, 1:2] * lean)
    standing += [*rng.uniform(-0.04, 0.04, 2), rng.uniform(-0.02, 0.02)]
    x = np.vstack([lying, standing]) + rng.normal(scale=1e-3, size=(2 * len(lying), 3))
    return x, make_elements(x, np.vstack([faces, faces + len(lying)]))


def line_length(x: FloatArray, e: Elements) -> float:
    """Returns the length, m, of the line along which triangles meet, pair by pair."""
    at: dict[tuple[int, int], list[FloatArray]] = {}
    around: dict[tuple[int, int], list[int]] = {}
    for t, nodes in enumerate(e.triangle.tolist()):
        for a, b in itertools.combinations(sorted(nodes), 2):
            around.setdefault((a, b), []).append(t)
    for k, t in piercing_edges(x, e):
        p, q = x[e.edge[k]]
        a, b, c = x[e.triangle[t]]
        normal = np.cross(b - a, c - a)
        point = p + (q - p) * (normal @ (a - p)) / (normal @ (q - p))
        for own in around[tuple(sorted(e.edge[k].tolist()))]:
            at.setdefault((min(own, t), max(own, t)), []).append(point)
    assert all(len(points) == 2 for points in at.values())
    return float(sum(np.linalg.norm(p - q) for p, q in at.values()))


@settings(max_examples=60)
@given(st.integers(0, 10**6))
def test_edges_go_where_the_line_along_which_layers_meet_becomes_shorter(seed: int) -> None:
    """By as much as it does when one layer is moved as a whole."""
    x, e = crossing_sheets(seed)
    tangles, standing = Tangles(e), np.arange(len(x)) >= len(x) // 2
    tangled = tangles.everywhere(x)
    assert tangled.any() == (line_length(x, e) > 0.0)
    tangle = tangles.at(x, tangled)
    by_translation, steepest = np.zeros(3), 0.0
    for k, t in zip(tangle.edge, tangle.triangle, strict=True):
        weights, way = tangles.meeting(x, int(k), int(t))
        node = np.concatenate([e.edge[k], e.triangle[t]])
        np.testing.assert_allclose(weights @ x[node], 0.0, atol=1e-12)
        by_translation += way if standing[e.edge[k, 0]] else -way
        steepest = max(steepest, float(np.linalg.norm(way)))
    step = 1e-7
    for axis in np.eye(3):
        there, back = (x + s * step * np.outer(standing, axis) for s in (1.0, -1.0))
        change = (line_length(there, e) - line_length(back, e)) / (2.0 * step)
        assert change == pytest.approx(-by_translation @ axis, abs=1e-4 * (1.0 + steepest**2))


@pytest.mark.parametrize("pushed", ["corner", "border", "middle"])
def test_a_sheet_that_was_pushed_through_another_comes_out(pushed: str) -> None:
    x, e, rim, upper = two_sheets(9, 0.03, 0.006)
    x[upper, :2] -= 0.015  # within the rim, all of it
    place = np.stack(np.divmod(upper - upper[0], 9), axis=1)
    centre = {"corner": (8, 8), "border": (8, 4), "middle": (4, 4)}[pushed]
    start = x.copy()
    start[upper[np.abs(place - centre).max(axis=1) <= 1], 2] -= 0.02
    assert len(piercing_edges(start, e, 1)) > 8
    material, still = Material(damping=0.01), np.zeros((len(rim), 3))
    crossed, energy = {}, []
    for led_back in (True, False):
        cloth = LayeredCloth(ImplicitCloth(e, material, H, rim))
        state = ClothState.at_rest(start)
        if led_back:
            state.tangled[:] = Tangles(e).everywhere(start)
        for _ in range(80):
            state, _ = cloth.step(state, Obstacles.none(), still)
            found = np.zeros(len(x), dtype=np.bool_)
            if led_back:
                for k, t in piercing_edges(state.x, e, 1):
                    found[e.edge[k]] = found[e.triangle[t]] = True
                np.testing.assert_array_equal(state.tangled, found)
            energy.append(float(0.5 * cloth.mass @ (state.v**2).sum(axis=1)))
        crossed[led_back] = len(piercing_edges(state.x, e, 1))
        assert state.tangled.any() == (led_back and crossed[True] > 0)
    assert crossed[True] == 0
    assert crossed[False] > 0
    # no more than from falling 3 cm
    assert max(energy) < 9.81 * 0.03 * cloth.mass.sum()


def test_only_who_may_pass_does() -> None:
    x, e, _, upper = two_sheets(9, 0.03, 0.006)
    x[upper] += [0.0, 0.0, 2e-3] * np.sin(np.arange(len(upper)))[:, None]
    dx = np.zeros_like(x)
    dx[upper, 2] = -0.006
    w, layers = np.ones(len(x)), LayerSeparation(e)
    nobody, all_upper = np.zeros(len(x), dtype=np.bool_), np.isin(np.arange(len(x)), upper)
    assert len(piercing_edges(x + dx, e)) > 0
    for passing in (
        None,
        Passing(nobody, nobody, ~nobody),
        Passing(all_upper, nobody, ~nobody),
        Passing(nobody, all_upper, all_upper),
    ):
        after, _ = layers.correct(x, dx, w, passing=passing)
        assert len(piercing_edges(x + after, e)) == 0
    for passing in (Passing(~nobody, nobody, nobody), Passing(nobody, all_upper, ~nobody)):
        after, record = layers.correct(x, dx, w, passing=passing)
        np.testing.assert_array_equal(after, dx)
        assert record.pairs == 0


def test_what_is_led_back_keeps_momentum_and_what_holds_it() -> None:
    x, e = next(s for s in map(crossing_sheets, range(100)) if len(piercing_edges(*s)) > 4)
    tangles = Tangles(e)
    tangled = tangles.everywhere(x)
    tangle, still = tangles.at(x, tangled), np.zeros_like(x)
    pairs = LayerSeparation(e).pairs(x, still, 0.01)
    rng = np.random.default_rng(0)
    mass, step = rng.uniform(0.5, 2.0, len(x)), 1e-3
    way = tangles.lead_back(tangle, x, still, 1.0 / mass, still, pairs, step)
    assert way[tangled].any()
    assert np.abs(way).max() < 10.0 * step
    np.testing.assert_allclose(mass @ way, 0.0, atol=1e-15)
    held, lying = np.flatnonzero(tangled)[:3], np.flatnonzero(tangled)[3:6]
    w, barred = 1.0 / mass, np.zeros_like(x)
    w[held] = 0.0
    barred[lying] = [0.0, 0.6, 0.8]
    way = tangles.lead_back(tangle, x, still, w, barred, pairs, step)
    np.testing.assert_array_equal(way[held], 0.0)
    np.testing.assert_allclose(way[lying] @ [0.0, 0.6, 0.8], 0.0, atol=1e-15)
    assert way.any()


def test_who_is_astray_is_cut_off_by_what_pierces() -> None:
    x, e, _, upper = two_sheets(9, 0.03, 0.006)
    x[upper, :2] -= 0.015
    place = np.stack(np.divmod(upper - upper[0], 9), axis=1)
    through = upper[(place >= 6).all(axis=1)]
    x[through, 2] -= 0.02
    tangles = Tangles(e)
    tangle = tangles.at(x, tangles.everywhere(x))
    np.testing.assert_array_equal(np.flatnonzero(tangle.passing.astray), through)
    assert not tangles.at(x, np.zeros(len(x), dtype=np.bool_)).passing.astray.any()


@settings(max_examples=15)
@given(st.integers(0, 10**6))
def test_what_is_led_back_is_not_thrown(seed: int) -> None:
    """With nodes held anywhere in the tangle; nothing moves at first, and nothing falls."""
    x, e = crossing_sheets(seed)
    tangled = Tangles(e).everywhere(x)
    rng = np.random.default_rng(seed)
    held = np.sort(rng.choice(len(x), 12, replace=False)).astype(np.int32)
    plain = ImplicitCloth(e, Material(damping=0.01), H, held, gravity=np.zeros(3))
    cloth, state = LayeredCloth(plain), ClothState.at_rest(x)
    state.tangled[:] = tangled
    fastest = 0.0
    for _ in range(40):
        state, _ = cloth.step(state, Obstacles.none(), np.zeros((len(held), 3)))
        fastest = max(fastest, float(np.linalg.norm(state.v, axis=1).max()))
    # what was pinched gives way faster than the few centimetres a second that it is led at
    assert fastest < 1.5
    assert (fastest > 0.0) == bool(tangled.any())
