"""Plausibility of a garment estimate: its shape, its motion, and whether it is frozen.

The shape is checked against the mesh and the grippers (`garment_shape.py`), nodes and reported
velocities against earlier messages. Grippers carry along the nodes that they hold, so nodes that
stay the same to the last bit while a gripper moves are frozen.
"""

from __future__ import annotations

from dataclasses import dataclass

import numba as nb
import numpy as np

from drake_dress.models.arrays import FloatArray
from drake_dress.models.sides import SIDES
from drake_dress.models.supervision.fault import SOUND, Fault, Finding
from drake_dress.models.supervision.garment_shape import ShapeBounds, impossible_shape

# Consecutive messages without any change before an estimate counts as frozen.
_REPEATS = 3
# Time constant with which reported velocities are integrated and compared with positions, s.
_SUMMED_FOR = 0.2
# Greatest motion due to noise among some thousand nodes, in standard deviations.
_FURTHEST = 10.0


@dataclass(frozen=True)
class GarmentBounds:
    """Limits of a plausible garment estimate.

    Attributes:
        shape: limits of each message's shape.
        speed: greatest speed of a node between messages, m/s.
        velocity: greatest reported velocity of a node, m/s.
        velocity_error: greatest error of reported velocities relative to the motion, root mean
            square, m/s.
        frozen_travel: greatest travel of a gripper while the garment stays the same, m; 0 disables
            the check.
    """

    shape: ShapeBounds
    speed: float = 3.0
    velocity: float = 10.0
    velocity_error: float = 0.5
    frozen_travel: float = 0.01


@dataclass(frozen=True)
class GarmentTrack:
    """Memory of the sound messages.

    Attributes:
        stamp: time stamp of the last one, s.
        nodes: (n,3) of the last one, m. velocity: (n,3) m/s, if it had velocities.
        drift: (n,3) motion of the nodes that their velocities do not explain, fading with the time
            constant `_SUMMED_FOR`, m; None if no velocities are reported.
        same: consecutive messages without any change.
        grippers: (2,3) positions at the last change, m.
    """

    stamp: float
    nodes: FloatArray
    velocity: FloatArray | None
    drift: FloatArray | None
    same: int = 0
    grippers: FloatArray | None = None


def judge_garment(
    nodes: FloatArray,
    velocity: FloatArray | None,
    stamp: float,
    grippers: FloatArray | None,
    track: GarmentTrack | None,
    bounds: GarmentBounds,
) -> tuple[Finding, GarmentTrack | None]:
    """Returns the finding about a message, and the new track.

    Args:
        nodes: (n,3) finite, m, world.
        velocity: (n,3) finite, m/s, if it is reported.
        stamp: time stamp of the message, s.
        grippers: (2,3) positions of left and right gripper, m; None if not known.
        track: None before the first sound message.
        bounds: limits of a plausible estimate.
    """
    told = impossible_shape(nodes, grippers, bounds.shape) or _too_fast(velocity, bounds)
    if told is not None:
        return Finding(Fault.IMPOSSIBLE, told), track
    if track is None or stamp <= track.stamp:
        drift = None if velocity is None else np.zeros_like(velocity)
        begun = GarmentTrack(stamp, nodes, velocity, drift, 0, grippers)
        return SOUND, track or begun
    told = _leap(nodes, stamp - track.stamp, track, bounds)
    if told is not None:
        return Finding(Fault.LEAP, told), track
    track = _remembered(nodes, velocity, stamp, grippers, track)
    told = _contradicted(track, bounds)
    if told is not None:
        return Finding(Fault.IMPOSSIBLE, told), track
    told = _frozen(grippers, track, bounds.frozen_travel)
    return (SOUND if told is None else Finding(Fault.FROZEN, told)), track


def _too_fast(velocity: FloatArray | None, b: GarmentBounds) -> str | None:
    if velocity is None:
        return None
    fastest, node = largest_length(velocity)
    if fastest <= b.velocity:
        return None
    return f"velocity of node {node} {fastest:.3g} m/s, expected {b.velocity:g} m/s at most"


def _leap(nodes: FloatArray, time: float, track: GarmentTrack, b: GarmentBounds) -> str | None:
    moved, k = largest_length(nodes - track.nodes)
    allowed = b.speed * time + _FURTHEST * b.shape.node_noise
    if moved <= allowed:
        return None
    return f"node {k} moved {moved:.2f} m in {time:.3f} s, expected {allowed:.2f} m at most"


def _remembered(
    nodes: FloatArray,
    velocity: FloatArray | None,
    stamp: float,
    grippers: FloatArray | None,
    track: GarmentTrack,
) -> GarmentTrack:
    same = bool(np.array_equal(nodes, track.nodes))
    return GarmentTrack(
        stamp,
        nodes,
        velocity,
        _drift(nodes, velocity, stamp - track.stamp, track),
        track.same + 1 if same else 0,
        track.grippers if same and track.grippers is not None else grippers,
    )


def _drift(
    nodes: FloatArray, velocity: FloatArray | None, time: float, track: GarmentTrack
) -> FloatArray | None:
    if velocity is None:
        return None
    if track.velocity is None or track.drift is None or time > _SUMMED_FOR:
        # two velocities do not describe the motion in so long a time
        return np.zeros_like(velocity)
    drift: FloatArray = drifted(
        track.drift, nodes, track.nodes, track.velocity, velocity, time, np.exp(-time / _SUMMED_FOR)
    )
    return drift


def _contradicted(track: GarmentTrack, b: GarmentBounds) -> str | None:
    """Returns how the reported velocities contradict the nodes' motion; None if they do not."""
    if track.drift is None:
        return None
    error = float(np.sqrt(np.vdot(track.drift, track.drift) / len(track.drift)))
    allowed = b.velocity_error * _SUMMED_FOR + 6.0 * b.shape.node_noise
    if error <= allowed:
        return None
    return (
        f"positions drift from what velocities say by {error:.2f} m in about {_SUMMED_FOR:g} s, "
        f"expected {allowed:.2f} m at most"
    )


def _frozen(grippers: FloatArray | None, track: GarmentTrack, travel: float) -> str | None:
    if travel == 0.0 or grippers is None or track.grippers is None or track.same < _REPEATS:
        return None
    moved = np.linalg.norm(grippers - track.grippers, axis=1)
    k = int(np.argmax(moved))
    if moved[k] <= travel:
        return None
    return (
        f"all nodes the same to the last bit in {track.same} messages while the {SIDES[k]} gripper "
        f"moved {100.0 * moved[k]:.1f} cm, expected {100.0 * travel:g} cm at most"
    )


# Compiled, because estimates come 50 times a second, to a process that has commands to send.


@nb.njit(cache=True, nogil=True)
def largest_length(vectors):  # type: ignore[no-untyped-def]
    """Returns the greatest length of vectors (n,3), and the index of that vector."""
    most, at = -1.0, 0
    for i in range(len(vectors)):
        square = vectors[i, 0] ** 2 + vectors[i, 1] ** 2 + vectors[i, 2] ** 2
        if square > most:
            most, at = square, i
    return np.sqrt(most), at


@nb.njit(cache=True, nogil=True)
def drifted(drift, nodes, before, velocity_before, velocity, time, kept):  # type: ignore[no-untyped-def]
    """Returns the drift (n,3), m: a share of it so far, and the motion velocities do not explain.

    Args:
        drift: (n,3) so far, m.
        nodes: (n,3) now, m.
        before: (n,3) nodes at the last message, m.
        velocity_before: (n,3) at the last message, m/s.
        velocity: (n,3) now, m/s.
        time: time between both, s.
        kept: share of the drift so far that is kept.
    """
    out = np.empty_like(drift)
    for i in range(len(drift)):
        for a in range(3):
            told = 0.5 * time * (velocity_before[i, a] + velocity[i, a])
            out[i, a] = kept * drift[i, a] + nodes[i, a] - before[i, a] - told
    return out
