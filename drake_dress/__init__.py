"""Dual-arm dressing with a differentiable garment, as a Drake diagram."""

__version__ = "0.1.0"
