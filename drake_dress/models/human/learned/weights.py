"""Reads and writes the weights of the predictors: safetensors, which hold numbers and no code."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path

import numpy as np
from safetensors import SafetensorError, safe_open
from safetensors.numpy import save_file

from drake_dress.errors import UserError
from drake_dress.file_output import replacing
from drake_dress.models.human.learned import diffusion, network
from drake_dress.models.human.learned.familiarity import FAMILIAR_SHAPES
from drake_dress.models.human.learned.intent import intent_weights
from drake_dress.models.human.learned.network import FUTURE, HISTORY
from drake_dress.models.human.learned.predictor import LearnedPredictor, Networks
from drake_dress.models.human.learned.recurrent import RecurrentPredictor, recurrent_weights
from drake_dress.models.human.learned.ridge import RidgePredictor

SHIPPED = Path(__file__).parent / "shipped"
INTENT, MOTION, RECURRENT = (f"{name}.safetensors" for name in ("intent", "motion", "recurrent"))
# Files by the network that `drake-dress train` names.
FILES = {"intent": INTENT, "motion": MOTION, "recurrent": RECURRENT}
Arrays = dict[str, np.ndarray]


def read_weights(path: Path, shapes: Mapping[str, tuple[int, ...]]) -> Arrays:
    """Returns the arrays of a file; executes nothing that it holds.

    Args:
        path: of the file.
        shapes: names and shapes that it must have.

    Raises:
        UserError: the file cannot be read, or is not one of these weights.
    """
    expected = "expected weights written by drake-dress train"
    if not path.is_file():
        raise UserError(str(path), "", f"no such file, {expected}")
    try:
        with safe_open(path, framework="numpy") as file:
            arrays = {name: file.get_tensor(name) for name in file.keys()}  # noqa: SIM118
    except (SafetensorError, OSError, ValueError, TypeError, AttributeError) as error:
        raise UserError(str(path), "", f"cannot be read as safetensors, {expected}") from error
    for name, shape in shapes.items():
        if name not in arrays:
            raise UserError(str(path), name, f"is missing, {expected}")
        array = arrays[name]
        if array.shape != shape or array.dtype != np.float32:
            found = f"is {array.dtype} {list(array.shape)}"
            raise UserError(str(path), name, f"{found}, expected float32 {list(shape)}")
        if not np.all(np.isfinite(array)):
            raise UserError(str(path), name, "holds numbers that are not finite")
    return {name: arrays[name] for name in shapes}


def write_weights(path: Path, weights: Mapping[str, np.ndarray], told: Mapping[str, str]) -> None:
    """Writes weights atomically, with what is told of them as metadata."""
    arrays = {k: np.ascontiguousarray(v, dtype=np.float32) for k, v in weights.items()}
    with replacing(path) as partial:
        save_file(arrays, partial, dict(told))


def intent_shapes() -> dict[str, tuple[int, ...]]:
    """Returns names and shapes of the intent network's weights."""
    return _shapes(intent_weights(np.random.default_rng(0)))


def motion_shapes() -> dict[str, tuple[int, ...]]:
    """Returns names and shapes of the weights of everything that predicts motion."""
    rng = np.random.default_rng(0)
    drawn = network.motion_weights(rng) | diffusion.denoiser_weights(rng)
    shapes = _shapes(drawn | diffusion.initialiser_weights(rng)) | FAMILIAR_SHAPES
    return shapes | {
        "linear.map": (3, HISTORY - 1, FUTURE),
        "latent.latent": (diffusion.VALUES, diffusion.LATENT),
        "latent.motion": (diffusion.LATENT, diffusion.VALUES),
        "region.factor": (FUTURE + 1, 3),
        "region.linear": (FUTURE + 1, 3),
    }


@lru_cache
def networks(folder: Path = SHIPPED) -> Networks:
    """Returns the networks in a folder, or those of the package.

    Raises:
        UserError: a file is missing or unusable.
    """
    return Networks(
        read_weights(folder / INTENT, intent_shapes()),
        read_weights(folder / MOTION, motion_shapes()),
    )


def learned_predictor(folder: Path = SHIPPED) -> LearnedPredictor:
    """Returns the predictor with the weights in a folder, or with those of the package."""
    return LearnedPredictor(networks(folder))


def ridge_predictor(folder: Path = SHIPPED) -> RidgePredictor:
    """Returns the linear predictor with the map in a folder, or with that of the package."""
    return RidgePredictor(networks(folder).linear)


def recurrent_shapes() -> dict[str, tuple[int, ...]]:
    """Returns names and shapes of the recurrent network's weights."""
    return _shapes(recurrent_weights(np.random.default_rng(0)))


@lru_cache
def recurrent_predictor(folder: Path = SHIPPED) -> RecurrentPredictor:
    """Returns the recurrent predictor with the weights in a folder, or those of the package."""
    return RecurrentPredictor(read_weights(folder / RECURRENT, recurrent_shapes()))


def _shapes(weights: Mapping[str, np.ndarray]) -> dict[str, tuple[int, ...]]:
    return {name: array.shape for name, array in weights.items()}
