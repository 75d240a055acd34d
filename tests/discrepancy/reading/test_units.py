"""Every signal is held against the others: units, rate, axes, sides and signs."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from drake_dress.discrepancy.reading import read_recordings
from drake_dress.discrepancy.recording import Recording
from drake_dress.errors import UserError
from drake_dress.models.arrays import FloatArray
from tests.discrepancy.hanging import DENSITY, MESH, Datasets, arrays, hanging, write_npz

Change = Callable[[Datasets], None]

Read = Callable[..., Recording]

MARKERS, PLACES = "garment/marker_position", "garment/marker_rest_position"
JOINTS = "human/joint_position"
GRIPPERS = [f"gripper/{side}/position" for side in ("left", "right")]
FORCES = [f"gripper/{side}/force" for side in ("left", "right")]


@pytest.fixture
def read(tmp_path: Path) -> Read:
    """Returns what is read of a recording that was changed."""

    def run(
        change: Change, rng: np.random.Generator | None = None, density: float | None = DENSITY
    ) -> Recording:
        datasets = arrays(hanging(rng or np.random.default_rng(1)))
        change(datasets)
        write_npz(tmp_path / "lab.npz", datasets)
        (found,) = read_recordings([tmp_path / "lab.npz"], MESH, density)
        return found

    return run


def scaled(names: Sequence[str], factor: float) -> Change:
    def change(datasets: Datasets) -> None:
        for name in names:
            datasets[name] = datasets[name] * factor

    return change


def y_up(names: Sequence[str]) -> Change:
    def change(datasets: Datasets) -> None:
        for name in names:
            x, y, z = np.moveaxis(datasets[name], -1, 0)
            datasets[name] = np.stack([x, z, -y], axis=-1)

    return change


def mirrored(datasets: Datasets) -> None:
    for name in (MARKERS, JOINTS, *GRIPPERS):
        datasets[name] = datasets[name] * [1.0, -1.0, 1.0]


def exchanged(datasets: Datasets) -> None:
    datasets[GRIPPERS[0]], datasets[GRIPPERS[1]] = datasets[GRIPPERS[1]], datasets[GRIPPERS[0]]


def clock(change: Callable[[FloatArray], npt.NDArray[Any]]) -> Change:
    def changed(datasets: Datasets) -> None:
        datasets["time"] = change(datasets["time"])

    return changed


def lost(name: str, at: int | tuple[int, int], value: float | FloatArray = 0.0) -> Change:
    def change(datasets: Datasets) -> None:
        datasets[name][at] = value

    return change


LENGTHS = {"millimetres": 1e3, "centimetres": 1e2, "inches": 39.37, "feet": 3.281}
WRONG = {
    **{
        f"{name} in {unit}": (scaled([name], factor), [name, "metres", unit])
        for name in (MARKERS, PLACES, JOINTS, *GRIPPERS)
        for unit, factor in LENGTHS.items()
    },
    "all in mm": (scaled([MARKERS, PLACES, JOINTS, *GRIPPERS], 1e3), [PLACES, "millimetres"]),
    "time in ms": (clock(lambda t: 1e3 * t), ["time", "10 s apart", "milliseconds"]),
    "frame numbers": (clock(lambda t: np.arange(len(t))), ["time", "1 s apart", "frame numbers"]),
    "ns since 1970": (clock(lambda t: 1e9 * (1.7e9 + t)), ["time", "nanoseconds"]),
    "32-bit seconds": (clock(lambda t: (1.7e9 + t).astype("f4")), ["time", "increase"]),
    "time in minutes": (clock(lambda t: t / 60.0), ["time", "covers"]),
    "a gap of a day": (clock(lambda t: t + 86400.0 * (t > 1.0)), ["time", "gap", "sample 100"]),
    "a gap of a second": (clock(lambda t: t + (t > 1.0)), ["time", "gap of 1.01 s"]),
    "samples 0.2 s apart": (clock(lambda t: 20.0 * t), ["time", "0.2 s apart"]),
    "forces in mN": (scaled(FORCES, 1e3), ["force", "2.62e+03", "millinewtons", "weight"]),
    "forces in grams": (scaled(FORCES, 102.0), ["force", "grams"]),
    "forces in kgf": (scaled(FORCES, 0.102), ["force", "kilograms"]),
    "forces in pounds": (scaled(FORCES, 0.2248), ["force", "pounds"]),
    "no force": (scaled(FORCES, 0.0), ["force", "is 0 N", "weight"]),
    "reversed forces": (scaled(FORCES, -1.0), ["force", "up", "sign is reversed"]),
    "one reversed force": (scaled(FORCES[:1], -1.0), [FORCES[0], "sign is reversed"]),
    "forces y up": (y_up(FORCES), ["force", "along -y", "z up"]),
    "world y up": (y_up([MARKERS, JOINTS, *GRIPPERS, *FORCES]), [MARKERS, "+y", "z up"]),
    "rest places y up": (y_up([PLACES]), [PLACES]),
    "person y up": (y_up([JOINTS]), [JOINTS, "z up"]),
    "left-handed axes": (mirrored, [MARKERS, "mirror"]),
    "grippers exchanged": (exchanged, ["gripper", "left"]),
    "a place at the origin": (lost(PLACES, 4), [PLACES, "marker 4", "origin"]),
    "two at one place": (lambda d: lost(PLACES, 4, d[PLACES][5])(d), [PLACES, "same place"]),
    "a hand that was lost": (lost(JOINTS, (50, 2)), [JOINTS, "left_hand", "sample 50"]),
    "a gripper that was lost": (lost(GRIPPERS[1], 50), [GRIPPERS[1], "jumps", "50"]),
}


@pytest.mark.parametrize("case", WRONG)
def test_what_cannot_be_is_refused_with_what_it_may_be(read: Read, case: str) -> None:
    change, words = WRONG[case]
    with pytest.raises(UserError) as error:
        read(change)
    for word in words:
        assert word in str(error.value)


@pytest.mark.parametrize("seed", range(5))
def test_what_is_sound_is_read_without_a_word(read: Read, seed: int) -> None:
    found = read(lambda d: None, np.random.default_rng(seed), DENSITY if seed % 2 else None)
    assert found.notes == ()


def test_a_clock_may_count_from_1970(read: Read) -> None:
    found = read(clock(lambda t: 1.7e9 + t))
    assert found.time[0] == 0.0
    assert found.duration == pytest.approx(2.0)
    assert "1.7e+09" in found.notes[0]


@pytest.mark.parametrize("share", [0.4, 2.5])
@pytest.mark.parametrize("tilt", [-15.0, 15.0])
def test_a_garment_may_be_lighter_or_heavier_and_the_world_not_level(
    read: Read, share: float, tilt: float
) -> None:
    c, s = np.cos(np.deg2rad(tilt)), np.sin(np.deg2rad(tilt))

    def change(datasets: Datasets) -> None:
        for name in FORCES:
            datasets[name] = share * datasets[name] @ [[1, 0, 0], [0, c, s], [0, -s, c]]

    assert read(change).notes == ()


def test_noise_that_the_data_do_not_have_is_told(read: Read) -> None:
    def change(datasets: Datasets) -> None:
        datasets[f"{MARKERS}/noise_std"] = np.array(1e-5)

    found = read(change)
    assert found.marker_noise == 1e-5
    assert "scatter by 0.00" in found.notes[0]


def test_markers_that_are_mixed_up_are_told(read: Read) -> None:
    def change(datasets: Datasets) -> None:
        order = np.random.default_rng(0).permutation(len(datasets[PLACES]))
        datasets[PLACES] = datasets[PLACES][order]

    with pytest.raises(UserError, match="mixed up"):
        read(change)
