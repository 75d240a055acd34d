"""Pictures rendered in another process equal those of the station's own cameras."""

import pickle
from pathlib import Path

import numpy as np
from drake import lcmt_image_array
from pydrake.common.value import AbstractValue
from pydrake.systems.analysis import Simulator
from pydrake.systems.sensors import LcmImageArrayToImages

from drake_dress.diagrams.scenario import load_scenario
from drake_dress.diagrams.setup import read_setup
from drake_dress.diagrams.station import make_simulated_station
from drake_dress.diagrams.studio import Studio
from drake_dress.models.sides import SIDES
from drake_dress.systems.lcm_inbox import cpp_serializer

SOURCE = Path(__file__).parents[2] / "scenarios" / "lab.yaml"
SETTINGS = [
    "plant.spacing=0.05",
    "controller.spacing=0.06",
    "station.cameras=[{name: rear, position: [-2.6, -0.6, 1.9], target: [0.0, 0.0, 1.1], "
    "width: 160, height: 120}]",
]


def test_pictures_are_the_station_s() -> None:
    scenario = load_scenario(SOURCE, SETTINGS)
    p = read_setup(scenario, SOURCE).station
    station = make_simulated_station(p)
    simulator = Simulator(station.diagram)
    context = simulator.get_mutable_context()
    assert station.robots is not None
    for i, side in enumerate(SIDES):
        given = {"position": station.robots.start[i], "velocity": np.zeros(7)}
        for name, value in given.items():
            station.diagram.GetInputPort(f"{side}_arm.{name}").FixValue(context, value)
    simulator.AdvanceTo(0.05)

    def read(name: str) -> np.ndarray:
        value: np.ndarray = station.diagram.GetOutputPort(name).Eval(context)
        return value

    studio = pickle.loads(pickle.dumps(Studio(p)))
    picture = studio("rear", 0.05, read("cheat_plant_state"), read("cheat_garment_position"))
    message = lcmt_image_array.decode(picture)
    assert message.header.utime == 50_000
    assert len(message.images) == 2
    sent: AbstractValue = cpp_serializer(lcmt_image_array).CreateDefaultValue()
    cpp_serializer(lcmt_image_array).Deserialize(picture, sent)
    receiver = LcmImageArrayToImages()
    at = receiver.CreateDefaultContext()
    receiver.get_input_port().FixValue(at, sent)
    for kind in ("color", "depth"):
        seen = receiver.GetOutputPort(f"{kind}_image").Eval(at).data
        own = station.diagram.GetOutputPort(f"rear.{kind}_image").Eval(context).data
        np.testing.assert_array_equal(seen, own)
    depth = seen[..., 0]
    # the coat hangs there, 1.9 m from the camera
    assert 1.5 < np.median(depth[50:70, 70:90]) < 2.3
