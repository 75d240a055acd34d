"""What the live page shows follows the ports."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from pydrake.common.value import Value
from pydrake.geometry import Meshcat, MeshcatParams
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource

from drake_dress.models.arrays import FloatArray
from drake_dress.models.garment.mesh import GarmentMesh
from drake_dress.models.human.learned.predictor import LearnedPredictor
from drake_dress.systems.garment_visualizer import GarmentVisualizer
from tests.models.human.learned.drawn import drawn_networks, drawn_scene
from tests.report import synthetic
from tests.report.browser import live_screenshot, needs_chromium


@pytest.fixture
def meshcat() -> Meshcat:
    return Meshcat(MeshcatParams(host="localhost"))


@pytest.fixture
def garment() -> GarmentMesh:
    return synthetic.coat(0.05)


def _publisher(meshcat: Meshcat, garment: GarmentMesh) -> Callable[..., FloatArray]:
    system = GarmentVisualizer(meshcat, garment.faces, len(garment.rest_position))
    context = system.CreateDefaultContext()

    def publish(y: float, stage: tuple[int, int] = (0, 0), target: float = np.nan) -> np.ndarray:
        position = garment.rest_position + [0.0, y, 1.4]
        grippers = np.array([0.0, 0.2 + y, 1.4, 0.0, -0.2 + y, 1.4])
        system.GetInputPort("garment_position").FixValue(context, position.ravel())
        system.GetInputPort("stage").FixValue(context, np.array(stage, dtype=float))
        system.GetInputPort("gripper_position").FixValue(context, grippers)
        system.GetInputPort("targets").FixValue(context, np.full(6, target))
        system.ForcedPublish(context)
        return position

    return publish


def test_garment_grippers_and_targets_are_drawn(meshcat: Meshcat, garment: GarmentMesh) -> None:
    publish = _publisher(meshcat, garment)
    publish(0.0, target=0.3)
    for path in ("garment/outside", "garment/lining", "gripper/left", "target/right"):
        assert meshcat.HasPath(f"dressing/{path}")
    position = publish(0.2)
    packed = meshcat._GetPackedObject("dressing/garment/outside")
    assert position.astype("<f4").tobytes() in packed


def test_forecast_is_drawn_if_it_is_connected(meshcat: Meshcat, garment: GarmentMesh) -> None:
    system = GarmentVisualizer(meshcat, garment.faces, len(garment.rest_position))
    context = system.CreateDefaultContext()
    system.GetInputPort("garment_position").FixValue(context, garment.rest_position.ravel())
    system.ForcedPublish(context)
    path = "dressing/forecast/right/2/region"
    assert not meshcat.HasPath(path)
    predictor, scene = LearnedPredictor(drawn_networks(0)), drawn_scene(0)
    forecast, _ = predictor.forecast(scene.history(), predictor.begin())
    system.GetInputPort("forecast").FixValue(context, Value[object](forecast))
    system.ForcedPublish(context)
    for side in ("left", "right"):
        for joint in (1, 2):
            assert meshcat.HasPath(f"dressing/forecast/{side}/{joint}/mean")
    assert meshcat.HasPath(path)


def test_stage_is_written_and_follows(meshcat: Meshcat, garment: GarmentMesh) -> None:
    publish = _publisher(meshcat, garment)
    publish(0.0, stage=(0, 1))
    first = meshcat._GetPackedObject("dressing/stage/front")
    publish(0.1, stage=(0, 1))
    assert meshcat._GetPackedObject("dressing/stage/front") == first  # nothing sent anew
    publish(0.1, stage=(2, 2))
    assert meshcat._GetPackedObject("dressing/stage/front") != first


def test_garment_alone_suffices(meshcat: Meshcat, garment: GarmentMesh) -> None:
    builder = DiagramBuilder()
    position = garment.rest_position.ravel()
    source = builder.AddSystem(ConstantVectorSource(position))
    shown = builder.AddSystem(GarmentVisualizer(meshcat, garment.faces, len(position) // 3))
    builder.Connect(source.get_output_port(), shown.GetInputPort("garment_position"))
    Simulator(builder.Build()).AdvanceTo(0.2)
    assert meshcat.HasPath("dressing/garment/outside")
    assert not meshcat.HasPath("dressing/target/left")


@needs_chromium
def test_live_page_shows_the_garment_move(
    meshcat: Meshcat, garment: GarmentMesh, tmp_path: Path
) -> None:
    publish = _publisher(meshcat, garment)
    meshcat.SetCameraPose([1.9, 0.0, 1.3], [0.0, 0.0, 1.1])
    meshcat.SetProperty("/Background", "top_color", [1.0, 1.0, 1.0])
    meshcat.SetProperty("/Background", "bottom_color", [1.0, 1.0, 1.0])
    pictures = []
    for name, y in (("left", 0.35), ("right", -0.35)):
        publish(y)
        pictures.append(live_screenshot(meshcat.web_url(), tmp_path, name))

    def blue(picture: np.ndarray) -> np.ndarray:
        mask = picture[:, :, 2] > picture[:, :, 0] + 0.15
        mask[:200, 600:] = False  # the controls
        return mask

    masks = [blue(p) for p in pictures]
    assert all(m.mean() > 0.02 for m in masks)
    columns = [np.nonzero(m)[1].mean() for m in masks]
    assert columns[0] > columns[1] + 100.0  # the person's left is on the right, seen from the front
    moved = np.abs(pictures[0] - pictures[1]).max(axis=2) > 0.1
    assert moved[masks[0] ^ masks[1]].mean() > 0.9
    assert not moved[550:, :100].any()
