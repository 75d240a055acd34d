"""An animated dressing as one self-contained HTML file: no server, no library, no downloads.

The garment's nodes are quantised with a step of at least 0.1 mm. Each frame is stored as the
difference to the previous one, with low and high bytes separate, and compressed with deflate. One
minute of 3,700 nodes takes about ten megabytes. The page inflates it with the browser's own
DecompressionStream. A person of a parametric body has a skin, which the page poses itself.
"""

from __future__ import annotations

import base64
import json
import zlib
from importlib import resources
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from drake_dress.errors import UserError
from drake_dress.file_output import write_bytes
from drake_dress.models.arm.solids import joined, panda_solids, stand
from drake_dress.models.arrays import FloatArray, IndexArray
from drake_dress.models.sides import SIDES
from drake_dress.report.arms import arm_poses
from drake_dress.report.log import RunLog
from drake_dress.report.log_schema import STAGE_NAMES
from drake_dress.report.person_skin import LoggedSkin, logged_skin
from drake_dress.report.stills import floor_height

MAX_BYTES = 25_000_000
# Limit of nodes times frames: hours of a garment would not fit in memory.
MAX_NODES = 10_000_000
_RESOLUTION = 1e-4  # m
_INT16_STEPS = 65_000


def write_replay_html(
    log: RunLog,
    path: str | Path,
    fps: float = 15.0,
    max_bytes: int = MAX_BYTES,
    max_nodes: int = MAX_NODES,
) -> None:
    """Writes the replay of a log.

    Args:
        log: Log with at least one sample.
        path: Path of the HTML file.
        fps: Frames per second of simulated time; the page interpolates. Halved until the file fits.
        max_bytes: Limit of the file size.
        max_nodes: Limit of nodes times frames.

    Raises:
        UserError: The log has no samples.
    """
    if not len(log):
        raise UserError(str(log.path), "/time", "holds no sample; expected at least one")
    nodes = len(log.rest_position)
    while len(_frames(log.time, fps)) * nodes > max_nodes and fps > 1e-3:
        fps *= 0.5
    while True:
        page = _page(log, fps)
        if len(page) <= max_bytes or fps < 0.5:
            break
        fps *= 0.5
    write_bytes(Path(path), page)


def _page(log: RunLog, fps: float) -> bytes:
    frames = _frames(log.time, fps)
    position = np.stack([log.garment_position(i) for i in frames])
    # A diverged run is shown until it diverges.
    finite = np.isfinite(position).all(axis=(1, 2))
    good = max(1, len(frames) if finite.all() else int(np.argmin(finite)))
    frames, position = frames[:good], np.nan_to_num(position[:good])
    low = position.min(axis=(0, 1))
    step = max(_RESOLUTION, float((position.max(axis=(0, 1)) - low).max()) / _INT16_STEPS)
    a, b, radius = log.capsules
    a, b = np.nan_to_num(a[frames]), np.nan_to_num(b[frames])
    arms = arm_poses(log, frames)
    logged = _known_skin(log, frames)
    low_points = [floor_height(position[0], (a[0], b[0], radius))]
    low_points.append(float(arms[0, ..., 2, 3].min(initial=np.inf)))
    if logged is not None:
        low_points.append(float(logged.vertices(int(frames[0]))[:, 2].min()))
    floor = min(low_points)
    meta = {
        "skin": None if logged is None else [len(logged.skin.vertices), len(logged.faces)],
        "frames": len(frames),
        "nodes": position.shape[1],
        "arms": arms.shape[1],
        "ofChair": log.of_chair.tolist(),
        "low": low.tolist(),
        "step": step,
        "time": [round(float(t), 4) for t in log.time[frames]],
        "stage": log.stage[frames].tolist(),
        "stageNames": list(STAGE_NAMES),
        "s": [[round(float(log.dressing[side][i, 0]), 3) for side in SIDES] for i in frames]
        if all(np.isfinite(log.dressing[side][frames, 0]).all() for side in SIDES)
        else None,
        "force": [
            [round(float(np.linalg.norm(log.gripper_force[side][i])), 1) for side in SIDES]
            for i in frames
        ]
        if all(np.isfinite(log.gripper_force[side][frames]).all() for side in SIDES)
        else None,
        "loops": {name: loop.tolist() for name, loop in log.loops.items()},
        "floor": floor,
        "center": log.joint_position[0].mean(axis=0).tolist(),
    }
    grippers = np.stack([log.gripper_position[side][frames] for side in SIDES], axis=1)
    blobs = {
        "positions": _encode(np.round((position - low) / step).astype(np.int64)),
        "faces": _base64(log.faces.astype("<u4").tobytes()),
        "capsuleA": _base64(a.astype("<f4").tobytes()),
        "capsuleB": _base64(b.astype("<f4").tobytes()),
        "radius": _base64(radius.astype("<f4").tobytes()),
        "grippers": _base64(np.nan_to_num(grippers).astype("<f4").tobytes()),
        "skin": "" if logged is None else _skin_blob(logged, frames),
        **_arm_blobs(arms, floor),
    }
    template = resources.files("drake_dress.report").joinpath("viewer.html").read_text("utf-8")
    page = template.replace('"@META@"', json.dumps(meta, allow_nan=False))
    for name, blob in blobs.items():
        page = page.replace(f"@{name}@", blob)
    return page.encode("utf-8")


def _known_skin(log: RunLog, frames: IndexArray) -> LoggedSkin | None:
    """Returns the person's skin; None if there is none, or a joint is not known in a frame."""
    return logged_skin(log) if np.isfinite(log.joint_position[frames]).all() else None


def _skin_blob(logged: LoggedSkin, frames: IndexArray) -> str:
    """Returns the person's skin, packed.

    The page poses it by the motions of its bones, which are a hundredth of the vertices. Packed are
    vertices at rest, motions (k,9,3,4), triangles, and skin weights in 1/255.
    """
    skin, joints = logged.skin, logged.log.joint_position[frames]
    parts = [
        skin.vertices.astype("<f4"),
        np.stack([logged.person.motions(at) for at in joints]).astype("<f4"),
        skin.faces.astype("<u2"),
        np.round(255.0 * skin.weights).astype("u1"),
    ]
    return _base64(zlib.compress(b"".join(part.tobytes() for part in parts), 9))


def _arm_blobs(poses: FloatArray, floor: float) -> dict[str, str]:
    """Returns the concatenated solids of the links, and their (k,a,8,4,4) poses packed.

    The bases stand on columns that reach down to the floor, m.
    """
    if not poses.shape[1]:
        return dict.fromkeys(("armSize", "armVertices", "armNormals", "armFaces", "armPoses"), "")
    base, *moving = panda_solids()
    height = float(poses[0, 0, 0, 2, 3]) - floor
    solids = [base if height <= 0.0 else joined(base, stand(height)), *moving]
    # for each link its quaternion (x, y, z, w) and its position
    turn = Rotation.from_matrix(poses[..., :3, :3].reshape(-1, 3, 3)).as_quat()
    placed = np.hstack([turn, poses[..., :3, 3].reshape(-1, 3)])
    count = np.array([(len(s.vertices), s.faces.size) for s in solids])
    vertices, normals, faces = (
        np.concatenate([getattr(s, name) for s in solids])
        for name in ("vertices", "normals", "faces")
    )
    return {
        "armSize": _base64(count.astype("<u4").tobytes()),
        "armVertices": _base64(vertices.astype("<f4").tobytes()),
        "armNormals": _base64(normals.astype("<f4").tobytes()),
        "armFaces": _base64(faces.astype("<u4").tobytes()),
        "armPoses": _base64(placed.astype("<f4").tobytes()),
    }


def _frames(time: FloatArray, fps: float) -> IndexArray:
    """Returns the samples nearest to a regular time grid, including the first and the last."""
    count = max(1, round((time[-1] - time[0]) * fps)) + 1
    wanted = np.linspace(time[0], time[-1], count)
    right = np.clip(np.searchsorted(time, wanted), 1, max(1, len(time) - 1))
    if len(time) == 1:
        return np.zeros(1, dtype=np.int64)
    nearest = np.where(wanted - time[right - 1] < time[right] - wanted, right - 1, right)
    return np.unique(nearest).astype(np.int64)


def _encode(steps: IndexArray) -> str:
    """Returns the deflated time differences of (frames, n, 3) modulo 2^16, by byte plane."""
    difference = np.diff(steps, axis=0, prepend=0).astype(np.uint16)
    # Separate x, y and z of a frame, too, so that adjacent values are similar.
    planes = difference.transpose(0, 2, 1).ravel()
    # Zigzag encoding gives small negative differences a zero high byte, too.
    signed = planes.view(np.int16).astype(np.int32)
    zigzag = ((signed << 1) ^ (signed >> 15)).astype(np.uint16)
    raw = (zigzag & 0xFF).astype(np.uint8).tobytes() + (zigzag >> 8).astype(np.uint8).tobytes()
    return _base64(zlib.compress(raw, 6))


def _base64(data: bytes) -> str:
    return base64.b64encode(data).decode("ascii")
