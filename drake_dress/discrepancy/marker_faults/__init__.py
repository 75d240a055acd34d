"""Finds what a motion-capture system reports of markers that it did not see where it says.

Each function returns positions with NaN where a marker was not measured, and a line for each kind
and marker that says where. What counts as evidence:

    lost        a value that stands for "not seen": zeros, 9999, the last position again and again
    exchanges   two or more markers that take each other's places
    tracks      a marker that is elsewhere for a while, or farther away than the cloth reaches
"""

from __future__ import annotations

import numpy as np

from drake_dress.discrepancy.marker_faults.exchanges import exchanged
from drake_dress.discrepancy.marker_faults.lost import held_values, substitutes
from drake_dress.discrepancy.marker_faults.telling import told
from drake_dress.discrepancy.marker_faults.tracks import find_jumps, out_of_reach, strays
from drake_dress.models.arrays import FloatArray

__all__ = ["without_faults", "without_substitutes"]


def without_substitutes(
    time: FloatArray, marker: FloatArray, gripper: FloatArray, names: tuple[str, ...]
) -> tuple[FloatArray, list[str]]:
    """Returns markers without the values that stand for lost ones, and what is to be said of them.

    Args:
        time: (T,) s.
        marker: (T,m,3) in any unit of length, NaN where not seen; infinity may stand for that too.
        gripper: (T,2,3) in any unit of length: a garment that is not moved may stand still.
        names: of the markers.
    """
    infinite = np.asarray(np.isinf(marker).any(axis=2))
    notes = told(names, infinite, "is infinite: taken as not seen")
    seen = np.asarray(np.isfinite(marker).all(axis=2))
    marker = np.where(seen[:, :, None], marker, np.nan)
    for what, bad in substitutes(marker):
        notes += told(names, bad, f"{what}: taken as not seen")
        marker = np.where(bad[:, :, None], np.nan, marker)
    bad = held_values(time, marker, gripper)
    notes += told(names, bad, "repeats its last position exactly: taken as not seen")
    return np.where(bad[:, :, None], np.nan, marker), notes


def without_faults(
    time: FloatArray,
    marker: FloatArray,
    places: FloatArray | None,
    reach: FloatArray | None,
    noise: float,
    names: tuple[str, ...],
) -> tuple[FloatArray, list[str]]:
    """Returns markers without spikes and exchanged labels, and what is to be said of them.

    Args:
        time: (T,) s.
        marker: (T,m,3) m, NaN where not seen.
        places: (m,3) on the rest shape, m; None where they are not known.
        reach: (m,m) m, the farthest that cloth lets two markers part; None likewise.
        noise: standard deviation of a coordinate, m.
        names: of the markers.
    """
    notes = []
    jumps = find_jumps(time, marker, noise)
    for group, bad in exchanged(time, marker, places, jumps):
        listed = " and ".join(names[k] for k in group)
        notes += told((listed,), bad[:, None], "exchange places: taken as not seen", "markers")
        both = np.zeros(marker.shape[:2], dtype=np.bool_)
        both[:, group] = bad[:, None]
        marker = np.where(both[:, :, None], np.nan, marker)
    far = out_of_reach(marker, reach, noise)
    jumps = find_jumps(time, marker, noise)
    astray = strays(time, marker, jumps, far)
    notes += told(names, astray, "jumps away from its track: taken as not seen")
    marker = np.where(astray[:, :, None], np.nan, marker)
    # what stood too far from a marker that is gone now may be well where it is
    far = out_of_reach(marker, reach, noise)
    notes += told(
        names, far, "is farther from its neighbours than the cloth reaches: taken as not seen"
    )
    return np.where(far[:, :, None], np.nan, marker), notes
