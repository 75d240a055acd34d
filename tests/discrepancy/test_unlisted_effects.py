"""Effects that only generated data have: they do what they say, and no list knows them."""

from pathlib import Path

import numpy as np
import pytest

from drake_dress.diagrams.garment import build_garment
from drake_dress.discrepancy.hidden_effect import ALL_SIZES, SIZES, draw_hidden
from drake_dress.discrepancy.unlisted_effects import UNLISTED, MagnetisedCuff, SlidingLayer, Snag
from drake_dress.models.cloth.elements import make_elements
from drake_dress.models.effects.effect import Sheet
from drake_dress.models.effects.registry import EFFECTS
from drake_dress.models.garment.grain import grain
from tests.discrepancy.data import quick_scenario


@pytest.fixture(scope="module")
def sheet() -> Sheet:
    mesh = build_garment(quick_scenario().garment, 0.06, Path("."))
    return Sheet(make_elements(mesh.rest_position, mesh.faces), mesh.rest_position, grain(mesh))


def test_what_explains_does_not_know_them() -> None:
    assert not set(UNLISTED) & set(EFFECTS)
    assert set(ALL_SIZES) == set(SIZES) | set(UNLISTED)
    assert set(SIZES) == set(EFFECTS)
    drawn = [draw_hidden("random", np.random.default_rng(k)) for k in range(80)]
    assert {e.NAME for effects in drawn for e in effects} <= set(EFFECTS)
    assert [] in drawn


def test_a_magnet_pulls_the_cuff_to_its_post_and_harder_when_near(sheet: Sheet) -> None:
    x = sheet.rest_position
    magnet = MagnetisedCuff(strength=2.0, x=0.0, y=0.3, z=-0.2)
    force = magnet.apply(sheet, x, np.zeros_like(x))
    pulled = np.flatnonzero(force.any(axis=1))
    assert 0 < len(pulled) < 0.1 * len(x)
    top = x[np.argmax(x[:, 2] + 0.01 * x[:, 1])]
    away = top + [0.0, 0.3, -0.2] - x[pulled].mean(axis=0)
    total = force.sum(axis=0)
    assert np.dot(total, away) > 0.999 * np.linalg.norm(total) * np.linalg.norm(away)
    nearer = x.copy()
    nearer[pulled] += 0.3 * away
    closer = magnet.apply(sheet, nearer, np.zeros_like(x)).sum(axis=0)
    grown = np.linalg.norm(closer) / np.linalg.norm(total)
    far = float(np.linalg.norm(away))
    near = 0.7 * far
    assert grown == pytest.approx((max(far, 0.08) / max(near, 0.08)) ** 3, rel=1e-6)


def test_a_snag_holds_what_is_near_and_nothing_else(sheet: Sheet) -> None:
    x = sheet.rest_position
    place = x[10] + [0.01, 0.0, 0.0]
    snag = Snag(stiffness=20.0, radius=0.04, x=place[0], y=place[1], z=place[2])
    force = snag.apply(sheet, x, np.zeros_like(x))
    np.testing.assert_allclose(force[10, 0], 20.0 * 0.01 * np.exp(-1.0 / 16.0), rtol=1e-6)
    far = np.linalg.norm(x - place, axis=1) > 0.2
    assert np.abs(force[far]).max() < 1e-6


def test_a_sliding_layer_takes_energy_and_not_more_than_its_stress(sheet: Sheet) -> None:
    rng = np.random.default_rng(1)
    x = sheet.rest_position
    v = 0.2 * rng.standard_normal(x.shape)
    lining = SlidingLayer(stress=0.6)
    force = lining.apply(sheet, x, v)
    height = x[:, 2]
    top = height >= height.max() - 0.06 * np.ptp(height)
    assert np.all(np.sum(force * (v - v[top].mean(axis=0)), axis=1) <= 0.0)
    assert np.all(np.linalg.norm(force, axis=1) <= 0.6 * sheet.elements.node_area * (1 + 1e-9))
    # what moves as a whole does not slide
    assert np.abs(lining.apply(sheet, x, np.ones_like(x))).max() < 1e-12
