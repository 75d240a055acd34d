"""Dual-arm dressing with a differentiable garment, as a Drake diagram."""

from drake_dress.caches import prepare_caches

# Before any library that keeps a cache is imported.
prepare_caches()

__version__ = "0.1.0"
