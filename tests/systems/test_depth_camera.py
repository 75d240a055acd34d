"""Images of a depth camera arrive late, with errors that its seed draws."""

from __future__ import annotations

from typing import Any

import numpy as np
from pydrake.common.value import Value
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import Context, Diagram, DiagramBuilder, LeafSystem
from pydrake.systems.sensors import ImageDepth32F, ImageLabel16I

from drake_dress.models.perception.camera_errors import CameraErrors
from drake_dress.models.perception.segmentation_errors import SegmentationErrors
from drake_dress.models.perception.stereo_errors import StereoErrors
from drake_dress.systems.depth_camera import DepthCamera

SIZE = (40, 30)
LATENCY, PERIOD = 0.073, 0.1
NONE = CameraErrors(
    StereoErrors(
        disparity_noise=0.0,
        disparity_step=0.0,
        grazing_deg=90.0,
        grazing_spread_deg=0.0,
        missing=0.0,
    ),
    SegmentationErrors(outline=0.0, missed=0.0),
    latency=LATENCY,
)


class Scene(LeafSystem):
    """A wall that comes nearer, at a depth of 3 m less the time, and whose label is the time."""

    def __init__(self) -> None:
        super().__init__()
        self.DeclareAbstractOutputPort("depth", lambda: Value(ImageDepth32F(*SIZE)), self._depth)
        self.DeclareAbstractOutputPort("labels", lambda: Value(ImageLabel16I(*SIZE)), self._labels)

    def _depth(self, context: Context, output: Any) -> None:
        output.get_mutable_value().mutable_data[..., 0] = 3.0 - context.get_time()

    def _labels(self, context: Context, output: Any) -> None:
        output.get_mutable_value().mutable_data[..., 0] = 1 + round(10.0 * context.get_time())


def filmed(errors: CameraErrors, seed: int = 0) -> tuple[Diagram, Simulator]:
    builder = DiagramBuilder()
    scene = builder.AddSystem(Scene())
    camera = builder.AddSystem(DepthCamera(SIZE, 50.0, PERIOD, errors, (seed,)))
    builder.Connect(scene.GetOutputPort("depth"), camera.GetInputPort("true_depth"))
    builder.Connect(scene.GetOutputPort("labels"), camera.GetInputPort("true_labels"))
    for name in ("depth_image", "label_image", "image_time"):
        builder.ExportOutput(camera.GetOutputPort(name), name)
    diagram = builder.Build()
    return diagram, Simulator(diagram)


def images(diagram: Diagram, simulator: Simulator) -> tuple[float, np.ndarray, np.ndarray]:
    context = simulator.get_context()
    depth, labels = (
        diagram.GetOutputPort(f"{kind}_image").Eval(context).data[..., 0].copy()
        for kind in ("depth", "label")
    )
    return float(diagram.GetOutputPort("image_time").Eval(context)[0]), depth, labels


def test_images_are_of_the_newest_exposure_that_has_arrived() -> None:
    diagram, simulator = filmed(NONE)
    arrived = False
    for time in np.arange(0.01, 0.5, 0.02):
        simulator.AdvanceTo(time)
        told, depth, labels = images(diagram, simulator)
        expected = PERIOD * np.floor((time - LATENCY) / PERIOD + 1e-9)
        if time < LATENCY:
            assert told < 0.0
            assert not depth.any()
            assert not labels.any()
            continue
        arrived = True
        assert told == np.float64(expected) or abs(told - expected) < 1e-9
        # the last column may be seen by one imager only
        np.testing.assert_allclose(depth[:, :-4], 3.0 - expected, rtol=1e-5)
        np.testing.assert_array_equal(labels, 1 + round(10.0 * expected))
    assert arrived


def test_errors_are_those_of_the_seed() -> None:
    found = []
    for seed in (1, 1, 2):
        diagram, simulator = filmed(CameraErrors(latency=0.0), seed)
        simulator.AdvanceTo(0.25)
        found.append(images(diagram, simulator)[1])
    np.testing.assert_array_equal(found[0], found[1])
    assert (found[0] != found[2]).any()


def test_each_exposure_has_errors_of_its_own() -> None:
    diagram, simulator = filmed(CameraErrors(latency=0.0))
    simulator.AdvanceTo(0.05)
    first = images(diagram, simulator)
    simulator.AdvanceTo(0.15)
    second = images(diagram, simulator)
    assert np.std((first[1] + first[0]) - (second[1] + second[0])) > 1e-3
