"""The plan's gradient and descent, on a small coat."""

import numpy as np
import pytest

from drake_dress.models.cloth.contact.obstacles import Obstacles
from drake_dress.models.cloth.elements import FloatArray, make_elements
from drake_dress.models.cloth.explicit_bias import ExplicitBiasCloth
from drake_dress.models.cloth.material import Material
from drake_dress.models.control.global_mpc import GlobalController, SleeveTarget, Weights
from drake_dress.models.dressing.sleeve import find_entry, loop_orientation, sleeve_state
from drake_dress.models.garment.coat import CoatParameters, make_coat
from drake_dress.models.sides import SIDES

HORIZON = 3


@pytest.fixture(scope="module")
def setting() -> tuple[GlobalController, FloatArray, tuple[SleeveTarget, SleeveTarget]]:
    mesh = make_coat(CoatParameters(), 0.05)
    held = np.concatenate([mesh.grasp[s] for s in SIDES])
    cloth = ExplicitBiasCloth(
        make_elements(mesh.rest_position, mesh.faces), Material(), 0.1, held, tolerance=1e-10
    )
    loops = tuple(np.asarray(mesh.loops[f"{s}_armhole"]) for s in SIDES)
    signs = tuple(float(loop_orientation(mesh, s)) for s in SIDES)
    controller = GlobalController(
        cloth,
        (len(mesh.grasp["left"]), len(mesh.grasp["right"])),
        (loops[0], loops[1]),
        (signs[0], signs[1]),
        HORIZON,
        Weights(direction=0.02, safety=1e-3, free_force=0.5),
        0.15,
        8,
        0.2,
        find_entry(mesh),
    )
    x = np.array(mesh.rest_position)
    targets = []
    for i in (0, 1):
        state = sleeve_state(x, loops[i], signs[i])
        targets.append(
            SleeveTarget(
                np.tile(state.p_c + np.array([0.05, 0.02, 0.03]), (HORIZON, 1)),
                np.tile([0.6, 0.0, 0.8], (HORIZON, 1)),
                entering=i == 1,
            )
        )
    return controller, x, (targets[0], targets[1])


def _beside(point: FloatArray) -> Obstacles:
    """Returns a ball 3 cm from `point`, near enough for the clearance, too far to touch."""
    center = np.atleast_2d(point + [0.02, 0.01, 0.05])
    radius = np.array([np.linalg.norm([0.02, 0.01, 0.05]) - 0.03])
    still = np.zeros((1, 3))
    return Obstacles(center, center, radius, still, still)


@pytest.mark.parametrize("beside", [False, True])
@pytest.mark.parametrize("span", [0.2, 1.0])
def test_gradient_of_the_plan_matches_finite_differences(
    setting: tuple[GlobalController, FloatArray, tuple[SleeveTarget, SleeveTarget]],
    beside: bool,
    span: float,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Grippers beyond their span, and closer than a garment that is entered wants them."""
    controller, x, targets = setting
    monkeypatch.setattr(controller, "_span", span)
    rng = np.random.default_rng(0)
    velocity = 0.03 * rng.normal(size=(HORIZON, 2, 3))
    grip = x[controller.cloth.held[controller._split[0]]].mean(axis=0)
    person = [_beside(grip) if beside else Obstacles.none()] * HORIZON
    rest = np.zeros_like(x)
    rollout = controller._rollout(x, rest, velocity, targets, person)
    if beside:
        assert controller._clearance(x, person[0])[0] > 0.0
    gradient = controller._gradient(rollout, velocity, targets, person)
    for _ in range(5):
        d = rng.normal(size=velocity.shape)
        step = 1e-6
        high = controller._rollout(x, rest, velocity + step * d, targets, person).cost
        low = controller._rollout(x, rest, velocity - step * d, targets, person).cost
        assert np.sum(gradient * d) == pytest.approx((high - low) / (2 * step), rel=1e-4)


def test_plan_lowers_its_cost_and_keeps_the_speed_limit(
    setting: tuple[GlobalController, FloatArray, tuple[SleeveTarget, SleeveTarget]],
) -> None:
    controller, x, targets = setting
    plan = controller.solve(
        x, np.zeros_like(x), targets, [Obstacles.none()] * HORIZON, np.zeros((HORIZON, 2, 3))
    )
    assert plan.cost < 0.9 * plan.initial_cost
    assert np.linalg.norm(plan.velocity, axis=2).max() <= 0.15 + 1e-12
    assert plan.reason in ("small_step", "no_descent", "iterations")
