"""The policy's directions and obstacles go with the person, wherever the person has turned."""

from __future__ import annotations

import numpy as np
import pytest

from drake_dress.models.cloth.material import Material
from drake_dress.models.control.policy import DressingPolicy, PersonModel, PolicyParameters
from drake_dress.models.dressing.coordinates import ArmAxis
from drake_dress.models.dressing.sleeve import SleeveState
from drake_dress.models.dressing.stages import Task
from drake_dress.models.garment.coat import CoatParameters, make_coat
from drake_dress.models.human.body import (
    ArmPose,
    BodyMeasures,
    arm_points,
    body_capsules,
    shoulder_joint,
)
from drake_dress.models.human.heading import heading
from drake_dress.models.sides import SIDES

M = BodyMeasures()
POSE = ArmPose(0.25, 0.8, 0.0, 0.2)
HORIZON = 3


@pytest.fixture(scope="module")
def policy() -> DressingPolicy:
    shape = PersonModel(
        body_capsules(M, "sitting"),
        np.stack([shoulder_joint(M, "sitting", side) for side in SIDES]),
        (M.upper_arm_radius, M.forearm_radius, M.hand_radius),
    )
    return DressingPolicy(
        make_coat(CoatParameters(), 0.06), Material(), shape, PolicyParameters(horizon=HORIZON)
    )


def frame(yaw: float, place: tuple[float, float] = (0.0, 0.0)) -> tuple[np.ndarray, np.ndarray]:
    c, s = np.cos(yaw), np.sin(yaw)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]), np.array([*place, 0.0])


def joints(yaw: float = 0.0, place: tuple[float, float] = (0.0, 0.0)) -> np.ndarray:
    where = frame(yaw, place)
    return np.vstack([arm_points(M, "sitting", side, POSE, where) for side in SIDES])


def test_person_who_faces_forward_is_where_the_capsules_say(policy: DressingPolicy) -> None:
    torso = [c for c in body_capsules(M, "sitting") if c.body == "torso"]
    seen = policy._obstacles(np.stack([joints()] * (HORIZON + 1)))
    for obstacles in seen:
        np.testing.assert_allclose(obstacles.a[: len(torso)], [c.a_B for c in torso], atol=1e-12)
        np.testing.assert_allclose(obstacles.b[: len(torso)], [c.b_B for c in torso], atol=1e-12)
        np.testing.assert_array_equal(obstacles.velocity, 0.0)


@pytest.mark.parametrize("yaw", [-0.5, 0.26, 2.0])
def test_torso_turns_with_the_shoulders(policy: DressingPolicy, yaw: float) -> None:
    """Knees of a person who sits are in front of the hips, wherever front is."""
    place = (0.3, -0.2)
    rotation, origin = frame(yaw, place)
    ahead = policy._obstacles(np.stack([joints()] * (HORIZON + 1)))[0]
    turned = policy._obstacles(np.stack([joints(yaw, place)] * (HORIZON + 1)))[0]
    np.testing.assert_allclose(turned.a, ahead.a @ rotation.T + origin, atol=1e-12)
    np.testing.assert_allclose(turned.b, ahead.b @ rotation.T + origin, atol=1e-12)


def test_torso_that_is_predicted_to_turn_moves_as_it_does(policy: DressingPolicy) -> None:
    """Over a step, ends of capsules go where their velocity and rotation carry them."""
    h = policy.parameters.time_step
    rows = [joints(0.05 * j) for j in range(HORIZON + 1)]
    predicted = policy._obstacles(np.stack(rows))
    for now, then in zip(predicted[:-1], predicted[1:], strict=True):
        np.testing.assert_allclose(now.a + h * now.velocity, then.a, atol=1e-12)
    knee = int(np.argmax(predicted[0].a[:, 0]))
    assert np.linalg.norm(predicted[0].velocity[knee]) == pytest.approx(
        0.5 * np.linalg.norm(predicted[0].a[knee, :2]), rel=0.01
    )


@pytest.mark.parametrize("yaw", [-0.5, 0.26, 2.0])
@pytest.mark.parametrize("side", [0, 1])
@pytest.mark.parametrize("task", [Task.PREPARE, Task.DRESS])
@pytest.mark.parametrize("retreat", [False, True])
def test_targets_turn_with_the_person(
    policy: DressingPolicy, yaw: float, side: int, task: Task, retreat: bool
) -> None:
    """Person, sleeves and all turned alike: what is asked for is the same, turned."""
    place = (0.3, -0.2)
    rotation, origin = frame(yaw, place)
    rng = np.random.default_rng(0)
    spots = [joints()[3 * i + 2] + rng.normal(0.0, 0.1, 3) for i in (0, 1)]
    normals = [rng.normal(size=3) for _ in (0, 1)]
    sleeves = [SleeveState(p, n / np.linalg.norm(n)) for p, n in zip(spots, normals, strict=True)]

    def target(q: np.ndarray, x: np.ndarray, sleeves: list[SleeveState]):  # type: ignore[no-untyped-def]
        rows = [q] * (HORIZON + 1)
        axes = [
            [ArmAxis(hand=r[3 * i + 2], elbow=r[3 * i + 1], shoulder=r[3 * i]) for r in rows]
            for i in (0, 1)
        ]
        to = [heading(r) for r in rows]
        facts = [policy._facts(x, q, axes[i][0], to[0], sleeves[i], i) for i in (0, 1)]
        tasks = (task, task)
        return policy._target(tasks, side, axes, to, facts, sleeves, retreat, False, (1, 1))

    x = policy.mesh.rest_position + [-0.4, 0.0, 0.9]
    straight = target(joints(), x, sleeves)
    turned = target(
        joints(yaw, place),
        x @ rotation.T + origin,
        [SleeveState(rotation @ s.p_c + origin, rotation @ s.v_c) for s in sleeves],
    )
    np.testing.assert_allclose(turned.position, straight.position @ rotation.T + origin, atol=1e-9)
    np.testing.assert_allclose(turned.direction, straight.direction @ rotation.T, atol=1e-9)
