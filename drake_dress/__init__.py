"""Dual-arm dressing with a differentiable garment, as a Drake diagram."""

from drake_dress.caches import prepare_caches
from drake_dress.machine import limit_threads

# Must run before any import of a library that keeps a cache or starts threads.
prepare_caches()
limit_threads()

__version__ = "0.2.0"
