"""Parametric coats: measures, ready cuts, sizes, and the mesh that they give."""

from drake_dress.models.garment.coat.cuts import COATS
from drake_dress.models.garment.coat.make import make_coat
from drake_dress.models.garment.coat.parameters import (
    COLLARS,
    OPENINGS,
    SPACING_RANGE,
    CoatParameters,
)
from drake_dress.models.garment.coat.sizes import (
    SIZE_TABLES,
    BodySize,
    body_of_size,
    coat_of_size,
    size_codes,
)

__all__ = [
    "COATS",
    "COLLARS",
    "OPENINGS",
    "SIZE_TABLES",
    "SPACING_RANGE",
    "BodySize",
    "CoatParameters",
    "body_of_size",
    "coat_of_size",
    "make_coat",
    "size_codes",
]
