"""The measures of a scenario's coat."""

from dataclasses import fields, replace

from drake_dress.diagrams.scenario.schema import Coat
from drake_dress.models.garment.coat import COATS, CoatParameters

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
