"""Samples of an arm's motion by leapfrog diffusion.

A diffusion model denoises what is left of the motion after the network's mean, in units of its
error's scale and in a few smooth coordinates. Denoising from pure noise takes many steps. Leapfrog
diffusion (Mao, Xu, Zhu, Chen, Wang, CVPR 2023) jumps over most of them: an initialiser places all
samples at once, by a mean, a spread and 20 normalised samples that know of each other, as if they
had been denoised already up to the last few steps, which the denoiser then takes.
"""

from __future__ import annotations

import numpy as np

from drake_dress.models.human.learned.layers import (
    Array,
    Weights,
    dense,
    dense_weights,
    like,
    namespace,
    norm_weights,
    normalised,
    swish,
)
from drake_dress.models.human.learned.network import FUTURE, WIDTH

SAMPLES = 20
LATENT = 24  # smooth coordinates of a motion
VALUES = FUTURE * 9  # numbers of a motion
NOISE_STEPS, LEAP = 50, 5  # steps of the whole diffusion, and those that are taken
_INNER, _CLOCK = 160, 16
# Share of the signal that is left after each step, as variance (linear schedule of Ho et al. 2020,
# with fewer and larger steps).
_LEFT = np.cumprod(1.0 - np.linspace(2e-3, 0.2, NOISE_STEPS)).astype(np.float32)
_KEPT = np.concatenate([np.ones(1, dtype=np.float32), _LEFT])


def denoiser_weights(rng: np.random.Generator) -> dict[str, np.ndarray]:
    """Returns drawn weights of the denoiser."""
    weights = dense_weights(rng, "denoise.noisy", LATENT, _INNER)
    weights |= dense_weights(rng, "denoise.context", WIDTH, _INNER)
    weights |= dense_weights(rng, "denoise.clock", _CLOCK, _INNER)
    for name in ("denoise.first", "denoise.second"):
        weights |= norm_weights(f"{name}.norm", _INNER) | dense_weights(
            rng, f"{name}.dense", _INNER, _INNER
        )
    return weights | dense_weights(rng, "denoise.noise", _INNER, LATENT, 0.1)


def initialiser_weights(rng: np.random.Generator) -> dict[str, np.ndarray]:
    """Returns drawn weights of the initialiser."""
    weights = dense_weights(rng, "start.enter", WIDTH, _INNER)
    weights |= norm_weights("start.norm", _INNER)
    weights |= dense_weights(rng, "start.dense", _INNER, _INNER)
    weights |= dense_weights(rng, "start.mean", _INNER, LATENT, 0.01)
    weights |= dense_weights(rng, "start.spread", _INNER, LATENT, 0.01)
    weights |= dense_weights(rng, "start.samples", _INNER, SAMPLES * LATENT, 0.1)
    drawn = rng.normal(size=SAMPLES * LATENT).astype(np.float32)
    return weights | {"start.samples.bias": drawn}


def noised(latent: Array, noise: Array, step: Array) -> Array:
    """Returns latents (N,L) after `step` (N,) steps of the diffusion with `noise` (N,L)."""
    kept = like(_KEPT, latent)[step][:, None]
    return kept**0.5 * latent + (1.0 - kept) ** 0.5 * noise


def predicted_noise(weights: Weights, noisy: Array, z: Array, step: int | Array) -> Array:
    """Returns the noise (N,L) in latents (N,L), given the context z (N,`WIDTH`).

    Args:
        weights: of the denoiser.
        noisy: (N,L).
        z: (N,`WIDTH`).
        step: how many steps of the diffusion they have gone through; one, or (N,).
    """
    inner = dense(weights, "denoise.noisy", noisy) + dense(weights, "denoise.context", z)
    return _noise(weights, inner, step)


def samples(weights: Weights, z: Array) -> Array:
    """Returns `SAMPLES` latents (N,S,L) of each context z (N,`WIDTH`)."""
    latent = started(weights, z)
    count = z.shape[0]
    shape = (count, SAMPLES, LATENT)
    of_context = dense(weights, "denoise.context", z)[:, None]
    for step in range(LEAP, 0, -1):
        inner = dense(weights, "denoise.noisy", latent) + of_context
        noise = _noise(weights, inner.reshape(count * SAMPLES, -1), step).reshape(shape)
        # the deterministic step of Song, Meng, Ermon 2021 (DDIM)
        kept, before = float(_KEPT[step]), float(_KEPT[step - 1])
        clean = (latent - (1.0 - kept) ** 0.5 * noise) / kept**0.5
        latent = before**0.5 * clean + (1.0 - before) ** 0.5 * noise
    return latent


def started(weights: Weights, z: Array) -> Array:
    """Returns the initialiser's latents (N,S,L): mean + spread · normalised samples."""
    xp = namespace(z)
    inner = swish(dense(weights, "start.enter", z))
    inner = inner + swish(dense(weights, "start.dense", normalised(weights, "start.norm", inner)))
    mean = dense(weights, "start.mean", inner)
    spread = xp.exp(xp.clip(dense(weights, "start.spread", inner), -3.0, 2.0))
    drawn = dense(weights, "start.samples", inner).reshape(z.shape[0], SAMPLES, LATENT)
    off = drawn - drawn.mean(axis=1)[:, None]
    size = ((off * off).mean(axis=1) + 1e-4) ** 0.5
    return mean[:, None] + spread[:, None] * off / size[:, None]


def motion_of(weights: Weights, latent: Array) -> Array:
    """Returns motions (…,F,3,3), in units of the error's scale, of latents (…,L)."""
    rows = latent @ weights["latent.motion"]
    return rows.reshape(*latent.shape[:-1], FUTURE, 3, 3)


def latent_of(weights: Weights, motion: Array) -> Array:
    """Returns the latents (N,L) of motions (N,F,3,3), in units of the error's scale."""
    return motion.reshape(motion.shape[0], VALUES) @ weights["latent.latent"]


def latent_basis(motion: np.ndarray) -> dict[str, np.ndarray]:
    """Returns the bases of principal coordinates of motions (N,F,3,3), scaled to variance 1."""
    flat = motion.reshape(len(motion), VALUES).astype(np.float64)
    values, vectors = np.linalg.eigh(flat.T @ flat / len(flat))
    size = np.sqrt(values[-LATENT:])
    basis = vectors[:, -LATENT:]
    return {
        "latent.latent": (basis / size).astype(np.float32),
        "latent.motion": (basis * size).T.astype(np.float32).copy(),
    }


def _noise(weights: Weights, inner: Array, step: int | Array) -> Array:
    clock = _clock(step)
    clock = like(clock, inner)
    inner = swish(inner + dense(weights, "denoise.clock", clock))
    for name in ("denoise.first", "denoise.second"):
        inner = inner + swish(
            dense(weights, f"{name}.dense", normalised(weights, f"{name}.norm", inner))
        )
    return dense(weights, "denoise.noise", inner)


def _clock(step: int | Array) -> np.ndarray:
    """Returns sines and cosines of the steps, (`_CLOCK`,) or (N,`_CLOCK`)."""
    at = np.asarray(step, dtype=np.float64)[..., None] / NOISE_STEPS
    angle = at * np.pi * np.arange(1, _CLOCK // 2 + 1)
    return np.concatenate([np.sin(angle), np.cos(angle)], axis=-1).astype(np.float32)
