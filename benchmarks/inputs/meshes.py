"""Random mutations of garment files: OBJ, PLY and STL."""

from __future__ import annotations

import struct
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

import numpy as np
import numpy.typing as npt

from benchmarks.inputs.damage import KINDS, damage
from benchmarks.inputs.trials import Expect, Trial, place
from drake_dress.models.arrays import FloatArray, IndexArray
from drake_dress.models.garment.coat import COATS, make_coat
from drake_dress.models.garment.load import load_garment

Rng = np.random.Generator
_SPACING = 0.05  # of the mutated jacket, m; coarse, to load quickly
# Permitted differences of an accepted garment from the jacket: relative change of its area, and
# factor on its longest edge.
_AREA, _LONGEST = 0.1, 2.5


@dataclass(frozen=True)
class _Sheet:
    """A mesh: positions (n,3), faces (F,3), and whether it still is the jacket."""

    x: FloatArray
    faces: IndexArray
    same: bool = False


def draw_mesh(rng: Rng) -> Trial:
    """Returns a mutation of a valid garment file."""
    suffix = _pick(rng, ("obj", "obj", "ply", "stl"))
    binary = suffix != "obj" and bool(rng.integers(2))
    jacket = _jacket()
    how = _pick(rng, ("geometry", "bytes", "dialect" if suffix == "obj" else "geometry"))
    unit = "m"
    if how == "geometry":
        mutate = _pick(rng, _GEOMETRY)
        told, sheet, expect, unit = mutate(rng, jacket)
        told = f"{mutate.__name__[1:]} {told}"
        data = _written(sheet, suffix, binary)
    elif how == "dialect":
        told, data, expect = _dialect(rng, jacket)
        sheet = replace(jacket, same=True)
    else:
        told, data = _damaged(rng, _written(jacket, suffix, binary))
        sheet, expect = jacket, Expect.EITHER
    path = place() / f"garment.{suffix}"
    path.write_bytes(data)

    def use() -> str | None:
        mesh = load_garment(path, unit=unit)
        return _unlike_jacket(mesh.rest_position, mesh.faces, sheet.same)

    return Trial(f"{suffix}{' binary' * binary} {told}", expect, use)


@cache
def _jacket() -> _Sheet:
    mesh = make_coat(COATS["jacket"], _SPACING)
    return _Sheet(mesh.rest_position.round(6), mesh.faces.astype(np.int64))


def _area(x: FloatArray, faces: npt.NDArray[np.integer]) -> float:
    a, b, c = (x[faces[:, k]] for k in range(3))
    return float(0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1).sum())


def _longest(x: FloatArray, faces: npt.NDArray[np.integer]) -> float:
    return float(
        max(np.linalg.norm(x[faces[:, k]] - x[faces[:, k - 1]], axis=1).max() for k in range(3))
    )


def _unlike_jacket(x: FloatArray, faces: npt.NDArray[np.integer], same: bool) -> str | None:
    """Returns how an accepted garment differs from the mutated jacket; None if it does not."""
    jacket = _jacket()
    if not np.isfinite(x).all():
        return "positions that are not finite"
    share = _area(x, faces) / _area(jacket.x, jacket.faces)
    longest = _longest(x, faces) / _longest(jacket.x, jacket.faces)
    if same and (x.shape != jacket.x.shape or abs(share - 1.0) > 1e-3 or abs(longest - 1.0) > 1e-3):
        return f"{len(x)} nodes, area x {share:.4f}, longest edge x {longest:.4f}"
    if abs(share - 1.0) > _AREA:
        return f"area x {share:.3f}"
    return f"longest edge x {longest:.2f}" if longest > _LONGEST else None


_Mutated = tuple[str, _Sheet, Expect, str]


def _wrong_unit(rng: Rng, s: _Sheet) -> _Mutated:
    factor, unit = _pick(
        rng, ((1000.0, "m"), (100.0, "m"), (0.01, "m"), (1.0, "mm"), (1.0, "cm"), (10.0, "m"))
    )
    return f"x {factor:g} in {unit}", _Sheet(s.x * factor, s.faces), Expect.REFUSE, unit


def _right_unit(rng: Rng, s: _Sheet) -> _Mutated:
    factor, unit = _pick(rng, ((1000.0, "mm"), (100.0, "cm"), (1.0, "m")))
    return unit, _Sheet(s.x * factor, s.faces, True), Expect.ACCEPT, unit


def _not_finite(rng: Rng, s: _Sheet) -> _Mutated:
    x, value = s.x.copy(), _pick(rng, (np.nan, np.inf, -np.inf))
    x[rng.integers(len(x)), rng.integers(3)] = value
    return str(value), _Sheet(x, s.faces), Expect.REFUSE, "m"


def _spike(rng: Rng, s: _Sheet) -> _Mutated:
    x = s.x.copy()
    size = float(_pick(rng, (0.4, 0.8, 2.0, 50.0, 1e12)))
    x[rng.integers(len(x))] += size * np.eye(3)[rng.integers(3)]
    return f"{size:g} m", _Sheet(x, s.faces), Expect.REFUSE, "m"


def _shifted(rng: Rng, s: _Sheet) -> _Mutated:
    by = int(_pick(rng, (-1, 1, 3)))
    faces = (s.faces + by) % len(s.x)
    return f"faces by {by}", _Sheet(s.x, faces), Expect.REFUSE, "m"


def _shuffled(rng: Rng, s: _Sheet) -> _Mutated:
    return "nodes", _Sheet(rng.permutation(s.x), s.faces), Expect.REFUSE, "m"


def _renumbered(rng: Rng, s: _Sheet) -> _Mutated:
    order = rng.permutation(len(s.x))
    faces = rng.permutation(np.argsort(order)[s.faces])
    return "sound", _Sheet(s.x[order], faces, True), Expect.ACCEPT, "m"


def _loose_part(rng: Rng, s: _Sheet) -> _Mutated:
    size, at = float(rng.uniform(0.005, 0.1)), s.x[rng.integers(len(s.x))] + [0.0, 0.0, 0.02]
    square = at + size * np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0.0]])
    faces = np.vstack([s.faces, len(s.x) + np.array([[0, 1, 2], [0, 2, 3]])])
    return f"{size:.3f} m", _Sheet(np.vstack([s.x, square]), faces), Expect.REFUSE, "m"


def _two_coats(rng: Rng, s: _Sheet) -> _Mutated:
    x = np.vstack([s.x, s.x + [0.0, 0.0, float(rng.uniform(0.001, 1.0))]])
    return "", _Sheet(x, np.vstack([s.faces, s.faces + len(s.x)])), Expect.REFUSE, "m"


def _fin(rng: Rng, s: _Sheet) -> _Mutated:
    face = s.faces[rng.integers(len(s.faces))]
    x = np.vstack([s.x, s.x[face].mean(axis=0) + [0.0, 0.0, 0.03]])
    faces = np.vstack([s.faces, [face[0], face[1], len(s.x)]])
    # on a boundary edge it only adds a triangle
    return "", _Sheet(x, faces), Expect.EITHER, "m"


def _twice(rng: Rng, s: _Sheet) -> _Mutated:
    again = s.faces[rng.choice(len(s.faces), int(rng.integers(1, 20)))]
    return f"{len(again)} faces", _Sheet(s.x, np.vstack([s.faces, again])), Expect.EITHER, "m"


def _turned(rng: Rng, s: _Sheet) -> _Mutated:
    faces, some = s.faces.copy(), rng.choice(len(s.faces), int(rng.integers(1, 20)))
    faces[some] = faces[some][:, ::-1]
    return f"{len(some)} faces", _Sheet(s.x, faces), Expect.EITHER, "m"


def _holes(rng: Rng, s: _Sheet) -> _Mutated:
    gone = rng.choice(len(s.faces), int(rng.integers(1, len(s.faces))), replace=False)
    return f"{len(gone)} faces", _Sheet(s.x, np.delete(s.faces, gone, axis=0)), Expect.EITHER, "m"


def _empty(rng: Rng, s: _Sheet) -> _Mutated:
    faces = s.faces[: int(rng.integers(0, 2))]
    return f"{len(faces)} faces", _Sheet(s.x, faces), Expect.REFUSE, "m"


def _flat(rng: Rng, s: _Sheet) -> _Mutated:
    x, k = s.x.copy(), int(rng.integers(3))
    x[:, k] = 0.0
    return f"axis {k}", _Sheet(x, s.faces), Expect.REFUSE, "m"


def _point(rng: Rng, s: _Sheet) -> _Mutated:
    return "", _Sheet(0.0 * s.x + 1.0, s.faces), Expect.REFUSE, "m"


def _without_area(rng: Rng, s: _Sheet) -> _Mutated:
    faces = s.faces.copy()
    k = int(rng.integers(len(faces)))
    faces[k, 1] = faces[k, 0]
    return "one face", _Sheet(s.x, faces), Expect.EITHER, "m"


_GEOMETRY: tuple[Callable[[Rng, _Sheet], _Mutated], ...] = (
    _wrong_unit,
    _right_unit,
    _not_finite,
    _spike,
    _shifted,
    _shuffled,
    _renumbered,
    _loose_part,
    _two_coats,
    _fin,
    _twice,
    _turned,
    _holes,
    _empty,
    _flat,
    _point,
    _without_area,
)


def _pick(rng: Rng, items: Sequence[Any]) -> Any:
    return items[int(rng.integers(len(items)))]


def _written(s: _Sheet, suffix: str, binary: bool) -> bytes:
    return {"obj": _obj, "ply": _ply, "stl": _stl}[suffix](s, binary)


def _obj(s: _Sheet, _: bool) -> bytes:
    lines = [f"v {a:.6f} {b:.6f} {c:.6f}" for a, b, c in s.x]
    lines += [f"f {a} {b} {c}" for a, b, c in s.faces + 1]
    return "\n".join([*lines, ""]).encode()


def _ply(s: _Sheet, binary: bool) -> bytes:
    kind = "binary_little_endian" if binary else "ascii"
    head = (
        f"ply\nformat {kind} 1.0\nelement vertex {len(s.x)}\nproperty double x\nproperty double y\n"
        f"property double z\nelement face {len(s.faces)}\nproperty list uchar int vertex_indices\n"
        "end_header\n"
    )
    if binary:
        body = s.x.astype("<f8").tobytes()
        body += b"".join(struct.pack("<B3i", 3, *map(int, f)) for f in s.faces)
        return head.encode() + body
    rows = [f"{a:.6f} {b:.6f} {c:.6f}" for a, b, c in s.x]
    return "\n".join(
        [head + "\n".join(rows), *(f"3 {a} {b} {c}" for a, b, c in s.faces), ""]
    ).encode()


def _stl(s: _Sheet, binary: bool) -> bytes:
    corners = s.x[s.faces].astype(np.float32)
    if binary:
        body = b"".join(
            np.concatenate([np.zeros(3), c.ravel()]).astype("<f4").tobytes() + b"\0\0"
            for c in corners
        )
        return b"solid jacket".ljust(80, b" ") + struct.pack("<I", len(corners)) + body
    lines = ["solid jacket"]
    for c in corners:
        lines += ["facet normal 0 0 0", "outer loop"]
        lines += [f"vertex {a:.7g} {b:.7g} {d:.7g}" for a, b, d in c]
        lines += ["endloop", "endfacet"]
    return "\n".join([*lines, "endsolid jacket", ""]).encode()


def _dialect(rng: Rng, s: _Sheet) -> tuple[str, bytes, Expect]:
    """Returns the jacket as valid OBJ that combines several styles of notation."""
    habits = {
        name
        for name in (
            "bom",
            "crlf",
            "tabs",
            "indent",
            "comments",
            "negative",
            "slashes",
            "groups",
            "colours",
            "exponents",
            "continued",
            "blank",
            "w",
            "library",
        )
        if rng.random() < 0.3
    }
    n = len(s.x)
    number = "{:.9e}" if "exponents" in habits else "{:.6f}"
    lines = ["mtllib missing.mtl"] if "library" in habits else []
    tail = ""
    if "colours" in habits:
        tail = " 0.5 0.5 0.5"
    elif "w" in habits:
        tail = " 1.0"
    lines += ["v " + " ".join(number.format(c) for c in p) + tail for p in s.x]
    if "slashes" in habits:
        lines += ["vt 0.5 0.5", "vn 0 0 1"]
    for k, face in enumerate(s.faces):
        if "groups" in habits and k % 50 == 0:
            lines += [f"g panel{k} front", f"usemtl cloth{k}", "s off"]
        index = [int(i) - n if "negative" in habits else int(i) + 1 for i in face]
        more = ("/-1/-1" if "negative" in habits else "/1/1") if "slashes" in habits else ""
        words = [f"{i}{more}" for i in index]
        joint = " \\\n  " if "continued" in habits and k % 7 == 0 else " "
        lines.append("f " + joint.join(words))
    text = ("\r\n" if "crlf" in habits else "\n").join([*_laid_out(lines, habits), ""])
    if "crlf" in habits:
        text = text.replace("\\\n", "\\\r\n")
    data = text.encode()
    if "bom" in habits:
        data = b"\xef\xbb\xbf" + data
    return "+".join(sorted(habits)) or "plain", data, Expect.ACCEPT


def _laid_out(lines: list[str], habits: set[str]) -> list[str]:
    """Returns the same statements with other white space, comments and empty lines."""
    if "tabs" in habits:
        lines = [line.replace(" ", "\t") if "\\" not in line else line for line in lines]
    if "indent" in habits:
        lines = ["   " + line for line in lines]
    if "comments" in habits:
        lines = [
            line if "\\" in line or k % 3 else f"{line} # note {k}" for k, line in enumerate(lines)
        ]
    if "blank" in habits:
        lines = [x for k, line in enumerate(lines) for x in ([line, ""] if k % 11 == 0 else [line])]
    return lines


def _damaged(rng: Rng, sound: bytes) -> tuple[str, bytes]:
    how = _pick(rng, (*KINDS, "lines"))
    data = damage(rng, bytearray(sound), how, most=20, zeroed=4)
    return how, bytes(_other_lines(rng, data) if how == "lines" else data)


def _other_lines(rng: Rng, data: bytearray) -> bytearray:
    """Returns the file with some lines deleted and others copied to new positions."""
    lines = data.split(b"\n")
    for _ in range(int(rng.integers(1, 10))):
        k = int(rng.integers(len(lines)))
        if rng.random() < 0.5:
            del lines[k]
        else:
            lines.insert(k, lines[int(rng.integers(len(lines)))])
    return bytearray(b"\n".join(lines))
