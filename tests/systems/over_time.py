"""Outputs of systems that depend on time alone."""

import numpy as np
from pydrake.systems.framework import LeafSystem


def output_at(system: LeafSystem, times: np.ndarray) -> np.ndarray:
    """Returns the only output of a system at times (n,), s, in a context of its own."""
    context = system.CreateDefaultContext()
    rows = []
    for t in times:
        context.SetTime(t)
        rows.append(system.get_output_port().Eval(context))
    return np.array(rows)
