"""A small coat as a sewing pattern: two front halves, a back and four half sleeves, in cm."""

from __future__ import annotations

import copy
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

Json = dict[str, Any]


def _panel(
    vertices: Sequence[Sequence[float]],
    curved: dict[int, Any],
    translation: list[float],
    rotation: list[float],
) -> Json:
    count = len(vertices)
    edges: list[Json] = [{"endpoints": [i, (i + 1) % count]} for i in range(count)]
    for number, curvature in curved.items():
        edges[number]["curvature"] = curvature
    return {
        "vertices": vertices,
        "edges": edges,
        "translation": translation,
        "rotation": rotation,
    }


ARMHOLE = {"type": "quadratic", "params": [[0.5, 0.12]]}
NECK = {"type": "circle", "params": [14.0, 0, 0]}
NAPE = {"type": "cubic", "params": [[0.3, 0.1], [0.7, 0.1]]}
_LEFT = [[6, 0], [27, 0], [27, 44], [21, 64], [8, 67], [6, 56]]
_RIGHT = [[-27, 0], [-6, 0], [-6, 56], [-8, 67], [-21, 64], [-27, 44]]
_BACK = [[-27, 0], [27, 0], [27, 44], [21, 64], [8, 67], [-8, 67], [-21, 64], [-27, 44]]
_OUT: list[list[float]] = [[0, -11], [42, -7.5], [42, 7.5], [0, 11]]
_IN: list[list[float]] = [[-42, -7.5], [0, -11], [0, 11], [-42, 7.5]]


def small_coat() -> Json:
    """Returns the specification as GarmentCode writes it."""
    panels = {
        "left_front": _panel(_LEFT, {2: ARMHOLE, 4: NECK}, [0, 75, 11], [0, 0, 0]),
        "right_front": _panel(_RIGHT, {2: NECK, 4: ARMHOLE}, [0, 75, 11], [0, 0, 0]),
        "back": _panel(_BACK, {2: ARMHOLE, 4: NAPE, 6: ARMHOLE}, [0, 75, -11], [0, 180, 0]),
        "left_sleeve_f": _panel(_OUT, {}, [37, 126, 9], [0, 0, -40]),
        "left_sleeve_b": _panel(_IN, {}, [37, 126, -9], [0, 180, -40]),
        "right_sleeve_f": _panel(_IN, {}, [-37, 126, 9], [0, 0, 40]),
        "right_sleeve_b": _panel(_OUT, {}, [-37, 126, -9], [0, 180, 40]),
    }
    pairs = [
        ("left_front", 1, "back", 7),
        ("right_front", 5, "back", 1),
        ("left_front", 3, "back", 5),
        ("right_front", 3, "back", 3),
        ("left_front", 2, "left_sleeve_f", 3),
        ("back", 6, "left_sleeve_b", 1),
        ("right_front", 4, "right_sleeve_f", 1),
        ("back", 2, "right_sleeve_b", 3),
        ("left_sleeve_f", 2, "left_sleeve_b", 2),
        ("left_sleeve_f", 0, "left_sleeve_b", 0),
        ("right_sleeve_f", 2, "right_sleeve_b", 2),
        ("right_sleeve_f", 0, "right_sleeve_b", 0),
    ]
    stitches = [[{"panel": a, "edge": i}, {"panel": b, "edge": j}] for a, i, b, j in pairs]
    return {
        "pattern": {"panels": panels, "stitches": stitches},
        "properties": {"curvature_coords": "relative", "units_in_meter": 100},
    }


def changed(path: list[Any], value: Any) -> bytes:
    """Returns the small coat's file with the value at a path of keys replaced."""
    content = copy.deepcopy(small_coat())
    place: Any = content
    for key in path[:-1]:
        place = place[key]
    place[path[-1]] = value
    return json.dumps(content).encode()


def written(folder: Path) -> Path:
    """Writes the small coat and returns its file."""
    path = folder / "coat.json"
    path.write_text(json.dumps(small_coat()), encoding="utf-8")
    return path
