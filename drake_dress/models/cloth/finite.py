"""The error for a garment with values that are not finite: it names the node."""

from __future__ import annotations

import numpy as np

from drake_dress.models.arrays import FloatArray, IntArray


def explain_not_finite(
    x: FloatArray, v: FloatArray, held_motion: FloatArray, held: IntArray
) -> None:
    """Raises an error that says which input of a step is not finite, and at which node.

    Args:
        x: (n,3) positions, m.
        v: (n,3) velocities, m/s.
        held_motion: (k,3) motion or velocity of the held nodes.
        held: (k,) indices of the held nodes.

    Raises:
        ValueError: always. If all inputs are finite, the step's result was not.
    """
    for name, value, nodes in (
        ("position", x, None),
        ("velocity", v, None),
        ("motion of the held", held_motion, held),
    ):
        bad = np.flatnonzero(~np.isfinite(value).all(axis=1))
        if len(bad):
            node = int(bad[0] if nodes is None else nodes[bad[0]])
            raise ValueError(f"{name} node {node} is {value[bad[0]]}, expected finite numbers")
    raise ValueError("the step has no finite solution, expected positions of moderate size")
