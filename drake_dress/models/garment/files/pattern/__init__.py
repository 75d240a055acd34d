"""Sewing patterns in GarmentCode's JSON format: read, cut into triangles, sewn and put on."""

from drake_dress.models.garment.files.pattern.read import read_pattern

__all__ = ["read_pattern"]
