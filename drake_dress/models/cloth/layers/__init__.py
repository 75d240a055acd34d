"""Layers of a garment that do not pass through each other."""

from drake_dress.models.cloth.layers.piercing import piercing_edges
from drake_dress.models.cloth.layers.separation import LayerSeparation, SeparationRecord

__all__ = ["LayerSeparation", "SeparationRecord", "piercing_edges"]
