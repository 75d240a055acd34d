"""Errors on held-out sequences: of the mean, of the best sample, of the regions, and of intent.

Windows are looked at one by one, so nothing is adapted to the person.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from drake_dress.learning.motion.windows import Batch, Sequences, WindowSource
from drake_dress.learning.training.intent import logits
from drake_dress.learning.training.motion import predicted
from drake_dress.models.arrays import BoolArray, FloatArray
from drake_dress.models.human.learned import diffusion, network
from drake_dress.models.human.learned.linear import LinearMotion
from drake_dress.models.human.learned.network import FUTURE, HISTORY, PERIOD
from drake_dress.models.human.learned.predictor import Networks
from drake_dress.models.human.prediction import ConstantVelocityPredictor, decayed

# Displacements (2B,F+1,3,3), m, that a baseline predicts for the arms of a batch.
Baseline = Callable[[Batch], FloatArray]
EVERY = 0.5  # s, between windows
_TOGETHER, _SEED = 1200, 9
_WINDOW = 5  # samples of a velocity
_HORIZONS = {"1 s": 10, "2 s": 20}
# As the shipped constant_velocity, s and m/s.
_DECAY, _FASTEST = ConstantVelocityPredictor.decay_time, ConstantVelocityPredictor.max_speed


@dataclass(frozen=True)
class HeldOut:
    """Results on the windows of one kind of sequences.

    Attributes:
        errors: by predictor and horizon: mean error of joints and steps up to it, m.
        best: mean error of the best of all samples over the whole horizon, m.
        covered: share of joints and steps in the regions.
        count: number of arms' windows.
    """

    errors: Mapping[str, Mapping[str, float]]
    best: float
    covered: float
    count: int


def held_out_batches(data: Sequences, noise: float, with_sleeves: bool = True) -> list[Batch]:
    """Returns the windows of all sequences, `EVERY` s apart.

    Args:
        data: sequences that nothing was trained on.
        noise: standard deviation of each observed coordinate, m.
        with_sleeves: whether sleeves are seen.
    """
    source = WindowSource(data, _SEED, noise=noise, with_sleeves=with_sleeves)
    return source.every(EVERY, _TOGETHER)


def begins(batch: Batch) -> BoolArray:
    """Returns whether each arm begins a movement by will within the horizon."""
    willed = batch.willed[:, HISTORY - 1 :] > 0
    found: BoolArray = np.any(willed[:, 1:] & ~willed[:, :-1], axis=1)
    return found


def goes_on(batch: Batch) -> BoolArray:
    """Returns whether each arm moves by will, and begins no other movement within the horizon."""
    found: BoolArray = (batch.intent > 0) & ~begins(batch)
    return found


def rests(batch: Batch) -> BoolArray:
    """Returns whether each arm moves by will neither now nor within the horizon."""
    found: BoolArray = (batch.intent == 0) & ~begins(batch)
    return found


@dataclass(frozen=True)
class WindowErrors:
    """Results on each of N windows of an arm.

    Attributes:
        errors: by predictor: (N,F) mean error of the joints at each step, m.
        best: (N,) mean error of the best of all samples, m.
        covered: (N,F,3) whether steps and joints are in the regions.
    """

    errors: Mapping[str, FloatArray]
    best: FloatArray
    covered: BoolArray

    def mean(self, chosen: BoolArray | None = None) -> HeldOut:
        """Returns the means over the `chosen` (N,) windows, or over all; NaN if there are none."""
        which = slice(None) if chosen is None else chosen
        errors = {
            name: {label: _mean(rows[which, :steps]) for label, steps in _HORIZONS.items()}
            for name, rows in self.errors.items()
        }
        best = self.best[which]
        return HeldOut(errors, _mean(best), _mean(self.covered[which]), len(best))


def compared(
    batches: Sequence[Batch], networks: Networks, more: Mapping[str, Baseline]
) -> WindowErrors:
    """Returns the errors of the learned predictor and of all baselines.

    Args:
        batches: windows.
        networks: weights.
        more: baselines in addition to the plain ones.
    """
    baselines = plain(networks.linear) | dict(more)
    errors: dict[str, list[FloatArray]] = {name: [] for name in (*baselines, "learned")}
    best, covered = [], []
    for batch in batches:
        z, mean, scale = predicted(networks.motion, networks.intent, batch)
        off = np.linalg.norm(mean - batch.displacement, axis=3)
        errors["learned"].append(off[:, 1:].mean(axis=2))
        for name, of in baselines.items():
            away = np.linalg.norm(of(batch) - batch.displacement, axis=3)
            errors[name].append(away[:, 1:].mean(axis=2))
        covered.append((off <= network.radius(networks.motion, z))[:, 1:])
        best.append(_best(networks.motion, z, mean, scale, batch))
    return WindowErrors(
        {name: np.concatenate(rows) for name, rows in errors.items()},
        np.concatenate(best),
        np.concatenate(covered),
    )


def _mean(values: FloatArray | BoolArray) -> float:
    return float(values.mean()) if values.size else float("nan")


def plain(linear: LinearMotion) -> dict[str, Baseline]:
    """Returns the baselines without a network, by name."""
    return {
        "still": lambda batch: np.zeros_like(batch.displacement),
        "last velocity": _last_velocity,
        "constant velocity": lambda batch: _velocity(batch, None),
        "damped velocity": lambda batch: _velocity(batch, _DECAY),
        "ridge": lambda batch: linear.displacement(batch.arms.joints[:, :, :3]),
    }


@dataclass(frozen=True)
class IntentScore:
    """How well intent is told.

    Attributes:
        accuracy: share of right answers.
        balanced: mean of the shares of right answers where the arm moves by will and where it does
            not; most windows of the latter would be right if the answer were always no.
        area: area under the curve of hits over false alarms.
        count: number of arms' windows.
        willed: share of them by will.
    """

    accuracy: float
    balanced: float
    area: float
    count: int
    willed: float


def intent_score(
    batches: Sequence[Batch], weights: Mapping[str, np.ndarray], steps: int
) -> IntentScore:
    """Returns the score after `steps` steps of one and the same intent."""
    found, wanted = [], []
    for batch in batches:
        same = batch.willed[:, HISTORY - steps : HISTORY] == batch.intent[:, None]
        chosen = np.all(same, axis=1)
        found.append(logits(weights, batch, steps)[chosen])
        wanted.append(batch.intent[chosen] > 0)
    logit, true = np.concatenate(found), np.concatenate(wanted)
    right = (logit > 0.0) == true
    of_both = [float(right[which].mean()) for which in (true, ~true) if which.any()]
    return IntentScore(
        float(np.mean(right)),
        float(np.mean(of_both)),
        area_under_curve(logit, true),
        len(true),
        float(true.mean()),
    )


def area_under_curve(score: FloatArray, true: BoolArray) -> float:
    """Returns the probability that a true one scores higher than another; NaN without both."""
    positive, negative = int(true.sum()), int((~true).sum())
    if not positive or not negative:
        return float("nan")
    # ranks with ties shared (Mann and Whitney 1947)
    values, place, counts = np.unique(score, return_inverse=True, return_counts=True)
    del values
    rank = (np.cumsum(counts) - 0.5 * (counts - 1))[place]
    above = rank[true].sum() - 0.5 * positive * (positive + 1)
    return float(above / (positive * negative))


def _best(
    weights: Mapping[str, np.ndarray],
    z: np.ndarray,
    mean: FloatArray,
    scale: FloatArray,
    batch: Batch,
) -> FloatArray:
    latent = diffusion.samples(weights, z)
    motion = diffusion.motion_of(weights, latent) * scale[:, None, 1:, :, None]
    wanted = (batch.displacement - mean)[:, None, 1:]
    off: FloatArray = np.linalg.norm(motion - wanted, axis=4).mean(axis=(2, 3)).min(axis=1)
    return off


def _last_velocity(batch: Batch) -> FloatArray:
    moved = batch.arms.joints[:, -1:, :3] - batch.arms.joints[:, -2:-1, :3]
    result: FloatArray = np.arange(FUTURE + 1)[:, None, None] * moved
    return result


def _velocity(batch: Batch, decay: float | None) -> FloatArray:
    joints = batch.arms.joints[:, -_WINDOW:, :3]
    first, second = np.triu_indices(_WINDOW, 1)
    apart = (PERIOD * (second - first))[None, :, None, None]
    velocity = np.median((joints[:, second] - joints[:, first]) / apart, axis=1)
    ahead = PERIOD * np.arange(FUTURE + 1, dtype=np.float64)
    if decay is not None:
        speed = np.linalg.norm(velocity, axis=2, keepdims=True)
        velocity = velocity * np.minimum(1.0, _FASTEST / np.maximum(speed, 1e-12))
        ahead = decayed(ahead, decay)
    result: FloatArray = ahead[None, :, None, None] * velocity[:, None]
    return result
