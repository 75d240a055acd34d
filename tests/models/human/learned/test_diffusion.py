"""Leapfrog diffusion: noise of the right size, its steps back, and samples as the weights say."""

from __future__ import annotations

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from drake_dress.models.human.learned import diffusion
from drake_dress.models.human.learned.diffusion import LATENT, LEAP, NOISE_STEPS, SAMPLES
from drake_dress.models.human.learned.network import FUTURE, WIDTH
from tests.models.human.learned.drawn import drawn_networks

WEIGHTS = drawn_networks(0).motion
TENSORS = {k: torch.from_numpy(v) for k, v in WEIGHTS.items()}
seeds = st.integers(0, 2**32 - 1)


def normal(seed: int, *shape: int) -> np.ndarray:
    return np.random.default_rng(seed).normal(size=shape).astype(np.float32)


def smooth_motions(seed: int, count: int, rank: int = 12) -> np.ndarray:
    """Returns motions (N,F,3,3) that a few coordinates make up."""
    shapes = normal(seed, rank, FUTURE, 3, 3)
    return np.einsum("nr,rfkc->nfkc", normal(seed + 1, count, rank), shapes)


@given(seeds)
@settings(max_examples=15)
def test_numpy_and_torch_agree(seed: int) -> None:
    z, latent, noise = (
        normal(seed, 3, WIDTH),
        normal(seed + 1, 3, LATENT),
        normal(seed + 2, 3, LATENT),
    )
    step = np.random.default_rng(seed).integers(1, NOISE_STEPS + 1, size=3)
    tz, tl, tn = (torch.from_numpy(a) for a in (z, latent, noise))
    pairs = [
        (diffusion.started(WEIGHTS, z), diffusion.started(TENSORS, tz)),
        (diffusion.samples(WEIGHTS, z), diffusion.samples(TENSORS, tz)),
        (diffusion.noised(latent, noise, step), diffusion.noised(tl, tn, torch.from_numpy(step))),
        (
            diffusion.predicted_noise(WEIGHTS, latent, z, step),
            diffusion.predicted_noise(TENSORS, tl, tz, step),
        ),
        (diffusion.motion_of(WEIGHTS, latent), diffusion.motion_of(TENSORS, tl)),
    ]
    motion = diffusion.motion_of(WEIGHTS, latent)
    again = diffusion.latent_of(TENSORS, torch.from_numpy(motion))
    pairs.append((diffusion.latent_of(WEIGHTS, motion), again))
    for found, other in pairs:
        assert found.dtype == np.float32
        np.testing.assert_allclose(found, other.numpy(), rtol=1e-3, atol=1e-4)


def test_shapes_are_as_told() -> None:
    z = normal(0, 4, WIDTH)
    assert diffusion.samples(WEIGHTS, z).shape == (4, SAMPLES, LATENT)
    assert diffusion.started(WEIGHTS, z).shape == (4, SAMPLES, LATENT)
    assert diffusion.motion_of(WEIGHTS, normal(0, 4, 5, LATENT)).shape == (4, 5, FUTURE, 3, 3)
    assert diffusion.latent_of(WEIGHTS, normal(0, 4, FUTURE, 3, 3)).shape == (4, LATENT)
    assert diffusion.predicted_noise(WEIGHTS, normal(0, 4, LATENT), z, 3).shape == (4, LATENT)


@given(seeds, st.integers(0, NOISE_STEPS))
def test_noising_keeps_the_variance(seed: int, step: int) -> None:
    """The shares of signal and noise, squared, sum to 1."""
    one, none = np.ones((2, LATENT), dtype=np.float32), np.zeros((2, LATENT), dtype=np.float32)
    steps = np.full(2, step)
    signal, noise = diffusion.noised(one, none, steps), diffusion.noised(none, one, steps)
    np.testing.assert_allclose(signal**2 + noise**2, 1.0, rtol=1e-5)
    both = diffusion.noised(normal(seed, 2, LATENT), normal(seed + 1, 2, LATENT), steps)
    expected = signal * normal(seed, 2, LATENT) + noise * normal(seed + 1, 2, LATENT)
    np.testing.assert_allclose(both, expected, rtol=1e-5, atol=1e-6)


def test_noise_grows_from_nothing_to_almost_all() -> None:
    steps = np.arange(NOISE_STEPS + 1)
    one = np.ones((len(steps), LATENT), dtype=np.float32)
    signal = diffusion.noised(one, 0.0 * one, steps)[:, 0]
    assert signal[0] == 1.0
    assert (np.diff(signal) < 0.0).all()
    assert signal[-1] < 0.1
    # the leap begins where most of the signal is there
    assert signal[LEAP] > 0.9


def test_each_row_is_noised_by_its_own_step() -> None:
    latent, noise = normal(0, 3, LATENT), normal(1, 3, LATENT)
    step = np.array([0, 10, NOISE_STEPS])
    found = diffusion.noised(latent, noise, step)
    for k in range(3):
        alone = diffusion.noised(latent[k : k + 1], noise[k : k + 1], step[k : k + 1])
        np.testing.assert_array_equal(found[k : k + 1], alone)


@given(seeds)
@settings(max_examples=20)
def test_started_samples_have_the_mean_and_spread_that_their_weights_say(seed: int) -> None:
    mean, spread = normal(seed, LATENT), np.clip(normal(seed + 1, LATENT), -2.0, 1.5)
    weights = dict(WEIGHTS)
    for name, value in (("mean", mean), ("spread", spread)):
        weights[f"start.{name}.weight"] = 0.0 * weights[f"start.{name}.weight"]
        weights[f"start.{name}.bias"] = value
    found = diffusion.started(weights, normal(seed + 2, 2, WIDTH))
    np.testing.assert_allclose(found.mean(axis=1), np.tile(mean, (2, 1)), atol=1e-4)
    np.testing.assert_allclose(found.std(axis=1), np.tile(np.exp(spread), (2, 1)), rtol=0.01)


@given(seeds, st.floats(-2.0, 2.0))
@settings(max_examples=20)
def test_the_last_steps_take_back_noise_that_is_known(seed: int, size: float) -> None:
    """If the noise is the same at each step, samples with that noise are where they started."""
    noise = size * normal(seed, LATENT)
    weights = dict(WEIGHTS)
    weights["denoise.noise.weight"] = 0.0 * weights["denoise.noise.weight"]
    weights["denoise.noise.bias"] = noise
    z = normal(seed + 1, 2, WIDTH)
    clean = diffusion.samples(weights, z).reshape(-1, LATENT)
    steps = np.full(len(clean), LEAP)
    back = diffusion.noised(clean, np.tile(noise, (len(clean), 1)), steps)
    start = diffusion.started(weights, z).reshape(-1, LATENT)
    np.testing.assert_allclose(back, start, rtol=1e-4, atol=1e-4)


def test_step_and_context_matter_to_the_noise() -> None:
    latent, z = normal(0, 2, LATENT), normal(1, 2, WIDTH)
    found = diffusion.predicted_noise(WEIGHTS, latent, z, 3)
    same = diffusion.predicted_noise(WEIGHTS, latent, z, np.array([3, 3]))
    np.testing.assert_allclose(found, same, rtol=1e-5, atol=1e-6)
    later = diffusion.predicted_noise(WEIGHTS, latent, z, 30)
    other = diffusion.predicted_noise(WEIGHTS, latent, -z, 3)
    assert np.abs(later - found).max() > 1e-3
    assert np.abs(other - found).max() > 1e-3


def test_basis_whitens_motions_and_is_a_projection() -> None:
    motion = smooth_motions(0, 4000, 40)
    basis = diffusion.latent_basis(motion)
    latent = diffusion.latent_of(basis, motion)
    np.testing.assert_allclose(latent.T @ latent / len(latent), np.eye(LATENT), atol=2e-3)
    product = basis["latent.latent"] @ basis["latent.motion"]
    np.testing.assert_allclose(product @ product, product, atol=1e-5)
    np.testing.assert_allclose(product, product.T, atol=1e-5)
    assert np.trace(product) == pytest.approx(LATENT, rel=1e-4)
    both = basis["latent.motion"] @ basis["latent.latent"]
    np.testing.assert_allclose(both, np.eye(LATENT), atol=1e-4)


def test_motions_of_few_coordinates_are_kept_whole() -> None:
    motion = smooth_motions(3, 500, LATENT)
    basis = diffusion.latent_basis(motion)
    again = diffusion.motion_of(basis, diffusion.latent_of(basis, motion))
    np.testing.assert_allclose(again, motion, atol=1e-3)


def test_basis_keeps_the_largest_parts_of_motions() -> None:
    motion = smooth_motions(4, 2000, 60)
    basis = diffusion.latent_basis(motion)
    left = motion - diffusion.motion_of(basis, diffusion.latent_of(basis, motion))
    values = np.linalg.eigvalsh(np.cov(motion.reshape(len(motion), -1).T, bias=True))
    share = np.square(left).sum() / np.square(motion).sum()
    assert share == pytest.approx(values[:-LATENT].sum() / values.sum(), rel=0.02)
