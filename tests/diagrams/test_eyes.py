"""Controllers that see the garment with cameras."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator

from drake_dress.diagrams.assemble import Parts, parts, wired
from drake_dress.diagrams.cameras import CameraFaults
from drake_dress.diagrams.scenario import load_scenario
from drake_dress.diagrams.setup import read_setup
from drake_dress.errors import UserError
from drake_dress.models.effects.composition import seen_points
from drake_dress.models.effects.registry import EFFECTS
from drake_dress.models.perception.camera_errors import CameraErrors

SOURCE = Path(__file__).parents[2] / "scenarios" / "dummy_cameras.yaml"
COARSE = [
    "plant.spacing=0.05",
    "controller.spacing=0.06",
    "perception.spacing=0.05",
    "perception.material.damping=0.02",
]


HARDWARE = {
    "kind": "hardware",
    "arms": {"model": "panda"},
    "cameras": [{"name": "front", "position": [1, 0, 1], "target": [0, 0, 1]}],
}


def parts_of(*settings: str) -> Parts:
    return parts(read_setup(load_scenario(SOURCE, [*COARSE, *settings]), SOURCE))


def test_a_station_with_cameras_has_the_ports_of_one_that_knows() -> None:
    sees, knows = (parts_of(f"perception.kind={kind}") for kind in ("cameras", "oracle"))

    def names(p: Parts) -> set[str]:
        d = p.station.diagram
        outputs = {d.get_output_port(i).get_name() for i in range(d.num_output_ports())}
        return outputs | {d.get_input_port(i).get_name() for i in range(d.num_input_ports())}

    assert names(knows) <= names(sees)


def test_the_coat_is_tracked_in_images() -> None:
    p = parts_of()
    dressing = wired(p)
    simulator = Simulator(dressing.diagram)
    simulator.AdvanceTo(1.0)
    station = p.station.diagram
    context = station.GetMyContextFromRoot(simulator.get_context())

    def value(port: str) -> np.ndarray:
        return np.array(station.GetOutputPort(port).Eval(context))

    seen = value("estimate.garment_position").reshape(-1, 3)
    true = value("cheat_estimated_garment_position").reshape(-1, 3)
    far = np.linalg.norm(seen - true, axis=1)
    assert 1e-4 < far.mean() < 0.03
    assert value("estimate.garment_age")[0] < 0.35
    assert value("front.image_time")[0] == pytest.approx(0.9)


def test_without_opencv_nothing_is_begun(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "cv2", None)
    with pytest.raises(ModuleNotFoundError, match="cv2"):
        read_setup(load_scenario(SOURCE), SOURCE)
    read_setup(load_scenario(SOURCE, ["perception.kind=oracle"]), SOURCE)


def test_effects_of_cameras_move_the_cameras() -> None:
    """A point is seen where the effects say, if a perfect camera stands at its true pose."""
    none = CameraErrors(position=0.0, rotation_deg=0.0)
    effects = [
        EFFECTS["camera_rotation"](**{EFFECTS["camera_rotation"].parameters()[0].name: 0.05}),
    ]
    camera = parts_of().setup.station.cameras[0]
    true = CameraFaults(none, 0, effects).true_pose(camera, 0)
    points = np.random.default_rng(0).normal(size=(20, 3))
    # where the believed camera places what the true one sees
    placed = (camera.pose @ true.inverse() @ points.T).T
    np.testing.assert_allclose(placed, seen_points(points, effects), atol=1e-9)
    assert np.abs(placed - points).max() > 1e-3


@pytest.mark.parametrize(
    ("setting", "key"),
    [
        (f"station={json.dumps(HARDWARE)}", "perception.kind"),
        ("station.cameras=[]", "station.cameras"),
        ("perception.period=0.05", "perception.period"),
        ("perception.delay=0.1", "perception.delay"),
        ("perception.kind=eyes", "perception.kind"),
    ],
)
def test_what_cannot_see_is_refused(setting: str, key: str) -> None:
    with pytest.raises(UserError) as error:
        load_scenario(SOURCE, [setting])
    assert error.value.key == key
