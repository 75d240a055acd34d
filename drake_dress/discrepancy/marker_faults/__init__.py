"""Finds faulty marker positions in motion-capture data.

Each function returns positions with NaN in place of faulty values, and notes that name the fault,
the markers and the samples. One module finds each kind of fault:

    lost        a value that encodes "not seen": zeros, 9999, the last position repeated
    exchanges   two or more markers that are swapped
    tracks      a marker that leaves its track for a while, or is farther away than cloth allows
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
    """Returns markers with NaN in place of values that encode lost ones, and notes on them.

    Args:
        time: (T,) s.
        marker: (T,m,3) positions in any unit of length; NaN or infinity where not seen.
        gripper: (T,2,3) positions in any unit of length; while they are still, so may the garment.
        names: names of the markers.
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
    """Returns markers with NaN in place of spikes and swapped markers, and notes on them.

    Args:
        time: (T,) s.
        marker: (T,m,3) positions, m, NaN where not seen.
        places: (m,3) positions on the rest shape, m; None if unknown.
        reach: (m,m) distance along the cloth between markers, m; None if unknown.
        noise: standard deviation of a coordinate, m.
        names: names of the markers.
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
    # markers that were too far only from values that are removed now are kept
    far = out_of_reach(marker, reach, noise)
    notes += told(
        names, far, "is farther from its neighbours than the cloth reaches: taken as not seen"
    )
    return np.where(far[:, :, None], np.nan, marker), notes
