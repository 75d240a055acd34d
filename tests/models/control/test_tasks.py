"""What sleeves are asked to do goes with the person, and with what they have done since."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given as drawn
from hypothesis import strategies as st

from drake_dress.models.control.preparing import choose_approach, lifts
from drake_dress.models.control.situation import SleeveTarget
from drake_dress.models.control.task_parameters import TaskParameters
from drake_dress.models.control.tasks import Assignment, TaskPlanner, arm_axes
from drake_dress.models.dressing.sleeve import SleeveState
from drake_dress.models.dressing.stages import SleeveFacts, StageState, Task
from drake_dress.models.garment.coat import CoatParameters, make_coat
from drake_dress.models.garment.hold import held_at_edges
from drake_dress.models.human.body import ArmPose, BodyMeasures, arm_points
from drake_dress.models.human.heading import heading
from drake_dress.models.sides import SIDES

M = BodyMeasures()
POSE = ArmPose(0.25, 0.8, 0.0, 0.2)
HORIZON = 3
STEP = 0.1


@pytest.fixture(scope="module")
def planner() -> TaskPlanner:
    return TaskPlanner(make_coat(CoatParameters(), 0.06), TaskParameters())


def frame(yaw: float, place: tuple[float, float] = (0.0, 0.0)) -> tuple[np.ndarray, np.ndarray]:
    c, s = np.cos(yaw), np.sin(yaw)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]), np.array([*place, 0.0])


def joints(yaw: float = 0.0, place: tuple[float, float] = (0.0, 0.0)) -> np.ndarray:
    where = frame(yaw, place)
    return np.vstack([arm_points(M, "sitting", side, POSE, where) for side in SIDES])


def armholes_apart(planner: TaskPlanner) -> float:
    centers = [planner.mesh.rest_position[loop].mean(axis=0) for loop in planner.armholes]
    return float(np.linalg.norm(centers[0] - centers[1]))


@pytest.mark.parametrize("yaw", [-0.5, 0.26, 2.0])
@pytest.mark.parametrize("side", [0, 1])
@pytest.mark.parametrize("task", [Task.PREPARE, Task.DRESS])
@pytest.mark.parametrize("retreat", [False, True])
def test_targets_turn_with_the_person(
    planner: TaskPlanner, yaw: float, side: int, task: Task, retreat: bool
) -> None:
    """Person, sleeves and all turned alike: what is asked for is the same, turned."""
    place = (0.3, -0.2)
    rotation, origin = frame(yaw, place)
    rng = np.random.default_rng(0)
    spots = [joints()[3 * i + 2] + rng.normal(0.0, 0.1, 3) for i in (0, 1)]
    normals = [rng.normal(size=3) for _ in (0, 1)]
    sleeves = [SleeveState(p, n / np.linalg.norm(n)) for p, n in zip(spots, normals, strict=True)]

    def target(q: np.ndarray, x: np.ndarray, sleeves: list[SleeveState]) -> SleeveTarget:
        _, seen = planner.assign(StageState(), x, q, 0.0)
        given = Assignment((task, task), seen.facts, (retreat, retreat), attempts=(1, 1))
        return planner.targets(given, sleeves, np.stack([q] * (HORIZON + 1)), STEP)[side]

    x = planner.mesh.rest_position + [-0.4, 0.0, 0.9]
    straight = target(joints(), x, sleeves)
    turned = target(
        joints(yaw, place),
        x @ rotation.T + origin,
        [SleeveState(rotation @ s.p_c + origin, rotation @ s.v_c) for s in sleeves],
    )
    np.testing.assert_allclose(turned.position, straight.position @ rotation.T + origin, atol=1e-9)
    np.testing.assert_allclose(turned.direction, straight.direction @ rotation.T, atol=1e-9)


MIRROR = np.array([-1.0, 1.0, 1.0])


@pytest.mark.parametrize("yaw", [0.0, 0.3])
@pytest.mark.parametrize("side", [0, 1])
@pytest.mark.parametrize("task", [Task.PREPARE, Task.DRESS])
@pytest.mark.parametrize(
    ("retreat", "withdraw", "swing"),
    [(False, False, False), (True, False, False), (False, True, False), (False, False, True)],
)
def test_dressing_from_the_front_is_the_mirror_image_of_that_from_behind(
    planner: TaskPlanner,
    yaw: float,
    side: int,
    task: Task,
    retreat: bool,
    withdraw: bool,
    swing: bool,
) -> None:
    """A gown in front of a person who reaches forward is asked for what a coat behind is."""
    mirrored = TaskPlanner(planner.mesh.opened_at_back(), planner.parameters, from_front=True)
    rng = np.random.default_rng(1)
    spots = [joints(yaw)[3 * i + 2] + rng.normal(0.0, 0.1, 3) for i in (0, 1)]
    normals = [rng.normal(size=3) for _ in (0, 1)]
    behind = [SleeveState(p, n / np.linalg.norm(n)) for p, n in zip(spots, normals, strict=True)]
    front = [SleeveState(MIRROR * s.p_c, MIRROR * s.v_c) for s in behind]

    def target(of: TaskPlanner, q: np.ndarray, sleeves: list[SleeveState]) -> SleeveTarget:
        at = [-0.4, 0.0, 0.9] if of is planner else [0.4, 0.0, 0.9]
        stages, seen = of.assign(StageState(), of.mesh.rest_position + at, q, 0.0)
        del stages
        given = Assignment(
            (task, task),
            seen.facts,
            (retreat, retreat),
            attempts=(1, 1),
            withdraw=withdraw,
            swing=(swing, swing),
        )
        return of.targets(given, sleeves, np.stack([q] * (HORIZON + 1)), STEP)[side]

    one = target(planner, joints(yaw), behind)
    other = target(mirrored, MIRROR * joints(yaw), front)
    np.testing.assert_allclose(other.position, MIRROR * one.position, atol=1e-9)
    np.testing.assert_allclose(other.direction, MIRROR * one.direction, atol=1e-9)


def test_a_sleeve_on_its_arm_is_asked_to_go_on_at_its_rate(planner: TaskPlanner) -> None:
    axes = arm_axes(joints())
    on = SleeveFacts(linked=True, s=0.5, hand_distance=0.2, prepared_error=0.2, passed=0.0)
    given = Assignment((Task.DRESS, Task.DRESS), (on, on))
    sleeves = [SleeveState(axis.G(0.7), axis.D(0.7)) for axis in axes]
    renewed = planner.renewed(given, sleeves, joints())
    assert renewed.facts[0].s == pytest.approx(0.7)
    rate = planner.parameters.progress_rate
    for step, count in ((0.1, 3), (0.05, 6)):
        rows = np.stack([joints()] * (count + 1))
        for axis, target in zip(axes, planner.targets(renewed, sleeves, rows, step), strict=True):
            s = 0.7 + rate * step * np.arange(1, count + 1)
            aside = planner.parameters.elbow_outward * axis.outward(0.7)
            np.testing.assert_allclose(target.position - aside, [axis.G(v) for v in s], atol=1e-12)
            np.testing.assert_allclose(target.direction, [axis.D(v) for v in s], atol=1e-12)


def test_a_sleeve_passes_a_bent_elbow_on_its_outside_and_little_ahead(
    planner: TaskPlanner,
) -> None:
    bent = ArmPose(0.25, 0.8, 0.0, 1.5)
    q = np.vstack([arm_points(M, "sitting", side, bent) for side in SIDES])
    axis, p = arm_axes(q)[0], planner.parameters
    rows = np.stack([q] * (HORIZON + 1))

    def asked(s: float) -> np.ndarray:
        on = SleeveFacts(linked=True, s=s, hand_distance=0.2, prepared_error=0.2, passed=0.0)
        sleeve = SleeveState(axis.G(s), axis.D(s))
        given = Assignment((Task.DRESS, Task.DRESS), (on, on))
        # 1 s per step: the rate alone asks for more than is left of the arm
        return np.asarray(planner.targets(given, [sleeve, sleeve], rows, 1.0)[0].position)

    outward = axis.outward(1.0)
    at_elbow = asked(1.0)
    lead = p.elbow_lead / np.linalg.norm(outward)
    np.testing.assert_allclose(
        at_elbow,
        np.tile(axis.G(float(1.0 + lead)) + p.elbow_outward * outward, (HORIZON, 1)),
        atol=1e-9,
    )
    np.testing.assert_allclose(asked(1.45)[-1], axis.G(p.final_progress), atol=0.02)


def test_a_sleeve_that_is_on_no_arm_makes_no_progress(planner: TaskPlanner) -> None:
    off = SleeveFacts(linked=False, s=0.0, hand_distance=0.2, prepared_error=0.2, passed=0.1)
    given = Assignment((Task.PREPARE, Task.PREPARE), (off, off))
    sleeves = [SleeveState(axis.G(0.7), axis.D(0.7)) for axis in arm_axes(joints())]
    assert planner.renewed(given, sleeves, joints()).facts == (off, off)


@pytest.mark.parametrize("side", [0, 1])
def test_a_hand_that_was_missed_is_gone_about_in_other_ways(
    planner: TaskPlanner, side: int
) -> None:
    ways = planner.parameters.approaches
    x = planner.mesh.rest_position + [-0.4, 0.0, 0.9]
    forearm = arm_axes(joints())[side].D(0.0)

    def asked(attempts: int) -> tuple[SleeveFacts, SleeveTarget]:
        missed = (attempts, 0) if side == 0 else (0, attempts)
        _, seen = planner.assign(StageState(attempts=missed), x, joints(), 0.0)
        given = Assignment((Task.PREPARE, Task.PREPARE), seen.facts, attempts=missed)
        rows = np.stack([joints()] * (HORIZON + 1))
        found = planner.targets(given, planner.sleeves(x), rows, STEP)
        return seen.facts[side], found[side]

    facts, targets = zip(*(asked(k) for k in range(len(ways) + 1)), strict=True)
    along = [float(t.direction[0] @ forearm) for t in targets]
    for k, (way, target) in enumerate(zip(ways, targets, strict=False)):
        assert target.direction_weight == way.emphasis
        for j, other in enumerate(ways):
            if way.tilt == other.tilt:
                assert (along[k] < along[j]) == (way.orientation < other.orientation)
            elif way.orientation == other.orientation:
                # it is the level part of the forearm that it turns to
                slope = [t.direction[0, 2] for t in (targets[k], targets[j])]
                assert (slope[0] < slope[1]) == (way.tilt < other.tilt)
            # the line on which the hand is met is another one
            if way.share != other.share:
                assert abs(facts[k].prepared_error - facts[j].prepared_error) > 1e-3
    # all were tried: the first again
    np.testing.assert_array_equal(targets[-1].direction, targets[0].direction)
    assert facts[-1] == facts[0]


@pytest.mark.parametrize(("extension", "first"), [(1.1, 1), (0.6, 0), (0.4, 2)])
def test_a_forearm_is_first_gone_about_as_its_slope_asks_for(
    planner: TaskPlanner, extension: float, first: int
) -> None:
    q = np.vstack(
        [
            arm_points(M, "sitting", side, ArmPose(0.25, extension, 0.0, 0.0), frame(0.0))
            for side in SIDES
        ]
    )
    axis, to, ways = arm_axes(q)[0], heading(q), planner.parameters.approaches
    off = SleeveFacts(linked=False, s=0.0, hand_distance=0.5, prepared_error=0.2, passed=0.0)
    away = SleeveState(axis.G(0.0) - 0.3 * axis.D(0.0), axis.D(0.0))
    rows = np.stack([q] * (HORIZON + 1))
    asked = []
    for k in range(len(ways)):
        given = Assignment((Task.PREPARE, Task.REST), (off, off), attempts=(k, 0))
        asked.append(planner.targets(given, [away, away], rows, STEP)[0].direction[0])
    order = [first, *(i for i in range(len(ways)) if i != first)]
    np.testing.assert_allclose(asked, [ways[i].entry(axis.D(0.0), to, 0) for i in order])


def test_a_hanging_hand_is_gone_about_in_the_first_way_every_second_time() -> None:
    p, to = TaskParameters(), heading(joints())
    ways = p.edge_approaches

    def order(forearm: np.ndarray) -> list[int]:
        chosen = [choose_approach(p, forearm, to, 0, k, False, "edges") for k in range(7)]
        return [ways.index(way) for way in chosen]

    last = len(ways) - 1
    steep = np.array([0.1, 0.0, 0.995])
    assert order(steep) == [last, last, 0, last, 1, last, 2]
    assert order(np.array([0.8, 0.0, 0.6])) == [0, 1, 2, 3, 0, 1, 2]
    for missed in range(4):
        lifted = missed % 2 == 1
        assert lifts(p, steep, False, missed, "edges") == lifted
        assert not lifts(p, steep, True, missed, "edges")
        assert not lifts(p, steep, False, missed, "shoulders")
        assert not lifts(p, np.array([0.8, 0.0, 0.6]), False, missed, "edges")


@pytest.mark.parametrize("tethered", [False, True])
@pytest.mark.parametrize("side", [0, 1])
def test_an_arm_that_was_led_inward_is_gone_about_along_its_forearm(
    planner: TaskPlanner, side: int, tethered: bool
) -> None:
    """Every other time, only the first one, and only once it was missed a few times."""
    p, off = planner.parameters, SleeveFacts(False, 0.0, 0.5, 0.5, 0.0)
    other = replace(off, linked=tethered, s=0.5)
    for inward in (-0.2, 0.1):
        q = joints()
        to = heading(q)
        across = to.leftward * (-1.0 if side == 0 else 1.0)
        hand, elbow = q[3 * side + 2], q[3 * side + 1]
        level = np.sqrt(1.0 - 0.8**2 - inward**2)
        q[3 * side + 1] = hand + np.linalg.norm(elbow - hand) * (
            inward * across + level * to.front + [0.0, 0.0, 0.8]
        )
        axis, rows = arm_axes(q)[side], np.stack([q] * 2)
        assert float(axis.D(0.0) @ across) == pytest.approx(inward)
        sleeves = [SleeveState(a.G(0.0) - 0.4 * a.D(0.0), a.D(0.0)) for a in arm_axes(q)]
        for missed in range(7):
            given = Assignment(
                (Task.PREPARE, Task.WAIT) if side == 0 else (Task.WAIT, Task.PREPARE),
                (off, other) if side == 0 else (other, off),
                attempts=(missed, 0) if side == 0 else (0, missed),
            )
            asked = planner.targets(given, sleeves, rows, STEP)[side].direction[0]
            along = p.led_approach.entry(axis.D(0.0), to, side)
            due = not tethered and inward < p.led_inward and missed in (3, 5)
            assert np.allclose(asked, along) == due


@pytest.mark.parametrize("tethered", [False, True])
@pytest.mark.parametrize("side", [0, 1])
def test_a_sleeve_goes_where_it_is_seen_then_in_line_then_on(
    planner: TaskPlanner, side: int, tethered: bool
) -> None:
    """One that missed its hand, or whose other one is on its arm, which goes around."""
    axes = arm_axes(joints())
    hand, away = axes[side].G(0.0), np.array([-0.1, 0.02, -0.06])
    normal = np.array([0.6, 0.0, 0.8])
    other = SleeveFacts(tethered, 0.5, hand_distance=0.2, prepared_error=0.2, passed=0.0)
    outlook = (None, None) if tethered else (away, None) if side == 0 else (None, away)
    rows = np.stack([joints()] * (HORIZON + 1))

    def asked(sight: float, retreats: bool, beside: float = 0.2) -> np.ndarray:
        # the hand is beside the opening's axis, on the side from which it is entered
        sleeve = SleeveState(hand - 0.1 * normal + [0.0, beside, 0.0], normal)
        sleeves = [sleeve, SleeveState(axes[1 - side].G(0.5), axes[1 - side].D(0.5))]
        off = SleeveFacts(False, 0.0, 0.2, 0.2, 0.0, sight=sight)
        order = (off, other) if side == 0 else (other, off)
        given = Assignment(
            (Task.PREPARE, Task.PREPARE), order, (retreats, retreats), outlook=outlook
        )
        both = sleeves if side == 0 else sleeves[::-1]
        found: np.ndarray = planner.targets(given, both, rows, STEP)[side].position[0]
        return found

    if tethered:
        away = asked(0.0, False) - hand
    np.testing.assert_allclose(asked(0.0, False), hand + away)
    p = planner.parameters
    before, beyond = -p.funnel_distance * normal, p.overshoot * normal
    np.testing.assert_allclose(asked(1.0, False), hand + before)
    half = 0.5 * (p.stages.least_sight + p.clear_sight)
    np.testing.assert_allclose(asked(half, False), hand + 0.5 * (away + before))
    np.testing.assert_allclose(asked(1.0, False, p.funnel_narrow), hand + beyond)
    between = 0.5 * (p.funnel_narrow + p.funnel_wide)
    np.testing.assert_allclose(asked(1.0, False, between), hand + 0.5 * (before + beyond))
    # one that has just missed the hand keeps away first, seen or not
    assert np.linalg.norm(asked(1.0, True) - hand) > planner.parameters.retreat_distance


def asked_unseen(
    planner: TaskPlanner, side: int, outward: float, ahead: float, up: float
) -> tuple[float, float]:
    """Returns how far behind its hand and outward of it a sleeve is asked to be, m.

    The hand does not see it, and the other sleeve is on its arm. It is now outward, ahead of and
    above the hand.
    """
    q = joints()
    axes, to = arm_axes(q), heading(q)
    hand, out = axes[side].G(0.0), -to.inward(side)
    place = hand + outward * out + ahead * to.front + [0.0, 0.0, up]
    sleeve = SleeveState(place, np.array([0.6, 0.0, 0.8]))
    waits = SleeveState(axes[1 - side].G(0.5), axes[1 - side].D(0.5))
    off = SleeveFacts(False, 0.0, float(np.linalg.norm(hand - place)), 0.2, 0.0, sight=0.0)
    on = SleeveFacts(linked=True, s=0.5, hand_distance=0.2, prepared_error=0.2, passed=0.0)
    given = Assignment(
        (Task.PREPARE, Task.WAIT) if side == 0 else (Task.WAIT, Task.PREPARE),
        (off, on) if side == 0 else (on, off),
    )
    both = [sleeve, waits] if side == 0 else [waits, sleeve]
    rows = np.stack([q] * (HORIZON + 1))
    asked = planner.targets(given, both, rows, STEP)[side].position[0] - hand
    return -float(asked @ to.front), float(asked @ out)


@pytest.mark.parametrize("side", [0, 1])
@drawn(st.floats(-0.3, 0.3), st.floats(-0.3, 0.3), st.floats(-0.3, 0.3))
def test_a_tethered_sleeve_goes_around_the_hand_that_does_not_see_it(
    planner: TaskPlanner, side: int, outward: float, ahead: float, up: float
) -> None:
    """Outward and far back first; forward only where the panel passes beside the hand."""
    p = planner.parameters
    behind, beside = asked_unseen(planner, side, outward, ahead, up)
    assert beside > p.passing_from
    if outward < p.passing_from:
        assert behind > p.passing_back
    elif outward > p.passing_beside:
        assert behind == pytest.approx(p.passing_behind)
        assert beside == pytest.approx(p.passing_outward)
    else:
        assert behind >= p.passing_behind - 1e-9


def test_a_wider_armhole_may_be_further_beside_the_hand() -> None:
    """It is drawn on where a narrower one is aligned first: the hand fits in beside the middle."""
    q, to = np.stack([joints()] * (HORIZON + 1)), heading(joints())
    facts = SleeveFacts(False, 0.0, 0.12, 0.06, 0.0)
    given = Assignment((Task.PREPARE, Task.REST), (facts, facts))

    def ahead(girth: float, beside: float) -> float:
        coat = CoatParameters(armhole_girth=girth, cuff_girth=0.4, chest=1.5)
        planner = TaskPlanner(make_coat(coat, 0.06), TaskParameters())
        axis, p = arm_axes(joints())[0], planner.parameters
        normal = p.approaches[0].direction(axis.D(0.0), to, 0)
        across = np.cross(normal, [0.0, 0.0, 1.0])
        across /= np.linalg.norm(across)
        sleeve = SleeveState(axis.G(0.0) - 0.1 * normal + beside * across, normal)
        goal = planner.targets(given, [sleeve, sleeve], q, STEP)[0].position[0]
        return float(normal @ (goal - axis.G(0.0)))

    p = TaskParameters()
    at = p.funnel_wide
    assert ahead(0.5, at) == pytest.approx(-p.funnel_distance)
    assert ahead(0.56, at) == pytest.approx(-p.funnel_distance)
    wider = 2.0 * np.pi * (p.funnel_radius + p.funnel_wide - p.funnel_narrow)
    assert ahead(wider, at) == pytest.approx(p.overshoot, abs=0.01)


@pytest.mark.parametrize("side", [0, 1])
@drawn(st.floats(-0.3, 0.3), st.floats(-0.3, 0.3), st.floats(-0.3, 0.3))
def test_with_the_edges_held_it_passes_behind_the_hand_and_not_over_it(
    planner: TaskPlanner, side: int, outward: float, ahead: float, up: float
) -> None:
    """In front of the hand it goes straight back; only behind the hand it comes in line with it."""
    held = TaskPlanner(held_at_edges(planner.mesh, 0.4, "test"), planner.parameters)
    p = planner.parameters
    behind, beside = asked_unseen(held, side, outward, ahead, up)
    assert behind > 0.5 * p.edge_back
    if ahead > -0.25 * p.edge_back:
        assert beside == pytest.approx(outward)
        assert behind == pytest.approx(p.edge_back)
    elif ahead < -0.75 * p.edge_back:
        assert beside == pytest.approx(p.edge_outward)


def test_the_first_sleeve_comes_in_line_before_it_is_drawn_over_the_hand(
    planner: TaskPlanner,
) -> None:
    q, to = np.stack([joints()] * (HORIZON + 1)), heading(joints())
    axis, p = arm_axes(joints())[0], planner.parameters
    normal = p.approaches[0].direction(axis.D(0.0), to, 0)
    across = np.cross(normal, [0.0, 0.0, 1.0])
    across /= np.linalg.norm(across)
    facts = SleeveFacts(False, 0.0, 0.12, 0.06, 0.0)
    given = Assignment((Task.PREPARE, Task.REST), (facts, facts))

    def ahead(beside: float, depth: float = -0.1) -> float:
        sleeve = SleeveState(axis.G(0.0) + depth * normal + beside * across, normal)
        goal = planner.targets(given, [sleeve, sleeve], q, STEP)[0].position[0]
        return float(normal @ (goal - axis.G(0.0)))

    assert ahead(p.funnel_wide) == pytest.approx(-p.funnel_distance)
    assert ahead(p.funnel_narrow) == pytest.approx(p.overshoot)
    assert ahead(0.5 * (p.funnel_narrow + p.funnel_wide)) == pytest.approx(
        0.5 * (p.overshoot - p.funnel_distance)
    )
    # the hand is in the opening: it goes on, along the forearm
    assert ahead(p.funnel_wide, depth=0.05) > 0.0


def test_a_sleeve_goes_back_as_far_as_its_hand_is_barred_from_it(planner: TaskPlanner) -> None:
    """Without a leap: an armhole that turned round with each line of sight would get nowhere."""
    q, to = np.stack([joints()] * (HORIZON + 1)), heading(joints())
    axis, p = arm_axes(joints())[0], planner.parameters
    way = p.approaches[0].direction(axis.D(0.0), to, 0)
    near = SleeveState(axis.G(0.0) - 0.12 * way, way)

    def ahead(sight: float) -> float:
        facts = SleeveFacts(False, 0.0, 0.12, 0.06, 0.0, sight=sight)
        given = Assignment((Task.PREPARE, Task.REST), (facts, facts))
        goal = planner.targets(given, [near, near], q, STEP)[0].position[0]
        return float(way @ (goal - axis.G(0.0)))

    found = [ahead(sight) for sight in np.linspace(0.0, 1.0, 41)]
    assert found[0] < -0.9 * p.approach_distance
    assert found[-1] == pytest.approx(p.overshoot)
    assert np.all(np.diff(found) > -1e-12)
    assert np.diff(found).max() < 0.25 * (found[-1] - found[0])


def test_a_sleeve_that_is_up_leaves_the_garment_to_the_other(planner: TaskPlanner) -> None:
    q = np.stack([joints()] * (HORIZON + 1))
    p, axes = planner.parameters, arm_axes(joints())

    def asked(s: tuple[float, float]) -> list[np.ndarray]:
        sleeves = [SleeveState(a.G(x), a.D(x)) for a, x in zip(axes, s, strict=True)]
        facts = [SleeveFacts(True, x, 0.5, 0.5, 0.0) for x in s]
        given = Assignment((Task.DRESS, Task.DRESS), (facts[0], facts[1]))
        return [t.position[-1] for t in planner.targets(given, sleeves, q, STEP)]

    left, right = asked((1.95, 1.89))
    np.testing.assert_allclose(left, axes[0].G(p.stages.done_progress))
    np.testing.assert_allclose(right, axes[1].G(p.final_progress))
    # with both nearly there both go on
    left, _ = asked((1.95, p.stages.kept_progress + 0.005))
    np.testing.assert_allclose(left, axes[0].G(p.final_progress))


def test_a_garment_that_is_taken_back_goes_behind_both_shoulders(planner: TaskPlanner) -> None:
    p, yaw = planner.parameters, 0.4
    q, turn = joints(yaw), frame(yaw)[0]
    off = SleeveFacts(False, 0.0, 0.1, 0.1, 0.0, touches=True)
    given = Assignment((Task.PREPARE, Task.PREPARE), (off, off), (True, False), withdraw=True)
    sleeves = [SleeveState(a.G(0.0), a.D(0.0)) for a in arm_axes(q)]
    for axis, target in zip(
        arm_axes(q), planner.targets(given, sleeves, np.stack([q] * 2), STEP), strict=True
    ):
        behind = turn.T @ (axis.G(2.0) - target.position[0])
        np.testing.assert_allclose(behind, [p.withdrawal_distance, 0.0, 0.0], atol=1e-12)
        assert target.entering
        assert target.corridor is None
        assert target.passage is None


@pytest.mark.parametrize("side", [0, 1])
def test_a_second_sleeve_is_swung_back_behind_the_first(planner: TaskPlanner, side: int) -> None:
    p, yaw = planner.parameters, 0.4
    q, turn = joints(yaw), frame(yaw)[0]
    off = SleeveFacts(False, 0.0, 0.1, 0.1, 0.0, touches=True)
    on = SleeveFacts(True, 0.5, 0.2, 0.2, 0.0)
    sleeves = [SleeveState(a.G(0.5), a.D(0.5)) for a in arm_axes(q)]
    given = Assignment(
        (Task.PREPARE, Task.WAIT) if side == 0 else (Task.WAIT, Task.PREPARE),
        (off, on) if side == 0 else (on, off),
        swing=(side == 0, side == 1),
    )
    target = planner.targets(given, sleeves, np.stack([q] * 2), STEP)[side]
    backward, outward, up = turn.T @ (sleeves[1 - side].p_c - target.position[0])
    assert backward > 0.0
    assert up == pytest.approx(0.0)
    assert (outward < 0.0) == (side == 0)
    reach = armholes_apart(planner)
    assert np.hypot(backward, outward) == pytest.approx(p.swing_reach * reach)
    assert target.corridor is None
    assert target.passage is None


def test_sleeves_that_are_done_stay_where_they_are_on_their_arms(planner: TaskPlanner) -> None:
    q, moved = joints(), joints() + [0.1, 0.0, 0.0]
    p, beside = planner.parameters, np.array([0.0, 0.01, 0.01])
    on = [SleeveFacts(True, s, 0.5, 0.5, 0.0) for s in (1.96, 1.91)]
    sleeves = [
        SleeveState(a.G(f.s) + beside, a.D(f.s)) for a, f in zip(arm_axes(q), on, strict=True)
    ]
    given = Assignment((Task.HOLD, Task.HOLD), (on[0], on[1]))
    left, right = planner.targets(given, sleeves, np.stack([q, q, moved]), STEP)
    np.testing.assert_allclose(left.position[0], sleeves[0].p_c)
    np.testing.assert_allclose(left.position[1], sleeves[0].p_c + [0.1, 0.0, 0.0])
    # one that has slipped to where it only just counts is drawn up again
    axis = arm_axes(q)[1]
    np.testing.assert_allclose(right.position[0], axis.G(p.held_progress) + beside)
    assert left.position_weight > 0.0


def test_a_waiting_sleeve_is_as_far_up_as_lets_the_other_be_prepared(planner: TaskPlanner) -> None:
    """Where it is too far off even so, it is drawn aside by what is lacking."""
    p, facts = planner.parameters, SleeveFacts(False, 0.0, 0.5, 0.5, 0.0)
    given = Assignment((Task.WAIT, Task.PREPARE), (replace(facts, linked=True, s=1.5), facts))
    reach = p.waiting_reach * armholes_apart(planner)
    longest = p.longest_reach * armholes_apart(planner)
    held, drawn = [], []
    for across in np.linspace(0.0, 0.8, 17):  # the right hand comes over to the left arm
        q = joints()
        q[5] += across * (q[2] - q[5])
        axis, other = arm_axes(q)
        sleeves = [SleeveState(axis.G(1.5), axis.D(1.5)), SleeveState(other.G(0.0), other.D(0.0))]
        waiting, prepared = planner.targets(given, sleeves, np.stack([q] * 2), STEP)
        apart = float(np.linalg.norm(waiting.position[0] - prepared.position[0]))
        along = np.linspace(0.0, 2.0, 2001)
        aside = np.linalg.norm(axis.points(along) - waiting.position[0], axis=1)
        if aside.min() < 1e-3:
            s = along[np.argmin(aside)]
            assert apart < reach or (apart < longest and s < p.stages.waiting_progress + 1e-3)
            if s < p.final_progress - 0.05:
                further = axis.points(np.linspace(s + 0.05, 2.0, 50))
                assert np.linalg.norm(further - prepared.position[0], axis=1).min() > reach
            held.append(s)
        else:
            stood = axis.G(p.stages.waiting_progress)
            to_other, moved = prepared.position[0] - stood, waiting.position[0] - stood
            np.testing.assert_allclose(np.cross(to_other, moved), 0.0, atol=1e-12)
            assert moved @ to_other > 0.0
            drawn.append(float(np.linalg.norm(moved)))
            assert drawn[-1] <= p.largest_aside + 1e-12
            assert apart == pytest.approx(longest) or drawn[-1] == pytest.approx(p.largest_aside)
    assert sum(min(held) + 0.1 < s < p.final_progress - 0.1 for s in held) > 1
    assert max(drawn) > 0.01


@pytest.mark.parametrize(("apart", "stay"), [(0.1, 4), (0.4, 3), (0.9, 0)])
def test_a_waiting_sleeve_stays_while_the_other_is_at_its_hand(
    planner: TaskPlanner, apart: float, stay: int
) -> None:
    """Up or down, it would draw that armhole away; but a garment drawn out is let down."""
    p, q = planner.parameters, joints()
    q[5] = q[2] + [0.0, -apart, 0.0]
    axis, other = arm_axes(q)
    longest, stayed = p.longest_reach * armholes_apart(planner), 0
    for s in (0.1, 0.5, 0.9, 1.3):
        far = SleeveFacts(False, 0.0, 1.1 * p.near_distance, 0.1, 0.0)
        near = replace(far, hand_distance=0.5 * p.near_distance)
        sleeves = [SleeveState(axis.G(s), axis.D(s)), SleeveState(other.G(0.0), other.D(0.0))]

        tasks = (Task.WAIT, Task.PREPARE)
        given = [Assignment(tasks, (replace(f, linked=True, s=s), f)) for f in (near, far)]
        (place, to), (further, _) = (
            [t.position[0] for t in planner.targets(g, sleeves, np.stack([q] * 2), STEP)]
            for g in given
        )
        stays = max(s, p.stages.waiting_progress)
        if np.linalg.norm(axis.G(stays) - to) < longest:
            np.testing.assert_allclose(place, axis.G(stays), atol=1e-6)
            stayed += 1
        elif stays > p.stages.waiting_progress:
            # no further up, and the other one in reach or all that is allowed done for it
            assert np.linalg.norm(place - to) < np.linalg.norm(axis.G(stays) - to)
            lowest = axis.G(p.stages.waiting_progress)
            short = float(np.linalg.norm(lowest - to)) - longest
            assert np.linalg.norm(place - to) < longest + max(0.0, short) + 1e-6
        if apart == 0.1 and s < 1.0:
            # from further off it is drawn up, to where it lets the other one be
            assert axis.coordinates(further).s > 1.0
    assert stayed == stay


def test_a_waiting_sleeve_that_may_slip_off_counts_for_more(planner: TaskPlanner) -> None:
    p, q = planner.parameters, joints()
    axis, other = arm_axes(q)
    least, off = p.stages.waiting_progress, SleeveFacts(False, 0.0, 0.3, 0.3, 0.0)
    weights = []
    for s in (0.5 * least, 1.5 * least):
        given = Assignment((Task.WAIT, Task.PREPARE), (replace(off, linked=True, s=s), off))
        sleeves = [SleeveState(axis.G(s), axis.D(s)), SleeveState(other.G(0.0), other.D(0.0))]
        weights.append(planner.targets(given, sleeves, np.stack([q] * 2), STEP)[0].position_weight)
    assert weights[0] > 2.0 * weights[1] == 2.0


def test_sleeves_are_on_while_both_arms_are_far_enough_in_them(planner: TaskPlanner) -> None:
    q, kept = joints(), planner.parameters.stages.kept_progress
    axes, angle = arm_axes(q), np.linspace(0.0, 2.0 * np.pi, len(planner.armholes[0]), False)
    circle = np.stack([np.cos(angle), np.sin(angle)], axis=1)

    def on(progress: tuple[float, float], beside: tuple[float, float] = (0.0, 0.0)) -> bool:
        x = planner.mesh.rest_position.copy()
        for loop, axis, s, off in zip(planner.armholes, axes, progress, beside, strict=True):
            across = np.linalg.svd(axis.D(s)[None])[2][1:]
            x[loop] = axis.G(s) + (0.1 * circle + [off, 0.0]) @ across
        return planner.are_on(x, q)

    up, down = kept + 0.01, kept - 0.01
    assert on((up, up))
    assert not on((up, down))
    assert not on((down, up))
    # beside its arm a sleeve is not on it, however far up
    assert not on((up, up), (0.0, 0.2))
    assert not on((up, up), (0.2, 0.0))


def test_a_hand_at_an_opening_is_drawn_in_along_its_forearm(planner: TaskPlanner) -> None:
    """Whatever bars its sight, and with more weight on where the armhole is."""
    q = np.stack([joints()] * (HORIZON + 1))
    axis = arm_axes(joints())[0]
    away = SleeveState(axis.G(0.0) - 0.3 * axis.D(0.0), axis.D(0.0))
    off = SleeveFacts(linked=False, s=0.0, hand_distance=0.5, prepared_error=0.2, passed=0.0)
    near = replace(off, hand_distance=0.1, sight=0.0)
    p = planner.parameters
    for facts, retreat in ((near, False), (replace(near, touches=True), False), (near, True)):
        given = Assignment((Task.PREPARE, Task.REST), (facts, off), (retreat, False))
        target = planner.targets(given, [away, away], q, STEP)[0]
        if retreat:
            assert target.corridor is None
            assert target.position_weight == 1.0
            assert target.passage is None
            continue
        assert target.position_weight == p.near_position
        assert target.corridor is not None
        np.testing.assert_allclose(target.corridor.hand[0], axis.G(0.0))
        np.testing.assert_allclose(target.corridor.into[-1], -axis.D(0.0))
        assert target.passage is not None
        np.testing.assert_allclose(target.passage, np.tile(-axis.D(0.0), (HORIZON, 1)))
        onward = np.stack([axis.G((j + 1) * STEP * p.progress_rate) for j in range(HORIZON)])
        assert np.allclose(target.position, onward) == facts.touches


HANGING = ArmPose(np.deg2rad(12.0), np.deg2rad(5.0), 0.0, np.deg2rad(10.0))


@pytest.mark.parametrize("side", [0, 1])
@pytest.mark.parametrize(("spread", "missed"), [(True, 1), (True, 0), (False, 1)])
def test_an_armhole_that_missed_a_hanging_hand_comes_to_it_then_through_it(
    planner: TaskPlanner, side: int, spread: bool, missed: int
) -> None:
    """With the edges held; otherwise, and at first, it is drawn along the forearm at once."""
    mesh = held_at_edges(planner.mesh, 0.4, "test") if spread else planner.mesh
    held, p = TaskPlanner(mesh, planner.parameters), planner.parameters
    rest = np.vstack([arm_points(M, "standing", s, HANGING) for s in SIDES])
    axis, hand = arm_axes(rest)[side], rest[3 * side + 2]
    forearm = axis.D(0.0)
    tilted = np.cross(forearm, [1.0, 0.0, 0.0])
    normal = (forearm + tilted / np.linalg.norm(tilted)) / np.sqrt(2.0)
    across = np.array([1.0, 0.0, 0.0]) - normal[0] * normal
    across /= np.linalg.norm(across)
    off = SleeveFacts(linked=False, s=0.0, hand_distance=0.5, prepared_error=0.2, passed=0.0)
    near = replace(off, hand_distance=0.08, touches=True)
    facts = (near, off) if side == 0 else (off, near)
    tasks = (Task.PREPARE, Task.REST) if side == 0 else (Task.REST, Task.PREPARE)

    def asked(center: np.ndarray) -> np.ndarray:
        sleeve = SleeveState(center, normal)
        rows = np.stack([rest] * (HORIZON + 1))
        given = Assignment(tasks, facts, attempts=(missed, missed))
        found = held.targets(given, [sleeve, sleeve], rows, STEP)[side]
        return np.asarray(found.position[-1] - hand)

    radius = planner._radii[side]
    wide = p.funnel_wide + max(0.0, radius - p.funnel_radius)
    beside = asked(hand + 1.1 * wide * across - 0.02 * normal)
    before = asked(hand - 0.02 * normal)
    inside = asked(hand + 0.06 * normal)
    if not spread or missed == 0:
        drawn = axis.G(HORIZON * STEP * p.progress_rate) - hand
        for place in (beside, before, inside):
            np.testing.assert_allclose(place, drawn, atol=1e-9)
        return
    np.testing.assert_allclose(beside, 0.0, atol=1e-9)
    between = (normal + forearm) / np.linalg.norm(normal + forearm)
    np.testing.assert_allclose(before, p.overshoot * between, atol=1e-9)
    np.testing.assert_allclose(inside, p.overshoot * forearm, atol=1e-9)
