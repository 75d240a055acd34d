"""The prediction in a diagram: one forecast for all controllers, each at its own time step."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import Diagram, DiagramBuilder, InputPort
from pydrake.systems.primitives import ConstantVectorSource

from drake_dress.diagrams.prediction import Prediction, Predictor, View
from drake_dress.models.garment.coat import CoatParameters, make_coat
from drake_dress.models.human.learned.predictor import LearnedPredictor
from drake_dress.models.human.learned.ridge import RidgePredictor
from drake_dress.models.human.prediction import ConstantVelocityPredictor, StillPredictor
from drake_dress.systems.human_forecast import HumanForecast
from tests.models.human.learned.drawn import drawn_networks, drawn_scene

MESH = make_coat(CoatParameters(), 0.06)
JOINTS = drawn_scene(0, 1).joints[0]
SHOULDERS = np.array([[0.0, 0.18, 1.4], [0.0, -0.18, 1.4]])
NETWORKS = drawn_networks(0)


def built(predictor: Predictor, joints: np.ndarray) -> tuple[Diagram, list[View], list[str]]:
    """Returns a diagram with two views, (0.2 s, 5) and (0.05 s, 8), and what they are fed with."""
    builder = DiagramBuilder()
    values = {
        "estimate.joint_position": joints.ravel(),
        "estimate.garment_position": MESH.rest_position.ravel(),
    }
    sources = {k: builder.AddSystem(ConstantVectorSource(v)) for k, v in values.items()}
    fed: list[str] = []

    def feed(name: str, port: InputPort) -> None:
        fed.append(name)
        builder.Connect(sources[name].get_output_port(), port)

    prediction = Prediction(builder, feed, predictor, MESH, SHOULDERS)
    views = [prediction.view("far", 0.2, 5), prediction.view("near", 0.05, 8)]
    return builder.Build(), views, fed


def value(port: Any, simulator: Simulator) -> np.ndarray:
    context = port.get_system().GetMyContextFromRoot(simulator.get_context())
    found: np.ndarray = port.Eval(context)
    return found


@pytest.mark.parametrize(
    "predictor", [StillPredictor(), ConstantVelocityPredictor(), RidgePredictor(NETWORKS.linear)]
)
def test_predictors_of_joints_tell_no_radius_and_see_no_garment(predictor: Predictor) -> None:
    diagram, views, fed = built(predictor, JOINTS)
    assert [view.radius for view in views] == [None, None]
    assert fed == ["estimate.joint_position"] * 2
    simulator = Simulator(diagram)
    simulator.AdvanceTo(0.5)
    for view, steps in zip(views, (5, 8), strict=True):
        rows = value(view.joints, simulator).reshape(steps + 1, 6, 3)
        np.testing.assert_allclose(rows, np.tile(JOINTS, (steps + 1, 1, 1)), atol=1e-9)


def test_all_views_are_of_one_forecast_at_their_own_time_steps() -> None:
    diagram, views, fed = built(LearnedPredictor(NETWORKS), JOINTS)
    assert fed.count("estimate.garment_position") == 1
    forecasts = [s for s in diagram.GetSystems() if isinstance(s, HumanForecast)]
    assert len(forecasts) == 1
    simulator = Simulator(diagram)
    simulator.AdvanceTo(2.55)
    forecast = value(forecasts[0].GetOutputPort("forecast"), simulator)
    for view, step, steps in zip(views, (0.2, 0.05), (5, 8), strict=True):
        rows = value(view.joints, simulator).reshape(steps + 1, 6, 3)
        np.testing.assert_allclose(rows[0], JOINTS, atol=1e-9)
        at = 2.55 + step * np.arange(steps + 1)
        mean: np.ndarray = forecast.mean_at(at)  # type: ignore[attr-defined]
        np.testing.assert_allclose(rows - rows[0], mean - mean[0], atol=1e-9)
        assert view.radius is not None
        radius = value(view.radius, simulator).reshape(steps + 1, 6)
        np.testing.assert_allclose(radius, forecast.radius_at(at))  # type: ignore[attr-defined]
        assert (radius > 0.0).all()


def test_sleeves_reach_the_forecast() -> None:
    diagram, _, _ = built(LearnedPredictor(NETWORKS), JOINTS)
    simulator = Simulator(diagram)
    simulator.AdvanceTo(0.3)
    (forecast,) = (s for s in diagram.GetSystems() if isinstance(s, HumanForecast))
    context = forecast.GetMyContextFromRoot(simulator.get_context())
    known = context.get_abstract_state(0).get_value().observations
    sleeves = known.value[-1, 6:].reshape(2, 2, 3)
    for i, side in enumerate(("left", "right")):
        loop = MESH.rest_position[MESH.loops[f"{side}_armhole"]]
        np.testing.assert_allclose(sleeves[i, 0], loop.mean(axis=0), atol=0.02)


def test_person_not_seen_yet_is_where_shoulders_are_expected() -> None:
    diagram, views, _ = built(LearnedPredictor(NETWORKS), np.full((6, 3), np.nan))
    simulator = Simulator(diagram)
    simulator.AdvanceTo(0.5)
    rows = value(views[0].joints, simulator).reshape(-1, 6, 3)
    assert np.isfinite(rows).all()
    np.testing.assert_allclose(rows[0, [0, 3]], SHOULDERS, atol=0.03)
    # the arms hang
    assert (rows[0, [2, 5], 2] < 1.1).all()
