"""Steps of a garment in a process of its own: the same numbers, whatever else happens."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator

from drake_dress.diagrams.station import SimulatedStation
from drake_dress.models.cloth.contact.obstacles import Obstacles
from drake_dress.models.cloth.implicit.implicit_cloth import ImplicitCloth
from drake_dress.models.cloth.material import Material
from drake_dress.models.cloth.state import ClothState
from drake_dress.systems.garment_steps import StepsHere, StepsInWorker, Surroundings
from tests.models.cloth.sheets import sheet_elements
from tests.systems.draped import H, draped_station

SIDE = 12
SHEET, ELEMENTS = sheet_elements(SIDE + 1, SIDE + 1, 0.03)
HELD = np.array([0, SIDE], dtype=np.int32)
# a bar under the sheet
BAR = Obstacles(
    np.array([[-0.1, 0.18, -0.06]]),
    np.array([[0.5, 0.18, -0.06]]),
    np.array([0.05]),
    np.zeros((1, 3)),
    np.zeros((1, 3)),
)
AROUND = Surroundings(BAR.radius, len(HELD))
STILL = np.zeros((2, 3))


def cloth() -> ImplicitCloth:
    return ImplicitCloth(ELEMENTS, Material(), H, HELD)


@pytest.fixture
def in_worker() -> Iterator[StepsInWorker]:
    steps = StepsInWorker(cloth(), AROUND)
    yield steps
    steps._process.kill()


def same(one: ClothState, other: ClothState) -> bool:
    return all(np.array_equal(getattr(one, k), value) for k, value in vars(other).items())


def copied(state: ClothState) -> ClothState:
    return ClothState(**{k: np.array(value) for k, value in vars(state).items()})


def test_surroundings_stand_in_one_array() -> None:
    rng = np.random.default_rng(2)
    a, b = rng.normal(size=(2, 3, 3))
    velocity, angular_velocity = rng.normal(size=(2, 3, 3))
    bodies = Obstacles(a, b, np.ones(3), velocity, angular_velocity)
    velocity = rng.normal(size=(5, 3))
    around = Surroundings(bodies.radius, 5)
    flat = around.flat(bodies, velocity)
    assert flat.shape == (around.size,)
    again, motion = around.of(flat)
    for name in ("a", "b", "radius", "velocity", "angular_velocity"):
        np.testing.assert_array_equal(getattr(again, name), getattr(bodies, name))
    np.testing.assert_array_equal(motion, velocity)


def test_numbers_are_those_of_steps_made_here(in_worker: StepsInWorker) -> None:
    here = StepsHere(cloth(), AROUND)
    states = {}
    for steps in (here, in_worker):
        state, found = ClothState.at_rest(SHEET), []
        for k in range(60):
            steps.begin(state, AROUND.flat(BAR, STILL + 0.1 * np.sin(0.1 * k)))
            state = steps.end()
            found.append(copied(state))
        states[type(steps)] = found
    assert all(same(a, b) for a, b in zip(states[StepsHere], states[StepsInWorker], strict=True))
    assert (states[StepsHere][-1].owner >= 0).any()


def test_a_step_may_begin_anywhere_and_be_forgotten(in_worker: StepsInWorker) -> None:
    here = StepsHere(cloth(), AROUND)
    around = AROUND.flat(BAR, STILL)
    moved = ClothState.at_rest(SHEET + np.array([0.0, 0.0, 0.3]))
    in_worker.begin(ClothState.at_rest(SHEET), around)
    last = in_worker.end()
    in_worker.begin(last, around)
    in_worker.begin(moved, around)
    here.begin(moved, around)
    assert same(in_worker.end(), here.end())


def test_a_result_lasts_while_the_next_step_is_made(in_worker: StepsInWorker) -> None:
    around = AROUND.flat(BAR, STILL)
    in_worker.begin(ClothState.at_rest(SHEET), around)
    first = in_worker.end()
    kept = copied(first)
    in_worker.begin(first, around)
    in_worker.end()
    assert same(first, kept)


def test_what_is_not_finite_is_told_and_does_not_end_it(in_worker: StepsInWorker) -> None:
    around = AROUND.flat(BAR, STILL)
    in_worker.begin(ClothState.at_rest(SHEET), AROUND.flat(BAR, np.full((2, 3), np.nan)))
    with pytest.raises(ValueError, match="held"):
        in_worker.end()
    in_worker.begin(ClothState.at_rest(SHEET), around)
    assert np.isfinite(in_worker.end().x).all()


def test_what_was_not_begun_does_not_end(in_worker: StepsInWorker) -> None:
    for steps in (in_worker, StepsHere(cloth(), AROUND)):
        with pytest.raises(RuntimeError, match="begun"):
            steps.end()


def test_a_process_that_is_gone_is_told(in_worker: StepsInWorker) -> None:
    around = AROUND.flat(BAR, STILL)
    in_worker.begin(ClothState.at_rest(SHEET), around)
    state = in_worker.end()
    assert in_worker._process.pid is not None
    os.kill(in_worker._process.pid, signal.SIGKILL)
    with pytest.raises(RuntimeError, match="ended"):
        for _ in range(2):
            in_worker.begin(state, around)
            state = in_worker.end()


def test_it_ends_with_who_began_it() -> None:
    # a parent that is killed tells nobody
    code = (
        "from tests.systems import test_garment_steps as t\n"
        "if __name__ == '__main__':\n"
        "    steps = t.StepsInWorker(t.cloth(), t.AROUND)\n"
        "    steps.begin(t.ClothState.at_rest(t.SHEET), t.AROUND.flat(t.BAR, t.STILL))\n"
        "    steps.end()\n"
        "    print(steps._process.pid, flush=True)\n"
        "    input()\n"
    )
    parent = subprocess.Popen(
        [sys.executable, "-c", code],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        cwd=Path(__file__).parents[2],
    )
    assert parent.stdout is not None
    child = int(parent.stdout.readline())
    assert Path(f"/proc/{child}").exists()
    parent.kill()
    parent.wait()
    for _ in range(100):
        state = Path(f"/proc/{child}/stat")
        # a zombie that nobody waits for has ended, too
        if not state.exists() or state.read_text().rsplit(")", 1)[1].split()[0] == "Z":
            return
        time.sleep(0.05)
    pytest.fail("the process went on")


def advanced(made: SimulatedStation) -> tuple[Simulator, np.ndarray]:
    simulator = Simulator(made.diagram)
    context = simulator.get_mutable_context()
    for i, side in enumerate(("left", "right")):
        port = made.diagram.GetInputPort(f"{side}_gripper.position_command")
        port.FixValue(context, made.start_grippers[i] + np.array([0.2, 0.0, -0.1]))
    simulator.AdvanceTo(0.6)
    return simulator, made.diagram.GetOutputPort("cheat_plant_state").Eval(context)


def test_a_station_does_the_same_either_way() -> None:
    made = draped_station(in_worker=True)
    try:
        _, there = advanced(made)
    finally:
        steps = made.cloth._steps
        assert isinstance(steps, StepsInWorker)
        steps._process.kill()
    _, here = advanced(draped_station(in_worker=False))
    np.testing.assert_array_equal(there, here)


def test_a_copy_of_a_context_goes_on_as_the_first_does() -> None:
    made = draped_station(in_worker=False)
    simulator, _ = advanced(made)
    copy = simulator.get_context().Clone()
    port = made.cloth.GetOutputPort("garment_position")
    other = Simulator(made.diagram, copy)
    ends = []
    for which in (simulator, other):
        which.Initialize()
        which.AdvanceTo(0.7)
        ends.append(port.Eval(made.cloth.GetMyContextFromRoot(which.get_context())))
    # the solver begins with another factor, and ends within its tolerance
    np.testing.assert_allclose(ends[0], ends[1], atol=1e-3)


def test_the_garment_is_one_step_behind_grippers_and_bodies() -> None:
    made = draped_station(in_worker=False)
    simulator = Simulator(made.diagram)
    context = simulator.get_mutable_context()
    for i, side in enumerate(("left", "right")):
        port = made.diagram.GetInputPort(f"{side}_gripper.position_command")
        port.FixValue(context, made.start_grippers[i] + np.array([0.0, 0.0, 0.3]))
    here = made.cloth.GetMyContextFromRoot(context)
    out = made.cloth.GetOutputPort("garment_position")
    start = out.Eval(here).copy()
    simulator.AdvanceTo(0.5 * H)
    np.testing.assert_array_equal(out.Eval(here), start)
    gripper = made.diagram.GetOutputPort("left_gripper.position_measured")
    held = made.cloth.cloth.held[0]
    offset = start.reshape(-1, 3)[held] - made.start_grippers[0]
    before = gripper.Eval(context).copy()
    for k in range(1, 60):
        simulator.AdvanceTo(k * H + 1e-9)
        x = out.Eval(here).reshape(-1, 3)[held]
        # where the gripper was, as far as that could be known a step earlier
        np.testing.assert_allclose(x - offset, before, atol=1.5 * 2.0 * H**2 + 1e-9)
        before = gripper.Eval(context).copy()
    assert before[2] > made.start_grippers[0, 2] + 0.01
