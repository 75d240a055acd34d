"""Converts the Panda's URDF and meshes of `example-robot-data` to a form that Drake reads.

The package's visual meshes are COLLADA, its collision meshes STL; Drake reads neither. The visual
meshes are converted to glTF once and kept in the user's cache. The control keeps distances by
capsules (`SHAPE`) before anything touches, so the description has no collision geometry. The
fingers are fixed, closed on cloth.
"""

from __future__ import annotations

import errno
import shutil
import tempfile
import xml.etree.ElementTree as ElementTree
from importlib import metadata
from pathlib import Path

import numpy as np
import trimesh
from trimesh.transformations import rotation_matrix, translation_matrix

from drake_dress.caches import user_cache
from drake_dress.models.arm.panda import FLANGE, HAND_TURN
from drake_dress.models.arrays import FloatArray

PACKAGE = "example-robot-data"
_FOLDER = "robots/panda_description"
# Version of the converted files.
_FORM = 2
# glTF has y up; programs that read it rotate it back.
_Y_UP = np.array([[1.0, 0, 0, 0], [0, 0, 1.0, 0], [0, -1.0, 0, 0], [0, 0, 0, 1.0]])
# Opening of each finger, m; both together hold two layers of cloth.
_OPENING = 0.001
# Offset of the fingers' joints from the hand's frame along its z, m.
_FINGERS = 0.0584


def _hand_parts() -> tuple[tuple[str, FloatArray], ...]:
    z = [0.0, 0.0, 1.0]
    hand = translation_matrix([0.0, 0.0, FLANGE]) @ rotation_matrix(HAND_TURN, z)
    finger = translation_matrix([0.0, _OPENING, _FINGERS])
    other = rotation_matrix(np.pi, z)
    return ("hand", hand), ("finger", hand @ finger), ("finger", hand @ other @ finger)


# Names of meshes that are part of the last link, each with its pose X_LM (4,4).
HAND_PARTS = _hand_parts()


def panda_urdf(cache: Path | None = None) -> Path:
    """Returns the Panda's URDF, with its meshes next to it; converts both on first use.

    Args:
        cache: folder to keep them in; the user's cache by default.

    Raises:
        FileNotFoundError: the package is not installed, or has no Panda.
    """
    try:
        version = metadata.version(PACKAGE)
    except metadata.PackageNotFoundError:
        raise FileNotFoundError(f"package {PACKAGE} is not installed; it has the Panda") from None
    folder = (cache or _user_cache()) / f"panda-{version}-{_FORM}"
    urdf = folder / "panda.urdf"
    if not urdf.exists():
        folder.parent.mkdir(parents=True, exist_ok=True)
        made = Path(tempfile.mkdtemp(dir=folder.parent, prefix="panda-"))
        try:
            _convert(panda_source(), made)
            try:
                made.rename(folder)
            except OSError:
                if not urdf.exists():  # a real error: no other process has made the folder
                    raise
        finally:
            shutil.rmtree(made, ignore_errors=True)
    return urdf


def link_meshes() -> tuple[tuple[tuple[Path, FloatArray], ...], ...]:
    """Returns the glTF files of the base and of links 1 to 7, each with its pose X_LM (4,4).

    The hand and its fingers are part of the last link.

    Raises:
        FileNotFoundError: the package is not installed, or has no Panda.
    """
    folder = panda_urdf().parent
    files: list[tuple[tuple[Path, FloatArray], ...]] = []
    for i in range(8):
        files.append(((folder / f"link{i}" / "model.gltf", np.eye(4)),))
    files[-1] += tuple((folder / name / "model.gltf", X) for name, X in HAND_PARTS)
    return tuple(files)


def panda_source() -> Path:
    """Returns the Panda's folder in the package.

    Raises:
        FileNotFoundError: the package has no Panda.
    """
    for file in metadata.files(PACKAGE) or []:
        if file.as_posix().endswith(f"{_FOLDER}/urdf/panda.urdf"):
            return Path(str(file.locate())).resolve().parents[1]
    raise FileNotFoundError(f"package {PACKAGE} has no {_FOLDER}/urdf/panda.urdf")


def _user_cache() -> Path:
    folder = user_cache()
    if folder is None:
        raise OSError(errno.EROFS, "no folder for caches can be written to, set XDG_CACHE_HOME")
    return folder


def _convert(source: Path, out: Path) -> None:
    tree = ElementTree.parse(source / "urdf" / "panda.urdf")
    robot = tree.getroot()
    for link in robot.iter("link"):
        for collision in link.findall("collision"):
            link.remove(collision)
        for mesh in link.iter("mesh"):
            name = Path(mesh.attrib["filename"]).stem
            _write_mesh(source / "meshes" / "visual" / f"{name}.dae", out / name)
            mesh.attrib["filename"] = f"{name}/model.gltf"
    for joint in robot.iter("joint"):
        for tag in ("safety_controller", "mimic"):
            for element in joint.findall(tag):
                joint.remove(element)
        if joint.attrib["type"] == "prismatic":
            _fix(joint)
    tree.write(out / "panda.urdf", encoding="unicode")


def _fix(joint: ElementTree.Element) -> None:
    """Makes a finger's joint fixed, slightly open."""
    axis, origin = joint.find("axis"), joint.find("origin")
    if axis is None or origin is None:
        raise ValueError(f"joint {joint.attrib['name']} has no axis or no origin")
    way = [float(v) * _OPENING for v in axis.attrib["xyz"].split()]
    place = [float(v) for v in origin.attrib["xyz"].split()]
    origin.attrib["xyz"] = " ".join(f"{p + w:g}" for p, w in zip(place, way, strict=True))
    joint.attrib["type"] = "fixed"
    for tag in ("axis", "limit", "dynamics"):
        for element in joint.findall(tag):
            joint.remove(element)


def _write_mesh(source: Path, folder: Path) -> None:
    if folder.exists():
        return
    folder.mkdir()
    scene = trimesh.load_scene(source)
    scene.apply_transform(_Y_UP)
    for name, content in scene.export(file_type="gltf").items():
        (folder / name).write_bytes(content)
