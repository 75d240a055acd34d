"""Measures and shape of a coat, and what they may be."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np

from drake_dress.errors import UserError
from drake_dress.models.garment.coat.curves import unit_ellipse

SPACING_RANGE = (0.01, 0.06)  # m
# What may be sewn to the neckline, and the side on which a coat is open.
COLLARS = ("stand", "none", "lapel", "shawl", "hood")
OPENINGS = ("front", "back")


@dataclass(frozen=True)
class CoatParameters:
    """Measures of a coat.

    For a coat that opens at the back, "front" means its open side in all descriptions below.

    Attributes:
        body_length: height of the shoulder tips above the hem, m.
        chest: girth at the underarm, closed over the open front, m.
        shoulder_width: distance between the shoulder tips, m.
        sleeve_length: length from the shoulder tip to the cuff, along the top, m.
        armhole_girth: girth of an armhole, m.
        cuff_girth: girth of a cuff, m.
        collar_height: height of a standing collar, width of a shawl or lapel collar at the nape, m.
        neck_width: distance between the inner ends of the shoulder seams, m.
        front_opening: gap between the front edges at the underarm, part of the chest girth, m.
        shoulder_slope: height of a shoulder seam's inner end above its outer end, m.
        grasp_fraction: place of the grasp along the shoulder seam, neck (0) to shoulder tip (1).
        grasp_radius: radius within which a gripper holds the cloth, m. With 0 it holds the whole
            seam.
        hem_girth: girth of the hem, closed over the open front, m. None for a straight body.
        hem_opening: gap between the front edges at the hem, m. None for the share of the girth
            that it has at the underarm.
        elbow_girth: girth of a sleeve halfway along it, m. None for a straight taper.
        neck_depth: depth of the front neckline below the inner ends of the shoulder seams, m. The
            front edges end there, and the neckline runs around the neck. None for front edges that
            lean toward the neck and end at the shoulder seams.
        nape_depth: depth of the neckline's middle on the closed side, measured likewise, m. None
            for 1 cm.
        lapel_width: largest width of a lapel or of the front part of a shawl collar, m. None for
            `collar_height`.
        lapel_depth: depth of the lower end of lapels or shawl below the shoulder tips, m. None for
            the level of the underarm.
        vent_length: length of a slit from the hem up the middle of the closed side, m. None for no
            slit.
        hood_height: height of a hood above the nape, m. None for 0.3 m.
        sleeve_slope_deg: slope of the sleeves below the horizontal at rest, deg. None for 58 deg;
            kimono sleeves have less.
        collar: what is sewn to the neckline. `stand` is a strip that stands up; `lapel` is that
            strip and a lapel on each front edge, with a notch between them; `shawl` is one folded
            strip around neckline and front edges; `hood`; or `none`.
        opens: side on which the coat is open, `front` or `back`.
    """

    body_length: float = 0.72
    chest: float = 1.16
    shoulder_width: float = 0.46
    sleeve_length: float = 0.56
    armhole_girth: float = 0.54
    cuff_girth: float = 0.32
    collar_height: float = 0.05
    neck_width: float = 0.17
    front_opening: float = 0.22
    shoulder_slope: float = 0.04
    grasp_fraction: float = 0.75
    grasp_radius: float = 0.035
    hem_girth: float | None = None
    hem_opening: float | None = None
    elbow_girth: float | None = None
    collar: str = "stand"
    neck_depth: float | None = None
    nape_depth: float | None = None
    lapel_width: float | None = None
    lapel_depth: float | None = None
    opens: str = "front"
    vent_length: float | None = None
    hood_height: float | None = None
    sleeve_slope_deg: float | None = None

    @property
    def lengths(self) -> dict[str, float]:
        """Measures of the cloth that are lengths, m, by name; those that are None are absent."""
        values = {e.name: getattr(self, e.name) for e in fields(self) if e.name not in _NO_LENGTHS}
        return {name: value for name, value in values.items() if value is not None}

    def with_lengths(self, lengths: Mapping[str, float]) -> CoatParameters:
        """Returns the coat with some lengths, m, replaced by name."""
        changes: dict[str, Any] = dict(lengths)
        return replace(self, **changes)

    @property
    def is_plain(self) -> bool:
        """Whether the coat has the shape of the defaults, whatever its sizes."""
        shaped = [e.name for e in fields(self) if e.default is None]
        plain = (self.collar, self.opens) == ("stand", "front")
        return plain and all(getattr(self, name) is None for name in shaped)

    @property
    def has_lapels(self) -> bool:
        """Whether something is sewn to the front edges."""
        return self.collar in ("lapel", "shawl")


_NO_LENGTHS = ("grasp_fraction", "grasp_radius", "sleeve_slope_deg", "collar", "opens")
_RANGES = {
    "body_length": (0.25, 1.5),
    "chest": (0.5, 2.2),
    "shoulder_width": (0.2, 0.9),
    "sleeve_length": (0.1, 0.9),
    "armhole_girth": (0.24, 1.0),
    "cuff_girth": (0.12, 0.8),
    "collar_height": (0.015, 0.15),
    "neck_width": (0.08, 0.26),
    "front_opening": (0.01, 0.4),
    "shoulder_slope": (0.0, 0.08),
    "grasp_fraction": (0.0, 1.0),
    "grasp_radius": (0.0, 0.12),
    "hem_girth": (0.5, 3.0),
    "hem_opening": (0.01, 1.0),
    "elbow_girth": (0.12, 1.0),
    "neck_depth": (0.02, 0.2),
    "nape_depth": (0.0, 0.12),
    "lapel_width": (0.02, 0.15),
    "lapel_depth": (0.08, 1.2),
    "vent_length": (0.05, 1.0),
    "hood_height": (0.12, 0.45),
    "sleeve_slope_deg": (20.0, 75.0),
}
_CHOICES = {"collar": COLLARS, "opens": OPENINGS}
_UNITS = {"grasp_fraction": "", "sleeve_slope_deg": " deg"}
# Bounds of a measure, as factors of another one.
_FLARE = (0.8, 1.5)  # hem over chest
_ELBOW = (0.82, 1.12)  # elbow over the mean of armhole and cuff
_HOOD_NECK = 0.34  # neck_depth below a hood, over its height
_LARGEST_GAP = 0.4  # gap of the hem over its girth


def check(p: CoatParameters, spacing: float, source: str) -> None:
    """Checks measures, each by itself and against the others, and the spacing, m.

    Raises:
        UserError: one is out of range.
    """
    for entry in fields(p):
        value = getattr(p, entry.name)
        if entry.name in _CHOICES:
            _check_choice(value, entry.name, source)
        elif value is not None or entry.default is not None:
            _check_number(value, entry.name, source)
    low, high = SPACING_RANGE
    if not low <= spacing <= high:
        raise UserError(source, "spacing", f"is {spacing} m, expected {low} to {high} m")
    _check_pattern(p, source)
    _check_shape(p, source)


def _check_choice(value: object, key: str, source: str) -> None:
    if value not in _CHOICES[key]:
        expected = ", ".join(_CHOICES[key])
        raise UserError(source, key, f"is {value!r}, expected one of {expected}")


def _check_number(value: object, key: str, source: str) -> None:
    low, high = _RANGES[key]
    if isinstance(value, bool) or not isinstance(value, (int, float, np.number)):
        raise UserError(source, key, f"is {value!r}, expected a number")
    if not low <= value <= high:
        unit = _UNITS.get(key, " m")
        raise UserError(source, key, f"is {value}{unit}, expected {low} to {high}{unit}")


def _check_pattern(p: CoatParameters, source: str) -> None:
    """Checks the measures that every coat has against each other."""
    if not 0.4 * p.armhole_girth <= p.cuff_girth <= p.armhole_girth:
        raise UserError(
            source,
            "cuff_girth",
            f"is {p.cuff_girth} m, expected {0.4 * p.armhole_girth:.2f} to {p.armhole_girth} m "
            f"(0.4 to 1 times armhole_girth)",
        )
    if p.shoulder_width < p.neck_width + 0.12:
        raise UserError(
            source,
            "shoulder_width",
            f"is {p.shoulder_width} m, expected at least 0.12 m more than neck_width "
            f"({p.neck_width} m)",
        )
    breadth = p.chest / unit_ellipse(np.linspace(0.0, 0.5, 200))[1] * 2.0
    if not 0.7 * breadth <= p.shoulder_width <= 1.35 * breadth:
        raise UserError(
            source,
            "shoulder_width",
            f"is {p.shoulder_width} m, expected {0.7 * breadth:.2f} to {1.35 * breadth:.2f} m "
            f"for a chest of {p.chest} m",
        )


def _check_shape(p: CoatParameters, source: str) -> None:
    """Checks the measures that only some coats have."""
    hem = p.chest if p.hem_girth is None else p.hem_girth
    mean = 0.5 * (p.armhole_girth + p.cuff_girth)
    for key, low, high, told in (
        ("hem_girth", _FLARE[0] * p.chest, _FLARE[1] * p.chest, f"for a chest of {p.chest} m"),
        ("hem_opening", 0.0, _LARGEST_GAP * hem, f"for a hem of {hem:.2f} m"),
        ("elbow_girth", _ELBOW[0] * mean, _ELBOW[1] * mean, f"for a mean girth of {mean:.2f} m"),
        ("lapel_depth", 0.0, 0.8 * p.body_length, "(0.8 of body_length)"),
        ("vent_length", 0.0, 0.6 * p.body_length, "(0.6 of body_length)"),
    ):
        value = getattr(p, key)
        if value is not None and not low <= value <= high:
            raise UserError(source, key, f"is {value} m, expected {low:.2f} to {high:.2f} m {told}")
    hood = 0.3 if p.hood_height is None else p.hood_height
    if p.collar == "hood" and p.neck_depth is not None and p.neck_depth > _HOOD_NECK * hood:
        raise UserError(
            source,
            "neck_depth",
            f"is {p.neck_depth} m, expected at most {_HOOD_NECK * hood:.3f} m below a hood of "
            f"{hood} m, which would fold through itself",
        )
    if p.has_lapels and p.neck_depth is not None:
        raise UserError(
            source,
            "neck_depth",
            f"is given with collar {p.collar}, whose front edges end at the shoulder seams; "
            f"expected none, or collar stand, none or hood",
        )
