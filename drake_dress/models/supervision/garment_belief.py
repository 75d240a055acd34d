"""Whether an estimate of a garment can be believed: its shape, its motion, and that it lives.

A shape is held against the mesh and the grippers (`garment_shape.py`), nodes and reported
velocities against messages before. Grippers carry the nodes that they hold along, so nodes that
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

# Messages in a row without any change, before they are called frozen.
_REPEATS = 3
# Time constant with which reported velocities are summed up and held against positions, s.
_SUMMED_FOR = 0.2
# Of which the fastest of some thousand noisy nodes is further off, in standard deviations.
_FURTHEST = 10.0


@dataclass(frozen=True)
class GarmentBounds:
    """What an estimate of a garment may say.

    Attributes:
        shape: of each message.
        speed: of a node between messages, at most, m/s.
        velocity: of a node as it is reported, at most, m/s.
        velocity_error: of reported velocities against motion, root mean square, m/s.
        frozen_travel: of a gripper while the garment stays the same, at most, m; 0 does not
            judge it.
    """

    shape: ShapeBounds
    speed: float = 3.0
    velocity: float = 10.0
    velocity_error: float = 0.5
    frozen_travel: float = 0.01


@dataclass(frozen=True)
class GarmentTrack:
    """What is remembered of the sound messages.

    Attributes:
        stamp: of the last one, s.
        nodes: (n,3) of it, m. velocity: (n,3) m/s, where it had some.
        drift: (n,3) by which nodes moved more than their velocities say, fading with the time
            constant `_SUMMED_FOR`, m; None where none are reported.
        same: messages in a row without any change.
        grippers: (2,3) where they were when something changed last, m.
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
    """Returns what is wrong with a message, and what is remembered from then on.

    Args:
        nodes: (n,3) finite, m, world.
        velocity: (n,3) finite, m/s, if it is reported.
        stamp: of the message, s.
        grippers: (2,3) where left and right gripper are, m; None where that is not known.
        track: None before the first sound message.
        bounds: of what is believed.
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
        # what happened in so long a time two velocities do not tell
        return np.zeros_like(velocity)
    drift: FloatArray = drifted(
        track.drift, nodes, track.nodes, track.velocity, velocity, time, np.exp(-time / _SUMMED_FOR)
    )
    return drift


def _contradicted(track: GarmentTrack, b: GarmentBounds) -> str | None:
    """Returns how velocities that were reported contradict the nodes' motion, if they do."""
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


# Compiled: an estimate comes 50 times a second, to a process that has commands to send.


@nb.njit(cache=True, nogil=True)
def largest_length(vectors):  # type: ignore[no-untyped-def]
    """Returns the greatest length of vectors (n,3), and which has it."""
    most, at = -1.0, 0
    for i in range(len(vectors)):
        square = vectors[i, 0] ** 2 + vectors[i, 1] ** 2 + vectors[i, 2] ** 2
        if square > most:
            most, at = square, i
    return np.sqrt(most), at


@nb.njit(cache=True, nogil=True)
def drifted(drift, nodes, before, velocity_before, velocity, time, kept):  # type: ignore[no-untyped-def]
    """Returns (n,3) the share `kept` of a drift and the motion that velocities do not tell of, m.

    Args:
        drift: (n,3) so far, m.
        nodes: (n,3) now, m.
        before: (n,3) at the last message, m.
        velocity_before: (n,3) at the last message, m/s.
        velocity: (n,3) now, m/s.
        time: between both, s.
        kept: share of the drift so far.
    """
    out = np.empty_like(drift)
    for i in range(len(drift)):
        for a in range(3):
            told = 0.5 * time * (velocity_before[i, a] + velocity[i, a])
            out[i, a] = kept * drift[i, a] + nodes[i, a] - before[i, a] - told
    return out
