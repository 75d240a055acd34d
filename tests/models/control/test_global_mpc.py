"""The plan's gradient and descent, on a small coat."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from drake_dress.models.arrays import FloatArray
from drake_dress.models.cloth.contact.obstacles import Obstacles
from drake_dress.models.cloth.elements import make_elements
from drake_dress.models.cloth.explicit.explicit_bias import ExplicitBiasCloth, ExplicitSettings
from drake_dress.models.cloth.material import Material
from drake_dress.models.control.budget import Budget
from drake_dress.models.control.corridor import Corridor
from drake_dress.models.control.costs import Weights
from drake_dress.models.control.global_mpc import GlobalController, Plan
from drake_dress.models.control.situation import HeldGarment, Situation, SleeveTarget
from drake_dress.models.dressing.sleeve import find_entry, loop_orientation, sleeve_state
from drake_dress.models.garment.coat import CoatParameters, make_coat
from drake_dress.models.garment.mesh import GarmentMesh
from drake_dress.models.sides import SIDES

HORIZON = 3
# The armhole of an overcoat at a hand, about a hundred nodes on the arm: 44 s into a dressing;
# python -m benchmarks.plan_gradient run.h5 --at 44 --save tests/models/control/data/entering.npz
ENTERING = Path(__file__).parent / "data" / "entering.npz"


@pytest.fixture(scope="module")
def setting() -> tuple[GlobalController, FloatArray, tuple[SleeveTarget, SleeveTarget]]:
    mesh = make_coat(CoatParameters(), 0.05)
    held = np.concatenate([mesh.grasp[s] for s in SIDES])
    cloth = ExplicitBiasCloth(
        make_elements(mesh.rest_position, mesh.faces),
        Material(),
        0.1,
        held,
        settings=ExplicitSettings(tolerance=1e-10),
    )
    loops = tuple(np.asarray(mesh.loops[f"{s}_armhole"]) for s in SIDES)
    signs = tuple(float(loop_orientation(mesh, s)) for s in SIDES)
    controller = GlobalController(
        cloth,
        HeldGarment(
            (len(mesh.grasp["left"]), len(mesh.grasp["right"])),
            (loops[0], loops[1]),
            (signs[0], signs[1]),
            0.2,
            find_entry(mesh),
        ),
        HORIZON,
        Weights(
            direction=0.02, speed=0.5, safety=1e-3, free_force=0.5, separation=10.0, passage=2.0
        ),
        0.15,
        8,
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
                corridor=_ahead(x[loops[i][0]]) if i == 1 else None,
                passage=np.tile([0.6, 0.0, -0.8], (HORIZON, 1)) if i == 0 else None,
            )
        )
    return controller, x, (targets[0], targets[1])


def _ahead(point: FloatArray) -> Corridor:
    """Returns a way on which `point` hangs."""
    return Corridor(
        np.tile(point - [0.01, 0.02, 0.05], (HORIZON, 1)), np.tile([0.0, 0.6, 0.8], (HORIZON, 1))
    )


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
    """Grippers beyond their span, closer than a garment that is entered wants them, on edge."""
    controller, x, targets = setting
    monkeypatch.setattr(controller, "grip", replace(controller.grip, span=span))
    rng = np.random.default_rng(0)
    velocity = 0.03 * rng.normal(size=(HORIZON, 2, 3))
    grip = x[controller.grip.nodes[controller.grip.of_side[0]]].mean(axis=0)
    person = [_beside(grip) if beside else Obstacles.none()] * HORIZON
    left = np.tile([0.6, 0.8, 0.0], (HORIZON, 1))
    situation = Situation(x, np.zeros_like(x), targets, person, left)
    rollout = controller._rollout(situation, velocity)
    first, costs = rollout.steps[0], controller.costs
    _, level, clearance = costs.of_garment
    assert (level.value(first) > 0.0) == (span == 1.0)
    assert (clearance.value(first) > 0.0) == beside
    _, _, corridor, passage, _ = costs.of_sleeves
    assert corridor.value(first, 1) > 0.0
    assert passage.value(first, 0) > 0.0
    gradient = controller._gradient(rollout, velocity)
    for _ in range(5):
        d = rng.normal(size=velocity.shape)
        step = 1e-6
        high = controller._rollout(situation, velocity + step * d).cost
        low = controller._rollout(situation, velocity - step * d).cost
        assert np.sum(gradient * d) == pytest.approx((high - low) / (2 * step), rel=1e-4)


def test_plan_lowers_its_cost_and_keeps_the_speed_limit(
    setting: tuple[GlobalController, FloatArray, tuple[SleeveTarget, SleeveTarget]],
) -> None:
    controller, x, targets = setting
    plan = controller.solve(
        Situation(x, np.zeros_like(x), targets, [Obstacles.none()] * HORIZON),
        np.zeros((HORIZON, 2, 3)),
    )
    assert plan.cost < 0.9 * plan.initial_cost
    assert np.linalg.norm(plan.velocity, axis=2).max() <= 0.15 + 1e-12
    assert plan.reason in ("small_step", "no_descent", "iterations")


def test_a_plan_may_be_asked_to_be_slow_but_for_what_is_on_its_way(
    setting: tuple[GlobalController, FloatArray, tuple[SleeveTarget, SleeveTarget]],
) -> None:
    controller, x, targets = setting
    start = np.full((HORIZON, 2, 3), 0.05)
    situation = Situation(x, np.zeros_like(x), targets, [Obstacles.none()] * HORIZON)
    plan = controller.solve(situation, start, 1, max_speed=0.01)
    np.testing.assert_allclose(plan.velocity[0], start[0], atol=1e-12)
    assert np.linalg.norm(plan.velocity[1:], axis=2).max() == pytest.approx(0.01)
    faster = controller.solve(situation, start, 1, max_speed=1.0)
    assert 0.01 < np.linalg.norm(faster.velocity[1:], axis=2).max() <= 0.15 + 1e-12


def test_a_plan_is_as_good_as_its_budget_allows(
    setting: tuple[GlobalController, FloatArray, tuple[SleeveTarget, SleeveTarget]],
) -> None:
    """What is there when the budget is spent is used; more never makes a plan worse."""
    controller, x, targets = setting
    start = np.full((HORIZON, 2, 3), 0.01)
    situation = Situation(x, np.zeros_like(x), targets, [_beside(x[0])] * HORIZON)

    def solved(budget: Budget) -> Plan:
        return controller.solve(situation, start, budget=budget)

    whole = solved(Budget())
    assert whole.reason != "budget"
    assert whole.evaluations > 3
    assert whole.work > 0
    first = solved(Budget(iterations=1))
    assert (first.reason, first.evaluations, first.iterations) == ("budget", 1, 0)
    np.testing.assert_array_equal(first.velocity, start)
    costs = [first.cost]
    for share in np.linspace(0.2, 1.0, 9):
        budget = Budget(iterations=int(share * whole.work))
        plan = solved(budget)
        again = solved(budget)
        np.testing.assert_array_equal(plan.velocity, again.velocity)
        assert plan.work <= max(first.work, 1.2 * share * whole.work)
        costs.append(plan.cost)
    assert costs == sorted(costs, reverse=True)
    assert costs[-1] < costs[0]
    np.testing.assert_array_equal(solved(Budget(iterations=10**9)).velocity, whole.velocity)
    assert solved(Budget(seconds=0.0)).evaluations == 1


def test_plan_turns_a_garment_back_that_is_on_edge(
    setting: tuple[GlobalController, FloatArray, tuple[SleeveTarget, SleeveTarget]],
) -> None:
    """The left gripper goes to the person's left of the right one, whatever sleeves are asked."""
    controller, x, targets = setting
    across = controller.grip.left_from_right(x)
    across = across / np.linalg.norm(across)
    left = np.tile(np.cross(across, [0.0, 0.0, 1.0]), (HORIZON, 1))
    idle = tuple(replace(t, position_weight=0.0, direction_weight=0.0) for t in targets)
    start = np.zeros((HORIZON, 2, 3))
    person = [Obstacles.none()] * HORIZON
    situation = Situation(x, np.zeros_like(x), (idle[0], idle[1]), person, left)
    plan = controller.solve(situation, start)
    moved = controller.cloth.time_step * (plan.velocity[:, 0] - plan.velocity[:, 1]).sum(axis=0)
    assert left[0] @ moved > 0.03


@pytest.fixture(scope="module")
def entering() -> tuple[GlobalController, dict[str, FloatArray], list[SleeveTarget]]:
    with np.load(ENTERING) as file:
        kept = {name: np.asarray(file[name]) for name in file.files}
    mesh = GarmentMesh(
        kept["rest_position"].astype(np.float64),
        kept["faces"].astype(np.int32),
        {name[5:]: nodes for name, nodes in kept.items() if name.startswith("loop_")},
        {name[6:]: nodes for name, nodes in kept.items() if name.startswith("grasp_")},
        kept["region"],
    )
    cloth = ExplicitBiasCloth(
        make_elements(mesh.rest_position, mesh.faces),
        Material(),
        0.2,
        np.concatenate([mesh.grasp[s] for s in SIDES]),
        settings=ExplicitSettings(tolerance=1e-2, iterations=8),
    )
    controller = GlobalController(
        cloth,
        HeldGarment(
            (len(mesh.grasp["left"]), len(mesh.grasp["right"])),
            (mesh.loops["left_armhole"], mesh.loops["right_armhole"]),
            (loop_orientation(mesh, "left"), loop_orientation(mesh, "right")),
            0.44,
            find_entry(mesh),
        ),
        len(kept["start"]),
        Weights(speed=0.5, safety=1e-4, separation=10.0),
        0.12,
        3,
    )
    targets = []
    for side in SIDES:
        place, (position, direction, enters) = kept[f"target_{side}"], kept[f"weights_{side}"]
        targets.append(SleeveTarget(place[:, :3], place[:, 3:], position, direction, bool(enters)))
    for name in ("x", "v"):
        kept[name] = kept[name].astype(np.float64)
    return controller, kept, targets


def test_gradient_with_frozen_contact_tells_what_motions_of_a_centimetre_do(
    entering: tuple[GlobalController, dict[str, FloatArray], list[SleeveTarget]],
) -> None:
    """The exact one does not, from the third last step back: the reason for the other."""
    controller, seen, (left, right) = entering
    person = [Obstacles.resting(seen["a"], seen["b"], seen["radius"])] * len(seen["start"])
    situation = Situation(seen["x"], seen["v"], (left, right), person)

    def cost(velocity: FloatArray) -> float:
        return controller._rollout(situation, velocity).cost

    start = seen["start"]
    slope = np.zeros_like(start)
    for index in np.ndindex(start[1:].shape):
        step = np.zeros_like(start)
        step[1:][index] = 0.01
        slope[1:][index] = (cost(start + step) - cost(start - step)) / 0.02
    rollout = controller._rollout(situation, start)
    assert max(len(tape.contacts.nodes) for tape in rollout.tapes) > 50
    cosine, ratio = {}, {}
    for frozen in (True, False):
        controller.frozen_contact = frozen
        gradient = controller._gradient(rollout, start)[1:]
        size, wanted = (np.linalg.norm(g, axis=(1, 2)) for g in (gradient, slope[1:]))
        cosine[frozen] = np.sum(gradient * slope[1:], axis=(1, 2)) / (size * wanted)
        ratio[frozen] = size / wanted
    controller.frozen_contact = True
    assert cosine[True].min() > 0.8
    assert ratio[True].max() < 2.0
    assert cosine[False][0] < 0.5
    assert ratio[False][0] > 3.0


def test_plan_among_contacts_lowers_its_cost(
    entering: tuple[GlobalController, dict[str, FloatArray], list[SleeveTarget]],
) -> None:
    controller, seen, (left, right) = entering
    person = [Obstacles.resting(seen["a"], seen["b"], seen["radius"])] * len(seen["start"])
    situation = Situation(seen["x"], seen["v"], (left, right), person)
    plan = controller.solve(situation, seen["start"], 1)
    assert plan.cost < 0.8 * plan.initial_cost
    np.testing.assert_allclose(plan.velocity[0], seen["start"][0], atol=1e-12)
