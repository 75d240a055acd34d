"""Trains what predicts motion: linear map, residual network, regions, and leapfrog diffusion.

The parts are trained one after the other, each on what those before it leave:

1. the linear map, in closed form;
2. the residual network with the scale of its error;
3. the denoiser of a diffusion of what is left, in its principal coordinates;
4. the initialiser that leaps over most of the diffusion, on the samples that come out of it;
5. the factors of the regions, from validation sequences (split conformal prediction).

A training may go on from other weights with recordings of people: the residual network then learns
from both, half and half, and all else but the regions and what is familiar stays.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import torch

from drake_dress.learning.motion.windows import Augmentation, Batch, Sequences, WindowSource
from drake_dress.learning.training.loop import Batches, Loss, Report, Schedule, train
from drake_dress.models.arrays import FloatArray
from drake_dress.models.human.learned import diffusion, network
from drake_dress.models.human.learned.familiarity import familiar_weights
from drake_dress.models.human.learned.intent import balanced_logit
from drake_dress.models.human.learned.layers import logistic
from drake_dress.models.human.learned.linear import LinearFit, LinearMotion
from drake_dress.models.human.learned.network import COVERED, FUTURE, HISTORY

RESIDUAL = Schedule(steps=12000, rate=3e-3, every=1000, patience=12)
DENOISER = Schedule(steps=4000, rate=2e-3, every=500, patience=6)
INITIALISER = Schedule(steps=4000, rate=2e-3, every=500, patience=6)
ADAPTING = Schedule(steps=3000, rate=5e-4, every=250, patience=6)
# Noise of joints where nothing else is said, m, and time between windows of validation data, s.
NOISE, EVERY = 0.004, 0.5
_BATCH, _SMALLER_BATCH = 256, 128
_LINEAR_BATCH = 1024
# Share of the free sequences' error in the validation's: they move five times as far.
_FREE_SHARE = 0.1
_HELD_OUT_BATCHES = 12  # of validation data for the diffusion
_SEED_OF = {"linear": 1, "residual": 2, "contexts": 3, "denoiser": 4, "validation": 5}

Arrays = dict[str, np.ndarray]
Said = Callable[[str], Report]


@dataclass(frozen=True)
class Contexts:
    """What the diffusion learns from: contexts (N,W) and scaled motions (N,F,3,3) of arms."""

    z: np.ndarray
    motion: np.ndarray


@dataclass(frozen=True)
class _Stage:
    """A part of the diffusion: first weights, batches, loss, held-out batch and schedule."""

    first: Arrays
    batches: Batches
    loss: Loss
    held_out: Any
    schedule: Schedule


@dataclass(frozen=True)
class MotionTraining:
    """A training of the motion predictor.

    Attributes:
        train: sequences of all kinds.
        validation: sequences by kind.
        intent: weights of the intent network.
        seed: of weights and batches.
        with_sleeves: whether the networks see sleeves.
        residual, denoiser, initialiser: schedules.
        linear_batches: number of batches that the linear map is fitted to.
        context_batches: number of batches that the diffusion learns from.
        familiar_batches: number of batches that say what is familiar.
        recorded: sequences of people that are learned from besides.
        start: weights to go on from.
    """

    train: Sequences
    validation: Mapping[str, Sequences]
    intent: Mapping[str, np.ndarray]
    seed: int = 0
    with_sleeves: bool = True
    residual: Schedule = RESIDUAL
    denoiser: Schedule = DENOISER
    initialiser: Schedule = INITIALISER
    linear_batches: int = 60
    context_batches: int = 240
    familiar_batches: int = 60
    recorded: Sequences | None = None
    start: Mapping[str, np.ndarray] | None = None

    def run(
        self,
        folder: Path | None = None,
        said: Said = lambda stage: lambda step, loss: None,
        stop: Callable[[], bool] = lambda: False,
    ) -> Arrays | None:
        """Returns all weights; None if stopped before the end.

        Args:
            folder: of the checkpoints, from which it goes on.
            said: returns what reports the steps of a stage of that name.
            stop: returns whether to stop.
        """
        if self.start is not None:
            return self._adapted(self.start, folder, said, stop)
        weights: Arrays = {"linear.map": self._linear().map.astype(np.float32)}
        found = self._residual(weights, folder, said("residual"), stop)
        if found is None:
            return None
        weights |= found
        contexts = self._contexts(weights, self.train, self.context_batches, "contexts")
        count = min(self.context_batches, _HELD_OUT_BATCHES)
        held_out = self._contexts(weights, self.validation["active"], count, "validation")
        weights |= diffusion.latent_basis(contexts.motion)
        for name, part in (("denoiser", self._denoiser), ("initialiser", self._initialiser)):
            stage = part(weights, contexts, held_out)
            found = train(
                stage.first,
                stage.batches,
                stage.loss,
                lambda w, stage=stage: float(stage.loss(w, stage.held_out)),  # type: ignore[misc]
                stage.schedule,
                _file(folder, name),
                said(name),
                stop,
            )
            if found is None:
                return None
            weights |= found
        weights |= self.regions(weights) | self._familiar()
        return weights

    def _adapted(
        self,
        start: Mapping[str, np.ndarray],
        folder: Path | None,
        said: Said,
        stop: Callable[[], bool],
    ) -> Arrays | None:
        """Returns the weights `start` after the residual network has learned further."""
        weights: Arrays = {"linear.map": start["linear.map"]}
        found = self._residual(weights, folder, said("residual"), stop)
        if found is None:
            return None
        weights = dict(start) | found
        return weights | self.regions(weights) | self._familiar()

    def _source(self, data: Sequences, seed: tuple[int, ...], changed: bool = True) -> WindowSource:
        how = Augmentation() if self.with_sleeves else Augmentation(bare=1.0)
        return WindowSource(data, seed, how if changed else None, NOISE, self.with_sleeves)

    def _drawn(self, seed: tuple[int, ...]) -> list[Batch]:
        """Returns a batch of windows; with recordings, half of them are of these."""
        if self.recorded is None:
            return [self._source(self.train, seed).drawn(_BATCH)]
        both = self._source(self.train, seed), self._source(self.recorded, (*seed, 1))
        return [source.drawn(_BATCH // 2) for source in both]

    def _linear(self) -> LinearMotion:
        fit = LinearFit(HISTORY, FUTURE)
        for k in range(self.linear_batches):
            seed = (self.seed, _SEED_OF["linear"], k)
            batch = self._source(self.train, seed, changed=False).drawn(_LINEAR_BATCH)
            fit.add(batch.arms.joints[:, :, :3], batch.displacement)
        return fit.solved()

    def _residual(
        self, weights: Arrays, folder: Path | None, report: Report, stop: Callable[[], bool]
    ) -> Arrays | None:
        linear = LinearMotion(weights["linear.map"].astype(np.float64))
        held_out = {k: validation_windows(d, self.with_sleeves) for k, d in self.validation.items()}

        def batches(step: int) -> tuple[torch.Tensor, ...]:
            seed = (self.seed, _SEED_OF["residual"], step)
            parts = [
                (
                    batch.arms.tokens,
                    intents(self.intent, batch),
                    linear.displacement(batch.arms.joints[:, :, :3]).astype(np.float32),
                    batch.displacement.astype(np.float32),
                )
                for batch in self._drawn(seed)
            ]
            return tuple(
                torch.from_numpy(np.concatenate(part)) for part in zip(*parts, strict=True)
            )

        def loss(w: Mapping[str, torch.Tensor], batch: Any) -> torch.Tensor:
            device = next(iter(w.values())).device
            tokens, intent, base, wanted = (part.to(device) for part in batch)
            z = network.context(w, tokens, intent)
            off = base + network.residual(w, z) - wanted
            error = (off.square().sum(-1) + 1e-8).sqrt()
            # Scale and radius are fitted to the error that there is, without a say in the features.
            # An error counts by its expected size: else a person who walks would outweigh ten who
            # are being dressed.
            scale = network.error_scale(w, z.detach())
            beyond = error.detach() - network.quantile(w, z.detach())
            quantile = torch.maximum(COVERED * beyond, (COVERED - 1.0) * beyond)
            likely = scale.log() + error / scale
            return (likely + quantile / scale.detach()).mean()

        def validation(w: Mapping[str, torch.Tensor]) -> float:
            arrays = {k: v.detach().cpu().numpy() for k, v in w.items()} | weights
            shares = {k: _FREE_SHARE if k == "free" else 1.0 for k in held_out}
            return sum(
                shares[k] * float(np.mean([errors(arrays, self.intent, b).mean() for b in windows]))
                for k, windows in held_out.items()
            )

        first = network.motion_weights(np.random.default_rng(self.seed))
        if self.start is not None:
            first = {name: self.start[name] for name in first}
        return train(
            first, batches, loss, validation, self.residual, _file(folder, "residual"), report, stop
        )

    def _contexts(self, weights: Arrays, data: Sequences, batches: int, stage: str) -> Contexts:
        z, motion = [], []
        for k in range(batches):
            batch = self._source(data, (self.seed, _SEED_OF[stage], k)).drawn(_BATCH)
            context, mean, scale = predicted(weights, self.intent, batch)
            z.append(context)
            motion.append((batch.displacement - mean)[:, 1:] / scale[:, 1:, :, None])
        return Contexts(np.concatenate(z), np.concatenate(motion).astype(np.float32))

    def _denoiser(self, weights: Arrays, contexts: Contexts, held_out: Contexts) -> _Stage:
        latent = diffusion.latent_of(weights, contexts.motion)
        other = diffusion.latent_of(weights, held_out.motion)

        def drawn(z: np.ndarray, rows: np.ndarray, rng: np.random.Generator) -> Any:
            noise = rng.normal(size=(len(z), diffusion.LATENT)).astype(np.float32)
            step = rng.integers(1, diffusion.NOISE_STEPS + 1, size=len(z))
            return tuple(torch.from_numpy(part) for part in (z, rows, noise, step))

        def batches(step: int) -> Any:
            rng = np.random.default_rng((self.seed, _SEED_OF["denoiser"], step))
            chosen = rng.integers(len(latent), size=2 * _BATCH)
            return drawn(contexts.z[chosen], latent[chosen], rng)

        def loss(w: Mapping[str, torch.Tensor], batch: Any) -> torch.Tensor:
            device = next(iter(w.values())).device
            z, clean, noise, step = (part.to(device) for part in batch)
            found = diffusion.predicted_noise(
                w, diffusion.noised(clean, noise, step), z, step.cpu().numpy()
            )
            return (found - noise).square().mean()

        fixed = drawn(held_out.z, other, np.random.default_rng(self.seed))
        first = diffusion.denoiser_weights(np.random.default_rng(self.seed))
        return _Stage(first, batches, loss, fixed, self.denoiser)

    def _initialiser(self, weights: Arrays, contexts: Contexts, held_out: Contexts) -> _Stage:
        kept = {k: torch.from_numpy(v) for k, v in weights.items() if not k.startswith("region")}

        def batches(step: int) -> Any:
            rng = np.random.default_rng((self.seed, _SEED_OF["denoiser"], step, 1))
            chosen = rng.integers(len(contexts.z), size=_SMALLER_BATCH)
            return torch.from_numpy(contexts.z[chosen]), torch.from_numpy(contexts.motion[chosen])

        def loss(w: Mapping[str, torch.Tensor], batch: Any) -> torch.Tensor:
            device = next(iter(w.values())).device
            z, wanted = (part.to(device) for part in batch)
            both = {k: v.to(device) for k, v in kept.items()} | dict(w)
            found = diffusion.motion_of(both, diffusion.samples(both, z))
            off = _distance(found - wanted[:, None])
            # the energy score, which the true distribution minimises, and the best of all samples
            score = off.mean(1) - 0.5 * _mean_apart(found)
            return (score + off.min(1).values).mean()

        fixed = torch.from_numpy(held_out.z[:512]), torch.from_numpy(held_out.motion[:512])
        first = diffusion.initialiser_weights(np.random.default_rng(self.seed))
        return _Stage(first, batches, loss, fixed, self.initialiser)

    def regions(self, weights: Arrays) -> Arrays:
        """Returns what regions that cover `COVERED` need, from validation sequences.

        Returns:
            the factors (F+1,3) on the learned radii, and the radii (F+1,3), m, about the linear
            predictor's mean.
        """
        linear = LinearMotion(weights["linear.map"].astype(np.float64))
        ratios, distances = [], []
        for data in self.validation.values():
            for batch in validation_windows(data, self.with_sleeves):
                z, mean, _ = predicted(weights, self.intent, batch)
                off = np.linalg.norm(batch.displacement - mean, axis=3)
                ratios.append(off / network.quantile(weights, z))
                ahead = linear.displacement(batch.arms.joints[:, :, :3])
                distances.append(np.linalg.norm(batch.displacement - ahead, axis=3))
        return {
            "region.factor": _conformal(np.concatenate(ratios)),
            "region.linear": _conformal(np.concatenate(distances)),
        }

    def _familiar(self) -> Arrays:
        tokens = [
            batch
            for k in range(self.familiar_batches)
            for batch in self._drawn((self.seed, _SEED_OF["contexts"], k, 1))
        ]
        return familiar_weights(np.concatenate([batch.arms.tokens for batch in tokens]))


def validation_windows(data: Sequences, with_sleeves: bool = True) -> list[Batch]:
    """Returns windows of all sequences, `EVERY` s apart, with noise."""
    source = WindowSource(data, _SEED_OF["validation"], noise=NOISE, with_sleeves=with_sleeves)
    return source.every(EVERY)


def intents(weights: Mapping[str, np.ndarray], batch: Batch) -> np.ndarray:
    """Returns the probabilities (2B,) that the arms of a batch move by will."""
    hidden = np.zeros(batch.arms.tokens.shape[:2], dtype=np.float32)
    found: np.ndarray = logistic(balanced_logit(weights, batch.arms.tokens, hidden))
    return found


def predicted(
    weights: Mapping[str, np.ndarray], intent: Mapping[str, np.ndarray], batch: Batch
) -> tuple[np.ndarray, FloatArray, FloatArray]:
    """Returns context (2B,W), mean (2B,F+1,3,3), m, and error's scale (2B,F+1,3), m, of a batch."""
    linear = LinearMotion(weights["linear.map"].astype(np.float64))
    z = network.context(weights, batch.arms.tokens, intents(intent, batch))
    base = linear.displacement(batch.arms.joints[:, :, :3])
    return z, base + network.residual(weights, z), network.error_scale(weights, z)


def errors(
    weights: Mapping[str, np.ndarray], intent: Mapping[str, np.ndarray], batch: Batch
) -> FloatArray:
    """Returns the errors (2B,F,3) of the mean, m, of each step and joint of a batch."""
    _, mean, _ = predicted(weights, intent, batch)
    off: FloatArray = np.linalg.norm((batch.displacement - mean)[:, 1:], axis=3)
    return off


def shortened(training: MotionTraining, steps: int) -> MotionTraining:
    """Returns a training of at most `steps` steps or batches a part."""
    parts = {
        name: replace(getattr(training, name), steps=steps, every=min(500, steps))
        for name in ("residual", "denoiser", "initialiser")
    }
    counts = {
        name: min(steps, getattr(training, name))
        for name in ("linear_batches", "context_batches", "familiar_batches")
    }
    return replace(training, **parts, **counts)


def _conformal(rows: FloatArray) -> np.ndarray:
    """Returns the smallest values (…) that hold `COVERED` of the next row of N rows (N,…)."""
    level = min(1.0, COVERED * (1.0 + 1.0 / len(rows)))
    return np.quantile(rows, level, axis=0).astype(np.float32)


def _distance(off: torch.Tensor) -> torch.Tensor:
    """Returns mean distances (…) of motions (…,F,3,3)."""
    return (off.square().sum(-1) + 1e-8).sqrt().mean((-1, -2))


def _mean_apart(samples: torch.Tensor) -> torch.Tensor:
    """Returns the mean distance (B,) of two of S samples (B,S,F,3,3), drawn independently.

    All pairs count: the distances of some could be made large while the others vanish.
    """
    count = samples.shape[1]
    total = torch.zeros(len(samples), device=samples.device)
    for k in range(1, count // 2 + 1):
        # sample and the k-th after it; at half the way round each pair is met twice
        share = 1.0 if 2 * k == count else 2.0
        total = total + share * _distance(samples - samples.roll(k, 1)).mean(1)
    return total / count


def _file(folder: Path | None, stage: str) -> Path | None:
    return None if folder is None else folder / f"{stage}.checkpoint.safetensors"
