"""Labelled garment meshes: parametric coats, a user's own file, transfer between meshes."""

from drake_dress.models.garment.coat import COATS, CoatParameters, make_coat
from drake_dress.models.garment.load import load_garment
from drake_dress.models.garment.mesh import REGION_NAMES, GarmentMesh
from drake_dress.models.garment.transfer import barycentric_transfer

__all__ = [
    "COATS",
    "REGION_NAMES",
    "CoatParameters",
    "GarmentMesh",
    "barycentric_transfer",
    "load_garment",
    "make_coat",
]
