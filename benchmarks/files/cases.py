"""The kinds of garment files, each with its keys and what has to become of it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.files import written
from benchmarks.files.garments import Made, drawn_cut, make, skirt, trousers
from benchmarks.files.surface import kept
from drake_dress.models.arrays import FloatArray, IntArray
from drake_dress.models.garment.axes import orientation
from drake_dress.models.garment.edges import boundary_loops

Rng = np.random.Generator


@dataclass(frozen=True)
class Trial:
    """A file and what has to become of it.

    Attributes:
        path: the file.
        keys: of `garment.mesh`, at most three.
        made: what has to be read; None if the file has to be refused.
        refusal: pattern of the message with which it has to be refused.
        note: pattern of a note that has to be told.
        judged: pattern of the reason with which a look has to say that it cannot go on.
    """

    path: Path
    keys: dict[str, Any] = field(default_factory=dict)
    made: Made | None = None
    refusal: str = ""
    note: str = ""
    judged: str = ""


def quads_in_decimetres(rng: Rng, folder: Path) -> Trial:
    """OBJ in decimetres, y up, with quads and nodes counted back from the last."""
    made = make(drawn_cut(rng))
    x = in_axes(made.x, "y") / 0.1
    path = written.obj(folder / "a.obj", [("Coat", x, made.faces)], quads=True, relative=True)
    return Trial(path, {"unit": "dm", "up": "y"}, made)


def one_of_two(rng: Rng, folder: Path) -> Trial:
    """A glTF with a blazer and a skirt, of which one is taken."""
    made = make(drawn_cut(rng))
    path = _suit(made, folder / "suit.glb")
    return Trial(path, {"up": "y", "take": ("Blazer",)}, made)


def two_at_once(rng: Rng, folder: Path) -> Trial:
    """The same without a key that takes one."""
    path = _suit(make(drawn_cut(rng)), folder / "suit.glb")
    return Trial(path, {"up": "y"}, refusal=r"separate parts.*(Blazer|Skirt).*garment\.mesh\.take")


def _suit(made: Made, path: Path) -> Path:
    blazer = ("Blazer", in_axes(made.x, "y"), made.faces)
    x, faces = skirt()
    return written.glb(path, [blazer, ("Skirt", in_axes(x, "y"), faces)])


def without_welding(rng: Rng, folder: Path) -> Trial:
    """Binary STL in millimetres, x up, each triangle with nodes of its own."""
    made = make(drawn_cut(rng))
    path = written.stl(folder / "scan.stl", 1000.0 * in_axes(made.x, "x"), made.faces)
    return Trial(path, {"unit": "mm", "up": "x"}, made)


def turned_about(rng: Rng, folder: Path) -> Trial:
    """PLY in inches, upside down and facing another way."""
    made = make(drawn_cut(rng))
    path = written.ply(folder / "scan.ply", in_axes(made.x, "-z", "-y") / 0.0254, made.faces)
    return Trial(path, {"unit": "in", "up": "-z", "facing": "-y"}, made)


def facing_untold(rng: Rng, folder: Path) -> Trial:
    """The same without the key for facing: the sleeves do not stand at left and right."""
    made = make(drawn_cut(rng))
    path = written.ply(folder / "scan.ply", in_axes(made.x, "-z", "-y") / 0.0254, made.faces)
    return Trial(path, {"unit": "in", "up": "-z"}, refusal=r"garment\.mesh\.facing: -?y")


def unit_untold(rng: Rng, folder: Path) -> Trial:
    """OBJ in feet, whose unit is to be found."""
    made = make(drawn_cut(rng))
    path = written.obj(folder / "a.obj", [("Coat", made.x / 0.3048, made.faces)])
    return Trial(path, {"unit": "auto"}, made, note=r"the unit is ft")


def double_walls(rng: Rng, folder: Path) -> Trial:
    """PLY whose cloth has a thickness of some millimetres."""
    made = make(drawn_cut(rng))
    x, faces = walled(made, rng.uniform(0.003, 0.008))
    return Trial(written.ply(folder / "thick.ply", x, faces), refusal=r"thickness|two layers")


def mixed_winding(rng: Rng, folder: Path) -> Trial:
    """OBJ of which a sleeve and a half of the body are wound the other way round."""
    made = make(drawn_cut(rng))
    faces, middle = made.faces.copy(), made.x[made.faces].mean(axis=1)
    some = (middle[:, 1] > rng.uniform(0.15, 0.4)) | (middle[:, 0] < 0.0)
    faces[some] = faces[some][:, ::-1]
    path = written.obj(folder / "a.obj", [("Coat", made.x, faces)])
    return Trial(path, {}, made, note=r"wound the other way round")


def hood(rng: Rng, folder: Path) -> Trial:
    """A hooded pullover, whose opening in front is as large as a cuff may be."""
    made = make(replace(drawn_cut(rng), is_open=False, hood=True))
    path = written.obj(folder / "hoodie.obj", [("Hoodie", 100.0 * made.x, made.faces)])
    return Trial(path, {"unit": "cm"}, made, judged=r"closed front")


def hood_and_one_closed_sleeve(rng: Rng, folder: Path) -> Trial:
    """The same with a closed left cuff, for which no other opening may be taken."""
    made = make(replace(drawn_cut(rng), is_open=False, hood=True))
    x, faces = closed_at(made, made.cuffs["left"])
    path = written.obj(folder / "hoodie.obj", [("Hoodie", x, faces)])
    return Trial(path, {}, refusal=r"one side only|unlike|left (sleeve|cuff)")


def of_trousers(rng: Rng, folder: Path) -> Trial:
    """Trousers, in centimetres."""
    x, faces = trousers()
    x = 100.0 * x * rng.uniform(0.95, 1.05)
    path = written.obj(folder / "trousers.obj", [("Pants", x, faces)])
    return Trial(path, {"unit": "cm"}, refusal=r"trousers")


def vest(rng: Rng, folder: Path) -> Trial:
    """A vest: the same garment without sleeves."""
    cut = drawn_cut(rng)
    made = make(cut)
    x, faces = made.x, made.faces
    for sign in (1.0, -1.0):
        x, faces = kept(x, faces, cut.half_width - 0.045 - sign * x[:, 1])
    path = written.obj(folder / "vest.obj", [("Vest", x, faces)])
    return Trial(path, {}, refusal=r"vest")


def pullover(rng: Rng, folder: Path) -> Trial:
    """A pullover: read, and told that it cannot be put on like a coat."""
    made = make(replace(drawn_cut(rng), is_open=False))
    path = written.stl(folder / "pullover.stl", made.x, made.faces)
    return Trial(path, {}, made, judged=r"closed front")


def three_times_life_size(rng: Rng, folder: Path) -> Trial:
    """A shirt as large as a tent: the scale that would fit is told."""
    made = make(drawn_cut(rng))
    path = written.obj(folder / "shirt.obj", [("Shirt", 3.0 * made.x, made.faces)])
    return Trial(path, {}, refusal=r"(scale|unit).*(would fit|it would be|\bfit\b)")


def scaled_to_life_size(rng: Rng, folder: Path) -> Trial:
    """The same with a scale."""
    made = make(drawn_cut(rng))
    path = written.obj(folder / "shirt.obj", [("Shirt", 3.0 * made.x, made.faces)])
    return Trial(path, {"scale": 1.0 / 3.0}, made)


def narrow_cuffs(rng: Rng, folder: Path) -> Trial:
    """Cuffs narrower than a hand: read, and told that they cannot go on."""
    made = make(replace(drawn_cut(rng), cuff=rng.uniform(0.028, 0.035)))
    path = written.obj(folder / "a.obj", [("Coat", made.x, made.faces)])
    return Trial(path, {}, made, judged=r"cuffs? (is|are) narrower than the hand")


def collar_of_three_sheets(rng: Rng, folder: Path) -> Trial:
    """A strip that stands on a line within the cloth, beside the neck: three sheets meet there."""
    made = make(drawn_cut(rng))
    x, faces = with_strip(made, np.array([-0.06, 0.0, 0.0]))
    path = written.obj(folder / "a.obj", [("Coat", x, faces)])
    return Trial(path, {}, made, note=r"belong to more than two faces")


def panels_with_a_gap(rng: Rng, folder: Path) -> Trial:
    """Two halves whose seam has a gap: the distance that joins them is told."""
    x, faces, _ = _halves(rng)
    path = written.obj(folder / "a.obj", [("Coat", x, faces)])
    return Trial(path, {}, refusal=r"garment\.mesh\.weld: 0\.005 joins them")


def panels_welded(rng: Rng, folder: Path) -> Trial:
    """The same with this distance."""
    x, faces, made = _halves(rng)
    path = written.obj(folder / "a.obj", [("Coat", x, faces)])
    return Trial(path, {"weld": 0.005}, made)


def _halves(rng: Rng) -> tuple[FloatArray, IntArray, Made]:
    made = make(replace(drawn_cut(rng), is_open=False))
    x, faces = made.x, made.faces
    behind = x[faces].mean(axis=1)[:, 0] < 0.0
    back, front = np.unique(faces[behind]), np.unique(faces[~behind])
    new = np.zeros(len(x), dtype=np.int32)
    new[back] = len(front) + np.arange(len(back))
    both = [np.searchsorted(front, faces[~behind]), new[faces[behind]]]
    nodes = np.concatenate([x[front], x[back] - [0.002, 0.0, 0.0]])
    return nodes, np.concatenate(both).astype(np.int32), made


def lined(rng: Rng, folder: Path) -> Trial:
    """A glTF with a lining as a mesh of its own, which is left out."""
    made = make(drawn_cut(rng))
    path = written.glb(folder / "a.glb", [*_coat_and_lining(made)])
    return Trial(path, {"up": "y", "leave_out": ("Lining",)}, made)


def lining_untold(rng: Rng, folder: Path) -> Trial:
    """The same without a key."""
    made = make(drawn_cut(rng))
    path = written.glb(folder / "a.glb", [*_coat_and_lining(made)])
    return Trial(path, {"up": "y"}, refusal=r"two layers, such as a lining.*garment\.mesh\.take")


def _coat_and_lining(made: Made) -> list[written.Part]:
    inner = made.x - 0.006 * normals(made.x, made.faces)
    return [
        ("Shell", in_axes(made.x, "y"), made.faces),
        ("Lining", in_axes(inner, "y"), made.faces[:, ::-1]),
    ]


def compressed(rng: Rng, folder: Path) -> Trial:
    """A glTF compressed by Draco."""
    made = make(drawn_cut(rng))
    path = written.draco(folder / "a.glb", [("Coat", in_axes(made.x, "y"), made.faces)])
    return Trial(path, {"up": "y"}, refusal=r"Draco compression.*export it without")


def of_usd(rng: Rng, folder: Path) -> Trial:
    """A USD stage as text."""
    del rng
    path = folder / "coat.usda"
    path.write_text('#usda 1.0\ndef Mesh "Coat" { }\n')
    return Trial(path, {}, refusal=r"USD stage, which is not read.*export it as glTF or OBJ")


CASES: tuple[Callable[[Rng, Path], Trial], ...] = (
    quads_in_decimetres,
    one_of_two,
    two_at_once,
    without_welding,
    turned_about,
    facing_untold,
    unit_untold,
    double_walls,
    mixed_winding,
    hood,
    hood_and_one_closed_sleeve,
    of_trousers,
    vest,
    pullover,
    three_times_life_size,
    scaled_to_life_size,
    narrow_cuffs,
    collar_of_three_sheets,
    panels_with_a_gap,
    panels_welded,
    lined,
    lining_untold,
    compressed,
    of_usd,
)


def in_axes(x: FloatArray, up: str, facing: str | None = None) -> FloatArray:
    """Returns positions in the axes of a file, of which `up` points up and `facing` forward."""
    return np.asarray(x @ orientation(up, facing))


def normals(x: FloatArray, faces: IntArray) -> FloatArray:
    """Returns (n,3) unit normals of the nodes."""
    across = np.cross(x[faces[:, 1]] - x[faces[:, 0]], x[faces[:, 2]] - x[faces[:, 0]])
    total = np.zeros_like(x)
    np.add.at(total, faces.ravel(), np.repeat(across, 3, axis=0))
    return np.asarray(total / np.maximum(np.linalg.norm(total, axis=1, keepdims=True), 1e-12))


def walled(made: Made, thickness: float) -> tuple[FloatArray, IntArray]:
    """Returns a garment with an inner wall that is joined to the outer one at all borders."""
    x, faces, n = made.x, made.faces, len(made.x)
    rims = [
        triangle
        for loop in boundary_loops(faces)
        for a, b in zip(loop, np.roll(loop, -1), strict=True)
        for triangle in ([b, a, a + n], [b, a + n, b + n])
    ]
    both = np.concatenate([faces, faces[:, ::-1] + n, np.array(rims)])
    return np.vstack([x, x - thickness * normals(x, faces)]), both.astype(np.int32)


def closed_at(made: Made, at: FloatArray) -> tuple[FloatArray, IntArray]:
    """Returns a garment of which the opening nearest to a point is closed by triangles."""
    middle = {k: made.x[loop].mean(axis=0) for k, loop in enumerate(boundary_loops(made.faces))}
    loop = boundary_loops(made.faces)[min(middle, key=lambda k: np.linalg.norm(middle[k] - at))]
    fan = [[b, a, len(made.x)] for a, b in zip(loop, np.roll(loop, -1), strict=True)]
    return np.vstack([made.x, made.x[loop].mean(axis=0)]), np.vstack([made.faces, fan])


def with_strip(made: Made, at: FloatArray) -> tuple[FloatArray, IntArray]:
    """Returns a garment with a strip of two triangles on an edge near a point."""
    x, faces = made.x, made.faces
    near = np.argsort(np.linalg.norm(x[faces].mean(axis=1) - at, axis=1))
    border = np.concatenate(boundary_loops(faces))
    inner = [f for f in near[:200] if not np.isin(faces[f], border).any()]
    a, b = faces[inner[0], :2]
    top = np.array([x[node] + [0.0, 0.0, 0.02] for node in (a, b)])
    n = len(x)
    return np.vstack([x, top]), np.vstack([faces, [[a, b, n], [b, n + 1, n]]]).astype(np.int32)
