"""`drake-dress calibrate` on pictures that Drake renders of a board in an arm's hand."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import cv2
import numpy as np
import pytest
from pydrake.common.value import Value
from pydrake.geometry import (
    Box,
    ClippingRange,
    ColorRenderCamera,
    DepthRange,
    DepthRenderCamera,
    FramePoseVector,
    GeometryFrame,
    GeometryInstance,
    MakeRenderEngineVtk,
    PerceptionProperties,
    RenderCameraCore,
    RenderEngineVtkParams,
    RenderLabel,
    SceneGraph,
)
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.sensors import CameraInfo, RgbdSensor

from drake_dress.__main__ import main
from drake_dress.diagrams.cameras import looking
from drake_dress.diagrams.scenario import load_scenario
from drake_dress.diagrams.sections.station import placement
from drake_dress.models.arm.panda import LIMITS, panda
from drake_dress.models.perception.charuco import Board

SCENARIO = Path(__file__).parents[2] / "scenarios" / "lab.yaml"
WIDTH, HEIGHT, FOV = 640, 480, 45.0
BOARD = Board()
THICK = 0.002
NOMINAL = np.array([0.3, -0.3, 0.0, -1.9, 0.0, 1.7, 0.8])


class Photographer:
    """Renders the board, (4,4) X_WB of its first corner, from a camera, X_WC."""

    def __init__(self, place: Path, camera: np.ndarray) -> None:
        picture = BOARD.picture(64)
        cv2.imwrite(str(place / "board.png"), picture)
        builder = DiagramBuilder()
        self.scene: SceneGraph = builder.AddSystem(SceneGraph())
        self.scene.AddRenderer("vtk", MakeRenderEngineVtk(RenderEngineVtkParams()))
        source = self.scene.RegisterSource("board")
        self.frame = self.scene.RegisterFrame(source, GeometryFrame("board"))
        size = BOARD.square * np.array([BOARD.columns, BOARD.rows])
        shape = GeometryInstance(RigidTransform(), Box(size[0], size[1], THICK), "board")
        seen = PerceptionProperties()
        seen.AddProperty("phong", "diffuse_map", str(place / "board.png"))
        seen.AddProperty("label", "id", RenderLabel(1))
        shape.set_perception_properties(seen)
        self.scene.RegisterGeometry(source, self.frame, shape)
        core = RenderCameraCore(
            "vtk",
            CameraInfo(WIDTH, HEIGHT, np.deg2rad(FOV)),
            ClippingRange(0.05, 5.0),
            RigidTransform(),
        )
        self.sensor: RgbdSensor = builder.AddSystem(
            RgbdSensor(
                self.scene.world_frame_id(),
                RigidTransform(RotationMatrix(camera[:3, :3]), camera[:3, 3]),
                ColorRenderCamera(core, False),
                DepthRenderCamera(core, DepthRange(0.1, 4.0)),
            )
        )
        builder.Connect(self.scene.get_query_output_port(), self.sensor.query_object_input_port())
        builder.ExportInput(self.scene.get_source_pose_port(source), "pose")
        self.diagram = builder.Build()
        # pose of the box in the board's frame: OpenCV's origin is a corner, with z into the board
        self.box = np.eye(4)
        self.box[:3, :3] = np.diag([1.0, -1.0, -1.0])
        self.box[:3, 3] = [0.5 * size[0], 0.5 * size[1], 0.5 * THICK]

    def take(self, board: np.ndarray) -> np.ndarray:
        context = self.diagram.CreateDefaultContext()
        at = board @ self.box
        poses = FramePoseVector()
        poses.set_value(self.frame, RigidTransform(RotationMatrix(at[:3, :3]), at[:3, 3]))
        self.diagram.GetInputPort("pose").FixValue(context, Value(poses))
        image = self.sensor.color_image_output_port().Eval(
            self.sensor.GetMyContextFromRoot(context)
        )
        return np.array(image.data[:, :, :3])


@pytest.fixture(scope="module")
def pictures(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, np.ndarray]:
    """Returns a directory with pictures and poses, and the true X_WC."""
    place = tmp_path_factory.mktemp("calibration")
    scenario = load_scenario(SCENARIO)
    where = placement(scenario.station.arms, scenario.person)
    assert where is not None
    arm = panda(where.base("left"))
    rng = np.random.default_rng(0)
    tool = arm.links(NOMINAL)[-1]
    camera = np.eye(4)
    camera[:3, 3] = tool[:3, 3] + [0.75, 0.25, 0.15]
    camera[:3, :3] = looking(camera[:3, 3], tool[:3, 3])
    # the hand holds the board facing the camera, but not exactly
    held = np.eye(4)
    facing = tool[:3, :3].T @ camera[:3, :3]
    held[:3, :3] = facing @ cv2.Rodrigues(np.array([0.1, -0.15, 0.05]))[0]
    size = BOARD.square * np.array([BOARD.columns, BOARD.rows])
    held[:3, 3] = [0.01, -0.02, 0.03] - held[:3, :3] @ [0.5 * size[0], 0.5 * size[1], 0.0]
    studio = Photographer(place, camera)
    with (place / "poses.csv").open("w", newline="") as file:
        table = csv.writer(file)
        table.writerow(["image", *(f"q{i}" for i in range(1, 8))])
        for k in range(14):
            q = NOMINAL + rng.uniform(-0.22, 0.22, 7) * [0.5, 0.5, 0.5, 0.5, 1.5, 1.5, 1.5]
            q = np.clip(q, LIMITS.lower, LIMITS.upper)
            image = studio.take(arm.links(q)[-1] @ held)
            cv2.imwrite(str(place / f"{k:02d}.png"), image[:, :, ::-1])
            table.writerow([f"{k:02d}.png", *q])
    return place, camera


def camera_setting() -> str:
    return (
        "station.cameras=[{name: front, position: [1, 0, 1], target: [0, 0, 1], "
        f"width: {WIDTH}, height: {HEIGHT}, fov_deg: {FOV}}}]"
    )


def test_the_camera_is_found(
    pictures: tuple[Path, np.ndarray], capsys: pytest.CaptureFixture[str]
) -> None:
    place, camera = pictures
    words = ["calibrate", str(place), "--scenario", str(SCENARIO), "--set", camera_setting()]
    assert main([*words, "--camera", "front"]) == 0
    found = json.loads((place / "calibration.json").read_text())
    assert len(found["residual_px"]) >= 10
    assert found["rms_px"] < 0.6
    np.testing.assert_allclose(found["position"], camera[:3, 3], atol=4e-3)
    turn = np.array(found["rotation"]).T @ camera[:3, :3]
    assert np.linalg.norm(cv2.Rodrigues(turn)[0]) < 5e-3
    assert "camera at" in capsys.readouterr().out


def test_intrinsics_are_found_where_none_are_given(pictures: tuple[Path, np.ndarray]) -> None:
    place, camera = pictures
    out = place / "own" / "found.json"
    assert main(["calibrate", str(place), "--scenario", str(SCENARIO), "--out", str(out)]) == 0
    found = json.loads(out.read_text())
    np.testing.assert_allclose(found["position"], camera[:3, 3], atol=0.05)


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        ("no poses", "poses.csv: no such file"),
        ("bad header", "poses.csv: line 1: expected image,q1"),
        ("degrees", "poses.csv: line 2: joints beyond their limits"),
        ("no picture", "missing.png: is no readable picture"),
        ("no board", "is seen in 0 pictures"),
    ],
)
def test_what_cannot_be_used_is_told(
    change: str, expected: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    header = "image," + ",".join(f"q{i}" for i in range(1, 8))
    row = ",".join(str(x) for x in NOMINAL)
    cv2.imwrite(str(tmp_path / "grey.png"), np.full((60, 80), 128, dtype=np.uint8))
    table = {
        "bad header": f"picture\n{row}\n",
        "degrees": f"{header}\ngrey.png,30,0,0,-90,0,90,45\n",
        "no picture": f"{header}\nmissing.png,{row}\n",
        "no board": f"{header}\n" + 6 * f"grey.png,{row}\n",
    }.get(change)
    if table is not None:
        (tmp_path / "poses.csv").write_text(table)
    assert main(["calibrate", str(tmp_path), "--scenario", str(SCENARIO)]) == 2
    words = capsys.readouterr().err
    assert expected in words
    assert "Traceback" not in words
    assert not (tmp_path / "calibration.json").exists()


def test_the_board_is_written_to_print(tmp_path: Path) -> None:
    path = tmp_path / "board.png"
    assert main(["calibrate", "--print-board", str(path)]) == 0
    picture = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE)
    assert picture is not None
    assert picture.shape[1] / 600 * 0.0254 == pytest.approx(7 * 0.03, rel=0.002)
    assert main(["calibrate", "--board", "7x5", "--print-board", str(path)]) == 2
