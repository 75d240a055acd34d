"""The file of the parametric body: what `drake-dress dataset body` writes.

It has the points of the left half, which are vertices on the plane of symmetry, other vertices,
joints on the plane and joints of the left side. All numbers of shapes are multiples of `STEP`.
"""

from __future__ import annotations

import zipfile
from dataclasses import dataclass
from functools import lru_cache
from io import BytesIO
from pathlib import Path

import numpy as np
import numpy.typing as npt

from drake_dress.errors import UserError
from drake_dress.file_output import write_bytes
from drake_dress.models.arrays import FloatArray, IndexArray
from drake_dress.models.human.skin.macro import AGES, MUSCLES, SEXES, WEIGHTS, Macro, corner_weights

SHIPPED = Path(__file__).parent / "shipped" / "body.npz"
STEP = 1e-4  # m; a tenth of what a body's height is asked to
PARTS = (
    "trunk", "neck", "head", "upper_arm", "forearm", "palm", "fingers", "thumb", "thigh", "shin",
    "foot",
)  # fmt: skip
# Bones of the left half; the torso has no side.
BONES = ("torso", "upper_arm", "forearm", "thigh", "shin")
MIDDLE_JOINTS = ("neck", "head")
JOINTS = (
    "shoulder", "elbow", "wrist", "knuckle_index", "knuckle_middle", "knuckle_little", "thumb",
    "hip", "knee", "ankle",
)  # fmt: skip
# Joints of the whole body.
ALL_JOINTS = (*MIDDLE_JOINTS, *(f"{side}_{name}" for side in ("left", "right") for name in JOINTS))
_SHAPES = ("base", "height", "proportions")
_CORNERS = (len(SEXES), len(AGES), len(MUSCLES), len(WEIGHTS))
_MIRROR = np.array([1.0, -1.0, 1.0])


@dataclass(frozen=True)
class BodyFile:
    """The content of the file; P points, n vertices of the left half, of which the first m middle.

    Attributes:
        middle: m.
        mean: (P,3) mean of all corners, m. Frame: x forward, y left, z up.
        base: (2,4,3,3,P,3) displacement from the mean at mean height, in steps.
        height: (2,4,3,3,P,3) displacement from least to greatest height, in steps.
        proportions: (2,4,3,3,P,3) displacement from ideal to uncommon proportions, in steps.
        faces: (F,3) triangles of the left half.
        weights: (n,5) skin weights of `BONES`.
        parts: (n,) indices in `PARTS`.
    """

    middle: int
    mean: FloatArray
    base: npt.NDArray[np.int16]
    height: npt.NDArray[np.int16]
    proportions: npt.NDArray[np.int16]
    faces: IndexArray
    weights: FloatArray
    parts: IndexArray

    @property
    def vertex_count(self) -> int:
        """Vertices of the left half."""
        return len(self.parts)

    def points(self, macro: Macro) -> FloatArray:
        """Returns the points (P,3) of the left half, m."""
        corner = corner_weights(macro)
        used = np.nonzero(corner)
        factor = STEP * corner[used]
        return np.asarray(
            self.mean
            + np.tensordot(factor, self.base[used], 1)
            + (macro.height - 0.5) * np.tensordot(factor, self.height[used], 1)
            + (macro.proportions - 0.5) * np.tensordot(factor, self.proportions[used], 1)
        )

    def whole(self, points: FloatArray) -> tuple[FloatArray, dict[str, FloatArray]]:
        """Returns vertices (2n-m,3) and joints (3,) by name of both halves."""
        n, middle = self.vertex_count, len(MIDDLE_JOINTS)
        vertices = np.vstack([points[:n], points[self.middle : n] * _MIRROR])
        of_side = points[n + middle :]
        joints = np.vstack([points[n : n + middle], of_side, of_side * _MIRROR])
        return vertices, dict(zip(ALL_JOINTS, joints, strict=True))

    def other_half(self) -> IndexArray:
        """Returns (n,) the index of each vertex's mirror image among all vertices."""
        n = self.vertex_count
        return np.concatenate([np.arange(self.middle), np.arange(n, 2 * n - self.middle)])


def write_body(path: Path, body: BodyFile) -> None:
    """Writes a body; the same body gives the same bytes."""
    buffer = BytesIO()
    np.savez_compressed(
        buffer,
        allow_pickle=False,
        middle=np.int64(body.middle),
        mean=body.mean.astype(np.float32),
        **{name: np.ascontiguousarray(np.moveaxis(getattr(body, name), -1, 0)) for name in _SHAPES},
        faces=body.faces.astype(np.uint16),
        weights=body.weights.astype(np.float32),
        parts=body.parts.astype(np.uint8),
    )
    write_bytes(path, buffer.getvalue())


@lru_cache
def read_body(path: Path = SHIPPED) -> BodyFile:
    """Returns the body in a file, or that of the package.

    Raises:
        UserError: the file is absent, or is not written by `drake-dress dataset body`.
    """
    expected = "expected a file that drake-dress dataset body wrote"
    if not path.is_file():
        raise UserError(str(path), "", f"no such file, {expected}")
    try:
        with np.load(path, allow_pickle=False) as arrays:
            shapes = {name: np.moveaxis(arrays[name], 0, -1) for name in _SHAPES}
            weights = arrays["weights"].astype(np.float64)
            body = BodyFile(
                middle=int(arrays["middle"]),
                mean=arrays["mean"].astype(np.float64),
                **shapes,
                faces=arrays["faces"].astype(np.int64),
                # sums are 1 up to the file's rounding
                weights=weights / weights.sum(axis=1, keepdims=True),
                parts=arrays["parts"].astype(np.int64),
            )
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile) as error:
        raise UserError(str(path), "", f"cannot be read, {expected}") from error
    points = (body.vertex_count + len(MIDDLE_JOINTS) + len(JOINTS), 3)
    shapes_fit = all(array.shape == (*_CORNERS, *points) for array in shapes.values())
    if body.mean.shape != points or not shapes_fit:
        raise UserError(str(path), "base", f"has the shape {list(body.base.shape)}, {expected}")
    return body
