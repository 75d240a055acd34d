"""What every effect of the list obeys."""

import dataclasses
from typing import Any

import numpy as np
import pytest

from drake_dress.models.arrays import FloatArray
from drake_dress.models.cloth.material import Material
from drake_dress.models.effects.effect import (
    AdhesionEffect,
    BodyEffect,
    CameraEffect,
    ClockEffect,
    Effect,
    FibreEffect,
    ForceEffect,
    FrictionEffect,
    GravityEffect,
    MassEffect,
    MaterialEffect,
    MountEffect,
    ShapeEffect,
    Sliding,
    StretchEffect,
)
from drake_dress.models.effects.registry import EFFECTS
from drake_dress.models.human.body import BodyMeasures
from tests.models.effects.scene import MATERIAL, sheet
from tests.present import present

# the names that users rely on
NAMES = """air_drag wind surface_density local_mass stretch_stiffness anisotropic_stiffness
strain_stiffening bending_stiffness internal_damping rest_size friction velocity_dependent_friction
anisotropic_friction adhesion limb_radius limb_compliance gripper_latency gripper_slip
gripper_compliance time_offset camera_rotation camera_translation gravity_tilt""".split()


def arguments(effect: Effect) -> tuple[Any, ...]:
    """Returns what an effect of this kind is applied to."""
    rng = np.random.default_rng(3)
    piece = sheet()
    n = len(piece.rest_position)
    if isinstance(effect, MaterialEffect):
        return (MATERIAL,)
    if isinstance(effect, ShapeEffect):
        return (piece.rest_position,)
    if isinstance(effect, MassEffect | FibreEffect | AdhesionEffect):
        return (piece,)
    if isinstance(effect, ForceEffect):
        moved = piece.rest_position + 0.01 * rng.standard_normal((n, 3))
        return (piece, moved, rng.standard_normal((n, 3)))
    if isinstance(effect, FrictionEffect):
        grain = rng.standard_normal((5, 3))
        grain /= np.linalg.norm(grain, axis=1)[:, None]
        sliding = Sliding(
            np.arange(5, dtype=np.int32),
            0.1 * rng.standard_normal((5, 3)),
            rng.standard_normal((5, 3)),
            grain,
        )
        return (0.3, sliding)
    return (argument_without_garment(effect, rng),)


def argument_without_garment(effect: Effect, rng: np.random.Generator) -> Any:
    """Returns what an effect is applied to that knows no garment."""
    if isinstance(effect, GravityEffect):
        return np.array([0.0, 0.0, -9.81])
    if isinstance(effect, StretchEffect):
        return rng.uniform(-0.05, 0.05, 12)
    if isinstance(effect, BodyEffect):
        return BodyMeasures()
    if isinstance(effect, ClockEffect):
        return np.linspace(0.0, 1.0, 5)
    if isinstance(effect, CameraEffect | MountEffect):
        return rng.standard_normal((4, 3))
    raise AssertionError(type(effect))


def numbers(value: Any) -> FloatArray:
    """Returns what an effect gives as one vector."""
    if isinstance(value, Material | BodyMeasures):
        return np.array([float(v) for v in dataclasses.asdict(value).values()])
    return np.asarray(value, dtype=float).ravel()


def slope_numbers(slope: Any, value: Any) -> FloatArray:
    if isinstance(slope, dict):
        return np.array([slope.get(f.name, 0.0) for f in dataclasses.fields(value)])
    return np.asarray(slope, dtype=float).ravel()


def typical(kind: type[Effect]) -> Any:
    return kind(**{p.name: 0.8 * p.typical for p in kind.parameters()})


def test_the_list_is_the_one_that_users_rely_on() -> None:
    assert list(EFFECTS) == NAMES


@pytest.mark.parametrize("name", NAMES)
def test_derivatives_are_those_of_finite_differences(name: str) -> None:
    effect = typical(EFFECTS[name])
    given = arguments(effect)
    for p in effect.parameters():
        h = 1e-5 * p.typical
        value = getattr(effect, p.name)
        above = dataclasses.replace(effect, **{p.name: value + h}).apply(*given)
        below = dataclasses.replace(effect, **{p.name: value - h}).apply(*given)
        difference = (numbers(above) - numbers(below)) / (2.0 * h)
        slope = slope_numbers(effect.derivative(p.name, *given), above)
        scale = max(np.abs(difference).max(), 1e-6 * np.abs(numbers(above)).max() / p.typical)
        np.testing.assert_allclose(slope, difference, atol=1e-4 * scale)


@pytest.mark.parametrize("name", NAMES)
def test_an_effect_that_is_off_changes_nothing(name: str) -> None:
    effect: Any = EFFECTS[name]()
    assert effect.is_off
    given = arguments(effect)
    value = numbers(effect.apply(*given))
    if isinstance(effect, MaterialEffect | ShapeEffect | GravityEffect | BodyEffect | ClockEffect):
        np.testing.assert_array_equal(value, numbers(given[0]))
    elif isinstance(effect, CameraEffect):
        np.testing.assert_allclose(value, numbers(given[0]), atol=1e-15)
    elif isinstance(effect, StretchEffect):
        np.testing.assert_array_equal(value, 1.0)
    else:
        np.testing.assert_allclose(value, 0.0, atol=1e-15)


@pytest.mark.parametrize("name", NAMES)
def test_values_beyond_the_bounds_are_refused_by_name(name: str) -> None:
    kind = EFFECTS[name]
    for p in kind.parameters():
        for bad in (p.high + 1e-3, p.low - 1e-3, np.nan):
            with pytest.raises(ValueError, match=f"{name}.{p.name}"):
                kind(**{p.name: bad})


@pytest.mark.parametrize("name", NAMES)
def test_docstrings_name_every_parameter(name: str) -> None:
    kind = EFFECTS[name]
    for p in kind.parameters():
        assert f"{p.name}:" in present(kind.__doc__)
        assert p.low <= p.off <= p.high
        assert p.typical > 0.0
