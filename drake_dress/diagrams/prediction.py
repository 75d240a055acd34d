"""The prediction of the person's arms, as each controller takes it."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from pydrake.systems.framework import DiagramBuilder, OutputPort

from drake_dress.models.garment.mesh import GarmentMesh
from drake_dress.models.human.learned.forecast import Forecast, PersonPredictor
from drake_dress.models.human.prediction import MotionPredictor
from drake_dress.systems.human_forecast import ForecastView, HumanForecast
from drake_dress.systems.human_predictor import HumanPredictor
from drake_dress.systems.sleeve_observer import SleeveObserver

Predictor = MotionPredictor | PersonPredictor
# Period of looking at the estimates, and of forecasts, s.
_SAMPLING, _PERIOD = 0.05, 0.1


@dataclass(frozen=True)
class View:
    """Ports of a prediction at a controller's time step.

    Attributes:
        joints: predicted joints.
        radius: radii about them; None where the predictor tells none.
    """

    joints: OutputPort
    radius: OutputPort | None = None


@dataclass
class Prediction:
    """Adds what predicts the person to a diagram.

    Attributes:
        builder: of the diagram.
        feed: connects the station's outputs to input ports.
        predictor: of the person.
        mesh: the controller's garment.
        shoulders: (2,3) where the person's shoulders are expected before anything is seen, m.
    """

    builder: DiagramBuilder
    feed: Any
    predictor: Predictor
    mesh: GarmentMesh
    shoulders: np.ndarray
    _forecast: HumanForecast | None = field(default=None, init=False)

    @property
    def forecast(self) -> OutputPort | None:
        """Port of the forecasts; None where the predictor makes none, or before the first view."""
        return None if self._forecast is None else self._forecast.GetOutputPort("forecast")

    def view(self, name: str, time_step: float, steps: int) -> View:
        """Adds a system of that name that predicts `steps` steps of `time_step`, s."""
        if isinstance(self.predictor, PersonPredictor):
            return self._forecast_view(name, self.predictor, time_step, steps)
        system = self.builder.AddNamedSystem(name, HumanPredictor(self.predictor, time_step, steps))
        self.feed("estimate.joint_position", system.get_input_port())
        return View(system.get_output_port())

    def _forecast_view(
        self, name: str, predictor: PersonPredictor, time_step: float, steps: int
    ) -> View:
        if self._forecast is None:
            self._forecast = self._added(predictor)
        source = self._forecast
        first: Forecast = source.first
        view = self.builder.AddNamedSystem(name, ForecastView(first, time_step, steps))
        self.builder.Connect(source.GetOutputPort("forecast"), view.GetInputPort("forecast"))
        self.feed("estimate.joint_position", view.GetInputPort("joint_position"))
        return View(
            view.GetOutputPort("predicted_joint_position"), view.GetOutputPort("predicted_radius")
        )

    def _added(self, predictor: PersonPredictor) -> HumanForecast:
        start = np.full((6, 3), np.nan)
        start[[0, 3]] = self.shoulders
        forecast: HumanForecast = self.builder.AddNamedSystem(
            "human_forecast", HumanForecast(predictor, _SAMPLING, _PERIOD, start)
        )
        sleeves = self.builder.AddNamedSystem("sleeve_observer", SleeveObserver(self.mesh))
        self.feed("estimate.garment_position", sleeves.get_input_port())
        self.builder.Connect(sleeves.get_output_port(), forecast.GetInputPort("sleeve_state"))
        self.feed("estimate.joint_position", forecast.GetInputPort("joint_position"))
        return forecast
