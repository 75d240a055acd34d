"""What cannot be read is one line that names file and dataset, whatever is wrong with the bytes."""

import io
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drake_dress.discrepancy.reading import read_recordings
from drake_dress.errors import UserError
from tests.discrepancy.hanging import DENSITY, MESH, Datasets, arrays, hanging, write_hdf5

MARKERS = "garment/marker_position"


@pytest.fixture(scope="module")
def sound() -> Datasets:
    return arrays(hanging(np.random.default_rng(0), duration=1.0, markers=8))


@pytest.fixture(scope="module")
def whole(sound: Datasets, tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    """The bytes of a sound file of each kind."""
    directory = tmp_path_factory.mktemp("whole")
    write_hdf5(directory / "a.h5", sound)
    np.savez_compressed(directory / "a.npz", **dict[str, Any](sound))
    return {kind: (directory / f"a.{kind}").read_bytes() for kind in ("h5", "npz")}


def refusal(path: Path) -> str:
    with pytest.raises(UserError) as error:
        read_recordings([path], MESH, DENSITY)
    text = str(error.value)
    assert text.startswith(str(path))
    assert "\n" not in text
    return text


@pytest.mark.parametrize("kind", ["h5", "npz"])
@given(data=st.data())
@settings(max_examples=40)
def test_flipped_and_missing_bytes_are_told_or_do_no_harm(
    whole: dict[str, bytes],
    tmp_path_factory: pytest.TempPathFactory,
    kind: str,
    data: st.DataObject,
) -> None:
    content = bytearray(whole[kind])
    begin = data.draw(st.integers(0, len(content) - 1))
    for k in range(begin, min(begin + data.draw(st.integers(1, 300)), len(content))):
        content[k] ^= data.draw(st.just(0x5A))
    if data.draw(st.booleans()):
        content = content[: data.draw(st.integers(1, len(content)))]
    path = tmp_path_factory.mktemp("flipped") / f"lab.{kind}"
    path.write_bytes(content)
    try:
        (read,) = read_recordings([path], MESH, DENSITY)
    except UserError as error:
        assert str(error).startswith(str(path))
        assert "\n" not in str(error)
    else:
        assert np.isfinite(read.marker_position).any()


@pytest.mark.parametrize("kind", ["h5", "npz"])
@pytest.mark.parametrize("share", [0.0, 0.01, 0.5, 0.99])
def test_a_file_that_is_cut_short_is_refused(
    whole: dict[str, bytes], tmp_path: Path, kind: str, share: float
) -> None:
    path = tmp_path / f"lab.{kind}"
    path.write_bytes(whole[kind][: int(share * len(whole[kind]))])
    refusal(path)


def damaged_chunk(file: h5py.File) -> None:
    offset = file[MARKERS].id.get_chunk_info(0).byte_offset
    name = file.filename
    file.close()
    with open(name, "r+b") as raw:
        raw.seek(offset + 20)
        raw.write(b"\xff" * 40)


def blosc(file: h5py.File) -> None:
    shape = file[MARKERS].shape
    del file[MARKERS]
    plan = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
    plan.set_chunk(shape)
    plan.set_filter(32001, h5py.h5z.FLAG_OPTIONAL, (2, 2, 8, 1000))
    space = h5py.h5s.create_simple(shape)
    data = h5py.h5d.create(
        file["garment"].id, b"marker_position", h5py.h5t.NATIVE_DOUBLE, space, plan
    )
    data.write_direct_chunk((0, 0, 0), b"abcdefgh", 0)


def replaced(name: str, value: object) -> Callable[[h5py.File], None]:
    def spoil(file: h5py.File) -> None:
        del file[name]
        file[name] = value

    return spoil


def huge(file: h5py.File) -> None:
    del file[MARKERS]
    file.create_dataset(MARKERS, shape=(10**6, 10**5, 3), dtype="f8", chunks=(100, 100, 3))


def a_group(file: h5py.File) -> None:
    del file[MARKERS]
    file.create_group(MARKERS)


def attribute(name: str, value: object) -> Callable[[h5py.File], None]:
    return lambda file: file[MARKERS].attrs.__setitem__(name, value)


HDF5 = {
    "a damaged chunk": (damaged_chunk, [MARKERS, "cannot be read"]),
    "a filter that is not installed": (blosc, [MARKERS, "filter", "32001"]),
    "a soft link to nothing": (replaced(MARKERS, h5py.SoftLink("/no")), [MARKERS, "link"]),
    "a link to no file": (replaced("time", h5py.ExternalLink("no.h5", "/x")), ["time", "link"]),
    "a link for a group": (replaced("gripper", h5py.SoftLink("/no")), ["gripper", "link"]),
    "a group for a dataset": (a_group, [MARKERS, "group"]),
    "nothing in it": (replaced("time", h5py.Empty("f8")), ["time", "nothing"]),
    "one number": (replaced("time", 1.0), ["time", "shape ()"]),
    "records": (replaced("time", np.zeros(3, [("a", "f8")])), ["time", "numbers"]),
    "texts": (replaced("time", ["a", "b"]), ["time", "numbers"]),
    "complex numbers": (replaced("time", np.zeros(101, complex)), ["time", "numbers"]),
    "more than memory": (huge, [MARKERS, "GB"]),
    "noise as text": (attribute("noise_std", "1 mm"), [MARKERS, "noise_std", "1 mm"]),
    "noise NaN": (attribute("noise_std", np.nan), [MARKERS, "noise_std", "nan"]),
    "noise of some zero": (attribute("noise_std", [1e-3, 0.0]), [MARKERS, "noise_std", "0"]),
    "no noise": (attribute("noise_std", h5py.Empty("f8")), [MARKERS, "noise_std"]),
    "noise in mm": (attribute("noise_std", 1.0), [MARKERS, "noise_std", "expected m"]),
    "unit": (attribute("unit", "mm"), [MARKERS, "'mm'", "expected m"]),
    "frame": (attribute("frame", "camera"), [MARKERS, "camera", "world"]),
}


@pytest.mark.parametrize("case", HDF5)
def test_what_cannot_be_read_of_hdf5_names_the_dataset(
    sound: Datasets, tmp_path: Path, case: str
) -> None:
    spoil, words = HDF5[case]
    path = write_hdf5(tmp_path / "lab.h5", sound)
    with h5py.File(path, "a") as file:
        spoil(file)
    text = refusal(path)
    for word in words:
        assert word in text


def an_npy(path: Path, sound: Datasets) -> None:
    with path.open("wb") as file:
        np.save(file, np.zeros(3))


def bomb(path: Path, sound: Datasets) -> None:
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        header = io.BytesIO()
        what = {"descr": "<f8", "fortran_order": False, "shape": (10**9, 10**3)}
        np.lib.format.write_array_header_1_0(header, what)
        archive.writestr("time.npy", header.getvalue() + bytes(10**6))


def texts(path: Path, sound: Datasets) -> None:
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("time.npy", "hello")


NPZ = {
    "an array alone": (an_npy, ["NPY"]),
    "a shape that is not there": (bomb, ["time", "GB"]),
    "texts": (texts, ["time", "cannot be read"]),
    "objects": (
        lambda p, s: np.savez(p, **{**s, "time": np.array([1, "a"], dtype=object)}),
        ["time", "numbers"],
    ),
    "no archive": (lambda p, s: p.write_bytes(b"PK\x03\x04" + bytes(99)), ["NPZ"]),
}


@pytest.mark.parametrize("case", NPZ)
def test_what_cannot_be_read_of_npz_names_the_array(
    sound: Datasets, tmp_path: Path, case: str
) -> None:
    write, words = NPZ[case]
    path = tmp_path / "lab.npz"
    write(path, sound)
    text = refusal(path)
    for word in words:
        assert word in text


def test_paths_that_are_no_files_are_refused(tmp_path: Path) -> None:
    (tmp_path / "lab.h5").mkdir()
    assert "directory" in refusal(tmp_path / "lab.h5")
    assert "no such file" in refusal(tmp_path / "none.h5")
    refusal(tmp_path / ("x" * 300 + ".h5"))


def test_a_file_given_twice_is_refused(sound: Datasets, tmp_path: Path) -> None:
    path = write_hdf5(tmp_path / "lab.h5", sound)
    with pytest.raises(UserError, match="twice"):
        read_recordings([path, path.parent / "." / path.name], MESH)


def test_groups_that_hold_each_other_are_read_once(sound: Datasets, tmp_path: Path) -> None:
    path = write_hdf5(tmp_path / "lab.h5", sound)
    with h5py.File(path, "a") as file:
        file["garment/again"] = file["/"]
    (read,) = read_recordings([path], MESH, DENSITY)
    assert read.notes == ()


def test_recording_2_comes_before_recording_10(sound: Datasets, tmp_path: Path) -> None:
    path = tmp_path / "lab.h5"
    with h5py.File(path, "w") as file:
        for name in ("recording_10", "recording_2"):
            for key, value in sound.items():
                file[f"{name}/{key}"] = value
    assert [r.name for r in read_recordings([path], MESH)] == ["recording_2", "recording_10"]


def test_what_is_not_used_is_told_and_what_may_be_meant_is_asked(
    sound: Datasets, tmp_path: Path
) -> None:
    more = {**sound, "arm/left/q": np.zeros((5, 7))}
    (read,) = read_recordings([write_hdf5(tmp_path / "more.h5", more)], MESH, DENSITY)
    assert read.notes == ("not used: arm/left/q",)
    renamed = {k.replace("marker_position", "marker_positions"): v for k, v in sound.items()}
    text = refusal(write_hdf5(tmp_path / "renamed.h5", renamed))
    assert "garment/marker_positions meant" in text
    del more["gripper/right/force"]
    (read,) = read_recordings([write_hdf5(tmp_path / "less.h5", more)], MESH, DENSITY)
    assert read.gripper_force is None
    assert "gripper/left/force" in " ".join(read.notes)
