"""`tests/gym/test_controller_policy.py` tests the requests of its controllers."""

import pytest

from drake_dress.diagrams.assemble import control_setup
from drake_dress.diagrams.controller_diagram import make_controller_diagram
from tests.diagrams.test_agent_diagram import made_of


@pytest.mark.parametrize(("method", "sees_grippers"), [("global", False), ("full", True)])
def test_its_ports_are_what_its_controllers_see(method: str, sees_grippers: bool) -> None:
    diagram = make_controller_diagram(control_setup(made_of(f"controller.method={method}")))
    names = [diagram.get_input_port(i).get_name() for i in range(diagram.num_input_ports())]
    expected = {"joint_position", "garment_position", "garment_velocity"}
    if sees_grippers:
        expected |= {"left_gripper_position", "right_gripper_position"}
    assert set(names) == expected
