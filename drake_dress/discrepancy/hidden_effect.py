"""Draws the effect that is hidden in generated data, at a relevant size."""

from __future__ import annotations

import difflib
from collections.abc import Callable, Mapping

import numpy as np

from drake_dress.discrepancy.unlisted_effects import UNLISTED
from drake_dress.errors import UserError
from drake_dress.models.effects.effect import Effect
from drake_dress.models.effects.registry import EFFECTS, HOW_TO_LOAD, own_effects

NOTHING, RANDOM = "nothing", "random"

Draw = Callable[[np.random.Generator, float], dict[str, float]]


def draw_effect(name: str, rng: np.random.Generator, size: float = 1.0) -> Effect:
    """Returns the effect called `name` with random parameters.

    Args:
        name: key of `EFFECTS` or `UNLISTED`.
        rng: random number generator.
        size: factor on its strength; 1 is a relevant size.
    """
    kind = EFFECTS.get(name) or UNLISTED[name]
    draw = kind.draw if name in own_effects() else ALL_SIZES[name]
    return kind(**draw(rng, size))


def hideable() -> tuple[str, ...]:
    """Returns the effects that `random` chooses from: the package's, then registered ones."""
    return (*SIZES, *own_effects())


def draw_hidden(what: str, rng: np.random.Generator, size: float = 1.0) -> list[Effect]:
    """Returns the hidden effects with random parameters.

    Args:
        what: names of effects joined by "+", `nothing`, or `random` for one of `hideable()` or
            nothing.
        rng: random number generator.
        size: factor on the effects' strength.

    Raises:
        UserError: an effect is unknown or repeated, or a parameter of this size is out of bounds.
    """
    if what == RANDOM:
        what = str(rng.choice([NOTHING, *hideable()]))
    if what == NOTHING:
        return []
    names = what.split("+")
    known = [*own_effects(), *ALL_SIZES]
    for name in names:
        if name not in known:
            near = difflib.get_close_matches(name, known, n=1)
            expected = f"did you mean {near[0]}?" if near else f"expected one of {', '.join(known)}"
            raise UserError(
                "--hide", name, f"is no effect that can be hidden ({HOW_TO_LOAD}), {expected}"
            )
        if names.count(name) > 1:
            raise UserError("--hide", name, "stands twice, expected it once")
    try:
        return [draw_effect(name, rng, size) for name in names]
    except ValueError as error:
        raise UserError("--size", f"{size:g}", f"at this size {error}") from None


def _between(low: float, high: float, both: bool = False) -> Callable[..., float]:
    def draw(rng: np.random.Generator, size: float) -> float:
        value = size * rng.uniform(low, high)
        return float(value * rng.choice([-1.0, 1.0]) if both else value)

    return draw


def _one(name: str, low: float, high: float, both: bool = False) -> Draw:
    draw = _between(low, high, both)
    return lambda rng, size: {name: draw(rng, size)}


def _direction(names: str, low: float, high: float) -> Draw:
    """Returns a draw of vectors with random direction and a length from `low` to `high`."""

    def draw(rng: np.random.Generator, size: float) -> dict[str, float]:
        vector = rng.standard_normal(len(names.split()))
        vector *= size * rng.uniform(low, high) / np.linalg.norm(vector)
        return dict(zip(names.split(), vector.tolist(), strict=True))

    return draw


def _local_mass(rng: np.random.Generator, size: float) -> dict[str, float]:
    # a pocket anywhere around the body, between hem and chest
    angle = rng.uniform(-np.pi, np.pi)
    return {
        "mass": size * rng.uniform(0.03, 0.06),
        "x": 0.11 * np.cos(angle),
        "y": 0.2 * np.sin(angle),
        "z": rng.uniform(-0.58, -0.3),
    }


def _wind(rng: np.random.Generator, size: float) -> dict[str, float]:
    angle, speed = rng.uniform(-np.pi, np.pi), size**0.5 * rng.uniform(0.9, 1.4)
    return {"x": speed * np.cos(angle), "y": speed * np.sin(angle), "z": 0.0}


def _slip(rng: np.random.Generator, size: float) -> dict[str, float]:
    return {"rate": size * rng.uniform(0.006, 0.012), "threshold": 0.0}


def _magnetised_cuff(rng: np.random.Generator, size: float) -> dict[str, float]:
    return {
        "strength": size * rng.uniform(1.5, 3.0),
        "x": rng.uniform(-0.1, 0.1),
        "y": rng.uniform(0.15, 0.3),
        "z": rng.uniform(-0.35, -0.25),
    }


def _snag(rng: np.random.Generator, size: float) -> dict[str, float]:
    # where the front of a garment passes when it is pressed against the held-out arm
    return {
        "stiffness": size * rng.uniform(4.0, 8.0),
        "radius": 0.05,
        "x": rng.uniform(0.12, 0.2),
        "y": rng.uniform(0.4, 0.62),
        "z": rng.uniform(1.05, 1.25),
    }


SIZES: Mapping[str, Draw] = {
    "air_drag": _one("coefficient", 1.5, 3.0),
    "wind": _wind,
    "surface_density": _one("added", 0.03, 0.06, both=True),
    "local_mass": _local_mass,
    "stretch_stiffness": _one("added", 150.0, 300.0, both=True),
    "anisotropic_stiffness": _one("warp", 600.0, 1500.0),
    "strain_stiffening": _one("rate", 10.0, 25.0),
    "bending_stiffness": _one("added", 1.5e-3, 2.5e-3, both=True),
    "internal_damping": _one("added", 0.015, 0.03),
    "rest_size": _one("strain", 0.015, 0.03, both=True),
    "friction": _one("added", 0.2, 0.29, both=True),
    "velocity_dependent_friction": _one("rate", 2.0, 4.0),
    "anisotropic_friction": _one("contrast", 0.6, 0.9, both=True),
    "adhesion": _one("strength", 60.0, 120.0),
    "limb_radius": _one("added", 0.01, 0.02, both=True),
    "limb_compliance": _one("compliance", 0.02, 0.04),
    "gripper_latency": _one("delay", 0.04, 0.08),
    "gripper_slip": _slip,
    "gripper_compliance": _one("compliance", 0.006, 0.012),
    "time_offset": _one("offset", 0.03, 0.06, both=True),
    "camera_rotation": _direction("x y z", 0.008, 0.016),
    "camera_translation": _direction("x y z", 0.008, 0.016),
    "gravity_tilt": _direction("about_x about_y", 0.025, 0.05),
}

ALL_SIZES: Mapping[str, Draw] = {
    **SIZES,
    "magnetised_cuff": _magnetised_cuff,
    "snag": _snag,
    "sliding_layer": _one("stress", 0.4, 0.8),
}
