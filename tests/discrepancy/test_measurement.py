"""Recordings that are given as arrays: taken as a file's are, refused with the field's name."""

from __future__ import annotations

from dataclasses import fields
from typing import Any

import numpy as np
import pytest

from drake_dress.discrepancy.measurement import Measurement
from drake_dress.discrepancy.reading import read_recordings
from drake_dress.discrepancy.reading.assembling import recording_of
from drake_dress.discrepancy.recording import Recording
from drake_dress.errors import UserError
from drake_dress.models.garment.sampling import spread_out
from tests.discrepancy.hanging import DENSITY, MESH, arrays, hanging, write_hdf5


def given(recording: Recording, **changes: Any) -> dict[str, Any]:
    """Returns a recording as the arguments of a measurement, its noise unknown."""
    names = [f.name for f in fields(Measurement) if not f.name.endswith("noise")]
    found = {n: getattr(recording, n) for n in names if n != "marker_node"}
    return {**found, **changes}


def test_arrays_are_taken_as_the_same_numbers_in_a_file_are(tmp_path: Any) -> None:
    r = hanging(np.random.default_rng(0))
    taken = recording_of(Measurement(**given(r)).raw(), MESH, DENSITY)
    (read,) = read_recordings([write_hdf5(tmp_path / "sway.h5", arrays(r))], MESH, DENSITY)
    for entry in fields(Recording):
        if entry.name not in ("name", "notes"):
            np.testing.assert_array_equal(getattr(taken, entry.name), getattr(read, entry.name))
    assert taken.name == "sway"


def test_markers_may_be_given_as_nodes() -> None:
    rng = np.random.default_rng(1)
    nodes = spread_out(MESH.rest_position, 24, 0)
    r = hanging(rng)
    places = MESH.rest_position[nodes]
    shifted = r.marker_position[:, :1] + (places - r.marker_rest_position[0])
    m = given(r, marker_rest_position=None, marker_node=nodes, marker_position=shifted)
    taken = recording_of(Measurement(**m).raw(), MESH, DENSITY)
    np.testing.assert_array_equal(taken.marker_rest_position, places)


def test_noise_that_is_given_is_used() -> None:
    m = Measurement(**given(hanging(np.random.default_rng(2))), marker_noise=2e-3, force_noise=0.1)
    taken = recording_of(m.raw(), MESH, DENSITY)
    assert (taken.marker_noise, taken.force_noise) == (2e-3, 0.1)


def test_only_what_has_to_be_there_is_asked_for() -> None:
    m = given(hanging(np.random.default_rng(3)), gripper_force=None, joint_position=None)
    taken = recording_of(Measurement(**m).raw(), MESH, DENSITY)
    assert taken.gripper_force is None
    assert taken.joint_position is None


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"gripper_position": np.zeros((201, 3))}, ["sway: gripper_position", "(time, 2, 3)"]),
        ({"marker_position": [["a"]]}, ["sway: marker_position", "numbers"]),
        ({"marker_rest_position": None}, ["marker_rest_position", "or marker_node"]),
        ({"marker_node": [1, 2]}, ["marker_rest_position", "not both"]),
        ({"marker_noise": -1.0}, ["sway: marker_noise", "above 0"]),
    ],
)
def test_what_cannot_be_a_recording_is_told_at_once(
    changes: dict[str, Any], words: list[str]
) -> None:
    with pytest.raises(UserError) as error:
        Measurement(**given(hanging(np.random.default_rng(4)), **changes))
    for word in words:
        assert word in str(error.value)


def test_what_the_garment_contradicts_is_told_when_it_is_held_against_it() -> None:
    r = hanging(np.random.default_rng(5))
    m = Measurement(**given(r, marker_position=1e3 * r.marker_position))
    with pytest.raises(UserError, match="sway: garment/marker_position"):
        recording_of(m.raw(), MESH, DENSITY)
