"""The weights of the package: they are there, small, free of code, and predict persons."""

from __future__ import annotations

import json

import numpy as np
import pytest

from drake_dress.models.human.learned.kinematics import LIMITS
from drake_dress.models.human.learned.weights import (
    FILES,
    SHIPPED,
    learned_predictor,
    recurrent_predictor,
    ridge_predictor,
)
from drake_dress.models.human.prediction import PREDICTORS
from tests.models.human.learned.drawn import Scene, drawn_scene, lengths, pose

HANGING = np.tile([0.15, 0.1, 0.0, 0.4], (2, 1))


def resting(noise: float, seed: int = 0) -> Scene:
    """Returns a person at rest beside a coat that does not move."""
    rng = np.random.default_rng(seed)
    joints = np.tile(pose(HANGING), (20, 1, 1)) + noise * rng.normal(size=(20, 6, 3))
    sleeves = np.concatenate([joints[:1, [2, 5]] - [0.2, 0.0, 0.1], np.ones((1, 2, 3)) / 3**0.5], 2)
    return Scene(joints, np.tile(sleeves, (20, 1, 1)))


def test_files_are_small_and_say_how_they_were_made() -> None:
    files = {path.name for path in SHIPPED.iterdir()}
    assert files == {*FILES.values(), "figures.json", "card.md"}
    assert sum(path.stat().st_size for path in SHIPPED.iterdir()) < 10e6
    told = json.loads((SHIPPED / "figures.json").read_text())
    assert set(told) == set(FILES)
    for name, figures in told.items():
        assert figures["command"] == f"drake-dress train {name} --seed 0"
        assert figures["data"].startswith("drake-dress dataset motion")
    card = (SHIPPED / "card.md").read_text()
    assert told["motion"]["data"].split("--seed")[1].strip() in card
    assert "MIT" in card or "BSD" in card or "Apache" in card


def test_names_of_scenarios_make_these_predictors() -> None:
    assert type(PREDICTORS["learned"]()) is type(learned_predictor())
    assert type(PREDICTORS["ridge"]()) is type(ridge_predictor())
    assert PREDICTORS["recurrent"]() is recurrent_predictor()


@pytest.mark.parametrize("count", [1, 2, 4, 5, 10])
def test_person_who_was_just_seen_is_not_predicted_to_fly_away(count: int) -> None:
    """The first samples of a run: the network was never trained on fewer than five."""
    predictor, scene, true = learned_predictor(), resting(0.0), pose(HANGING)
    joints, sleeves = scene.joints.copy(), scene.sleeves.copy()
    joints[:-count], sleeves[:-count] = np.nan, np.nan
    forecast, _ = predictor.forecast(Scene(joints, sleeves).history(), predictor.begin())
    assert forecast.is_linear == (count < 5)
    off = np.linalg.norm(forecast.mean - true, axis=2)
    assert off.max() < 0.05
    assert (off < forecast.radius).all()
    assert forecast.radius.max() < 0.8


@pytest.mark.parametrize("noise", [0.0, 0.004])
def test_person_at_rest_is_predicted_to_rest(noise: float) -> None:
    predictor, willed = learned_predictor(), []
    for seed in range(25):
        scene = resting(noise, seed)
        forecast, _ = predictor.forecast(scene.history(), predictor.begin())
        assert not forecast.is_linear
        true = pose(HANGING)
        off = np.linalg.norm(forecast.mean - true, axis=2)
        assert off.mean() < 0.02
        assert (off <= forecast.radius).mean() > 0.8
        willed.append(forecast.intent)
    assert np.mean(np.array(willed) < 0.5) >= 0.95
    assert np.mean(willed) < 0.15


@pytest.mark.parametrize("seed", range(3))
def test_limbs_keep_their_lengths_and_elbows_their_limits(seed: int) -> None:
    predictor = learned_predictor()
    scene = drawn_scene(seed)
    forecast, _ = predictor.forecast(scene.history(), predictor.begin())
    every = np.concatenate([forecast.mean[None], forecast.samples])
    np.testing.assert_allclose(
        lengths(every), np.broadcast_to(lengths(scene.joints[-1]), lengths(every).shape), rtol=1e-6
    )
    upper, fore = every[:, :, 1] - every[:, :, 0], every[:, :, 2] - every[:, :, 1]
    cosine = (upper * fore).sum(-1) / np.linalg.norm(upper, axis=-1) / np.linalg.norm(fore, axis=-1)
    assert np.arccos(np.clip(cosine, -1.0, 1.0)).max() <= LIMITS[1, 3] + 0.1


@pytest.mark.parametrize("size", [0.4, 2.0])
def test_person_of_another_size_is_left_to_simpler_predictors(size: float) -> None:
    predictor = learned_predictor()
    scene = Scene(size * resting(0.0).joints, np.full((20, 2, 6), np.nan))
    forecast, _ = predictor.forecast(scene.history(), predictor.begin())
    assert forecast.is_linear
    assert np.isfinite(forecast.mean).all()
