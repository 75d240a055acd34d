import codecs

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drake_dress.errors import UserError
from drake_dress.models.garment.coat import COATS, make_coat
from drake_dress.models.garment.files import RawMesh
from drake_dress.models.garment.files.obj import read_obj
from tests.present import present

JACKET = make_coat(COATS["jacket"], 0.06)
X = np.round(JACKET.rest_position, 6)
FACES = JACKET.faces
ENCODINGS = {
    "utf-8": b"",
    "utf-8-sig": b"",
    "utf-16": b"",
    "utf-16-le": codecs.BOM_UTF16_LE,
    "utf-16-be": codecs.BOM_UTF16_BE,
    "latin-1": b"",
}


def read(text: str | bytes, encoding: str = "utf-8") -> RawMesh:
    data = text if isinstance(text, bytes) else text.encode(encoding)
    return read_obj(data, "coat.obj", 10**6)


def refusal(text: str) -> str:
    with pytest.raises(UserError) as caught:
        read(text)
    assert str(caught.value).startswith("coat.obj: ")
    assert "\n" not in str(caught.value)
    return str(caught.value)


@st.composite
def dialects(draw: st.DrawFn) -> bytes:
    """An OBJ of the jacket, as some program writes it: bytes."""
    blocks = draw(st.integers(1, 4))
    relative = draw(st.booleans())
    gap = draw(st.sampled_from([" ", "  ", "\t", " \t "]))
    indent = draw(st.sampled_from(["", "  ", "\t"]))
    comment = draw(st.sampled_from(["", " # node", "# ärmel", "\t#"]))
    further = draw(st.sampled_from(["", " 1.0", " 0.5 0.5 0.5", " 1 0.1 0.2 0.3"]))
    corner = draw(st.sampled_from(["{0}", "{0}/{0}", "{0}//{0}", "{0}/{0}/{0}", "{0}/"]))
    form = draw(st.sampled_from(["{:.6f}", "{:.12e}", "{:+.6f}", "comma"]))
    continued = draw(st.booleans())
    normals = draw(st.booleans())
    extra = draw(st.sampled_from(["", "l 1 2 3", "p 1", "s off", "usemtl St\u00f6ff", "mg 0"]))
    keyword = draw(st.sampled_from(["f", "F", "fo"]))
    end = draw(st.sampled_from(["\n", "\r\n", "\r"]))
    encoding = draw(st.sampled_from(sorted(ENCODINGS)))

    def number(value: float) -> str:
        text = f"{value:.6f}" if form == "comma" else form.format(value)
        return text.replace(".", ",") if form == "comma" else text

    if form == "comma":
        further = further.replace(".", ",")
    # the blocks are consecutive faces, each after the nodes that it is the first to name
    lines = ["# Garment \u00e4 C:\\patterns\\", "mtllib missing folder\\coat.mtl\\", ""]
    written = 0
    for block, faces in enumerate(np.array_split(FACES, blocks)):
        lines.append(f"{'og'[block % 2]} \u00c4rmel {block}")
        need = len(X) if block == blocks - 1 else max(written, int(faces.max()) + 1)
        for p in X[written:need]:
            a, b, c = (number(v) for v in p)
            if continued:
                lines += [f"{indent}v{gap}{a} \\", f"  {b}{gap}{c}{further}{comment}"]
            else:
                lines.append(f"{indent}v{gap}{a}{gap}{b}{gap}{c}{further}{comment}")
            if normals:
                lines += [f"vn{gap}0 0 1", "vt 0.5 0.5"]
        written = max(written, need)
        lines.append(extra)
        for face in faces:
            index = [int(i) - written if relative else int(i) + 1 for i in face]
            lines.append(
                f"{indent}{keyword}{gap}{gap.join(corner.format(i) for i in index)}{comment}"
            )
    text = end.join(lines) + draw(st.sampled_from(["", end, end + end]))
    return ENCODINGS[encoding] + text.encode(encoding)


@settings(max_examples=40)
@given(dialects())
def test_every_dialect_reads_to_the_same_mesh(data: bytes) -> None:
    mesh = read(data)
    assert np.array_equal(mesh.position, X)
    assert np.array_equal(mesh.faces, FACES)
    assert len(present(mesh.node_line)) == len(X)
    assert len(present(mesh.face_line)) == len(FACES)


TRIANGLE = "v 0 0 0\nv 1 0 0\nv 0 1 0\n"


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        (TRIANGLE + "f 0 1 2\n", "line 4: names node 0, but OBJ counts nodes from 1 (does"),
        (TRIANGLE + "f 0 2 3\n", "line 4: names node 0, but OBJ counts nodes from 1"),
        (TRIANGLE + "f 1 2 9\n", "line 4: names node 9, but the file has 3"),
        (TRIANGLE + "f 1 2 -4\n", "line 4: names node -4, but only 3 nodes stand before"),
        (TRIANGLE + "f 1 2\n", "line 4: a face with 2 corners"),
        (TRIANGLE + "f 1 2 x\n", "line 4: 'x' is no corner"),
        (TRIANGLE + "f 1 2 3.5\n", "line 4: '3.5' is no corner"),
        (TRIANGLE + "f 1 2 " + "9" * 5000 + "\n", "line 4: '999"),
        (TRIANGLE + "fx 1 2 3\n", "line 4: 'fx' is no statement"),
        (TRIANGLE + "surf 0 1 0 1 1 2\n", "line 4: 'surf' is a curved surface"),
        ("v 0 0\n", "line 1: a node of 2 numbers"),
        ("v 0 0 nan\n", "line 1: 'nan' is NaN or infinity"),
        ("v 0 0 -inf\n", "line 1: '-inf' is NaN or infinity"),
        ("v 0 0 1e999\n", "line 1: 1e999 is infinite"),
        ("v 0 0 1_0\n", "line 1: '1_0' is not a number"),
        ("v 0 0 1,234.5\n", "line 1: '1,234.5' is not a number"),
        ("v 0 0 1.5\nv 0 0 1,5\n", "line 2: decimal points and decimal commas are mixed"),
        ("v 0 0 0 0.5\n", "line 1: the node has weight 0.5"),
        ("v 0 0 0\0\n", "is not text"),
    ],
)
def test_what_cannot_be_read_is_named_with_its_line(text: str, reason: str) -> None:
    assert reason in refusal(text)


def test_objects_and_groups_keep_their_names() -> None:
    text = (
        "o Left Sleeve\n" + TRIANGLE + "f 1 2 3\ng Panel A#1\nf 1 3 2\no B # a comment\nf 2 3 1\n"
    )
    mesh = read(text)
    names = [mesh.part_names[k] for k in mesh.face_part]
    assert names[0] == ("Left Sleeve",)
    assert {"Left Sleeve", "Panel", "A#1", "Panel A#1"} == set(names[1])
    assert names[2][0] == "B"
