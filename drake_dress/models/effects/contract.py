"""The contract of an effect, and its checks.

`check_class` looks at the class alone and is quick: registration calls it. `check_effect` also
calls the effect on sample arguments of its kind:

    off          with all sizes 0 it changes nothing
    pure         the same arguments give the same, finite result, and are not modified
    derivative   agrees with central differences, for every parameter
    bounds       values outside them are refused
    search       the effects of `starts` and `draw` are within the bounds, and not off
"""

from __future__ import annotations

import copy
import dataclasses
import inspect
import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from drake_dress.errors import UserError
from drake_dress.models.arrays import FloatArray
from drake_dress.models.cloth.elements import make_elements
from drake_dress.models.cloth.material import Material
from drake_dress.models.cloth.state import GRAVITY
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
    Parameter,
    ShapeEffect,
    Sheet,
    Sliding,
    StretchEffect,
)
from drake_dress.models.human.body import BodyMeasures
from drake_dress.models.register import check_name, is_name

KINDS: tuple[type[Effect], ...] = (
    ForceEffect,
    MaterialEffect,
    ShapeEffect,
    MassEffect,
    GravityEffect,
    FibreEffect,
    StretchEffect,
    FrictionEffect,
    AdhesionEffect,
    BodyEffect,
    CameraEffect,
    ClockEffect,
    MountEffect,
)

# Kinds whose `apply` returns its argument, changed.
_CHANGING = (MaterialEffect, ShapeEffect, GravityEffect, BodyEffect, ClockEffect, CameraEffect)

# Tapered arms with given masses, so that an effect on any of them shows.
_BODY = BodyMeasures(upper_arm_mass=1.6, forearm_mass=1.2, elbow_radius=0.04, wrist_radius=0.03)

# Parameters are checked at this fraction of their typical size.
_SHARE = 0.8
# Step of the differences, in typical sizes, and largest error of derivatives, relative to the
# largest of them.
_STEP, _AGREEMENT = 1e-5, 1e-4
# Differences below this times the result are rounding errors, not derivatives.
_ROUNDING = 1e-6
# Largest change by `apply` followed by `inverse`, m.
_THERE_AND_BACK = 1e-9


def check_class(kind: type[Effect]) -> None:
    """Checks a class against the contract without calling it.

    Raises:
        UserError: it breaks the contract; the message says how.
    """
    if not (isinstance(kind, type) and issubclass(kind, KINDS)):
        listed = ", ".join(k.__name__ for k in KINDS[:-2])
        raise UserError(f"effect {_name(kind)}", "", f"is no effect, expected one of {listed}")
    source = f"effect {kind.__name__}"
    made: Any = vars(kind).get("__dataclass_params__")
    if made is None or not made.frozen:
        raise UserError(
            source, "", "is no frozen dataclass, expected @dataclass(frozen=True) on the class"
        )
    check_name(source, kind, "air_drag")
    for entry in dataclasses.fields(kind):
        if not entry.metadata:
            raise UserError(source, entry.name, "has no unit and bounds, expected = parameter(…)")
    for p in kind.parameters():
        _check_parameter(source, p)
    if not kind.sizes():
        raise UserError(
            source, "", "has no size, expected a parameter without shape= that switches it on"
        )
    methods = ["apply", "derivative"] + ["inverse"] * issubclass(kind, CameraEffect)
    base = next(k for k in KINDS if issubclass(kind, k))
    for method in methods:
        if getattr(kind, method) is getattr(base, method):
            raise UserError(
                source,
                method,
                f"is missing, expected {method}{inspect.signature(getattr(base, method))}",
            )


def check_effect(kind: type[Effect]) -> None:
    """Checks an effect against the whole contract; for the tests of its author.

    Raises:
        UserError: it breaks the contract; the message says how.
    """
    check_class(kind)
    source, given = f"effect {kind.__name__}", sample_of(kind)
    _check_bounds(source, kind)
    _check_off(source, kind, given)
    effect = kind(**{p.name: _SHARE * p.typical for p in kind.parameters()})
    _check_purity(source, effect, given)
    if isinstance(effect, CameraEffect):
        back = effect.inverse(effect.apply(given[0]))
        if not np.abs(back - given[0]).max() < _THERE_AND_BACK:
            raise UserError(source, "inverse", "does not undo apply, expected the same points")
    for p in kind.parameters():
        _check_derivative(source, effect, p, given)
    _check_search(source, kind)


def sample_of(kind: type[Effect]) -> tuple[Any, ...]:
    """Returns arguments of `apply` for an effect of this kind, the same for each call."""
    return next(make for base, make in _SAMPLES.items() if issubclass(kind, base))()


def _check_parameter(source: str, p: Parameter) -> None:
    """Checks a parameter's name, unit, bounds, default and typical size."""
    if not is_name(p.name) or p.name.endswith("_std"):
        raise UserError(
            source, p.name, "is no name of a parameter, expected lower case, not ending in _std"
        )
    if not (isinstance(p.unit, str) and p.unit.strip()):
        raise UserError(source, p.name, "has no unit, expected SI, or 1 for a pure number")
    if not all(math.isfinite(v) for v in (p.low, p.high, p.typical, p.off)) or p.low >= p.high:
        raise UserError(
            source, p.name, f"has bounds {p.low} and {p.high}, expected finite ones, low below high"
        )
    if not p.low <= p.off <= p.high:
        raise UserError(
            source, p.name, f"is {p.off:g} by default, expected {p.low:g} to {p.high:g}"
        )
    if not 0.0 < p.typical <= p.high:
        raise UserError(
            source, p.name, f"has typical size {p.typical:g}, expected above 0, up to {p.high:g}"
        )


def _check_bounds(source: str, kind: type[Effect]) -> None:
    for p in kind.parameters():
        beyond = 1e-3 * (p.high - p.low)
        for bad in (p.high + beyond, p.low - beyond, math.nan):
            try:
                kind(**{p.name: bad})
            except ValueError:
                continue
            raise UserError(
                source, p.name, f"is allowed to be {bad:g}, expected {p.low:g} to {p.high:g} only"
            )


def _check_off(source: str, kind: type[Effect], given: tuple[Any, ...]) -> None:
    """Checks that `apply` changes nothing with all sizes 0."""
    off: Any = kind()
    if not off.is_off:
        raise UserError(source, "is_off", "is False with all sizes 0, expected True")
    value = off.apply(*given)
    if issubclass(kind, _CHANGING):
        expected = _numbers(given[0])
    else:
        expected = np.full_like(_numbers(value), 1.0 if issubclass(kind, StretchEffect) else 0.0)
    found = _numbers(value)
    if found.shape != expected.shape or not np.allclose(found, expected, rtol=0.0, atol=1e-15):
        raise UserError(source, "apply", "changes something with all sizes 0, expected nothing")


def _check_purity(source: str, effect: Any, given: tuple[Any, ...]) -> None:
    """Checks that two calls of `apply` agree and do not modify their arguments."""
    lent = copy.deepcopy(given)
    first, second = (_numbers(effect.apply(*lent)) for _ in range(2))
    expected = _shape(effect, given)
    if first.shape != expected or not np.isfinite(first).all():
        raise UserError(
            source,
            "apply",
            f"gives {'numbers that are not finite' if first.shape == expected else first.shape}, "
            f"expected finite numbers of shape {expected}",
        )
    if not np.array_equal(first, second):
        raise UserError(
            source, "apply", "gives another result when called again, expected the same"
        )
    for was, now in zip(_leaves(given), _leaves(lent), strict=True):
        if not np.array_equal(was, now):
            raise UserError(source, "apply", "changes its arguments, expected a new array")


def _check_derivative(source: str, effect: Any, p: Parameter, given: tuple[Any, ...]) -> None:
    """Checks the derivative by one parameter against central differences."""
    h, value = _STEP * p.typical, getattr(effect, p.name)
    above, below = (
        dataclasses.replace(effect, **{p.name: value + step}).apply(*given) for step in (h, -h)
    )
    difference = (_numbers(above) - _numbers(below)) / (2.0 * h)
    slope = _slope_numbers(effect.derivative(p.name, *given), above)
    if slope.shape != difference.shape:
        raise UserError(
            source,
            f"derivative by {p.name}",
            f"has shape {slope.shape}, expected {difference.shape} as apply",
        )
    largest = np.abs(difference).max(initial=0.0)
    scale = max(largest, _ROUNDING * np.abs(_numbers(above)).max(initial=0.0) / p.typical)
    off = np.abs(slope - difference)
    if not np.all(off <= _AGREEMENT * scale + 1e-7 * np.abs(difference)):
        worst = int(np.argmax(np.nan_to_num(off, nan=np.inf)))
        raise UserError(
            source,
            f"derivative by {p.name}",
            f"is {slope.flat[worst]:.6g} where central differences say "
            f"{difference.flat[worst]:.6g}, expected them within {_AGREEMENT:g} of the largest",
        )


def _check_search(source: str, kind: type[Effect]) -> None:
    rng = np.random.default_rng(3)
    made: tuple[tuple[str, Callable[[], Sequence[Effect]]], ...] = (
        ("starts", lambda: kind.starts(_sheet().rest_position)),
        ("draw", lambda: [kind(**kind.draw(rng, 1.0)) for _ in range(20)]),
    )
    for method, make in made:
        try:
            effects = make()
        except (TypeError, ValueError) as error:
            raise UserError(source, method, f"gives what is no such effect: {error}") from error
        if not effects or any(type(e) is not kind or e.is_off for e in effects):
            raise UserError(source, method, f"gives {effects}, expected {kind.__name__} not off")


def _shape(effect: Effect, given: tuple[Any, ...]) -> tuple[int, ...]:
    """Returns the shape of the result of `apply`, as an array of numbers."""
    if isinstance(effect, MassEffect | AdhesionEffect):
        return (given[0].elements.node_count,)
    if isinstance(effect, FibreEffect):
        return (len(given[0].elements.triangle),)
    if isinstance(effect, FrictionEffect):
        return (len(given[1].nodes),)
    return _numbers(given[1] if isinstance(effect, ForceEffect) else given[0]).shape


def _numbers(value: Any) -> FloatArray:
    """Returns a result of `apply` as an array; the fields of a dataclass in their order.

    A field that is not given counts as 0.
    """
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        value = [0.0 if v is None else float(v) for v in dataclasses.asdict(value).values()]
    return np.asarray(value, dtype=np.float64)


def _slope_numbers(slope: Any, value: Any) -> FloatArray:
    """Returns a derivative as an array; that of a dataclass maps changed fields to slopes."""
    if isinstance(slope, Mapping):
        slope = [slope.get(f.name, 0.0) for f in dataclasses.fields(value)]
    return np.asarray(slope, dtype=np.float64)


def _leaves(value: Any) -> list[Any]:
    """Returns the arrays and numbers in arguments."""
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        value = [getattr(value, f.name) for f in dataclasses.fields(value)]
    if isinstance(value, tuple | list):
        return [leaf for item in value for leaf in _leaves(item)]
    return [value]


def _name(kind: Any) -> str:
    return getattr(kind, "__name__", repr(kind))


def _sheet() -> Sheet:
    """Returns a vertical sheet of 20 by 28 cm with the warp running down."""
    columns, rows, spacing = 6, 8, 0.04
    i, k = np.meshgrid(np.arange(columns), np.arange(rows), indexing="ij")
    rest = np.stack([i * spacing, np.zeros(i.shape), -k * spacing], axis=2).reshape(-1, 3)
    a = (i[:-1, :-1] * rows + k[:-1, :-1]).ravel()
    faces = np.concatenate(
        [np.stack([a, a + rows, a + 1], 1), np.stack([a + rows, a + rows + 1, a + 1], 1)]
    )
    return Sheet(make_elements(rest, faces), rest, np.tile([0.0, 0.0, -1.0], (len(faces), 1)))


def _moving_sheet() -> tuple[Any, ...]:
    sheet, rng = _sheet(), np.random.default_rng(3)
    shape = sheet.rest_position.shape
    moved = sheet.rest_position + 0.01 * rng.standard_normal(shape)
    return sheet, moved, rng.standard_normal(shape)


def _sliding() -> tuple[Any, ...]:
    rng = np.random.default_rng(3)
    grain = rng.standard_normal((5, 3))
    grain /= np.linalg.norm(grain, axis=1)[:, None]
    nodes = np.arange(5, dtype=np.int32)
    velocity, force = 0.1 * rng.standard_normal((5, 3)), rng.standard_normal((5, 3))
    return 0.3, Sliding(nodes, velocity, force, grain)


def _vectors() -> tuple[Any, ...]:
    return (np.random.default_rng(3).standard_normal((4, 3)),)


_SAMPLES: Mapping[type[Effect], Callable[[], tuple[Any, ...]]] = {
    ForceEffect: _moving_sheet,
    MaterialEffect: lambda: (Material(0.3, 600.0, 3e-3, 0.003, 0.3, 0.003),),
    ShapeEffect: lambda: (_sheet().rest_position,),
    MassEffect: lambda: (_sheet(),),
    GravityEffect: lambda: (GRAVITY.copy(),),
    FibreEffect: lambda: (_sheet(),),
    StretchEffect: lambda: (np.random.default_rng(3).uniform(-0.05, 0.05, 12),),
    FrictionEffect: _sliding,
    AdhesionEffect: lambda: (_sheet(),),
    BodyEffect: lambda: (_BODY,),
    ClockEffect: lambda: (np.linspace(0.0, 1.0, 5),),
    CameraEffect: _vectors,
    MountEffect: _vectors,
}
