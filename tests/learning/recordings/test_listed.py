"""Files are listed with settings of their own, and all that is wrong is told at once."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drake_dress.errors import UserError
from drake_dress.learning.recordings import RecordingOptions, listed, read_all
from drake_dress.learning.recordings.listed import RATES, UNITS
from drake_dress.learning.recordings.reading import UPS
from tests.learning.recordings.test_reading import hanging, write_npz


@given(
    st.none() | st.sampled_from(UPS),
    st.none() | st.floats(*RATES),
    st.none() | st.floats(*UNITS),
)
def test_settings_of_a_file_come_before_those_of_all(
    up: str | None, rate: float | None, unit: float | None
) -> None:
    common = RecordingOptions(rate=60.0, up="-x", unit=0.25)
    said = {"up": up, "rate": rate, "unit": unit}
    words = [f"{key}={value}" for key, value in said.items() if value is not None]
    text = "no such/file.csv" + (f":{','.join(words)}" if words else "")
    found = listed(text, common)
    assert found.path == Path("no such/file.csv")
    for key, value in said.items():
        assert getattr(found.how, key) == (getattr(common, key) if value is None else value)


@pytest.mark.parametrize("text", ["a:b.csv", "plain.npz", "x=y.csv"])
def test_names_with_colons_or_equal_signs_are_names(text: str) -> None:
    assert listed(text).path == Path(text)


def test_an_existing_file_is_never_split(tmp_path: Path) -> None:
    path = tmp_path / "a:up=y"
    path.touch()
    assert listed(str(path)).path == path
    assert listed(str(path)).how == RecordingOptions()


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("a.csv:up=w", "a.csv:up=w: up: is 'w', expected one of x"),
        ("a.csv:rate=fast", "rate: is 'fast', expected a number from 1 to 2000"),
        ("a.csv:rate=0.5", "rate: is '0.5'"),
        ("a.csv:unit=nan", "unit: is 'nan', expected a number from 1e-06 to 10"),
        ("a.csv:up=z,hz=30", "hz: is no setting of a recording, expected up, rate or unit"),
    ],
)
def test_settings_that_are_wrong_are_told(text: str, told: str) -> None:
    with pytest.raises(UserError) as caught:
        listed(text)
    assert told in str(caught.value)


def test_all_files_that_cannot_be_used_are_told(tmp_path: Path) -> None:
    write_npz(tmp_path / "good.npz", hanging())
    write_npz(tmp_path / "unstamped.npz", hanging(), None)
    level = np.broadcast_to(hanging()[:1] * [1.0, 1.0, 0.01] + [0.3, 0.0, 0.0], (30, 6, 3)).copy()
    write_npz(tmp_path / "level.npz", level)
    names = ("good.npz", "unstamped.npz", "level.npz", "none.npz")
    told: list[str] = []
    with pytest.raises(UserError) as caught:
        read_all([listed(str(tmp_path / name)) for name in names], told.append)
    assert str(caught.value).startswith("--recordings: 3: of 4 cannot be used")
    for name in names[1:]:
        assert sum(line.startswith(str(tmp_path / name)) for line in told) == 1
    with pytest.raises(UserError) as caught:
        read_all([listed(str(tmp_path / name)) for name in names[:2]], told.append)
    assert "expected --rate HZ" in str(caught.value)
    (good, unstamped) = read_all(
        [listed(str(tmp_path / "good.npz")), listed(f"{tmp_path / 'unstamped.npz'}:rate=20")]
    )
    np.testing.assert_allclose(good.joints, unstamped.joints)


def test_files_of_one_name_are_told_from_each_other_by_their_folders(tmp_path: Path) -> None:
    files = ["a/one/walk.npz", "b/one/walk.npz", "b/two/walk.npz", "b/two/sit.npz"]
    for name in files:
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        write_npz(tmp_path / name, hanging())
    found = read_all([listed(str(tmp_path / name)) for name in files])
    assert [m.name for m in found] == ["a/one/walk", "b/one/walk", "two/walk", "sit"]


def test_one_file_twice_is_no_endless_search(tmp_path: Path) -> None:
    write_npz(tmp_path / "walk.npz", hanging())
    twice = [listed(str(tmp_path / "walk.npz"))] * 2
    assert len({m.name for m in read_all(twice)}) == 1
    assert read_all([]) == []
