from dataclasses import replace

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator

from drake_dress.diagrams.person import person_arms
from drake_dress.models.garment.coat import CoatParameters, make_coat
from drake_dress.models.human.active import ActiveParameters, ArmState, Want
from drake_dress.models.human.body import ArmPose, BodyMeasures
from drake_dress.models.human.joints import JointParameters
from drake_dress.models.human.motions import Motion, Reach, Turn, Wave
from drake_dress.systems.active_person import ActivePerson

POSE = ArmPose(0.2, 0.8, 0.1, 0.3)
ARMS = person_arms(
    BodyMeasures(), "standing", {"left": POSE, "right": POSE}, JointParameters(6.0, 3.0, 3.6, 1.2)
)
MESH = make_coat(CoatParameters(), 0.06)
REST = ARMS.rest.ravel()


def after(
    duration: float, *motions: Motion, yaw: float = 0.0, origin: tuple[float, float] = (0.0, 0.0)
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Returns set-point, its rate, stance and intent of a person beside a coat, turned alike."""
    place = np.array([*origin, 0.0])
    system = ActivePerson(
        ARMS, 9, np.arange(1, 9), 0, place, MESH, motions, ActiveParameters(), 0.004
    )
    assert not system.HasAnyDirectFeedthrough()
    simulator = Simulator(system)
    context = simulator.get_mutable_context()
    state = np.concatenate([[yaw], REST, np.zeros(9)])
    system.GetInputPort("person_state").FixValue(context, state)
    c, s = np.cos(yaw), np.sin(yaw)
    turned = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    x = (MESH.rest_position + [-0.3, 0.0, 1.2]) @ turned.T + place
    system.GetInputPort("garment_position").FixValue(context, x.ravel())
    simulator.AdvanceTo(duration)
    names = ("set_point", "set_point_rate", "stance", "intent")
    set_point, rate, stance, intent = (system.GetOutputPort(n).Eval(context) for n in names)
    return set_point, rate, stance, intent


def test_who_wants_nothing_stays() -> None:
    set_point, rate, stance, intent = after(0.5)
    np.testing.assert_array_equal(set_point, REST)
    np.testing.assert_array_equal(rate, 0.0)
    np.testing.assert_array_equal(stance, 0.0)
    np.testing.assert_array_equal(intent, 0.0)


def test_only_the_hand_that_is_asked_moves() -> None:
    set_point, rate, _, intent = after(0.5, Wave(start=0.0, sides=("right",)))
    np.testing.assert_array_equal(set_point[:4], REST[:4])
    assert np.abs(set_point[4:] - REST[4:]).max() > 0.02
    assert np.abs(rate[4:]).max() > 0.05
    np.testing.assert_array_equal(intent, [0.0, 1.0])


def test_stance_is_that_of_the_turn() -> None:
    _, _, stance, intent = after(2.0, Turn(start=1.0, angle=0.4, duration=2.0))
    np.testing.assert_allclose(stance, [0.2, 0.2 * 15.0 / 8.0])
    np.testing.assert_array_equal(intent, 1.0)


def test_intent_depends_on_time_and_state() -> None:
    """Its cached value is computed again when only one of them changes."""
    turn = Turn(start=1.0, angle=0.4, duration=2.0)
    system = ActivePerson(
        ARMS, 9, np.arange(1, 9), 0, np.zeros(3), MESH, (turn,), ActiveParameters(), 0.004
    )
    context, found = system.CreateDefaultContext(), []
    for time in (0.5, 1.5, 2.5, 3.5):
        context.SetTime(time)
        found.append(system.GetOutputPort("intent").Eval(context).tolist())
    assert found == [[0.0, 0.0], [1.0, 1.0], [1.0, 1.0], [0.0, 0.0]]
    right = context.get_discrete_state(1).CopyToVector()
    reaching = replace(ArmState.of(right), want=Want.REACH, rate=np.full(4, 0.5))
    context.SetDiscreteState(1, reaching.flat())
    np.testing.assert_array_equal(system.GetOutputPort("intent").Eval(context), [0.0, 1.0])


@pytest.mark.parametrize(("yaw", "origin"), [(0.6, (0.0, 0.0)), (-1.2, (0.5, -0.3))])
def test_reach_is_the_same_wherever_person_and_coat_are(
    yaw: float, origin: tuple[float, float]
) -> None:
    here, there = (
        after(0.4, Reach(within=1.0)),
        after(0.4, Reach(within=1.0), yaw=yaw, origin=origin),
    )
    assert np.abs(here[0] - REST).max() > 0.02
    np.testing.assert_array_equal(here[3], 1.0)
    np.testing.assert_allclose(there[0], here[0], atol=1e-9)
