"""Frees what a diagram holds that nobody uses any more."""

from __future__ import annotations

from pydrake.systems.framework import Diagram


def release(diagram: Diagram) -> None:
    """Lets go of all that the systems of a diagram hold, and of the diagram.

    A system written in Python is never freed by pydrake: its C++ part holds its bound methods,
    which hold the system, and Python's garbage collector does not see the C++ part. Each system
    keeps its diagram, so that a process which builds diagrams again and again grows by all of them.
    This empties the Python parts; what is left of a dressing's station is 0.8 MB in C++, where a
    whole one has several.

    Neither the diagram nor a system of it may be used afterwards.

    Args:
        diagram: of which no simulator is left.
    """
    for system in diagram.GetSystems():
        if isinstance(system, Diagram):
            release(system)
        system.__dict__.clear()
    diagram.__dict__.clear()
