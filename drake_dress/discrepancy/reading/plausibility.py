"""Checks the positions of a recording against each other: units, axes, sides and jumps.

Both grippers hold the garment where the scenario says, so at the start it hangs roughly in its rest
shape, rigidly moved. The rest places are compared with the scenario's garment, the markers with the
rest places, the grippers with the markers, and the person's joints with the lengths of human limbs.
The bounds are wide: real discrepancies (a size that is 3 % off, cameras turned by a degree) stay
far within them, and a wrong unit is far beyond them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from drake_dress.discrepancy.reading.raw import JOINTS, MARKERS, PLACES, RawRecording
from drake_dress.errors import UserError
from drake_dress.models.arrays import FloatArray
from drake_dress.models.garment.mesh import GarmentMesh
from drake_dress.models.sides import SIDES
from drake_dress.report.log_schema import JOINT_NAMES

# All positions are within this distance of the world's origin, m.
_FARTHEST = 20.0
# Largest distance of the rest places from the scenario's garment, m: their median, and any.
_OFF_GARMENT, _ANY_OFF_GARMENT = 0.1, 0.3
# Bounds on the size of the cloud of markers, relative to that of their rest places.
_SMALLEST, _LARGEST = 0.4, 2.8
# Largest misfit of a rigid motion, relative to the size of the rest cloud. Mixed-up markers leave
# more; hanging garments leave 0.05 to 0.1.
_MISFIT = 0.6
# Markers are mirrored if the rigid fit leaves more than _POOR, and the mirrored fit leaves less
# than _POOR and less than the share _MIRRORED of the rigid fit's misfit.
_MIRRORED, _POOR = 0.4, 0.12
# Largest angle between the garment's up axis and the world's at the start, degrees.
_TURNED = 60.0
# Largest distance of a gripper from where it holds the garment, m.
_OFF_GRASP = 0.35
# Largest distance of a gripper from the middle of the markers, in any order of them, m.
_AWAY = 2.0
# Start of a recording, during which the garment hangs still, s.
_START = 0.3
# Limbs of adults and children, m: upper arm, forearm with the wrist; between the shoulders.
_LIMB, _SHOULDERS = (0.12, 0.5), (0.12, 0.65)
# A person who faces +x has the left shoulder on the left (+y), even when turning: share of the
# distance between the shoulders by which it may be on the right.
_TURNED_AWAY = 0.5
# Largest tilt of the line through the shoulders of a sitting or standing person, degrees.
_LEVEL = 45.0
# Largest acceleration of a gripper or of a person's joint, m/s², and allowance for noise, m.
_ACCELERATION, _JITTER = 150.0, 0.03
_UNITS = (
    (1e3, "millimetres"),
    (1e2, "centimetres"),
    (39.37, "inches"),
    (10.0, "decimetres"),
    (3.281, "feet"),
    (1e-3, "kilometres"),
)
_AXES = ("x", "y", "z")


@dataclass(frozen=True)
class Start:
    """Pose of the garment at the start: x ≈ R rest + t.

    Attributes:
        rotation: (3,3) R; translation: (3,) t, m.
        middle: (3,) middle of the markers, m.
        misfit: residual of the best fit, relative to the size of the rest cloud.
        mirrored: residual of the best fit with a reflection, likewise.
        flat: whether the rest places are too close to a line to determine a rotation.
    """

    rotation: FloatArray
    translation: FloatArray
    middle: FloatArray
    misfit: float
    mirrored: float
    flat: bool

    @property
    def fits(self) -> bool:
        """Whether the rigid motion fits the markers, so that it can be used in further checks."""
        return not self.flat and self.misfit <= _MISFIT


def check_places(raw: RawRecording, key: str, places: FloatArray, mesh: GarmentMesh) -> None:
    """Raises UserError if rest places are not on the scenario's garment, or two are the same.

    Args:
        raw: the recording.
        key: name of the places' dataset, for messages.
        places: (m,3) garment frame, m.
        mesh: the scenario's garment.
    """
    off, _ = cKDTree(mesh.rest_position).query(places)
    size, whole = _size(places), _size(mesh.rest_position)
    if np.median(off) > _OFF_GARMENT:
        middle = float(np.median(off))
        raise UserError(
            raw.source,
            key,
            f"lies {middle:.4g} m from the scenario's garment (median), expected metres in the "
            f"garment's frame{_meant(size / whole)}",
        )
    zero = np.flatnonzero(~places.any(axis=1))
    if len(zero) and off[zero[0]] > 0.01:
        raise UserError(
            raw.source, key, f"of marker {zero[0]} is the origin (0, 0, 0), expected its place"
        )
    worst = int(np.argmax(off))
    if off[worst] > _ANY_OFF_GARMENT:
        raise UserError(
            raw.source,
            key,
            f"of marker {worst} lies {off[worst]:.3g} m from the scenario's garment, "
            f"expected up to {_ANY_OFF_GARMENT:g} m",
        )
    for i, j in cKDTree(places).query_pairs(1e-6):
        raise UserError(
            raw.source, key, f"of markers {i} and {j} is the same place, expected one for each"
        )


def check_markers(
    raw: RawRecording, time: FloatArray, marker: FloatArray, places: FloatArray
) -> Start | None:
    """Returns the pose of the garment at the start; None if too few markers are seen.

    Args:
        raw: the recording.
        time: (T,) s.
        marker: (T,m,3) m, NaN where not seen.
        places: (m,3) rest places, m.

    Raises:
        UserError: the markers are not in metres, not z up, mirrored, or do not fit their rest
            places.
    """
    key = raw.key(MARKERS)

    def wrong(message: str) -> UserError:
        return UserError(raw.source, key, message)

    seen = at_start(time, marker)
    there = np.isfinite(seen).all(axis=1)
    far = float(np.nanmax(np.abs(marker)))
    if there.sum() >= 4:
        ratio = _size(seen[there]) / max(_size(places[there]), 1e-9)
        if not _SMALLEST <= ratio <= _LARGEST:
            raise wrong(
                f"spans {ratio:.4g} times what {PLACES} does (reaches {far:.4g} m from the "
                f"origin), expected metres{_meant(ratio)}"
            )
    if far > _FARTHEST:
        raise wrong(f"reaches {far:.4g} m from the origin, expected metres, up to {_FARTHEST:g}")
    if there.sum() < 4:
        return None
    start = _fitted(places[there], seen[there])
    if start.flat:
        return start
    if start.misfit > _POOR and start.mirrored < min(_MIRRORED * start.misfit, _POOR):
        raise wrong(
            f"is a mirror image of {PLACES}, expected x forward, y to the wearer's left, z up"
        )
    if not start.fits:
        raise wrong(
            f"does not fit {PLACES}: moved and turned as a whole they are "
            f"{100 * start.misfit:.0f} % of the garment's size off, expected up to "
            f"{100 * _MISFIT:g} %; are markers' numbers mixed up?"
        )
    up = start.rotation[:, 2]
    if np.degrees(np.arccos(np.clip(up[2], -1.0, 1.0))) > _TURNED:
        raise wrong(f"hangs with the garment's up axis along {_axis(up)}, expected z up (+z)")
    return start


def check_grippers(
    raw: RawRecording, time: FloatArray, gripper: FloatArray, start: Start | None, mesh: GarmentMesh
) -> None:
    """Raises UserError if grippers (T,2,3), m, are not where the garment is held, or jump."""
    if start is not None and start.fits:
        _check_sides(raw, time, gripper, start, mesh)
    for k, side in enumerate(SIDES):
        key = raw.key(f"gripper/{side}/position")
        far = float(np.abs(gripper[:, k]).max())
        if start is not None and start.fits:
            held = start.rotation @ mesh.rest_position[mesh.grasp[side]].mean(axis=0)
            held = held + start.translation
            at = at_start(time, gripper[:, k : k + 1])[0]
            off = float(np.linalg.norm(at - held))
            if off > _OFF_GRASP:
                unit = next(
                    (name for size, name in _UNITS if np.linalg.norm(at / size - held) < 0.2), ""
                )
                hint = f"; is it in {unit}?" if unit else ""
                raise UserError(
                    raw.source,
                    key,
                    f"begins {off:.4g} m from where the markers say that it holds the garment, "
                    f"expected metres, up to {_OFF_GRASP:g}{hint}",
                )
        if far > _FARTHEST:
            raise UserError(
                raw.source,
                key,
                f"reaches {far:.4g} m from the origin, expected metres, up to {_FARTHEST:g}",
            )
        if start is not None:
            away = float(np.linalg.norm(at_start(time, gripper[:, k : k + 1])[0] - start.middle))
            if away > _AWAY:
                raise UserError(
                    raw.source,
                    key,
                    f"begins {away:.4g} m from the middle of the markers, expected metres, "
                    f"up to {_AWAY:g}",
                )
        _check_jumps(raw.source, key, time, gripper[:, k], "")


def _check_sides(
    raw: RawRecording, time: FloatArray, gripper: FloatArray, start: Start, mesh: GarmentMesh
) -> None:
    """Raises UserError if left and right grippers are exchanged."""
    grasp = np.stack([mesh.rest_position[mesh.grasp[side]].mean(axis=0) for side in SIDES])
    held = grasp @ start.rotation.T + start.translation
    at = at_start(time, gripper)
    given, exchanged = (float(np.linalg.norm(held - p, axis=1).max()) for p in (at, at[::-1]))
    if given > 0.1 and exchanged < min(0.4 * given, _OFF_GRASP):
        raise UserError(
            raw.source,
            raw.key("gripper"),
            f"left and right hold each other's side of the garment ({given:.2g} m off, "
            f"{exchanged:.2g} m if exchanged), expected left on the wearer's left",
        )


def check_joints(raw: RawRecording, time: FloatArray, joints: FloatArray) -> None:
    """Raises UserError if joints (T,6,3), m, are not those of a sitting or standing person."""
    key = raw.key(JOINTS)
    limbs = [(0, 1, _LIMB), (1, 2, _LIMB), (3, 4, _LIMB), (4, 5, _LIMB), (0, 3, _SHOULDERS)]
    for a, b, (least, most) in limbs:
        length = np.linalg.norm(joints[:, b] - joints[:, a], axis=1)
        usual = float(np.median(length))
        if not least <= usual <= most:
            raise UserError(
                raw.source,
                key,
                f"has {JOINT_NAMES[b]} {usual:.4g} m from {JOINT_NAMES[a]}, expected metres, "
                f"{least:g} to {most:g}{_meant(usual / 0.3)}",
            )
        bad = (length < 0.6 * least) | (length > 1.4 * most)
        if bad.any():
            at = int(np.argmax(bad))
            raise UserError(
                raw.source,
                key,
                f"has {JOINT_NAMES[b]} {length[at]:.4g} m from {JOINT_NAMES[a]} at sample {at}, "
                f"expected {least:g} to {most:g}",
            )
    across = np.median(joints[:, 0] - joints[:, 3], axis=0)
    tilt = np.degrees(np.arcsin(min(abs(across[2]) / np.linalg.norm(across), 1.0)))
    if tilt > _LEVEL:
        raise UserError(
            raw.source,
            key,
            f"has the shoulders one above the other ({tilt:.0f} degrees from level), expected z up",
        )
    if across[1] < -_TURNED_AWAY * np.linalg.norm(across):
        raise UserError(
            raw.source,
            key,
            f"has the left shoulder {-across[1]:.2g} m to the right of the right one, expected a "
            "person that faces +x, with the left at +y; are left and right exchanged?",
        )
    if np.abs(joints).max() > _FARTHEST:
        raise UserError(
            raw.source,
            key,
            f"reaches {np.abs(joints).max():.4g} m from the origin, expected metres, "
            f"up to {_FARTHEST:g}",
        )
    for k, name in enumerate(JOINT_NAMES):
        _check_jumps(raw.source, key, time, joints[:, k], f"of {name} ")


def at_start(time: FloatArray, values: FloatArray) -> FloatArray:
    """Returns (k,3) the medians of values (T,k,3) at the start, or of all if none is there."""
    first = time <= time[0] + _START
    found = np.full(values.shape[1:], np.nan)
    for k in range(values.shape[1]):
        for part in (values[first, k], values[:, k]):
            part = part[np.isfinite(part).all(axis=1)]
            if len(part):
                found[k] = np.median(part, axis=0)
                break
    return found


def axis_name(direction: FloatArray) -> str:
    """Returns the axis that a vector (3,) points along, such as +y."""
    return _axis(direction)


def _fitted(places: FloatArray, seen: FloatArray) -> Start:
    """Returns the rigid motion of places (m,3) that best fits seen points (m,3) (Kabsch 1976)."""
    p, q = places - places.mean(axis=0), seen - seen.mean(axis=0)
    u, s, vt = np.linalg.svd(p.T @ q)
    sign = float(np.sign(np.linalg.det(u @ vt))) or 1.0
    rotation = (u @ np.diag([1.0, 1.0, sign]) @ vt).T
    whole, square = float(np.sum(p * p)), float(np.sum(q * q))

    def misfit(trace: float) -> float:
        # with the best scale, too, so that a slightly larger garment is no misfit
        return float(np.sqrt(max(1.0 - trace**2 / (whole * square), 0.0)))

    spread = np.linalg.svd(p, compute_uv=False)
    return Start(
        rotation,
        seen.mean(axis=0) - rotation @ places.mean(axis=0),
        seen.mean(axis=0),
        misfit(s[0] + s[1] + sign * s[2]),
        misfit(s[0] + s[1] - sign * s[2]),
        bool(spread[1] < 0.05 * spread[0]),
    )


def _check_jumps(source: str, key: str, time: FloatArray, track: FloatArray, what: str) -> None:
    """Raises UserError if a track (T,3), m, jumps to a point that it cannot have reached."""
    # each point is compared with the line through its neighbours
    share = ((time[1:-1] - time[:-2]) / (time[2:] - time[:-2]))[:, None]
    off = np.linalg.norm(track[1:-1] - (1.0 - share) * track[:-2] - share * track[2:], axis=1)
    most = _JITTER + 0.5 * _ACCELERATION * (time[1:-1] - time[:-2]) * (time[2:] - time[1:-1])
    if np.any(off > most):
        at = int(np.argmax(off - most)) + 1
        raise UserError(
            source,
            key,
            f"{what}jumps by {off[at - 1]:.3g} m at sample {at}, expected a steady track",
        )


def _size(points: FloatArray) -> float:
    """Returns the RMS distance of points (k,3) from their mean, m."""
    away = points - points.mean(axis=0)
    return float(np.sqrt(np.mean(np.sum(away * away, axis=1))))


def _meant(ratio: float) -> str:
    """Returns a hint at the unit of a length that is `ratio` times the expected one, if any."""
    for size, name in _UNITS:
        if 0.6 < ratio / size < 1.6:
            return f"; is it in {name}?"
    return ""


def _axis(direction: FloatArray) -> str:
    k = int(np.argmax(np.abs(direction)))
    return ("+" if direction[k] > 0.0 else "-") + _AXES[k]
