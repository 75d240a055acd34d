"""The measures of a scenario's coat."""

from dataclasses import fields, replace

from drake_dress.diagrams.scenario.schema import Coat
from drake_dress.models.garment.coat import COATS, CoatParameters, make_coat
from drake_dress.models.garment.mesh import GarmentMesh

# Fields of `Coat` that are lengths.
COAT_MEASURES = tuple(entry.name for entry in fields(Coat) if entry.default is None)


def coat_parameters(coat: Coat) -> CoatParameters:
    """Returns the preset's measures, replaced by given ones, all scaled."""
    parameters = COATS[coat.preset]
    measures = {}
    for name in COAT_MEASURES:
        given = getattr(coat, name)
        measures[name] = coat.scale * (getattr(parameters, name) if given is None else given)
    if coat.grasp == "seam":
        parameters = replace(parameters, grasp_radius=0.0)
    return replace(parameters, **measures)


def coat_mesh(coat: Coat, spacing: float, like: Coat | None = None) -> GarmentMesh:
    """Returns a coat's mesh.

    Args:
        coat: the coat.
        spacing: wanted edge length, m.
        like: another coat, whose nodes the mesh has; see `make_coat`.

    Raises:
        UserError: measures contradict each other.
    """
    mesh = make_coat(
        coat_parameters(coat),
        spacing,
        source="garment.coat",
        like=None if like is None else coat_parameters(like),
    )
    return mesh.opened_at_back() if coat.opening == "back" else mesh
