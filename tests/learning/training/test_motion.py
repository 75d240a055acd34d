"""A few steps of the whole training of motion: its parts fit together, and its weights are read."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import lru_cache
from pathlib import Path

import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st

from drake_dress.learning.motion.windows import WindowSource
from drake_dress.learning.training import motion as module
from drake_dress.learning.training.loop import Report, Schedule, train
from drake_dress.learning.training.motion import (
    Contexts,
    MotionTraining,
    errors,
    intents,
    predicted,
    shortened,
    validation_windows,
)
from drake_dress.models.human.learned import diffusion, network
from drake_dress.models.human.learned.familiarity import distance
from drake_dress.models.human.learned.intent import intent_weights
from drake_dress.models.human.learned.linear import LinearMotion
from drake_dress.models.human.learned.network import COVERED, FUTURE, WIDTH
from drake_dress.models.human.learned.predictor import LearnedPredictor, Networks
from drake_dress.models.human.learned.tokens import SLEEVE_COLUMNS
from drake_dress.models.human.learned.weights import motion_shapes, read_weights, write_weights
from tests.learning.made import Data, carried, made, together
from tests.models.human.learned.drawn import drawn_scene

INTENT = intent_weights(np.random.default_rng(0))


@pytest.fixture(autouse=True)
def small(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Makes batches small; torch has one thread, as the tests of a file do."""
    for name, value in {
        "_BATCH": 16,
        "_SMALLER_BATCH": 16,
        "_LINEAR_BATCH": 128,
    }.items():
        monkeypatch.setattr(module, name, value)
    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    yield
    torch.set_num_threads(threads)


def training(steps: int = 4) -> MotionTraining:
    data = together(made("free", 4), made("active", 1))
    validation = {"free": made("free", 2), "active": made("active", 1)}
    return shortened(MotionTraining(data, validation, INTENT, seed=1), steps)


@lru_cache
def trained() -> dict[str, np.ndarray]:
    found = training().run()
    assert found is not None
    return found


def test_all_weights_are_made_and_read_and_predict(tmp_path: Path) -> None:
    path = tmp_path / "motion.safetensors"
    write_weights(path, trained(), {})
    read = read_weights(path, motion_shapes())
    assert read.keys() == trained().keys()
    predictor = LearnedPredictor(Networks(INTENT, read))
    forecast, _ = predictor.forecast(drawn_scene(0).history(), predictor.begin())
    for part in (forecast.mean, forecast.radius, forecast.samples):
        assert np.isfinite(part).all()


def test_stages_come_in_their_order_and_training_again_gives_the_same() -> None:
    said: list[str] = []

    def told(stage: str) -> Report:
        return lambda step, loss: said.append(f"{stage} {step}")

    again = training().run(said=told)
    assert said == ["residual 4", "denoiser 4", "initialiser 4"]
    assert again is not None
    for name, array in trained().items():
        np.testing.assert_array_equal(again[name], array)


def test_training_that_is_stopped_in_each_stage_ends_with_the_same_weights(tmp_path: Path) -> None:
    for steps in (1, 4, 4):
        left = iter([False] * steps + [True])
        assert training().run(tmp_path, stop=lambda left=left: next(left)) is None  # type: ignore[misc]
    names = {p.name.split(".")[0] for p in tmp_path.iterdir()}
    assert names == {"residual", "denoiser", "initialiser"}
    found = training().run(tmp_path)
    assert found is not None
    for name, array in trained().items():
        np.testing.assert_array_equal(found[name], array)


def test_linear_map_of_persons_at_constant_velocity_goes_on() -> None:
    data = carried(0, 10)
    weights = {"linear.map": MotionTraining(data, {}, INTENT)._linear().map}
    batch = WindowSource(data, 0).drawn(20)
    base = predicted(weights | trained(), INTENT, batch)[1]
    assert base.shape == (40, FUTURE + 1, 3, 3)
    ahead = np.einsum(
        "ntkc,ktf->nfkc",
        batch.arms.joints[:, :-1, :3] - batch.arms.joints[:, -1:, :3],
        weights["linear.map"],
    )
    moved = np.linalg.norm(batch.displacement, axis=3).mean()
    assert np.linalg.norm(ahead - batch.displacement[:, 1:], axis=3).mean() < 0.2 * moved


def test_regions_hold_what_they_should_of_validation_windows() -> None:
    weights = trained()
    inside = []
    every = [made("free", 2), made("active", 1)]
    for batch in (batch for data in every for batch in validation_windows(data)):
        z, mean, _ = predicted(weights, INTENT, batch)
        off = np.linalg.norm(batch.displacement - mean, axis=3)
        inside.append(off <= network.radius(weights, z) * (1.0 + 1e-6))
    share = np.concatenate(inside).mean(axis=0)
    count = len(np.concatenate(inside))
    assert (share >= COVERED).all()
    assert (share <= COVERED + 2.0 / count + 0.01).all()


def test_regions_of_the_linear_predictor_hold_as_many() -> None:
    weights, inside = trained(), []
    linear = LinearMotion(weights["linear.map"].astype(np.float64))
    for data in (made("free", 2), made("active", 1)):
        for batch in validation_windows(data):
            off = linear.displacement(batch.arms.joints[:, :, :3]) - batch.displacement
            inside.append(
                np.linalg.norm(off, axis=3) <= network.linear_radius(weights) * (1.0 + 1e-6)
            )
    every = np.concatenate(inside)
    assert (every.mean(axis=0) >= COVERED).all()
    assert (every.mean(axis=0) <= COVERED + 2.0 / len(every) + 0.01).all()


@given(st.integers(0, 2**32 - 1), st.integers(2, 7))
def test_mean_distance_apart_counts_all_pairs(seed: int, count: int) -> None:
    """As the energy score takes it: also each sample and itself."""
    samples = torch.from_numpy(np.random.default_rng(seed).normal(size=(3, count, 4, 3, 3)))
    found = module._mean_apart(samples)
    off = samples[:, :, None] - samples[:, None]
    expected = off.square().sum(-1).sqrt().mean((-1, -2)).mean((1, 2))
    np.testing.assert_allclose(found, expected, atol=1e-4)


def test_samples_are_as_far_apart_as_motions_are() -> None:
    """Contexts tell nothing of normally distributed motions; the samples are spread as these are.

    Their mean distance from a motion is then that of two motions, and so is that of two samples.
    """
    rng = np.random.default_rng(0)
    z = rng.normal(size=(4000, WIDTH)).astype(np.float32)
    latent = rng.normal(size=(4000, diffusion.LATENT))
    basis = np.linalg.qr(rng.normal(size=(diffusion.VALUES, diffusion.LATENT)))[0]
    motion = (latent @ basis.T).reshape(-1, FUTURE, 3, 3).astype(np.float32)
    contexts = Contexts(z, motion)
    some = replace(
        training(),
        denoiser=Schedule(steps=100, rate=2e-3),
        initialiser=Schedule(steps=150, rate=4e-3),
    )
    weights: dict[str, np.ndarray] = diffusion.latent_basis(motion)
    for part in (some._denoiser, some._initialiser):
        stage = part(weights, contexts, Contexts(z[:200], motion[:200]))
        found = train(stage.first, stage.batches, stage.loss, lambda w: 0.0, stage.schedule)
        assert found is not None
        weights |= found
    samples = diffusion.motion_of(weights, diffusion.samples(weights, z[:200]))
    samples, other = torch.from_numpy(samples), torch.from_numpy(motion[200:220])
    apart = float(module._mean_apart(samples).mean()) * 20 / 19
    true = float(module._distance(other[:, None] - other[None]).sum()) / (20 * 19)
    assert apart == pytest.approx(true, rel=0.3)


def test_what_is_trained_on_is_familiar() -> None:
    found = replace(training(), familiar_batches=40).run()
    assert found is not None
    batch = WindowSource(made("free", 4), 3, noise=0.004).drawn(60)
    assert (distance(found, batch.arms.tokens) < 1.0).mean() > 0.95


def test_errors_are_distances_of_the_mean_from_the_truth() -> None:
    (batch, *_) = validation_windows(made("free", 2))
    z, mean, scale = predicted(trained(), INTENT, batch)
    count = len(batch.intent)
    assert z.shape == (count, WIDTH)
    assert scale.shape == (count, FUTURE + 1, 3)
    shifted = replace(batch, displacement=mean + [0.0, 0.3, 0.4])
    np.testing.assert_allclose(errors(trained(), INTENT, shifted), 0.5, rtol=1e-6)
    assert errors(trained(), INTENT, batch).shape == (count, FUTURE, 3)
    share = intents(INTENT, batch)
    assert share.shape == (count,)
    assert ((share > 0.0) & (share < 1.0)).all()


def test_longer_training_errs_less() -> None:
    """Hands begin to rise at a moment that the linear map does not know."""
    data = carried(0, 12)
    rising = data.joint_position.copy()
    rising[:, 80:, [2, 5], 2] += 0.4 * np.linspace(0.0, 1.0, 80)[:, None]
    both = Data(rising, data.sleeve, data.intent)
    short = MotionTraining(both, {"active": both}, INTENT, seed=2)
    found = []
    for steps in (1, 40):
        weights: dict[str, np.ndarray] = {"linear.map": short._linear().map.astype(np.float32)}
        residual = shortened(short, steps)._residual(
            weights, None, lambda step, loss: None, lambda: False
        )
        assert residual is not None
        (batch, *_) = validation_windows(both)
        found.append(errors(weights | residual, INTENT, batch).mean())
    assert found[1] < 0.9 * found[0]


def test_samples_of_the_trained_diffusion_spread() -> None:
    (batch, *_) = validation_windows(made("active", 1))
    z, _, _ = predicted(trained(), INTENT, batch)
    latent = diffusion.samples(trained(), z)
    assert np.isfinite(latent).all()
    assert latent.std(axis=1).min() > 0.01


def test_diffusion_learns_what_the_mean_leaves_in_units_of_the_scale() -> None:
    some = training()
    contexts = some._contexts(trained(), made("free", 4), 1, "contexts")
    batch = some._source(made("free", 4), (some.seed, 3, 0)).drawn(16)
    z, mean, scale = predicted(trained(), INTENT, batch)
    np.testing.assert_array_equal(contexts.z, z)
    again = mean[:, 1:] + contexts.motion * scale[:, 1:, :, None]
    np.testing.assert_allclose(again, batch.displacement[:, 1:], atol=1e-5)
    assert contexts.motion.dtype == np.float32


def test_training_sees_persons_as_cameras_do_and_validation_all_of_them() -> None:
    batch = training()._source(made("free", 4), (1, 2)).drawn(64)
    assert 0.05 < (~batch.seen).mean() < 0.5
    assert all(b.seen.all() for b in validation_windows(made("free", 2)))


def test_without_sleeves_none_is_seen() -> None:
    for batch in validation_windows(made("active", 1), with_sleeves=False):
        assert not batch.arms.tokens[:, :, SLEEVE_COLUMNS].any()
    source = replace(training(), with_sleeves=False)._source(made("active", 1), (1, 2))
    assert not source.drawn(8).arms.tokens[:, :, SLEEVE_COLUMNS].any()


def test_recordings_are_added_to_weights_that_there_are() -> None:
    """Half of each batch is of recordings; the linear map and the diffusion stay."""
    base = training()
    recorded = carried(30, 6, 101)
    adapting = replace(
        base,
        start=trained(),
        recorded=recorded,
        residual=replace(base.residual, steps=60, rate=3e-3, every=20),
        validation={"recorded": carried(90, 4, 101)},
        familiar_batches=20,
    )
    found = adapting.run()
    assert found is not None
    assert set(found) == set(trained())
    changed = {name for name in found if not np.array_equal(found[name], trained()[name])}
    assert "displacement.weight" in changed
    assert not {n for n in changed if n.startswith(("linear", "latent", "denoise", "start"))}
    other = validation_windows(carried(200, 6, 101))
    after, before = (
        np.mean([errors(w, INTENT, batch).mean() for batch in other]) for w in (found, trained())
    )
    assert after < 0.9 * before
