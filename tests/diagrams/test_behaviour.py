"""Persons in the plant: passive ones stay where led, active ones move, dummies are springs."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest
from pydrake.geometry import SceneGraph
from pydrake.multibody.math import SpatialForce
from pydrake.multibody.plant import ExternallyAppliedSpatialForce, MultibodyPlant
from pydrake.multibody.tree import BodyIndex
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import Context, Diagram, DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource, PassThrough

from drake_dress.diagrams.behaviour import Behaviour, Kind, add_behaviour
from drake_dress.diagrams.person import (
    Person,
    add_person,
    joint_positions,
    person_arms,
)
from drake_dress.models.garment.coat import CoatParameters, make_coat
from drake_dress.models.human.active import ActiveParameters
from drake_dress.models.human.body import ArmPose, BodyMeasures, Posture, arm_points
from drake_dress.models.human.following import FollowingParameters
from drake_dress.models.human.joints import JointParameters
from drake_dress.models.human.lowering import Lowering
from drake_dress.models.human.motions import Motion, Reach, Turn, Wave, Withdraw
from drake_dress.models.human.spasm import SpasmParameters
from drake_dress.models.human.stirring import StirringParameters
from drake_dress.models.human.tremor import TremorParameters
from drake_dress.models.human.wheelchair import Wheelchair
from drake_dress.models.sides import SIDES, Side
from tests.systems.draped import draped_station

M = BodyMeasures()
JOINTS = JointParameters(6.0, 3.0, 3.6, 1.2)
POSE = ArmPose(*np.deg2rad([13.0, 46.0, 0.0, 10.0]))
ARMS: dict[Side, ArmPose] = {"left": POSE, "right": POSE}
MESH = make_coat(CoatParameters(), 0.05)
STAYS = Behaviour(lowering=Lowering(duration=0.0), stirring=StirringParameters(amplitude=0.0))
PERIOD = 0.004


@dataclass
class Scene:
    """A person without a coat, or with one that hangs still."""

    diagram: Diagram
    plant: MultibodyPlant
    person: Person
    simulator: Simulator

    @property
    def context(self) -> Context:
        return self.plant.GetMyMutableContextFromRoot(self.simulator.get_mutable_context())

    def pull(self, row: int, force: np.ndarray) -> None:
        body, point = self.person.joint_points[row]
        one = ExternallyAppliedSpatialForce()
        one.body_index, one.p_BoBq_B = BodyIndex(body), point
        one.F_Bq_W = SpatialForce(np.zeros(3), force)
        self.plant.get_applied_spatial_force_input_port().FixValue(self.context, [one])

    def tell(self, name: str, value: float) -> None:
        """Sets the input `told` or `opened`."""
        context = self.simulator.get_mutable_context()
        self.diagram.GetInputPort(name).FixValue(context, [value])

    def joints(self) -> np.ndarray:
        return joint_positions(self.plant, self.context, self.person)

    def intent(self) -> list[float]:
        port = self.diagram.GetOutputPort("intent")
        return list(port.Eval(self.simulator.get_context()))

    def record(self, until: float, every: float = 0.02) -> tuple[np.ndarray, np.ndarray]:
        """Returns times (n,), s, and joints (n,6,3), m, from now on."""
        now = self.simulator.get_context().get_time()
        times = now + every * np.arange(1, round((until - now) / every) + 1)
        rows = []
        for t in times:
            self.simulator.AdvanceTo(t)
            rows.append(self.joints())
        return times, np.array(rows)


def scene(
    behaviour: Behaviour,
    garment: np.ndarray | None = None,
    joints: JointParameters = JOINTS,
    chair: Wheelchair | None = None,
    poses: dict[Side, ArmPose] = ARMS,
) -> Scene:
    """Returns a person who stands, or sits in a wheelchair."""
    builder = DiagramBuilder()
    plant = builder.AddSystem(MultibodyPlant(PERIOD))
    if chair is not None:  # arms touch it
        scene_graph = builder.AddSystem(SceneGraph())
        plant.RegisterAsSourceForSceneGraph(scene_graph)
    posture: Posture = "standing" if chair is None else "sitting"
    person = add_person(plant, M, posture, poses, joints, turns=behaviour.turns, chair=chair)
    plant.Finalize()
    if chair is not None:
        builder.Connect(
            plant.get_geometry_pose_output_port(),
            scene_graph.get_source_pose_port(plant.get_source_id()),
        )
        builder.Connect(scene_graph.get_query_output_port(), plant.get_geometry_query_input_port())
    x = MESH.rest_position + [-2.0, 0.0, 1.4] if garment is None else garment
    nodes = builder.AddSystem(ConstantVectorSource(x.ravel()))
    arms = person_arms(M, posture, poses, joints)
    opened = builder.AddSystem(PassThrough(1))
    intent, told = add_behaviour(
        builder,
        plant,
        person,
        arms,
        behaviour,
        MESH,
        nodes.get_output_port(),
        opened.get_output_port(),
    )
    builder.ExportOutput(intent, "intent")
    builder.ExportInput(opened.get_input_port(), "opened")
    if told is not None:
        builder.ExportInput(told, "told")
    diagram = builder.Build()
    made = Scene(diagram, plant, person, Simulator(diagram))
    made.tell("opened", 0.0)
    return made


def passive(**following: float) -> Behaviour:
    return Behaviour(
        kind="passive", active=ActiveParameters(following=FollowingParameters(**following))
    )


def active(*motions: Motion, speed: float = 0.5) -> Behaviour:
    return Behaviour(kind="active", motions=motions, active=ActiveParameters(max_hand_speed=speed))


def names(diagram: Diagram) -> set[str]:
    return {type(system).__name__ for system in diagram.GetSystems()}


def state(s: Scene) -> np.ndarray:
    return s.context.get_discrete_state_vector().CopyToVector()


def test_dummy_that_stays_as_it_is_has_nothing_but_its_constant_tone() -> None:
    plain = scene(STAYS)
    assert names(plain.diagram) == {"MultibodyPlant", "ConstantVectorSource", "PassThrough"}
    tones = [
        system
        for system in plain.diagram.GetSystems()
        if isinstance(system, ConstantVectorSource) and system.get_output_port().size() == 8
    ]
    value = tones[0].get_output_port().Eval(tones[0].CreateDefaultContext())
    np.testing.assert_array_equal(value, plain.person.tone_torque(plain.plant))


def test_dummy_moves_to_the_bit_as_a_plant_with_tone_alone() -> None:
    """Dummies moved like this before persons had behaviours."""
    with_behaviour = scene(Behaviour())
    plant = MultibodyPlant(PERIOD)
    person = add_person(plant, M, "standing", ARMS, JOINTS)
    plant.Finalize()
    bare = Scene(plant, plant, person, Simulator(plant))
    plant.get_applied_generalized_force_input_port().FixValue(
        bare.context, person.tone_torque(plant)
    )
    for s in (with_behaviour, bare):
        s.pull(2, np.array([1.0, 3.0, -0.5]))
        s.simulator.AdvanceTo(0.5)
    np.testing.assert_array_equal(state(with_behaviour), state(bare))
    assert plant.num_positions() == 8


def test_station_of_a_dummy_has_no_system_of_a_behaviour() -> None:
    station = draped_station(
        mesh=MESH,
        measures=M,
        arms=ARMS,
        joints=JOINTS,
        time_step=0.01,
        body_time_step=0.01,
        behaviour=STAYS,
    )
    assert names(station.diagram) == {
        "MultibodyPlant",
        "SceneGraph",
        "ConstantVectorSource",
        "ClothPlant",
        "FloatingGripper",
    }


@pytest.mark.parametrize("kind", ["passive", "active"])
def test_untouched_person_keeps_its_pose(kind: str) -> None:
    s = scene(passive() if kind == "passive" else active())
    start = s.joints()
    s.simulator.AdvanceTo(2.0)
    np.testing.assert_allclose(s.joints(), start, atol=1e-6)


def test_arm_led_away_stays_near_where_it_was_led() -> None:
    s, dummy = scene(passive(time_constant=0.5)), scene(Behaviour())
    start, ends = s.joints()[2], []
    for one in (s, dummy):
        one.pull(2, np.array([0.0, 3.0, 0.0]))
        one.simulator.AdvanceTo(3.0)
        led = one.joints()[2]
        one.pull(2, np.zeros(3))
        one.simulator.AdvanceTo(6.0)
        ends.append((led, one.joints()[2]))
    led, stayed = ends[0]
    assert np.linalg.norm(led - start) > 3.0 * np.linalg.norm(ends[1][0] - start)
    assert np.linalg.norm(stayed - start) > 0.8 * np.linalg.norm(led - start)
    assert np.linalg.norm(ends[1][1] - start) < 1e-3
    # its weight is carried there, so it does not sag any more
    s.simulator.AdvanceTo(8.0)
    assert np.linalg.norm(s.joints()[2] - stayed) < 1e-3
    np.testing.assert_allclose(s.joints()[3:], scene(Behaviour()).joints()[3:], atol=1e-6)


def test_arm_led_by_less_than_the_threshold_comes_back() -> None:
    s = scene(passive(time_constant=0.5, threshold=0.5))
    start = s.joints()[2]
    s.pull(2, np.array([0.0, 0.6, 0.0]))
    s.simulator.AdvanceTo(3.0)
    assert np.linalg.norm(s.joints()[2] - start) > 0.008
    s.pull(2, np.zeros(3))
    s.simulator.AdvanceTo(6.0)
    assert np.linalg.norm(s.joints()[2] - start) < 1e-4


def test_led_round_and_let_go_the_person_has_only_taken_work() -> None:
    """A rotating force leads the hand round; its net work on the person is never negative."""
    s = scene(passive(time_constant=0.3, threshold=0.2))
    hand, work, least = s.joints()[2], 0.0, 0.0
    for k in range(300):
        phase = 2.0 * np.pi * k / 150
        force = 4.0 * np.array([np.sin(phase), 1.0 - np.cos(phase), 0.3 * np.sin(phase)])
        s.pull(2, force if k < 299 else np.zeros(3))
        s.simulator.AdvanceTo(0.02 * (k + 1))
        after = s.joints()[2]
        work, hand = work + float(force @ (after - hand)), after
        least = min(least, work)
    assert work > 0.3
    assert least > -0.01


def test_turn_ends_at_its_angle_without_haste() -> None:
    turn = Turn(start=0.5, angle=np.deg2rad(15.0), duration=2.0)
    s = scene(active(turn))
    assert s.plant.num_positions() == 9
    start = s.joints()
    _, joints = s.record(5.0)
    line = joints[:, 0] - joints[:, 3]
    yaw = np.arctan2(-line[:, 0], line[:, 1])
    assert np.abs(yaw[:24]).max() < 1e-6
    assert np.rad2deg(yaw[-1]) == pytest.approx(15.0, abs=0.05)
    assert np.rad2deg(yaw.max()) < 15.5
    assert np.abs(np.diff(yaw) / 0.02).max() < 1.1 * turn.speed
    # the arms turn with the torso
    c, s_ = np.cos(yaw[-1]), np.sin(yaw[-1])
    turned = start @ np.array([[c, -s_, 0.0], [s_, c, 0.0], [0.0, 0.0, 1.0]]).T
    np.testing.assert_allclose(joints[-1], turned, atol=2e-3)


def test_who_does_not_turn_is_welded_to_the_floor() -> None:
    assert scene(active(Wave())).plant.num_positions() == 8
    assert scene(Behaviour(kind="passive", motions=(Turn(),))).plant.num_positions() == 8


@pytest.mark.parametrize("kind", ["dummy", "passive"])
def test_who_has_no_will_has_no_intent(kind: Kind) -> None:
    """Not even while an arm is led away, or if motions are given, which only active ones make."""
    s = scene(Behaviour(kind=kind, motions=(Wave(start=0.0), Turn(angle=0.3))))
    s.pull(2, np.array([0.0, 5.0, 0.0]))
    for t in (0.0, 0.5, 1.0):
        s.simulator.AdvanceTo(t)
        assert s.intent() == [0.0, 0.0]


def test_intent_of_a_person_is_that_of_each_arm() -> None:
    s = scene(active(Wave(start=0.2, duration=0.6, sides=("right",)), Turn(start=3.0, angle=0.1)))
    found = []
    for t in (0.1, 0.5, 2.9, 3.5):
        s.simulator.AdvanceTo(t)
        found.append(s.intent())
    assert found == [[0.0, 0.0], [0.0, 1.0], [0.0, 0.0], [1.0, 1.0]]


def coat_near_the_hand(yaw: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Returns a coat (n,3) with its left armhole slightly outside the left hand, m.

    The second value is the centre (3,) of that armhole, m. The coat is rotated so that the hand
    enters along the sleeve.
    """
    x, loop = np.array(MESH.rest_position), MESH.loops["left_armhole"]
    center = x[loop].mean(axis=0)
    into = x[MESH.loops["left_cuff"]].mean(axis=0) - center
    into /= np.linalg.norm(into)
    wanted = np.array([-0.3, 0.8, -0.5])
    wanted /= np.linalg.norm(wanted)
    axis = np.cross(into, wanted)
    sine, cosine = np.linalg.norm(axis), into @ wanted
    k = np.cross(np.eye(3), axis / sine)
    rotation = np.eye(3) + sine * k + (1.0 - cosine) * (k @ k)
    assert rotation @ into == pytest.approx(wanted, abs=1e-9)
    goal = scene(Behaviour()).joints()[2] + [0.05, 0.12, 0.08]
    moved = (x - center) @ rotation.T + goal
    c, s = np.cos(yaw), np.sin(yaw)
    turned = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    return moved @ turned.T, turned @ goal


@pytest.mark.parametrize("yaw", [0.0, np.deg2rad(20.0)])
def test_reach_brings_the_hand_into_the_armhole(yaw: float) -> None:
    """This also holds after a turn, if the armhole has turned too."""
    garment, goal = coat_near_the_hand(yaw)
    turns = (Turn(start=0.0, angle=yaw, duration=1.0),) if yaw else ()
    s = scene(active(Reach(start=1.5, sides=("left",)), *turns), garment)
    times, joints = s.record(5.0)
    hand = joints[:, 2]
    speed = np.linalg.norm(np.diff(hand, axis=0), axis=1) / 0.02
    assert speed[times[1:] > 1.5].max() < 0.6
    assert np.linalg.norm(hand - goal, axis=1).min() < 0.05
    assert np.linalg.norm(hand[-1] - goal) < 0.08
    assert np.linalg.norm(hand[-1] - hand[-25]) < 5e-3


def test_hand_drawn_back_comes_back_and_a_waving_one_stays_near() -> None:
    wave = Wave(start=4.5, duration=2.0, amplitude=0.05, frequency=1.0, sides=("left",))
    s = scene(active(Withdraw(start=0.5, duration=1.5, sides=("left",)), wave))
    start = s.joints()
    times, joints = s.record(8.5)
    away = np.linalg.norm(joints[:, 2] - start[2], axis=1)
    drawn = (times > 1.5) & (times < 2.0)
    assert away[drawn].min() > 0.08
    assert away[times < 4.0].max() < 0.13
    assert away[(times > 4.3) & (times < 4.5)].max() < 0.01
    waving = (times > 4.5) & (times < 6.5)
    assert 0.04 < away[waving].max() < 0.09
    assert away[-1] < 0.01
    np.testing.assert_allclose(joints[:, 5], np.tile(start[5], (len(joints), 1)), atol=1e-3)


def tremble(seed: int, kind: Kind = "dummy", frequency: float = 5.0) -> np.ndarray:
    """Returns the left hand (n,3), m, sampled each period, after a second."""
    tremor = TremorParameters(amplitude=0.008, frequency=frequency)
    s = scene(Behaviour(kind=kind, tremor=tremor, seed=seed))
    times, joints = s.record(17.0, PERIOD)
    return joints[times > 1.0, 2]


@pytest.mark.parametrize(("kind", "frequency"), [("dummy", 5.0), ("passive", 8.0)])
def test_hand_trembles_at_its_frequency_by_its_amplitude(kind: Kind, frequency: float) -> None:
    hand = tremble(1, kind, frequency)
    hand = hand - hand.mean(axis=0)
    main = hand @ np.linalg.svd(hand, full_matrices=False)[2][0]
    power = np.abs(np.fft.rfft(main * np.hanning(len(main)))) ** 2
    f = np.fft.rfftfreq(len(main), PERIOD)
    assert abs(f[power.argmax()] - frequency) < 0.06 * frequency
    assert np.sqrt(2.0 * np.mean(main**2)) == pytest.approx(0.008, rel=0.2)


def test_tremor_is_the_same_for_the_same_seed_alone() -> None:
    def end(seed: int) -> np.ndarray:
        s = scene(Behaviour(tremor=TremorParameters(), seed=seed))
        s.simulator.AdvanceTo(0.5)
        return state(s)

    np.testing.assert_array_equal(end(1), end(1))
    assert np.abs(end(1) - end(2)).max() > 1e-3


def test_active_person_does_the_same_again() -> None:
    def end() -> np.ndarray:
        garment, _ = coat_near_the_hand()
        s = scene(active(Reach(), Turn(angle=0.2), Wave(start=0.5)), garment)
        s.simulator.AdvanceTo(1.0)
        return state(s)

    np.testing.assert_array_equal(end(), end())


def test_arms_model_is_that_of_the_plant() -> None:
    """Gravity torques in closed form equal those of the plant, whatever the torso's yaw."""
    plant = MultibodyPlant(PERIOD)
    person = add_person(plant, M, "standing", ARMS, JOINTS, turns=True)
    plant.Finalize()
    arms, dofs = person_arms(M, "standing", ARMS, JOINTS), person.arm_dofs(plant)
    np.testing.assert_allclose(arms.limits[0, 0], plant.GetPositionLowerLimits()[dofs[:4]])
    np.testing.assert_allclose(arms.limits[1, 1], plant.GetPositionUpperLimits()[dofs[4:]])
    context = plant.CreateDefaultContext()
    np.testing.assert_allclose(plant.GetPositions(context)[dofs], arms.rest.ravel())
    rng = np.random.default_rng(0)
    for _ in range(5):
        q = rng.uniform(-1.5, 1.5, 9)
        plant.SetPositions(context, q)
        gravity = plant.CalcGravityGeneralizedForces(context)[dofs]
        angles = q[dofs].reshape(2, 4)
        expected = [a.gravity_torque(b) for a, b in zip(arms.arms, angles, strict=True)]
        np.testing.assert_allclose(gravity, np.concatenate(expected), atol=1e-9)


@pytest.mark.parametrize("kind", ["dummy", "passive", "active"])
def test_arms_are_lowered_when_told_and_stir_once_the_coat_is_let_go(kind: Kind) -> None:
    s = scene(Behaviour(kind=kind))
    pose = Lowering().pose
    down = [arm_points(M, "standing", side, pose)[2] for side in SIDES]
    s.simulator.AdvanceTo(1.0)
    before = s.joints()
    s.tell("told", 1.0)
    _, way = s.record(5.0)
    np.testing.assert_allclose(s.joints()[[2, 5]], down, atol=0.01)
    # smoothly, and without haste
    hands = np.linalg.norm(np.diff(way[:, [2, 5]], axis=0), axis=2) / 0.02
    assert hands.max() < 0.6
    np.testing.assert_allclose(way[0], before, atol=2e-3)
    s.tell("opened", 1.0)
    _, stirred = s.record(10.0)
    swing = np.ptp(stirred[-150:, [2, 5]], axis=0)
    assert (np.linalg.norm(swing, axis=1) > 0.04).all()
    assert (np.linalg.norm(swing, axis=1) < 0.2).all()


@pytest.mark.parametrize("kind", ["dummy", "active"])
def test_arms_come_around_the_back_of_a_chair(kind: Kind) -> None:
    """The elbow is behind the chair's back, inward of its edge; straight down it would stay there.

    The arm ends over the armrest.
    """
    chair, sides = Wheelchair(handle_length=0.0), {"left": 1.0, "right": -1.0}
    behind = ArmPose(*np.deg2rad([-10.0, 62.0, 0.0, 35.0]))
    lowering = Lowering(ArmPose(*np.deg2rad([20.0, -20.0, 0.0, 70.0])))
    s = scene(
        Behaviour(kind=kind, lowering=lowering),
        chair=chair,
        poses={side: behind for side in SIDES},
    )
    half = 0.5 * (M.hip_width + 0.05)
    for k, side in enumerate(SIDES):
        elbow = s.joints()[3 * k + 1]
        assert elbow[0] < -0.15
        assert sides[side] * elbow[1] < half
    s.tell("told", 1.0)
    s.simulator.AdvanceTo(5.0)
    for k, side in enumerate(SIDES):
        expected = arm_points(M, "sitting", side, lowering.pose)[2]
        np.testing.assert_allclose(s.joints()[3 * k + 2], expected, atol=0.04)


def test_who_is_not_told_keeps_the_arms() -> None:
    s = scene(Behaviour())
    start = s.joints()
    s.tell("told", 0.0)
    s.simulator.AdvanceTo(3.0)
    np.testing.assert_allclose(s.joints(), start, atol=1e-6)


@pytest.mark.parametrize("kind", ["dummy", "passive", "active"])
def test_a_paralysed_arm_does_nothing_by_itself(kind: Kind) -> None:
    """It neither follows, nor is lowered, nor stirs; pushed aside, it comes back."""
    motions = (Wave(start=0.0, sides=("left", "right")),) if kind == "active" else ()
    limp = replace(JOINTS, right=replace(JOINTS, tone=0.0))
    s = scene(Behaviour(kind=kind, motions=motions), joints=limp)
    start = s.joints()
    s.tell("told", 1.0)
    s.simulator.AdvanceTo(3.0)
    s.tell("opened", 1.0)
    _, way = s.record(6.0)
    assert np.linalg.norm(way[:, 2] - start[2], axis=1).max() > 0.05
    np.testing.assert_allclose(way[:, 3:], np.tile(start[3:], (len(way), 1, 1)), atol=1e-3)
    assert s.intent()[1] == 0.0
    s.pull(5, np.array([0.0, -6.0, 0.0]))
    s.simulator.AdvanceTo(9.0)
    assert np.linalg.norm(s.joints()[5] - start[5]) > 0.05
    s.pull(5, np.zeros(3))
    s.simulator.AdvanceTo(14.0)
    np.testing.assert_allclose(s.joints()[5], start[5], atol=0.01)


def test_an_arm_in_spasm_bends_and_comes_back() -> None:
    spasm = SpasmParameters(sides=("right",), torque=3.0, interval=8.0, duration=1.0)
    s = scene(replace(STAYS, spasm=spasm, seed=3))
    start = s.joints()
    times, way = s.record(30.0)
    away = np.linalg.norm(way[:, 5] - start[5], axis=1)
    assert away.max() > 0.1
    # nearer to the shoulder, since the elbow bends
    most = way[away.argmax()]
    assert np.linalg.norm(most[5] - most[3]) < np.linalg.norm(start[5] - start[3]) - 0.02
    assert np.median(away) < 0.03
    np.testing.assert_allclose(way[:, :3], np.tile(start[:3], (len(times), 1, 1)), atol=1e-3)


def test_a_stiff_elbow_stays_within_its_limits() -> None:
    stiff = replace(JOINTS, right=replace(JOINTS, elbow_limits=tuple(np.deg2rad([5.0, 15.0]))))
    s = scene(STAYS, joints=stiff)
    for side in (2, 5):
        s.pull(side, np.array([12.0, 0.0, 6.0]))
        s.simulator.AdvanceTo(s.simulator.get_context().get_time() + 2.0)
    left, right = (s.plant.GetJointByName(f"{side}_elbow") for side in SIDES)
    assert right.GetOnePosition(s.context) < np.deg2rad(17.0)
    assert left.position_upper_limit() > 2.0
