"""The result of `explain` in plain words."""

from __future__ import annotations

from drake_dress.discrepancy.explanation import DISCRETISATION, LEFT, Cause, Explanation
from drake_dress.models.effects.registry import EFFECTS

_PLAIN = {
    "discretisation": "the simulation's own step and mesh",
    "air_drag": "the drag of the air",
    "wind": "a wind",
    "surface_density": "the weight of the cloth",
    "local_mass": "a mass at one place of the garment",
    "stretch_stiffness": "how stiff the cloth is against stretch",
    "anisotropic_stiffness": "a warp that is stiffer than the weft",
    "strain_stiffening": "cloth that stiffens as it stretches",
    "bending_stiffness": "how stiff the cloth is against bending",
    "internal_damping": "the cloth's internal damping",
    "rest_size": "the garment's size at rest",
    "friction": "the friction against the person",
    "velocity_dependent_friction": "friction that depends on speed",
    "anisotropic_friction": "friction that depends on direction",
    "adhesion": "cloth that clings to the person",
    "limb_radius": "the thickness of the limbs",
    "limb_compliance": "limbs that give way",
    "gripper_latency": "grippers that are late",
    "gripper_slip": "cloth that creeps out of the grippers",
    "gripper_compliance": "grippers that give way",
    "time_offset": "cameras whose clock is off",
    "camera_rotation": "cameras that are turned",
    "camera_translation": "cameras that are displaced",
    "gravity_tilt": "a world frame that is not level",
}


def plain(name: str) -> str:
    """Returns an effect in plain words."""
    own = EFFECTS[name].IN_WORDS if name in EFFECTS else ""
    return _PLAIN.get(name) or own or name.replace("_", " ")


def values(cause: Cause) -> str:
    """Returns a cause's parameters with their uncertainties."""
    if cause.effect is None:
        return ""
    parts = []
    for p in cause.effect.parameters():
        value, std = getattr(cause.effect, p.name), cause.std.get(p.name, 0.0)
        unit = "" if p.unit == "1" else f" {p.unit}"
        parts.append(f"{p.name.replace('_', ' ')} {value:.3g} ± {std:.1g}{unit}")
    return ", ".join(parts)


def headline(explanation: Explanation) -> str:
    """Returns the verdict as one sentence."""
    x = explanation
    if x.verdict == "nothing":
        least = x.loss.get("extended", 1.0) <= LEFT
        return (
            f"The simulation explains the data to its noise{'' if least else ' and its numerics'}: "
            f"{1e3 * x.before[0]:.1f} mm are left, {1e3 * x.noise[0]:.1f} mm are noise, "
            f"{1e3 * x.numerics:.1f} mm the simulation's own numerics."
        )
    if x.verdict == "unexplained":
        near = f"; the nearest is {plain(x.causes[0].name)}" if x.causes else ""
        return f"The simulation is off, and no effect of the list explains it{near}."
    names = [
        plain(c.name) + (f" ({values(c)})" if c.name != DISCRETISATION else "") for c in x.causes
    ]
    if x.verdict == "ambiguous":
        return f"Either {' or '.join(names)}: these recordings do not tell them apart."
    if x.doubted is not None:
        sure = f"confidence {100.0 * x.doubted.confidence:.0f} %"
        if len(names) > 1:
            sure += f" in {plain(x.doubted.name)}"
        return f"What the simulation lacks is likely {', and '.join(names)}; {sure}."
    return f"What the simulation lacks is {', and '.join(names)}."
