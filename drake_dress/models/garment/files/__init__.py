"""Reads triangle meshes from files, strictly: errors name the line that is not understood."""

from drake_dress.models.garment.files.raw import RawMesh
from drake_dress.models.garment.files.read import EXTENSIONS, MOST_TRIANGLES, read_mesh

__all__ = ["EXTENSIONS", "MOST_TRIANGLES", "RawMesh", "read_mesh"]
