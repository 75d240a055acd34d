from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh

from drake_dress.errors import UserError
from drake_dress.models.human.skin.body_file import PARTS
from drake_dress.models.human.skin.measures import body_values, skin_measures
from drake_dress.models.human.skin.phenotype import Phenotype
from drake_dress.models.human.skin.scan import NEEDED, OPTIONAL, Scan, scan_measures, scan_skin
from drake_dress.models.human.skin.skin import Skin
from drake_dress.models.rotation import rotation_about
from tests.models.human.skin.bodies import MAN, OLD_WOMAN, skin_of

Joints = dict[str, list[float]]


def scan_of(skin: Skin, path: Path, **options: Any) -> Scan:
    """Writes a skin as a scan; options: names of joints, and a map of points to the file's."""
    into: Callable[[np.ndarray], np.ndarray] = options.get("into", lambda p: p)
    mesh = trimesh.Trimesh(into(skin.vertices), skin.faces, process=False)
    mesh.export(path)
    joints = {
        name: into(skin.joints[name.replace("_hand", "_knuckle_middle")][None])[0].tolist()
        for name in options.get("names", NEEDED)
    }
    return Scan(path, joints=joints)


@pytest.mark.parametrize("person", [MAN, OLD_WOMAN])
@pytest.mark.parametrize("names", [NEEDED, NEEDED + OPTIONAL])
def test_scan_of_a_body_has_its_measures(
    tmp_path: Path, person: Phenotype, names: tuple[str, ...]
) -> None:
    skin = skin_of(person)
    values = body_values(skin_measures(skin))
    found = body_values(scan_measures(scan_of(skin, tmp_path / "scan.ply", names=names)))
    # a scan's thumb is not known, and it is in the hull of the hand's volume
    loose = {"hand_radius": 0.10, "forearm_mass": 0.15, "upper_arm_mass": 0.04}
    for name, value in values.items():
        assert found[name] == pytest.approx(value, rel=loose.get(name, 0.025)), name


@pytest.mark.parametrize("ending", ["obj", "ply", "stl"])
def test_unit_axis_and_place_of_a_scan_do_not_matter(tmp_path: Path, ending: str) -> None:
    skin = skin_of(MAN)
    turn = rotation_about("z", 2.0)

    def into(points: np.ndarray) -> np.ndarray:
        # turned on the floor, y up, in mm
        turned = points @ turn.T + [0.3, -1.0, 0.2]
        return 1000.0 * turned[:, [1, 2, 0]]

    scan = replace(scan_of(skin, tmp_path / f"scan.{ending}", into=into), unit="mm", up="y")
    here = scan_measures(scan_of(skin, tmp_path / "here.ply"))
    there = scan_measures(scan)
    # STL and PLY have single precision
    assert body_values(there) == pytest.approx(body_values(here), rel=1e-3)


def test_hole_in_a_scan_is_no_harm(tmp_path: Path) -> None:
    skin = skin_of(MAN)
    crown = skin.vertices[skin.faces][:, :, 2].max(axis=1) > skin.stature - 0.05
    behind = np.abs(skin.vertices[skin.faces].mean(axis=1) - [-0.1, 0.0, 1.15]).max(axis=1) < 0.04
    assert crown.any()
    assert behind.any()
    damaged = replace(skin, faces=skin.faces[~(crown | behind)])
    whole = body_values(scan_measures(scan_of(skin, tmp_path / "whole.ply")))
    holed = body_values(scan_measures(scan_of(damaged, tmp_path / "holed.ply")))
    assert holed == pytest.approx(whole, rel=0.035)


def test_vertices_belong_to_the_parts_that_they_are_of(tmp_path: Path) -> None:
    skin = skin_of(MAN)
    found = scan_skin(scan_of(skin, tmp_path / "scan.obj", names=NEEDED + OPTIONAL))
    assert len(found.parts) == len(skin.parts)
    same = found.parts == skin.parts
    for part in ("trunk", "upper_arm", "forearm", "thigh"):
        assert same[skin.parts == PARTS.index(part)].mean() > 0.75
    arms = np.isin(skin.parts, [3, 4, 5])
    assert np.array_equal(found.sides[arms], skin.sides[arms])
    assert found.weights.sum(axis=1) == pytest.approx(1.0)


BAD: list[tuple[dict[str, Any], str]] = [
    (
        {"unit": "mm"},
        "unit: in mm the scan is 0.00176 m tall, expected a person .* with m it would",
    ),
    ({"unit": "furlong"}, "unit: is 'furlong', expected one of m, cm"),
    ({"up": "x"}, "unit: in m the scan is 0.4"),
    ({"up": "w"}, "up: is 'w'"),
]


@pytest.mark.parametrize(("changes", "message"), BAD)
def test_wrong_unit_or_axis_is_told(tmp_path: Path, changes: dict[str, Any], message: str) -> None:
    scan = scan_of(skin_of(MAN), tmp_path / "scan.ply")
    with pytest.raises(UserError, match=message):
        scan_measures(replace(scan, **changes))


BAD_JOINTS: list[tuple[Joints, str]] = [
    ({"left_elbow": [0.0, 0.9, 1.1]}, r"left_elbow: \(0, 0.9, 1.1\) m is outside of the scan"),
    ({"left_elbow": [0.0, 0.0, 1.2]}, "left_hand: is .* m from left_elbow, expected 0.08 to 0.5"),
    ({"left_elbow": [0.0, 1.0]}, "left_elbow: is .*, expected x, y, z"),
    ({"left_elbow": [0.0, 1.0, float("nan")]}, "left_elbow: is .*, expected x, y, z"),
    ({"left_elbo": [0.0, 1.0, 1.0]}, "left_elbo: is unknown, expected left_shoulder"),
    ({"right_shoulder": [0.0, 0.15, 1.40]}, "right_shoulder: is 0.* m from left_shoulder"),
]


@pytest.mark.parametrize(("joints", "message"), BAD_JOINTS)
def test_misplaced_joint_is_told(tmp_path: Path, joints: Joints, message: str) -> None:
    scan = scan_of(skin_of(MAN), tmp_path / "scan.ply")
    with pytest.raises(UserError, match=message):
        scan_measures(replace(scan, joints={**scan.joints, **joints}))


def test_missing_joint_is_told(tmp_path: Path) -> None:
    scan = scan_of(skin_of(MAN), tmp_path / "scan.ply")
    joints = {name: place for name, place in scan.joints.items() if name != "right_hand"}
    with pytest.raises(UserError, match="joints: has no right_hand, expected left_shoulder, "):
        scan_measures(replace(scan, joints=joints))


def test_scan_without_an_arm_is_told(tmp_path: Path) -> None:
    skin = skin_of(MAN)
    forearm = np.isin(skin.parts, [4, 5, 6, 7]) & (skin.sides == 1)
    left = skin.faces[~forearm[skin.faces].any(axis=1)]
    with pytest.raises(UserError, match=r"left_elbow: .* is outside of the scan"):
        scan_measures(scan_of(replace(skin, faces=left), tmp_path / "scan.ply"))


def test_scan_without_legs_is_told(tmp_path: Path) -> None:
    skin = skin_of(MAN)
    lower = skin.vertices[skin.faces][:, :, 2].max(axis=1) < 0.9
    upper = replace(skin, faces=skin.faces[~lower])
    used, faces = np.unique(upper.faces, return_inverse=True)
    bust = replace(skin, vertices=skin.vertices[used], faces=faces.reshape(upper.faces.shape))
    with pytest.raises(UserError, match=r"left_shoulder: is at 6. % of the scan's height"):
        scan_measures(scan_of(bust, tmp_path / "bust.ply"))
