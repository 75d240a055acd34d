from collections.abc import Callable, Sequence

import numpy as np
import pytest

from drake_dress.models.arrays import FloatArray
from drake_dress.models.cloth.contact.obstacles import Obstacles
from drake_dress.models.cloth.explicit.explicit_bias import (
    ContactTypes,
    ExplicitBiasCloth,
    ExplicitSettings,
    Tape,
)
from drake_dress.models.cloth.explicit.rollout import Rollout, Seeds, roll_back, roll_out
from tests.models.cloth.explicit.inner.test_inner import HELD, MATERIAL, draped, limb

STEPS = 9


def _scene(h: float) -> tuple[ExplicitBiasCloth, FloatArray, FloatArray, FloatArray]:
    e, x, v, motion = draped(h)
    cloth = ExplicitBiasCloth(e, MATERIAL, h, HELD, settings=ExplicitSettings(tolerance=1e-12))
    rng = np.random.default_rng(3)
    motions = motion * rng.uniform(0.5, 1.5, size=(STEPS, 1, 1))
    return cloth, x, 0.2 * v, motions


def _loss_seeds(weight: FloatArray, wr: FloatArray) -> Callable[..., Seeds | None]:
    def seeds(j: int, x: FloatArray, v: FloatArray, r: FloatArray) -> Seeds | None:
        if j % 2:
            return None
        return weight[j], 0.01 * weight[j], wr[j]

    return seeds


def _loss(
    cloth: ExplicitBiasCloth,
    x: FloatArray,
    v: FloatArray,
    motions: FloatArray,
    bodies: Sequence[Obstacles],
    weight: FloatArray,
    wr: FloatArray,
) -> tuple[float, Rollout]:
    total = 0.0

    def observe(j: int, x: FloatArray, v: FloatArray, r: FloatArray) -> None:
        nonlocal total
        if j % 2 == 0:
            total += float(np.sum(weight[j] * (x + 0.01 * v)) + np.sum(wr[j] * r))

    run = roll_out(cloth, x, v, motions, bodies, observe)
    return total, run


def test_gradient_of_a_rollout_does_not_depend_on_the_checkpoints() -> None:
    cloth, x, v, motions = _scene(0.02)
    rng = np.random.default_rng(5)
    weight, wr = rng.normal(size=(STEPS, *x.shape)), 1e-3 * rng.normal(size=motions.shape)
    seeds = _loss_seeds(weight, wr)
    found = [
        roll_back(roll_out(cloth, x, v, motions, [limb()] * STEPS, segment=k), seeds, True)
        for k in (1, 3, STEPS)
    ]
    for other in found[1:]:
        np.testing.assert_array_equal(other.x, found[0].x)
        np.testing.assert_array_equal(other.held_motion, found[0].held_motion)
        np.testing.assert_array_equal(other.bodies, found[0].bodies)
        assert other.material == found[0].material


def test_gradient_of_a_free_rollout_matches_finite_differences() -> None:
    """Without contact nothing switches, so that the whole map can be differenced."""
    cloth, x, v, motions = _scene(0.02)
    nothing = [Obstacles.none()] * STEPS
    rng = np.random.default_rng(5)
    weight, wr = rng.normal(size=(STEPS, *x.shape)), 1e-3 * rng.normal(size=motions.shape)
    _, run = _loss(cloth, x, v, motions, nothing, weight, wr)
    g = roll_back(run, _loss_seeds(weight, wr))
    at = {"x": x, "v": v, "motions": motions}
    for name, slope in (("x", g.x), ("v", g.v), ("motions", g.held_motion)):
        numeric, exact = [], []
        for _ in range(6):
            d, step = rng.normal(size=at[name].shape), 1e-6
            high, low = (
                _loss(
                    cloth,
                    **{**at, name: at[name] + s * step * d},
                    bodies=nothing,
                    weight=weight,
                    wr=wr,
                )[0]
                for s in (1.0, -1.0)
            )
            numeric.append((high - low) / (2.0 * step))
            exact.append(float(np.sum(slope * d)))
        error = np.linalg.norm(np.subtract(numeric, exact))
        assert error < 1e-3 * np.linalg.norm(numeric), name


def test_a_rollout_keeps_as_many_states_as_the_root_of_its_steps() -> None:
    cloth, x, v, motions = _scene(0.02)
    many = np.repeat(motions, 6, axis=0)[:49]
    assert len(roll_out(cloth, x, v, many, [Obstacles.none()] * 49).states) == 7


def test_a_failed_step_is_named() -> None:
    cloth, x, v, motions = _scene(0.02)
    motions = motions.copy()
    motions[4, 2, 1] = np.nan
    before = x.copy()
    with pytest.raises(ValueError, match=r"step 4: motion of the held node 17 is .*nan"):
        roll_out(cloth, x, v, motions, [limb()] * STEPS)
    np.testing.assert_array_equal(x, before)


@pytest.mark.parametrize("name", ["position", "velocity"])
def test_input_that_is_not_finite_names_its_node_and_changes_nothing(name: str) -> None:
    cloth, x, v, motions = _scene(0.02)
    bad = {"position": x.copy(), "velocity": v.copy()}
    bad[name][31, 1] = np.inf
    kept = {key: value.copy() for key, value in bad.items()}
    with pytest.raises(ValueError, match=f"{name} node 31 is"):
        cloth.step(bad["position"], bad["velocity"], motions[0], limb())
    for key, value in bad.items():
        np.testing.assert_array_equal(value, kept[key])


@pytest.mark.parametrize("h", [0.005, 0.02])
def test_gradient_through_twenty_steps_in_contact_matches_finite_differences(h: float) -> None:
    """Contact types are held at every step, as the adjoint holds them."""
    cloth, x, v, _ = _scene(h)
    rng = np.random.default_rng(6)
    motion = h * np.tile([0.05, 0.02, -0.1], (4, 1))
    weight = rng.normal(size=x.shape)
    types: list[ContactTypes] = []
    tapes: list[Tape] = []
    x1, v1 = x, v
    for _ in range(20):
        x1, v1, _, tape = cloth.step(x1, v1, motion, limb())
        types.append(tape.types)
    assert min(np.count_nonzero(t.mode) for t in types) > 3

    def loss(x: FloatArray, v: FloatArray, motion: FloatArray) -> float:
        tapes.clear()
        for known in types:
            x, v, _, tape = cloth.step(x, v, motion, limb(), known)
            tapes.append(tape)
        return float(np.sum(weight * x))

    loss(x, v, motion)
    x_bar, v_bar, held_in = weight, np.zeros_like(x), np.zeros_like(motion)
    for tape in reversed(list(tapes)):
        g = cloth.vector_jacobian_product(tape, x_bar, v_bar, np.zeros_like(motion))
        x_bar, v_bar, held_in = g.x, g.v, held_in + g.held_motion
    at = {"x": x, "v": v, "motion": motion}
    for name, slope, step in (("x", x_bar, 1e-9), ("v", v_bar, 1e-8), ("motion", held_in, 1e-9)):
        numeric, exact = [], []
        for _ in range(6):
            d = rng.normal(size=at[name].shape)
            high, low = (loss(**{**at, name: at[name] + s * step * d}) for s in (1.0, -1.0))
            numeric.append((high - low) / (2.0 * step))
            exact.append(float(np.sum(slope * d)))
        a, b = np.array(numeric), np.array(exact)
        assert np.linalg.norm(a - b) < 1e-3 * np.linalg.norm(a), name


def test_arrays_written_to_after_a_rollout_do_not_change_its_derivative() -> None:
    cloth, x, v, motions = _scene(0.01)
    rng = np.random.default_rng(8)
    seeds = _loss_seeds(rng.normal(size=(STEPS, *x.shape)), rng.normal(size=(STEPS, 4, 3)))
    found = []
    for written in (False, True):
        given = [a.copy() for a in (x, v, motions)]
        run = roll_out(cloth, given[0], given[1], given[2], [limb()] * STEPS)
        if written:
            for array in given:
                array[...] = 7.0
        g = roll_back(run, seeds)
        found.append((g.x, g.v, g.held_motion, g.bodies))
    for calm, after in zip(*found, strict=True):
        np.testing.assert_array_equal(after, calm)
