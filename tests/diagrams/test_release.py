import gc
import weakref

from pydrake.multibody.plant import MultibodyPlant

from drake_dress.diagrams.agent_diagram import make_agent_diagram
from drake_dress.diagrams.release import release
from drake_dress.diagrams.station import SimulatedStation
from tests.diagrams.test_agent_diagram import made_of


def _kept(released: bool) -> list[bool]:
    """Returns whether the garment's integrator and the plant outlive their diagram."""
    parts = made_of()
    agent = make_agent_diagram(parts)
    station = parts.station
    assert isinstance(station, SimulatedStation)
    kept = [weakref.ref(station.cloth.cloth), weakref.ref(station.plant)]
    assert isinstance(station.plant, MultibodyPlant)
    if released:
        release(agent.diagram)
    del agent, station, parts
    gc.collect()
    return [each() is not None for each in kept]


def test_what_a_diagram_held_is_freed() -> None:
    assert _kept(released=True) == [False, False]


def test_it_is_not_freed_by_itself() -> None:
    # once this fails, pydrake frees systems written in Python, and `release` is no longer needed
    assert _kept(released=False) == [True, True]
