"""Recordings come in any unit and any frame; what is read is in metres with z up."""

from pathlib import Path

import h5py
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drake_dress.errors import UserError
from drake_dress.learning.recordings import RecordingOptions, read_recording
from drake_dress.learning.recordings.reading import UPS, turned_up
from drake_dress.models.arrays import FloatArray

COUNT = 30
TIME = 0.05 * np.arange(COUNT, dtype=np.float64)


def hanging() -> FloatArray:
    """Returns joints (T,6,3), m, of arms that hang and swing a little, z up."""
    rng = np.random.default_rng(3)
    left = np.array([[0.0, 0.18, 1.4], [0.02, 0.22, 1.12], [0.1, 0.24, 0.85]])
    pose = np.concatenate([left, left * [1.0, -1.0, 1.0]])
    swing = 0.05 * np.sin(TIME)[:, None, None] * rng.normal(size=(6, 3))
    swing[:, [0, 3]] = 0.0
    return pose + swing


def write_npz(path: Path, joints: FloatArray, time: FloatArray | None = TIME) -> None:
    if time is None:
        np.savez(path, joint_position=joints)
    else:
        np.savez(path, joint_position=joints, time=time)


@given(st.sampled_from(UPS))
def test_turning_up_is_a_rotation_that_takes_the_axis_to_z(up: str) -> None:
    turned = turned_up(np.eye(3), up)
    assert np.linalg.det(turned) == pytest.approx(1.0)
    sign = -1.0 if up.startswith("-") else 1.0
    axis = "xyz".index(up[-1])
    np.testing.assert_array_equal(turned[axis], [0.0, 0.0, sign])


@pytest.mark.parametrize("up", UPS)
@pytest.mark.parametrize("unit", [1.0, 0.1, 0.0254, 0.01, 0.001])
def test_unit_and_up_are_found_from_the_body(tmp_path: Path, up: str, unit: float) -> None:
    joints = hanging()
    # the inverse rotation, by the columns of what `turned_up` does
    matrix = turned_up(np.eye(3), up)
    write_npz(tmp_path / "r.npz", joints @ matrix.T / unit)
    told: list[str] = []
    found = read_recording(tmp_path / "r.npz", told=told.append)
    np.testing.assert_allclose(found.joints, joints, atol=1e-9)
    np.testing.assert_allclose(found.time, TIME)
    assert found.name == "r"
    assert np.isnan(found.sleeves).all()
    assert len(told) == 2
    assert f"{up} points up" in told[1]


def test_one_arm_is_the_right_one(tmp_path: Path) -> None:
    write_npz(tmp_path / "r.npz", hanging()[:, 3:])
    found = read_recording(tmp_path / "r.npz")
    assert np.isnan(found.joints[:, :3]).all()
    np.testing.assert_allclose(found.joints[:, 3:], hanging()[:, 3:])


def test_all_formats_say_the_same(tmp_path: Path) -> None:
    joints = hanging()
    write_npz(tmp_path / "a.npz", joints)
    with h5py.File(tmp_path / "b.h5", "w") as file:
        file["/human/joint_position"], file["/time"] = joints, TIME
    names = [
        f"{side}_{joint}_{axis}"
        for side in ("left", "right")
        for joint in ("shoulder", "elbow", "hand")
        for axis in "xyz"
    ]
    rows = np.column_stack([TIME, joints.reshape(COUNT, 18)])
    np.savetxt(
        tmp_path / "c.csv", rows, delimiter=",", header=",".join(["time", *names]), comments=""
    )
    read = [read_recording(tmp_path / name) for name in ("a.npz", "b.h5", "c.csv")]
    for other in read[1:]:
        np.testing.assert_allclose(other.joints, read[0].joints, atol=1e-9)
        np.testing.assert_allclose(other.time, read[0].time, atol=1e-9)


def test_rate_is_asked_for_where_there_are_no_stamps(tmp_path: Path) -> None:
    write_npz(tmp_path / "r.npz", hanging(), None)
    with pytest.raises(UserError, match=r"time: has no column or array of time, expected --rate"):
        read_recording(tmp_path / "r.npz")
    found = read_recording(tmp_path / "r.npz", RecordingOptions(rate=20.0))
    np.testing.assert_allclose(found.time, TIME)


def test_repeated_stamps_are_left_out_and_gaps_stay(tmp_path: Path) -> None:
    joints, time = hanging(), TIME.copy()
    joints[4, 2, 1] = np.nan
    time[10] = time[9]
    write_npz(tmp_path / "r.npz", joints, time)
    found = read_recording(tmp_path / "r.npz")
    assert len(found.time) == COUNT - 1
    assert np.all(np.diff(found.time) > 0.0)
    assert np.isnan(found.joints[4, 2]).all()
    assert np.isfinite(found.joints[4, 1]).all()


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        (lambda j, t: (j, t[::-1]), "time: decreases"),
        (lambda j, t: (np.full_like(j, np.nan), t), "has no arm with shoulder, elbow and hand"),
        (lambda j, t: (1e7 * j, t), "unit: is not known"),
        # the unit of the CMU motion capture database, 1/0.45 in
        (lambda j, t: (j / 0.0564, t), "unit: is not known.*in which 0.05.* would be an adult's"),
        (lambda j, t: (j[:, :, :2], t), "joint_position: has shape"),
        (lambda j, t: (j, t[:-1]), "time: has shape"),
    ],
)
def test_unusable_recordings_are_named(tmp_path: Path, change, expected: str) -> None:  # type: ignore[no-untyped-def]
    write_npz(tmp_path / "r.npz", *change(hanging(), TIME))
    with pytest.raises(UserError, match=expected):
        read_recording(tmp_path / "r.npz")


@pytest.mark.parametrize("name", ["r.npz", "r.h5", "r.csv"])
def test_bytes_that_are_no_recording_are_named(tmp_path: Path, name: str) -> None:
    path = tmp_path / name
    with pytest.raises(UserError, match="no such file"):
        read_recording(path)
    path.write_bytes(b"\x80\x04garbage\xff\xfe" * 20)
    with pytest.raises(UserError, match=name):
        read_recording(path)


def test_horizontal_arms_ask_for_up(tmp_path: Path) -> None:
    left = np.array([[0.0, 0.18, 1.4], [0.2, 0.38, 1.4], [0.4, 0.58, 1.4]])
    pose = np.concatenate([left, left * [-1.0, -1.0, 1.0]])
    write_npz(tmp_path / "r.npz", np.tile(pose, (COUNT, 1, 1)))
    with pytest.raises(UserError, match="up: is not known"):
        read_recording(tmp_path / "r.npz")
    found = read_recording(tmp_path / "r.npz", RecordingOptions(up="z"))
    np.testing.assert_allclose(found.joints[0], pose)
