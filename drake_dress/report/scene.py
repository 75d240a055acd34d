"""The garment, grippers, targets and stages of a dressing, drawn in Meshcat."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from pydrake.geometry import Box, Meshcat, Rgba, Sphere

from drake_dress.drawing import new_figure, pixels, plain_settings
from drake_dress.models.arrays import FloatArray, IntArray
from drake_dress.models.sides import SIDES
from drake_dress.report.log_schema import STAGE_NAMES

OUTSIDE = Rgba(0.22, 0.44, 0.70, 1.0)
LINING = Rgba(0.87, 0.62, 0.28, 1.0)
# Around the body that the garment touches, which stays visible in it.
_SKIN = Rgba(0.87, 0.70, 0.58, 0.45)
_GRIPPER = Rgba(0.2, 0.2, 0.22, 1.0)
_TARGET = {"left": Rgba(0.05, 0.65, 0.45, 1.0), "right": Rgba(0.85, 0.25, 0.2, 1.0)}
# Joints whose forecast is shown: elbow and hand of the left, then of the right arm.
_FORESEEN = {"left": (1, 2), "right": (4, 5)}
_TEXT = Rgba(0.1, 0.12, 0.15, 1.0)
_TEXT_HEIGHT = 0.07  # m
_TEXT_ABOVE = 0.5  # m above the garment, clear of a head


def show_skin(meshcat: Meshcat, path: str, vertices: FloatArray, faces: IntArray) -> None:
    """Draws a person's skin, translucent.

    Args:
        meshcat: Meshcat instance to draw in.
        path: Path in Meshcat's tree.
        vertices: (n,3), m.
        faces: (F,3) triangles.
    """
    meshcat.SetTriangleMesh(path, np.asfortranarray(vertices.T), np.asfortranarray(faces.T), _SKIN)


class DressingScene:
    """Draws everything except the person in Meshcat, both live and in the replay.

    Args:
        meshcat: Meshcat instance to draw in.
        faces: (3,F) triangles, as Meshcat expects them.
        path: Path in Meshcat's tree under which everything is drawn.

    Attributes:
        label: Text that shows the stages.
    """

    def __init__(self, meshcat: Meshcat, faces: IntArray, path: str) -> None:
        self._meshcat = meshcat
        self._faces = faces
        self._path = path
        self._drawn: set[str] = set()
        self._label_at: FloatArray | None = None
        self.label = ""
        # import the text renderer and find its fonts now, not while arms move
        _text_mesh("left", _TEXT_HEIGHT)

    def show_garment(self, position: FloatArray) -> None:
        """Draws the garment from its nodes (n,3), m; outside and lining differ in colour."""
        vertices = np.asfortranarray(position.T)
        if self._label_at is None and np.isfinite(position).all():
            self._label_at = position.mean(axis=0)
            self._label_at[2] = position[:, 2].max() + _TEXT_ABOVE
        # Two one-sided meshes, not one double-sided mesh, so that inside and outside differ.
        for name, color, side in (
            ("outside", OUTSIDE, Meshcat.SideOfFaceToRender.kFrontSide),
            ("lining", LINING, Meshcat.SideOfFaceToRender.kBackSide),
        ):
            self._meshcat.SetTriangleMesh(
                f"{self._path}/garment/{name}", vertices, self._faces, color, side=side
            )

    def show_grippers(self, position: FloatArray) -> None:
        """Draws the grippers (2,3), m."""
        for side, p in zip(SIDES, position, strict=True):
            self._place(f"{self._path}/gripper/{side}", Box(0.05, 0.05, 0.05), _GRIPPER, p)

    def show_targets(self, position: FloatArray) -> None:
        """Draws the target positions (2,3) of the armholes, m; NaN hides one."""
        for side, p in zip(SIDES, position, strict=True):
            self._place(f"{self._path}/target/{side}", Sphere(0.015), _TARGET[side], p)

    def show_forecast(self, joints: FloatArray, radius: FloatArray) -> None:
        """Draws where elbows and hands are foreseen.

        Args:
            joints: (6,3) shoulder, elbow, hand of left, then right arm, m; NaN hides one.
            radius: (6,) of the balls that hold them, m.
        """
        for side, rows in _FORESEEN.items():
            color = _TARGET[side]
            pale = Rgba(color.r(), color.g(), color.b(), 0.2)
            for row in rows:
                name = f"{self._path}/forecast/{side}/{row % 3}"
                self._place(f"{name}/mean", Sphere(0.01), color, joints[row])
                self._place(f"{name}/region", Sphere(1.0), pale, joints[row], float(radius[row]))

    def show_stage(self, stage: npt.ArrayLike) -> None:
        """Writes the stages (2,) of left and right above the garment's first position."""
        last = len(STAGE_NAMES) - 1
        names = [STAGE_NAMES[int(np.clip(s, 0, last))] for s in np.ravel(np.asarray(stage))]
        label = f"left: {names[0]}   right: {names[1]}"
        if label == self.label or self._label_at is None:
            return
        self.label = label
        # Meshcat has no text, so its pixels are drawn: once readable from the front, once from
        # behind, each with the person's left on the side where the viewer sees it.
        written = f"right: {names[1]}   left: {names[0]}"
        for name, text, toward in (("front", written, 1.0), ("back", label, -1.0)):
            flat, triangles = _text_mesh(text, _TEXT_HEIGHT)
            vertices = np.zeros((3, flat.shape[1]), order="F")
            vertices[1], vertices[2] = toward * flat[0], flat[1]
            vertices += self._label_at[:, None]
            side = Meshcat.SideOfFaceToRender.kFrontSide
            path = f"{self._path}/stage/{name}"
            self._meshcat.SetTriangleMesh(path, vertices, triangles, _TEXT, side=side)

    def _place(
        self, path: str, shape: Box | Sphere, color: Rgba, p: FloatArray, size: float = 1.0
    ) -> None:
        visible = bool(np.isfinite(p).all())
        if path not in self._drawn:
            self._meshcat.SetObject(path, shape, color)
            self._drawn.add(path)
        self._meshcat.SetProperty(path, "visible", visible)
        if visible:
            scaled = np.diag([size, size, size, 1.0])
            scaled[:3, 3] = p
            self._meshcat.SetTransform(path, scaled)


@plain_settings()
def _text_mesh(text: str, height: float) -> tuple[FloatArray, IntArray]:
    """Returns centred points (2,k), m, and triangles (3,t) that cover the pixels of a text."""
    figure = new_figure(0.18 * len(text) + 0.4, 0.6, dpi=72)
    figure.text(0.5, 0.5, text, ha="center", va="center", fontsize=22, family="sans-serif")
    ink = pixels(figure)[:, :, 0] < 128
    edge = np.diff(ink.astype(np.int8), axis=1, prepend=0, append=0)
    row, start = np.nonzero(edge == 1)
    _, end = np.nonzero(edge == -1)
    top = ink.shape[0] - row
    x = np.stack([start, end, end, start], axis=1) - 0.5 * ink.shape[1]
    y = np.stack([top - 1, top - 1, top, top], axis=1) - 0.5 * ink.shape[0]
    points = np.stack([x.ravel(), y.ravel()]) * (height / 22.0)
    corner = 4 * np.arange(len(row), dtype=np.int32)
    triangles = np.concatenate([corner + np.array([[0], [1], [2]]), corner + [[0], [2], [3]]], 1)
    return points, np.asfortranarray(triangles, dtype=np.int32)
