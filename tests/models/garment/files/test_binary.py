"""PLY and STL: every way of writing them reads to the same mesh, and damage is told."""

import struct
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drake_dress.errors import UserError
from drake_dress.models.garment.coat import COATS, make_coat
from drake_dress.models.garment.files import RawMesh
from drake_dress.models.garment.files import ply as ply_file
from drake_dress.models.garment.files import stl as stl_file

JACKET = make_coat(COATS["jacket"], 0.06)
X = JACKET.rest_position.astype(np.float32).astype(np.float64)
FACES = JACKET.faces


def read_ply(data: bytes, source: str, most_faces: int = 10**6) -> RawMesh:
    return ply_file.read_ply(data, source, most_faces)


def read_stl(data: bytes, source: str, most_faces: int = 10**6) -> RawMesh:
    return stl_file.read_stl(data, source, most_faces)


def refused(reader: Callable[[bytes, str], RawMesh], data: bytes, reason: str) -> None:
    with pytest.raises(UserError, match=reason) as caught:
        reader(data, "coat")
    assert "\n" not in str(caught.value)


def ply(
    form: str, *, quads: bool = False, vertices: int | None = None, faces: int | None = None
) -> bytes:
    """A PLY of the jacket; with quads, the first two faces as one with a repeated corner."""
    v, f = (len(X) if vertices is None else vertices), (len(FACES) if faces is None else faces)
    header = (
        f"ply\nformat {form} 1.0\ncomment c\nelement vertex {v}\nproperty double x\n"
        f"property double y\nproperty double z\nproperty uchar red\nelement face {f}\n"
        "property list uchar int vertex_indices\nend_header\n"
    ).encode()
    rows = [tuple(face) for face in FACES.tolist()]
    if quads:
        rows[0] = (*rows[0][:3], rows[0][0])
    if form == "ascii":
        body = "".join(f"{a!r} {b!r} {c!r} 7\n" for a, b, c in X.tolist())
        body += "".join(f"{len(r)} {' '.join(map(str, r))}\n" for r in rows)
        return header + body.encode()
    end = "<" if form == "binary_little_endian" else ">"
    return (
        header
        + b"".join(struct.pack(f"{end}dddB", *p, 7) for p in X.tolist())
        + b"".join(struct.pack(f"{end}B{len(r)}i", len(r), *r) for r in rows)
    )


def stl(name: bytes = b"made by hand") -> bytes:
    record = b"".join(struct.pack("<12fH", 0, 0, 1, *X[face].ravel(), 0) for face in FACES.tolist())
    return name.ljust(80, b" ") + struct.pack("<I", len(FACES)) + record


def text_stl() -> str:
    rows = ["solid jacket"]
    for face in FACES.tolist():
        rows += ["  facet normal 0 0 1", "    outer loop"]
        rows += [f"      vertex {a!r} {b!r} {c!r}" for a, b, c in X[face].tolist()]
        rows += ["    endloop", "  endfacet"]
    return "\n".join([*rows, "endsolid jacket", ""])


FORMS = ("ascii", "binary_little_endian", "binary_big_endian")


@pytest.mark.parametrize("form", FORMS)
def test_every_ply_reads_to_the_same_mesh(form: str) -> None:
    for end in (b"\n", b"\r\n") if form == "ascii" else (b"\n",):
        mesh = read_ply(ply(form).replace(b"\n", end) if form == "ascii" else ply(form), "coat")
        assert np.array_equal(mesh.position, X)
        assert np.array_equal(mesh.faces, FACES)
    assert len(read_ply(ply(form, quads=True), "coat").faces) == len(FACES) + 1


@pytest.mark.parametrize("form", FORMS)
def test_a_ply_that_counts_wrong_is_refused(form: str) -> None:
    whole = ply(form)
    refused(read_ply, whole[:-200], "element face: the header counts")
    refused(read_ply, whole + b"3 0 1 2\n", "more than its header counts")
    refused(read_ply, ply(form, faces=len(FACES) - 5), "more than its header counts")
    refused(read_ply, ply(form, faces=10**11), "more than the file holds")
    refused(read_ply, ply(form, vertices=len(X) - 5), "coat")
    refused(read_ply, whole[:60], "no PLY header")
    refused(read_ply, whole.replace(b"vertex_indices", b"neighbours"), "lacks a list")
    refused(read_ply, whole.replace(b"double z", b"double w"), "lacks x, y, z")


@pytest.mark.parametrize(
    "data",
    [
        stl(),
        stl(b"solid of a binary file"),
        text_stl().encode(),
        text_stl().upper().encode(),
        text_stl().replace("\n", "\r\n").encode("utf-8-sig"),
        text_stl().replace(".", ",").encode("utf-16"),
    ],
)
def test_every_stl_reads_to_the_same_triangles(data: bytes) -> None:
    mesh = read_stl(data, "coat")
    assert np.array_equal(mesh.position[mesh.faces], X[FACES])


def test_a_damaged_stl_is_refused() -> None:
    refused(read_stl, stl()[:-30], "header counts 720 triangles and the file holds 719.4")
    refused(read_stl, stl() + b"\0" * 7, "header counts 720 triangles and the file holds 720.1")
    refused(read_stl, b"solid", "ends within a solid")
    refused(read_stl, b"nonsense", "too few")
    text = text_stl()
    refused(read_stl, text[: len(text) // 2].encode(), "line|ends within a solid")
    refused(read_stl, text.replace("vertex 0", "vertex nan", 1).encode(), "line .* 'nan")
    lines = text.split("\n")
    refused(read_stl, "\n".join(lines[:3] + lines[4:]).encode(), "line 7: a triangle with 2")


def test_too_many_triangles_are_refused_before_they_are_read() -> None:
    for reader, data in (
        (ply_file.read_ply, ply("ascii")),
        (ply_file.read_ply, ply("binary_little_endian")),
        (stl_file.read_stl, text_stl().encode()),
    ):
        with pytest.raises(UserError, match="over 700 faces"):
            reader(data, "coat", 700)


@settings(max_examples=60)
@given(st.data())
def test_damaged_bytes_are_refused_or_read(data: st.DataObject) -> None:
    reader, whole = data.draw(
        st.sampled_from(
            [(read_ply, ply(form)) for form in FORMS]
            + [(read_stl, stl()), (read_stl, text_stl().encode())]
        )
    )
    damaged = bytearray(whole)
    for _ in range(data.draw(st.integers(1, 4))):
        at = data.draw(st.integers(0, len(damaged) - 1) | st.integers(0, 250))
        damaged[at] = data.draw(st.integers(0, 255))
    try:
        mesh = reader(bytes(damaged), "coat")
    except UserError as error:
        assert str(error).startswith("coat: ")
    else:
        assert mesh.faces.min(initial=0) >= 0
        assert mesh.faces.max(initial=-1) < len(mesh.position)
