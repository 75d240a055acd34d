"""The learned predictor of a person: intent, mean, regions and samples of both arms' motion.

The history's gaps are filled, and each arm is brought into its own frame. An attention network
tells intent. A residual network adds to the linear predictor's motion, and tells how far off the
sum may be. The result is weighed with simpler predictors by how each did on this person. Samples
come from leapfrog diffusion. Last, limbs get their lengths, and joints their limits.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from drake_dress.machine import one_thread
from drake_dress.models.arrays import BoolArray, FloatArray
from drake_dress.models.human.history import Sampling
from drake_dress.models.human.learned import diffusion, network, plain_experts
from drake_dress.models.human.learned.arm_frame import ArmFrames
from drake_dress.models.human.learned.experts import ExpertMemory, ExpertSettings
from drake_dress.models.human.learned.familiarity import distance
from drake_dress.models.human.learned.filling import filled
from drake_dress.models.human.learned.forecast import Forecast, PersonHistory
from drake_dress.models.human.learned.intent import balanced_logit
from drake_dress.models.human.learned.kinematics import Lengths, person_like
from drake_dress.models.human.learned.layers import logistic
from drake_dress.models.human.learned.linear import LinearMotion
from drake_dress.models.human.learned.network import FUTURE, HISTORY, PERIOD
from drake_dress.models.human.learned.tokens import ArmTokens, Windows, arm_tokens
from drake_dress.models.immutable import Immutable

SAMPLING = Sampling(HISTORY, PERIOD)
EXPERTS = (*plain_experts.NAMES, "linear", "network")
_NETWORK = EXPERTS.index("network")


@dataclass(frozen=True)
class Networks:
    """Weights of everything that is learned, by name.

    Attributes:
        intent: of the intent network.
        motion: of the residual network, the diffusion, the regions and the familiarity.
        linear: the linear predictor.
    """

    intent: Mapping[str, np.ndarray]
    motion: Mapping[str, np.ndarray]

    @property
    def linear(self) -> LinearMotion:
        """The linear predictor."""
        return LinearMotion(self.motion["linear.map"].astype(np.float64))


@dataclass(frozen=True)
class PredictorMemory(Immutable):
    """What is carried from one forecast to the next.

    Attributes:
        experts: how the experts did.
        poses: (time, s, (6,3) joints, m) of the last forecasts' row 0, newest last.
    """

    experts: ExpertMemory = ExpertMemory()
    poses: tuple[tuple[float, FloatArray], ...] = ()


@dataclass(frozen=True)
class _Arms:
    """Predictions in the arms' frames: mean and radii of the network, samples, (2,…) each."""

    mean: FloatArray
    radius: FloatArray
    samples: FloatArray


@dataclass(frozen=True)
class LearnedPredictor:
    """Predicts a person; see the module's docstring.

    Attributes:
        networks: weights.
        experts: settings of their weighing.
        sampling: of the history.
    """

    networks: Networks
    experts: ExpertSettings = ExpertSettings()
    sampling: Sampling = SAMPLING

    def begin(self) -> PredictorMemory:
        """Returns the memory before the first forecast."""
        return PredictorMemory()

    def forecast(
        self, history: PersonHistory, memory: PredictorMemory
    ) -> tuple[Forecast, PredictorMemory]:
        """Returns the forecast from the last sample on; see `PersonPredictor`."""
        with one_thread():
            return self._forecast(history, memory)

    def _forecast(
        self, history: PersonHistory, memory: PredictorMemory
    ) -> tuple[Forecast, PredictorMemory]:
        known = memory.experts.compared(history.time, history.joints[-1], PERIOD, self.experts)
        oldest = self._pose_at(memory, history.time - (HISTORY - 1) * PERIOD)
        joints, seen = filled(history.joints[None], oldest)
        arms = arm_tokens(_windows(joints, seen, history.sleeves[None]))
        hidden = np.tile(~np.any(np.isfinite(history.joints), axis=(1, 2)), (2, 1))
        intent = logistic(
            balanced_logit(self.networks.intent, arms.tokens, hidden.astype(np.float32))
        )
        linear = self.networks.linear.displacement(arms.joints[:, :, :3])
        is_new = np.count_nonzero(seen[0].any(axis=1)) < network.FEWEST
        is_linear = bool(is_new or np.max(distance(self.networks.motion, arms.tokens)) > 1.0)
        found = self._arms(arms, arms.joints[:, -1:, :3] + linear, intent, is_linear)
        lengths = Lengths.of(joints, seen)
        mapped = _in_world(arms.frames, arms.joints[:, -1:, :3] + linear)
        # of a person who was just seen the network says anything, which is not to be remembered
        learned = mapped if is_new else _in_world(arms.frames, found.mean)
        experts = np.stack([*plain_experts.plain_experts(joints[0]), mapped, learned])
        experts = person_like(experts[None], lengths, joints[:, -1])[0]
        allowed = np.ones(len(EXPERTS))
        allowed[_NETWORK] = 0.0 if is_linear else 1.0
        weights = known.weights(self.experts, allowed, FUTURE + 1)
        mean = (weights[..., None] * experts).sum(axis=0)
        # what is hidden now is known by the network alone
        lost = ~seen[0, -1]
        if not is_linear:
            mean[:, lost] = experts[_NETWORK][:, lost]
        moved = mean - _in_world(arms.frames, found.mean)
        size = np.repeat(known.size, 3)
        radius = size * np.concatenate([found.radius[0], found.radius[1]], axis=1)
        samples = np.stack(
            [_in_world(arms.frames, found.samples[:, k]) for k in range(diffusion.SAMPLES)]
        )
        both = np.concatenate([mean[None], samples + moved])[None]
        both = person_like(both, lengths, joints[:, -1])[0]
        forecast = Forecast(
            history.time, PERIOD, both[0], radius, both[1:], intent, is_linear, seen[0, -1]
        )
        lasting = FUTURE * PERIOD
        after = known.remembering(history.time, experts, both[0], radius, lasting)
        poses = tuple(p for p in memory.poses if p[0] > history.time - lasting - 0.5 * PERIOD)
        return forecast, PredictorMemory(after, (*poses, (history.time, both[0, 0])))

    def _arms(
        self, arms: ArmTokens, linear: FloatArray, intent: FloatArray, is_linear: bool
    ) -> _Arms:
        """Returns the predictions of both arms.

        Args:
            arms: tokens.
            linear: (2,F+1,3,3) the linear predictor's, m, in the arms' frames.
            intent: (2,) probabilities.
            is_linear: whether the network is not to be believed; radii are then those of the linear
                predictor, and samples as far apart as these say.
        """
        weights = self.networks.motion
        z = network.context(weights, arms.tokens, intent)
        mean = linear + network.residual(weights, z)
        scale = network.error_scale(weights, z)
        latent = diffusion.samples(weights, z)
        motion = diffusion.motion_of(weights, latent) * scale[:, None, 1:, :, None]
        radius = network.radius(weights, z)
        if is_linear:
            wider = network.linear_radius(weights) / radius
            motion, radius = motion * wider[:, None, 1:, :, None], wider * radius
        motion = np.concatenate([np.zeros_like(motion[:, :, :1]), motion], axis=2)
        return _Arms(mean, radius, mean[:, None] + motion)

    @staticmethod
    def _pose_at(memory: PredictorMemory, time: float) -> FloatArray | None:
        """Returns (1,6,3) the joints of an earlier forecast at `time`, s; None if there is none."""
        for at, pose in memory.poses:
            if abs(at - time) < 0.5 * PERIOD:
                return pose[None]
        return None


def _windows(joints: FloatArray, seen: BoolArray, sleeves: FloatArray) -> Windows:
    shown = np.all(np.isfinite(sleeves), axis=3)
    return Windows(joints, seen, np.where(shown[..., None], sleeves, 0.0), shown, PERIOD)


def _in_world(frames: ArmFrames, points: FloatArray) -> FloatArray:
    """Returns (F+1,6,3), m, world, of points (2,F+1,3,3) in the frames of left and right arm."""
    world = frames.world(points)
    return np.concatenate([world[0], world[1]], axis=1)
