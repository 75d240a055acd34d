"""Reads triangle meshes from files, strictly: what is not understood is refused with its line."""

from drake_dress.models.garment.files.raw import RawMesh
from drake_dress.models.garment.files.read import EXTENSIONS, MOST_TRIANGLES, read_mesh

__all__ = ["EXTENSIONS", "MOST_TRIANGLES", "RawMesh", "read_mesh"]
