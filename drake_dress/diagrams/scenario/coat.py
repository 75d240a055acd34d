"""The measures of a scenario's coat."""

from dataclasses import fields, replace

from drake_dress.diagrams.scenario.schema import Coat
from drake_dress.models.garment.coat import COATS, CoatParameters, body_of_size, coat_of_size

# Fields of `Coat` that are numbers, in the order in which a variation draws them.
COAT_MEASURES = tuple(entry.name for entry in fields(Coat) if entry.type == float | None)
# Those that are angles, which no scale changes.
_ANGLES = ("sleeve_slope_deg",)


def coat_parameters(coat: Coat) -> CoatParameters:
    """Returns the preset's measures in the coat's size, replaced by given ones, lengths scaled.

    Raises:
        UserError: the size is not in its table.
    """
    preset = COATS[coat.preset]
    if coat.size is not None:
        body = body_of_size(coat.size_table, coat.size, "garment.coat")
        preset = coat_of_size(preset, body)
    measures = {}
    for name in COAT_MEASURES:
        given = getattr(coat, name)
        value = getattr(preset, name) if given is None else given
        if value is not None:
            measures[name] = coat_scale(coat, name) * value
    if coat.grasp == "seam":
        measures["grasp_radius"] = 0.0
    return replace(
        preset,
        **measures,
        collar=preset.collar if coat.collar is None else coat.collar,
        opens=preset.opens if coat.opens is None else coat.opens,
    )


def coat_scale(coat: Coat, measure: str) -> float:
    """Returns the factor that `scale` puts on one of `COAT_MEASURES`."""
    return 1.0 if measure in _ANGLES else coat.scale
