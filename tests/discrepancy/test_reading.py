"""Measured logs are read, or refused in one line that names file and key."""

import csv
from pathlib import Path

import h5py
import numpy as np
import pytest
from scipy.spatial import cKDTree

from drake_dress.discrepancy.measured_log import write_recordings
from drake_dress.discrepancy.reading import read_recordings
from drake_dress.discrepancy.recording import Recording
from drake_dress.errors import UserError
from drake_dress.models.arrays import FloatArray
from drake_dress.models.garment.coat import COATS, make_coat
from tests.discrepancy.data import recordings
from tests.discrepancy.hanging import arrays, write_npz

MESH = make_coat(COATS["jacket"], 0.06)


@pytest.fixture(scope="module")
def made() -> list[Recording]:
    return recordings(("sway", "lift"), duration=1.0)


@pytest.fixture
def log(made: list[Recording], tmp_path: Path) -> Path:
    path = tmp_path / "measured.h5"
    write_recordings(path, made, "scenario: text")
    return path


def test_what_was_written_is_read(made: list[Recording], log: Path) -> None:
    for r, s in zip(made, read_recordings([log], MESH), strict=True):
        np.testing.assert_array_equal(r.time, s.time)
        np.testing.assert_array_equal(r.marker_position, s.marker_position)
        np.testing.assert_array_equal(r.gripper_position, s.gripper_position)
        np.testing.assert_array_equal(r.gripper_force, s.gripper_force)
        np.testing.assert_array_equal(r.joint_position, s.joint_position)
        assert (r.marker_noise, r.force_noise) == (s.marker_noise, s.force_noise)
        assert r.name == s.name


def test_recordings_of_the_same_motion_are_told_apart(
    made: list[Recording], tmp_path: Path
) -> None:
    path = tmp_path / "twice.h5"
    write_recordings(path, [made[0], made[1], made[0]], "scenario: text")
    names = [r.name for r in read_recordings([path], MESH)]
    assert names == ["sway", "lift", "sway 2"]


def test_a_file_may_hold_one_recording_at_its_root_and_lack_what_is_not_required(
    made: list[Recording], tmp_path: Path
) -> None:
    r = made[0]
    path = tmp_path / "one.h5"
    with h5py.File(path, "w") as file:
        file["time"] = r.time
        for k, side in enumerate(("left", "right")):
            file[f"gripper/{side}/position"] = r.gripper_position[:, k]
        file["garment/marker_position"] = r.marker_position
        nodes = cKDTree(MESH.rest_position).query(r.marker_rest_position)[1]
        file["garment/marker_node"] = nodes
    (read,) = read_recordings([path], MESH)
    assert read.gripper_force is None
    assert read.joint_position is None
    np.testing.assert_array_equal(read.marker_rest_position, MESH.rest_position[nodes])
    # the noise is found from the data
    assert read.marker_noise == pytest.approx(1e-3, rel=0.25)


def test_npz_and_csv_say_the_same_as_hdf5(made: list[Recording], tmp_path: Path) -> None:
    r = made[0]
    datasets = arrays(r)
    write_npz(tmp_path / "lab.npz", datasets)
    columns = {"time": r.time}
    for name, value in datasets.items():
        if name in ("time", "garment/marker_rest_position"):
            continue
        for index in np.ndindex(value.shape[1:]):
            *number, axis = index
            key = "/".join([name, *map(str, number), "xyz"[axis]])
            columns[key] = value[(slice(None), *index)]
    with (tmp_path / "lab.csv").open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(columns)
        for row in zip(*columns.values(), strict=True):
            writer.writerow(["" if np.isnan(v) else repr(float(v)) for v in row])
    with (tmp_path / "lab.markers.csv").open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(["marker", "x", "y", "z"])
        writer.writerows([i, *p.tolist()] for i, p in enumerate(r.marker_rest_position))
    for name in ("lab.npz", "lab.csv"):
        (read,) = read_recordings([tmp_path / name], MESH)
        np.testing.assert_array_equal(read.marker_position, r.marker_position)
        np.testing.assert_array_equal(read.gripper_force, r.gripper_force)
        np.testing.assert_array_equal(read.joint_position, r.joint_position)
        np.testing.assert_array_equal(read.marker_rest_position, r.marker_rest_position)


def change(path: Path, name: str, value: FloatArray | None) -> None:
    with h5py.File(path, "a") as file:
        del file[name]
        if value is not None:
            file[name] = value


def shifted_time(path: Path) -> None:
    with h5py.File(path) as file:
        time = np.array(file["recording_1/time"])
    time[7] = time[3]
    change(path, "recording_1/time", time)


def infinite_force(path: Path) -> None:
    with h5py.File(path, "a") as file:
        file["recording_0/gripper/left/force"][3, 1] = np.inf


def millimetres(path: Path) -> None:
    with h5py.File(path, "a") as file:
        file["recording_0/garment/marker_position"][...] *= 1000.0


def unseen(path: Path) -> None:
    with h5py.File(path, "a") as file:
        file["recording_0/garment/marker_position"][...] = np.nan


BAD = {
    "no time": (lambda p: change(p, "recording_1/time", None), ["recording_1/time", "missing"]),
    "time that turns back": (shifted_time, ["recording_1/time", "sample 7", "increasing"]),
    "no grippers": (
        lambda p: change(p, "recording_0/gripper/left/position", None),
        ["recording_0/gripper/left/position", "missing"],
    ),
    "wrong shape": (
        lambda p: change(p, "recording_0/gripper/right/position", np.zeros((5, 3))),
        ["recording_0/gripper/right/position", "(5, 3)", "expected"],
    ),
    "no markers": (
        lambda p: change(p, "recording_0/garment/marker_rest_position", None),
        ["marker_rest_position", "marker_node"],
    ),
    "infinite": (infinite_force, ["recording_0/gripper/left/force", "inf", "(3, 1)"]),
    "millimetres": (millimetres, ["recording_0/garment/marker_position", "metres"]),
    "never seen": (unseen, ["recording_0/garment/marker_position", "0 markers"]),
    "text": (
        lambda p: change(p, "recording_0/time", np.array([b"a", b"b"])),
        ["recording_0/time", "numbers"],
    ),
}


@pytest.mark.parametrize("case", BAD)
def test_what_cannot_be_used_is_named(log: Path, case: str) -> None:
    spoil, words = BAD[case]
    spoil(log)
    with pytest.raises(UserError) as error:
        read_recordings([log], MESH)
    for word in [str(log), *words]:
        assert word in str(error.value)


@pytest.mark.parametrize(
    ("name", "content"), [("lab.txt", "a"), ("lab.h5", "not HDF5"), ("lab.csv", "")]
)
def test_files_of_another_kind_are_refused(tmp_path: Path, name: str, content: str) -> None:
    path = tmp_path / name
    path.write_text(content)
    with pytest.raises(UserError, match=name):
        read_recordings([path], MESH)


def test_a_csv_says_which_line_is_no_number(tmp_path: Path) -> None:
    path = tmp_path / "lab.csv"
    path.write_text("time,gripper/left/position/x\n0.0,1.0\n0.1,far\n")
    with pytest.raises(UserError, match="line 3"):
        read_recordings([path], MESH)
