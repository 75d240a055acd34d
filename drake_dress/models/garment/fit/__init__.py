"""Whether a garment goes on a person: its measures beside the person's, and a verdict."""

from drake_dress.models.garment.fit.advice import SizeAdvice, size_advice
from drake_dress.models.garment.fit.girths import PersonGirths, person_girths
from drake_dress.models.garment.fit.judge import Comparison, Finding, Fit, judge
from drake_dress.models.garment.fit.sizes import GarmentSizes, Loop, garment_sizes

__all__ = [
    "Comparison",
    "Finding",
    "Fit",
    "GarmentSizes",
    "Loop",
    "PersonGirths",
    "SizeAdvice",
    "garment_sizes",
    "judge",
    "person_girths",
    "size_advice",
]
