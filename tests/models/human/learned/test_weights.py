"""Files of weights: numbers come back as they were, and every damage is one plain error."""

from __future__ import annotations

import io
import json
import pickle
import struct
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from safetensors.numpy import save_file

from drake_dress.errors import UserError
from drake_dress.models.human.learned import weights as module
from drake_dress.models.human.learned.weights import (
    INTENT,
    MOTION,
    intent_shapes,
    motion_shapes,
    networks,
    read_weights,
    write_weights,
)
from tests.models.human.learned.drawn import drawn_networks

SHAPES = {"some.weight": (2, 3), "some.bias": (3,)}
SOUND = {"some.weight": np.arange(6.0).reshape(2, 3), "some.bias": np.array([1.0, -2.5, 1e-3])}


def single(arrays: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    return {k: v.astype(np.float32) for k, v in arrays.items()}


def refused(path: Path) -> UserError:
    """Returns the error, which is of one line and names the file."""
    with pytest.raises(UserError) as caught:
        read_weights(path, SHAPES)
    text = str(caught.value)
    assert text.startswith(str(path))
    assert "\n" not in text
    return caught.value


def test_weights_come_back_as_they_were_written(tmp_path: Path) -> None:
    path = tmp_path / "w.safetensors"
    write_weights(path, SOUND, {"seed": "1"})
    found = read_weights(path, SHAPES)
    assert list(found) == list(SHAPES)
    for name, array in single(SOUND).items():
        assert found[name].dtype == np.float32
        np.testing.assert_array_equal(found[name], array)
    # what is more in the file is left out
    write_weights(path, SOUND | {"other": np.zeros(2)}, {})
    assert list(read_weights(path, SHAPES)) == list(SHAPES)


def test_strided_arrays_and_other_precisions_are_written_as_they_look(tmp_path: Path) -> None:
    path = tmp_path / "w.safetensors"
    wide = np.arange(12, dtype=np.int64).reshape(3, 4).T[::2]
    write_weights(path, {"some.weight": wide, "some.bias": SOUND["some.bias"][::-1]}, {})
    found = read_weights(path, SHAPES)
    np.testing.assert_array_equal(found["some.weight"], wide)
    np.testing.assert_array_equal(found["some.bias"], single(SOUND)["some.bias"][::-1])


@pytest.mark.parametrize(
    ("name", "array", "words"),
    [
        ("some.bias", None, "is missing"),
        ("some.bias", np.zeros(4, dtype=np.float32), "is float32 [4], expected float32 [3]"),
        ("some.weight", np.zeros((3, 2), dtype=np.float32), "[3, 2], expected float32 [2, 3]"),
        ("some.weight", np.zeros((2, 3)), "is float64 [2, 3], expected float32 [2, 3]"),
        ("some.weight", np.zeros((2, 3), dtype=np.int32), "is int32"),
        ("some.bias", np.zeros(3, dtype=np.float16), "is float16"),
        ("some.bias", np.array([0.0, np.nan, 0.0], dtype=np.float32), "not finite"),
        ("some.bias", np.array([0.0, np.inf, 0.0], dtype=np.float32), "not finite"),
    ],
)
def test_what_is_wrong_with_an_array_is_told_with_its_name(
    name: str, array: np.ndarray | None, words: str, tmp_path: Path
) -> None:
    path = tmp_path / "w.safetensors"
    arrays: dict[str, np.ndarray] = single(SOUND)
    if array is None:
        del arrays[name]
    else:
        arrays[name] = array
    save_file(arrays, path)
    error = refused(path)
    assert name in str(error)
    assert words in str(error)


class _Harmful:
    """Writes a file when it is unpickled."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def __reduce__(self) -> tuple[object, tuple[str, str]]:
        return open, (str(self.path), "w")


def test_files_that_are_no_weights_are_refused_and_run_no_code(tmp_path: Path) -> None:
    path, trace = tmp_path / "w.safetensors", tmp_path / "ran"
    refused(path)  # not there
    refused(tmp_path)  # a folder
    buffer = io.BytesIO()
    np.savez(buffer, **SOUND)  # type: ignore[arg-type]
    pickled = pickle.dumps({"some.weight": _Harmful(trace)})
    for content in (b"", b"\0", b"garbage", pickled, buffer.getvalue(), b"\xff" * 100):
        path.write_bytes(content)
        assert "expected weights written by drake-dress train" in str(refused(path))
    assert not trace.exists()


@pytest.mark.parametrize("kind", ["BF16", "F8_E4M3", "F8_E5M2", "BOOL", "C64", "F99"])
def test_kinds_of_numbers_that_numpy_has_not_are_refused(kind: str, tmp_path: Path) -> None:
    path = tmp_path / "w.safetensors"
    size = {"BF16": 2, "C64": 8}.get(kind, 1)
    header: dict[str, object] = {
        "some.weight": {"dtype": kind, "shape": [2, 3], "data_offsets": [0, 6 * size]},
        "some.bias": {"dtype": kind, "shape": [3], "data_offsets": [6 * size, 9 * size]},
    }
    text = json.dumps(header).encode()
    path.write_bytes(struct.pack("<Q", len(text)) + text + bytes(9 * size))
    refused(path)


@given(data=st.data())
@settings(max_examples=80, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_damaged_files_are_refused_or_hold_other_numbers(
    data: st.DataObject, tmp_path: Path
) -> None:
    """Bytes are changed, cut off or added anywhere."""
    path = tmp_path / "w.safetensors"
    write_weights(path, SOUND, {"seed": "1"})
    content = bytearray(path.read_bytes())
    how = data.draw(st.sampled_from(["changed", "cut", "added"]))
    at = data.draw(st.integers(0, len(content) - 1))
    if how == "changed":
        content[at] ^= data.draw(st.integers(1, 255))
    elif how == "cut":
        del content[at:]
    else:
        content[at:at] = data.draw(st.binary(min_size=1, max_size=9))
    path.write_bytes(content)
    try:
        found = read_weights(path, SHAPES)
    except UserError as error:
        assert str(error).startswith(str(path))
    else:
        assert how == "changed"
        assert {k: v.shape for k, v in found.items()} == SHAPES
        assert all(np.isfinite(v).all() for v in found.values())


def test_networks_of_a_folder_are_read(tmp_path: Path) -> None:
    drawn = drawn_networks(3)
    write_weights(tmp_path / INTENT, drawn.intent, {})
    write_weights(tmp_path / MOTION, drawn.motion, {})
    found = networks(tmp_path)
    for part in ("intent", "motion"):
        for name, array in getattr(drawn, part).items():
            np.testing.assert_array_equal(getattr(found, part)[name], array)
    np.testing.assert_array_equal(found.linear.map, drawn.motion["linear.map"])


def test_drawn_weights_have_all_names_and_shapes() -> None:
    drawn = drawn_networks(0)
    assert {k: v.shape for k, v in drawn.intent.items()} == intent_shapes()
    assert {k: v.shape for k, v in drawn.motion.items()} == motion_shapes()


def test_a_folder_without_weights_is_told(tmp_path: Path) -> None:
    write_weights(tmp_path / INTENT, drawn_networks(0).intent, {})
    with pytest.raises(UserError, match=MOTION):
        networks(tmp_path)


def test_a_write_that_fails_leaves_the_file_that_was_there(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "w.safetensors"
    write_weights(path, SOUND, {})

    def fails(*_: object) -> None:
        raise OSError("no space left on device")

    monkeypatch.setattr(module, "save_file", fails)
    with pytest.raises((OSError, UserError)):
        write_weights(path, {"some.bias": np.zeros(3)}, {})
    assert list(read_weights(path, SHAPES)) == list(SHAPES)
    assert [p.name for p in tmp_path.iterdir()] == [path.name]
