"""A mesh as read from a file, with the file's own numbers of nodes and lines."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from drake_dress.errors import UserError
from drake_dress.models.arrays import BoolArray, FloatArray, IndexArray

MaskArray = BoolArray


def too_many(source: str, most: int) -> UserError:
    """Returns the error for a file with too many faces."""
    return UserError(source, "faces", f"has over {most:,} faces, expected fewer: thin it first")


def place(point: FloatArray) -> str:
    """Returns a point, m, formatted for messages; empty if it is not finite."""
    if not np.isfinite(point).all():
        return ""
    near = np.abs(point) < 1000.0
    words = [f"{x:.2f}" if small else f"{x:.3g}" for x, small in zip(point, near, strict=True)]
    return f" at ({', '.join(words).replace('-0.00', '0.00')}) m"


@dataclass(frozen=True)
class RawMesh:
    """Triangles of a file, and where each node and face comes from.

    Nodes may be merged and left out; `file_node` and `became` map to and from the file's nodes.

    Attributes:
        source: the file, for messages.
        position: (n,3), in the unit of the file until `scaled`.
        faces: (F,3) indices into `position`.
        face_part: (F,) index into `part_names`.
        part_names: names of the object and groups that each part of the file belongs to.
        file_node: (n,) the file's node that each node comes from, counted from 0.
        became: (m,) the node that each node of the file was merged into, -1 for none.
        node_line: (m,) line of each node of the file, counted from 1; None in binary files.
        face_line: (F,) line of each face; None in binary files.
        uv: (F,3,2) texture coordinates of each corner, NaN where the file gives none; None if it
            gives none at all.
    """

    source: str
    position: FloatArray
    faces: IndexArray
    face_part: IndexArray
    part_names: tuple[tuple[str, ...], ...]
    file_node: IndexArray
    became: IndexArray
    node_line: IndexArray | None = None
    face_line: IndexArray | None = None
    uv: FloatArray | None = None

    @staticmethod
    def of(
        source: str,
        position: FloatArray,
        faces: IndexArray,
        *,
        face_part: IndexArray | None = None,
        part_names: tuple[tuple[str, ...], ...] = ((),),
        node_line: IndexArray | None = None,
        face_line: IndexArray | None = None,
        uv: FloatArray | None = None,
    ) -> RawMesh:
        """Returns a mesh whose nodes are those of the file."""
        every = np.arange(len(position))
        if face_part is None:
            face_part = np.zeros(len(faces), dtype=np.int64)
        if uv is not None and not np.isfinite(uv).any():
            uv = None
        return RawMesh(
            source, position, faces, face_part, part_names, every, every, node_line, face_line, uv
        )

    def scaled(self, factor: float) -> RawMesh:
        """Returns the mesh with all coordinates multiplied."""
        return replace(self, position=self.position * factor)

    def only(self, keep: MaskArray) -> RawMesh:
        """Returns the mesh with only the faces marked in `keep`, (F,), and the nodes they use."""
        faces = self.faces[keep]
        used = np.unique(faces)
        new = np.full(len(self.position), -1, dtype=np.int64)
        new[used] = np.arange(len(used))
        return replace(
            self,
            position=self.position[used],
            faces=new[faces],
            face_part=self.face_part[keep],
            face_line=None if self.face_line is None else self.face_line[keep],
            uv=None if self.uv is None else self.uv[keep],
            file_node=self.file_node[used],
            became=np.where(self.became < 0, -1, new[self.became]),
        )

    def joined(self, root: IndexArray) -> RawMesh:
        """Returns the mesh with each node replaced by node `root[node]`.

        Collapsed faces and unused nodes are dropped. A merged node is at the place of its root.

        Raises:
            UserError: no face is left.
        """
        faces = root[self.faces]
        became = np.where(self.became < 0, -1, root[self.became])
        flat = (faces == np.roll(faces, 1, axis=1)).any(axis=1)
        if flat.all():
            raise UserError(
                self.source,
                "faces",
                f"all {len(faces)} have corners at the same place, expected a surface",
            )
        return replace(self, faces=faces, became=became).only(~flat)

    def node(self, i: int | np.integer) -> str:
        """Returns a node's name in the file and its place: `node 12 (line 13) at (0, 0, 1) m`.

        The mesh must be in m, or its coordinates not finite.
        """
        number = int(self.file_node[i])
        line = "" if self.node_line is None else f" (line {self.node_line[number]})"
        return f"node {number}{line}{place(self.position[i])}"

    def face(self, i: int | np.integer) -> str:
        """Returns a face's name: its line in the file, or else its number."""
        return f"face {int(i)}" if self.face_line is None else f"line {self.face_line[i]}"
