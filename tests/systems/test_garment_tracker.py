"""The tracker's estimate comes late, and is carried on until the next one."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import scipy.sparse as sp
from pydrake.common.value import Value
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import BasicVector, Context, Diagram, DiagramBuilder, LeafSystem
from pydrake.systems.primitives import ConstantVectorSource
from pydrake.systems.sensors import ImageDepth32F, ImageLabel16I

from drake_dress.models.sides import SIDES
from drake_dress.systems.garment_tracker import GarmentTracker, TrackerTiming
from tests.models.perception.hanging import (
    CAMERA,
    COAT,
    GRIPPERS,
    JOINTS,
    motion,
    tracker_of_coat,
    view_of,
)

LABEL = 1


def swung(x: np.ndarray) -> np.ndarray:
    """Returns the coat swung away from the camera, 10 cm at its hem."""
    below = np.clip(x[COAT.held, 2].mean() - x[:, 2], 0.0, None)
    return x + 0.1 * (below / below.max())[:, None] * [1.0, 0.0, 0.0]


class Film(LeafSystem):
    """A coat that stays swung to the side; an image arrives each 0.1 s."""

    def __init__(self, x: np.ndarray, late: float) -> None:
        super().__init__()
        view = view_of(swung(x))
        size = CAMERA.width, CAMERA.height
        self._late = late

        def put(image: np.ndarray) -> Any:
            def calc(_: Context, output: Any) -> None:
                output.get_mutable_value().mutable_data[..., 0] = image

            return calc

        self.DeclareAbstractOutputPort(
            "depth", lambda: Value(ImageDepth32F(*size)), put(view.depth)
        )
        self.DeclareAbstractOutputPort(
            "labels", lambda: Value(ImageLabel16I(*size)), put(view.labels)
        )
        self.DeclareVectorOutputPort("time", 1, self._calc_time)

    def _calc_time(self, context: Context, output: BasicVector) -> None:
        tenths = np.floor(10.0 * (context.get_time() - self._late) + 1e-9)
        output.SetFromVector([max(tenths / 10.0, -1.0)])


def watched(waits: bool = True, late: float = 0.05) -> tuple[Diagram, Simulator, np.ndarray]:
    tracker = tracker_of_coat()
    start = tracker.begun(COAT.rest_position, motion(0))
    n = len(COAT.rest_position)
    system = GarmentTracker(
        tracker,
        start,
        sp.csr_array(sp.eye_array(n)),
        {"rear": CAMERA},
        LABEL,
        TrackerTiming(waits=waits),
    )
    builder = DiagramBuilder()
    builder.AddSystem(system)
    film = builder.AddSystem(Film(start.now.garment.cloth.x, late))
    for port, name in (("depth", "depth_image"), ("labels", "label_image"), ("time", "image_time")):
        builder.Connect(film.GetOutputPort(port), system.GetInputPort(f"rear.{name}"))
    constant = {f"{side}_gripper_position": GRIPPERS[i] for i, side in enumerate(SIDES)}
    constant |= {"joint_position": JOINTS.ravel(), "grippers_open": np.zeros(1)}
    for name, value in constant.items():
        source = builder.AddSystem(ConstantVectorSource(value))
        builder.Connect(source.get_output_port(), system.GetInputPort(name))
    for name in ("garment_position", "garment_velocity", "age"):
        builder.ExportOutput(system.GetOutputPort(name), name)
    diagram = builder.Build()
    return diagram, Simulator(diagram), start.now.garment.cloth.x


def output(diagram: Diagram, simulator: Simulator, name: str) -> np.ndarray:
    return np.array(diagram.GetOutputPort(name).Eval(simulator.get_context()))


def test_the_estimate_goes_to_what_is_seen() -> None:
    diagram, simulator, start = watched()
    np.testing.assert_allclose(output(diagram, simulator, "garment_position"), start.ravel())
    assert output(diagram, simulator, "age")[0] == np.inf
    simulator.AdvanceTo(1.15)
    x = output(diagram, simulator, "garment_position").reshape(-1, 3)
    there = swung(start)
    assert (
        np.linalg.norm(x - there, axis=1).mean()
        < 0.6 * np.linalg.norm(start - there, axis=1).mean()
    )
    np.testing.assert_allclose(x[COAT.held], start[COAT.held], atol=2e-3)


def test_images_are_used_late_and_their_age_is_told() -> None:
    diagram, simulator, _ = watched()
    for time in (0.27, 0.46, 0.75):
        simulator.AdvanceTo(time)
        # work begins at tenths, with the exposure at the tenth before, and takes 0.08 s
        begun = np.floor(10.0 * (time - 0.08) + 1e-9) / 10.0
        assert output(diagram, simulator, "age")[0] == pytest.approx(time - (begun - 0.1), abs=1e-6)


def test_between_estimates_nodes_go_on_at_their_velocity() -> None:
    diagram, simulator, _ = watched()
    simulator.AdvanceTo(0.40)
    x = output(diagram, simulator, "garment_position")
    v = output(diagram, simulator, "garment_velocity")
    assert np.abs(v).max() > 1e-3
    simulator.AdvanceTo(0.45)
    later = output(diagram, simulator, "garment_position")
    np.testing.assert_allclose(later, x + 0.05 * v, atol=1e-9)


def test_two_simulators_of_one_diagram_do_not_disturb_each_other() -> None:
    diagram, first, _ = watched()
    second = Simulator(diagram)
    for time in (0.2, 0.4, 0.6):
        first.AdvanceTo(time)
        second.AdvanceTo(time)
    np.testing.assert_array_equal(
        output(diagram, first, "garment_position"), output(diagram, second, "garment_position")
    )


def test_without_waiting_an_estimate_is_used_once_it_is_ready() -> None:
    diagram, simulator, _ = watched(waits=False)
    simulator.set_target_realtime_rate(1.0)
    for time in np.arange(0.5, 20.0, 0.5):
        simulator.AdvanceTo(time)
        if output(diagram, simulator, "age")[0] < np.inf:
            break
    assert output(diagram, simulator, "age")[0] < np.inf


def test_a_period_between_steps_is_refused() -> None:
    tracker = tracker_of_coat()
    start = tracker.begun(COAT.rest_position, motion(0))
    eye = sp.csr_array(sp.eye_array(len(COAT.rest_position)))
    with pytest.raises(ValueError, match="multiple"):
        GarmentTracker(tracker, start, eye, {}, LABEL, TrackerTiming(period=0.05))
