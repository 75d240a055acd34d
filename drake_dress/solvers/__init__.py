"""Solvers from Drake, behind the interfaces of `models/`."""
