"""Solvers that come with Drake, behind the interfaces of `models/`."""
