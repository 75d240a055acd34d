"""Schemes that solve the linear system of a step: one per file, one interface (interface.py)."""
