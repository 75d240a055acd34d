"""Data that hide effects: drawn by name or given, the same from the same seed."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest

from drake_dress.discrepancy.generate import Dataset, Session, make_dataset
from drake_dress.discrepancy.lab import SimulatedLab
from drake_dress.errors import UserError
from drake_dress.models.effects.effect import Effect
from drake_dress.models.effects.mass import SurfaceDensity
from tests.discrepancy.data import SCENARIO, SENSORS, quick_scenario

G = 9.81
SESSION = Session(["sway"], 0.3, SENSORS)


def made(hide: str | Sequence[Effect], seed: int = 3) -> Dataset:
    stages: list[str] = []
    data = make_dataset(
        quick_scenario(), SCENARIO.parent, hide, seed, 1.0, SESSION, 1, stages.append
    )
    assert stages == ["recording sway", "recorded sway"]
    return data


def weight(data: Dataset) -> float:
    """Returns what both grippers bear while the garment hangs still, N."""
    force = data.recordings[0].gripper_force
    assert force is not None
    return -float(force[:10, :, 2].sum(axis=1).mean())


def test_an_effect_that_is_given_acts_on_what_is_measured_and_a_seed_draws_the_same() -> None:
    effect = SurfaceDensity(added=0.3)
    first, again = made([effect]), made([effect])
    assert first.hidden == (effect,)
    lab = SimulatedLab.of(quick_scenario(), SCENARIO.parent)
    area = lab.cloth([]).elements.triangle_area.sum()
    assert weight(first) == pytest.approx((lab.material.surface_density + 0.3) * area * G, rel=0.03)
    one, two = first.recordings[0], again.recordings[0]
    np.testing.assert_array_equal(one.marker_position, two.marker_position)
    np.testing.assert_array_equal(one.marker_rest_position, two.marker_rest_position)


@pytest.mark.parametrize(
    ("motions", "words"),
    [
        (["fly"], "motions: fly: is no motion, expected sway"),
        (["sway", "sway"], "sway: stands twice"),
    ],
)
def test_motions_that_cannot_be_are_told(motions: list[str], words: str) -> None:
    with pytest.raises(UserError, match=words):
        Session(motions).check("motions")
