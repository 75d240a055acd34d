"""What a motion-capture system reports of markers that it lost is found, told and not used."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from drake_dress.discrepancy.reading import read_recordings
from drake_dress.discrepancy.recording import Recording
from drake_dress.models.arrays import BoolArray, FloatArray
from tests.discrepancy.hanging import DENSITY, MESH, arrays, hanging, write_npz

Read = Callable[..., tuple[Recording, Recording]]

MARKERS, PLACES = "garment/marker_position", "garment/marker_rest_position"


@pytest.fixture
def read(tmp_path: Path) -> Read:
    """Returns what is read of a recording whose markers were changed, and the recording."""

    def run(
        change: Callable[[FloatArray], None], seed: int = 0, **how: Any
    ) -> tuple[Recording, Recording]:
        sound = hanging(np.random.default_rng(seed), **how)
        datasets = arrays(sound)
        change(datasets[MARKERS])
        write_npz(tmp_path / "lab.npz", datasets)
        (found,) = read_recordings([tmp_path / "lab.npz"], MESH, DENSITY)
        return found, sound

    return run


def assert_only(found: Recording, sound: Recording, bad: BoolArray) -> None:
    """Asserts that just these markers and samples are not seen, and that all else is as it was."""
    np.testing.assert_array_equal(np.isnan(found.marker_position).all(axis=2), bad)
    np.testing.assert_array_equal(found.marker_position[~bad], sound.marker_position[~bad])


def bad_at(sound: Recording, samples: slice, *markers: int) -> BoolArray:
    bad = np.zeros(sound.marker_position.shape[:2], dtype=bool)
    for k in markers:
        bad[samples, k] = True
    return bad


def nearest(sound: Recording, k: int, n: int = 1) -> int:
    """Returns the n-th nearest marker to marker k at rest."""
    away = np.linalg.norm(sound.marker_rest_position - sound.marker_rest_position[k], axis=1)
    return int(np.argsort(away)[n])


@pytest.mark.parametrize("value", [0.0, -1.0, -9999.0, 9999.0, 1e6, np.inf, (999.0, 0.0, 0.0)])
def test_values_that_stand_for_a_lost_marker_are_not_positions(
    read: Read, value: float | tuple[float, float, float]
) -> None:
    def change(x: FloatArray) -> None:
        x[40:60, 5] = value

    found, sound = read(change)
    assert_only(found, sound, bad_at(sound, slice(40, 60), 5))
    assert len(found.notes) == 1
    assert "marker 5 at samples 40–59" in found.notes[0]


def test_zeros_of_all_markers_now_and_then_are_each_told(read: Read) -> None:
    lost = np.random.default_rng(1).random((201, 24)) < 0.1

    def change(x: FloatArray) -> None:
        x[lost] = 0.0

    found, sound = read(change)
    assert_only(found, sound, lost)
    told = " ".join(found.notes)
    assert all(f"marker {k} at" in told for k in range(24))


@pytest.mark.parametrize("count", [1, 3, 15])
def test_a_position_that_repeats_exactly_is_no_measurement(read: Read, count: int) -> None:
    def change(x: FloatArray) -> None:
        x[80 : 80 + count, 7] = x[79, 7]

    found, sound = read(change)
    assert_only(found, sound, bad_at(sound, slice(80, 80 + count), 7))
    assert "repeats" in found.notes[0]


def test_what_is_stored_with_few_digits_may_repeat(read: Read) -> None:
    def change(x: FloatArray) -> None:
        x[:] = np.round(x, 3)

    found, _ = read(change, noise=3e-4)
    assert (np.diff(found.marker_position[:40], axis=0) == 0.0).all(axis=2).any()
    assert not np.isnan(found.marker_position).any()


@pytest.mark.parametrize("rate", [50.0, 100.0, 200.0])
@pytest.mark.parametrize(("count", "size"), [(1, 0.07), (2, 0.07), (5, 0.1), (20, 0.3)])
def test_a_marker_that_is_elsewhere_for_a_while_is_not_seen_then(
    read: Read, rate: float, count: int, size: float
) -> None:
    rng = np.random.default_rng(int(rate) + count)
    begin, marker = int(rng.integers(40, 60)), int(rng.integers(24))
    away = rng.standard_normal(3)
    away *= size / np.linalg.norm(away)

    def change(x: FloatArray) -> None:
        x[begin : begin + count, marker] += away

    found, sound = read(change, rate=rate)
    assert_only(found, sound, bad_at(sound, slice(begin, begin + count), marker))
    assert "jumps" in found.notes[0]
    assert f"marker {marker} at" in found.notes[0]


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize(("begin", "end"), [(90, 91), (90, 120), (0, 60), (150, 201), (60, 201)])
def test_markers_that_exchange_places_are_not_seen_meanwhile(
    read: Read, seed: int, begin: int, end: int
) -> None:
    sound = hanging(np.random.default_rng(seed))
    one = seed
    other = nearest(sound, one, 1 + seed % 2)

    def change(x: FloatArray) -> None:
        x[begin:end, [one, other]] = x[begin:end, [other, one]]

    found, sound = read(change, seed)
    assert_only(found, sound, bad_at(sound, slice(begin, end), one, other))
    (note,) = found.notes
    assert "exchange" in note
    assert all(f" {k} " in note for k in (one, other))


def test_markers_that_are_exchanged_all_along_are_not_seen(read: Read) -> None:
    other = nearest(hanging(np.random.default_rng(0)), 2)

    def change(x: FloatArray) -> None:
        x[:, [2, other]] = x[:, [other, 2]]

    found, sound = read(change)
    assert_only(found, sound, bad_at(sound, slice(None), 2, other))


def test_three_markers_that_take_each_others_places_are_not_seen(read: Read) -> None:
    def change(x: FloatArray) -> None:
        x[90:110, [1, 2, 3]] = x[90:110, [2, 3, 1]]

    found, sound = read(change)
    assert_only(found, sound, bad_at(sound, slice(90, 110), 1, 2, 3))


def test_a_marker_that_slides_off_farther_than_cloth_reaches_is_not_seen_there(read: Read) -> None:
    def change(x: FloatArray) -> None:
        x[60:180, 4] += np.sin(np.linspace(0.0, np.pi, 120))[:, None] * [0.0, 0.0, 1.5]

    found, _ = read(change, markers=40)
    gone = np.asarray(np.isnan(found.marker_position).all(axis=2))
    assert gone[90:150, 4].all()
    assert not gone[:60, 4].any()
    assert not gone[180:, 4].any()
    assert not np.delete(gone, 4, axis=1).any()
    assert "reaches" in " ".join(found.notes)


@pytest.mark.parametrize("noise", [3e-4, 1e-3, 5e-3])
@pytest.mark.parametrize("rate", [25.0, 50.0, 100.0, 500.0])
def test_honest_data_are_left_as_they_are(read: Read, noise: float, rate: float) -> None:
    found, sound = read(lambda x: None, int(rate), noise=noise, rate=rate)
    assert_only(found, sound, bad_at(sound, slice(0, 0)))
    assert found.notes == ()
