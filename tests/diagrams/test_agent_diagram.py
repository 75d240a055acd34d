import numpy as np
import pytest
from pydrake.systems.analysis import Simulator

from drake_dress.diagrams.agent_diagram import make_agent_diagram
from drake_dress.diagrams.assemble import Parts, parts, wired
from drake_dress.diagrams.scenario import apply_variation, load_scenario
from drake_dress.diagrams.setup import read_setup
from drake_dress.models.sides import SIDES
from drake_dress.shipped import shipped_scenario

SOURCE = shipped_scenario("dummy_standing")
COARSE = ("plant.spacing=0.05", "plant.self_collision=false")


def made_of(*overrides: str) -> Parts:
    """Returns the parts of a scenario with a coarse garment."""
    scenario = apply_variation(load_scenario(SOURCE, [*COARSE, *overrides]))
    return parts(read_setup(scenario, SOURCE))


def test_an_agent_that_asks_as_the_controllers_do_has_their_run() -> None:
    run = wired(made_of())
    simulator = Simulator(run.diagram)
    follower = run.diagram.GetSubsystemByName("plan_follower")
    made = made_of()
    agent = make_agent_diagram(made)
    other = Simulator(agent.diagram)
    command = agent.diagram.GetInputPort("velocity")
    ports = [follower.GetOutputPort(f"{side}_velocity_request") for side in SIDES]
    # plans change their requests at multiples of 0.1 s, just after the events of that time
    for k in range(1, 9):
        at = follower.GetMyContextFromRoot(simulator.get_context())
        if k > 1:
            simulator.AdvanceTo(0.1 * (k - 1) + 1e-6)
        asked = np.concatenate([port.Eval(at) for port in ports])
        command.FixValue(other.get_mutable_context(), asked)
        for each in (simulator, other):
            each.AdvanceTo(0.1 * k - 1e-6)
    assert np.linalg.norm(asked) > 0.03
    for port in ("cheat_garment_position", "left_gripper.position_measured"):
        values = [
            station.GetOutputPort(port).Eval(station.GetMyContextFromRoot(each.get_context()))
            for station, each in ((run.station.diagram, simulator), (made.station.diagram, other))
        ]
        np.testing.assert_allclose(values[0], values[1], atol=1e-9)


@pytest.mark.parametrize("model", ["floating", "panda"])
def test_an_agent_that_asks_for_rest_leaves_the_grippers_where_they_are(model: str) -> None:
    made = made_of(f"station.arms.model={model}")
    agent = make_agent_diagram(made)
    simulator = Simulator(agent.diagram)
    agent.diagram.GetInputPort("velocity").FixValue(simulator.get_mutable_context(), np.zeros(6))
    simulator.AdvanceTo(0.3)
    station = made.station.diagram
    at = station.GetMyContextFromRoot(simulator.get_context())
    measured = [station.GetOutputPort(f"{s}_gripper.position_measured").Eval(at) for s in SIDES]
    np.testing.assert_allclose(measured, made.station.start_grippers, atol=2e-3)
