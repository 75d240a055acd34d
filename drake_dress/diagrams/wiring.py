"""A diagram under construction around a station, wired by port names."""

from __future__ import annotations

from typing import Any

from pydrake.systems.framework import DiagramBuilder, InputPort

from drake_dress.diagrams.station import Station


class Wiring:
    """Base of diagram builders: adds systems by name and connects ports by name.

    Attributes:
        builder: of the diagram.
        of: the station.
        station: its system in the diagram.
    """

    def __init__(self, station: Station) -> None:
        self.builder = DiagramBuilder()
        self.of = station
        self.station = self.builder.AddNamedSystem("station", station.diagram)

    @property
    def sees_truth(self) -> bool:
        """Whether the true garment is known, as in simulation."""
        return bool(self.station.HasOutputPort("cheat_garment_position"))

    def true(self, name: str) -> str:
        """Returns the name of the port of the true value, or of its estimate if it is unknown."""
        return f"cheat_{name}" if self.sees_truth else f"estimate.{name}"

    def add(self, name: str, system: Any) -> Any:
        """Adds a system and returns it."""
        return self.builder.AddNamedSystem(name, system)

    def connect(self, source: Any, output: str, target: Any, port: str) -> None:
        """Connects an output of one system to an input of another."""
        self.builder.Connect(source.GetOutputPort(output), target.GetInputPort(port))

    def feed(self, output: str, port: InputPort) -> None:
        """Connects an output of the station to an input port."""
        self.builder.Connect(self.station.GetOutputPort(output), port)
