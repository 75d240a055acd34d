"""CSV in the dialects of spreadsheets, and markers that are matched by their numbers."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from drake_dress.discrepancy.reading import read_recordings
from drake_dress.discrepancy.recording import Recording
from drake_dress.errors import UserError
from tests.discrepancy.hanging import DENSITY, MESH, arrays, csv_text, hanging, places_text

Read = Callable[..., Recording]

SOUND = arrays(hanging(np.random.default_rng(0), duration=0.6, markers=8))
PLACES = SOUND["garment/marker_rest_position"]
TEXT = csv_text(SOUND)
LINES = TEXT.splitlines(keepends=True)


def comma(value: float) -> str:
    return repr(value).replace(".", ",")


@pytest.fixture
def read(tmp_path: Path) -> Read:
    def run(content: str | bytes, places: str | bytes | None = None) -> Recording:
        places = places_text(PLACES) if places is None else places
        for name, value in (("lab.csv", content), ("lab.markers.csv", places)):
            (tmp_path / name).write_bytes(value if isinstance(value, bytes) else value.encode())
        (found,) = read_recordings([tmp_path / "lab.csv"], MESH, DENSITY)
        return found

    return run


def assert_sound(found: Recording) -> None:
    np.testing.assert_array_equal(found.time, SOUND["time"])
    np.testing.assert_array_equal(found.marker_position, SOUND["garment/marker_position"])
    np.testing.assert_array_equal(found.marker_rest_position, PLACES)
    np.testing.assert_array_equal(found.joint_position, SOUND["human/joint_position"])


DIALECTS = {
    "plain": TEXT,
    "byte order mark": TEXT.encode("utf-8-sig"),
    "UTF-16": TEXT.encode("utf-16"),
    "UTF-16 without its mark": TEXT.encode("utf-16-le"),
    "Latin-1": "".join(
        line.rstrip("\n") + (",Länge\n" if k == 0 else ",ä\n") for k, line in enumerate(LINES)
    ).encode("latin-1"),
    "semicolons": csv_text(SOUND, ";"),
    "decimal commas": csv_text(SOUND, ";", comma),
    "tabs": csv_text(SOUND, "\t"),
    "sep=": "sep=;\n" + csv_text(SOUND, ";"),
    "CR LF": TEXT.replace("\n", "\r\n"),
    "CR": TEXT.replace("\n", "\r"),
    "empty lines": TEXT + "\n\n",
    "leading slashes": TEXT.replace("garment/", "/garment/"),
}


@pytest.mark.parametrize("dialect", DIALECTS)
def test_dialects_say_the_same(read: Read, dialect: str) -> None:
    assert_sound(read(DIALECTS[dialect]))


def with_cell(text: str) -> str:
    return LINES[0] + LINES[1].replace("0.0", text, 1) + "".join(LINES[2:])


BAD = {
    "a column twice": (
        "".join(f"{line.rstrip()},{line.split(',')[0]}\n" for line in LINES),
        ["time", "twice"],
    ),
    "NUL": ("".join([*LINES[:2], "\0", *LINES[2:]]), ["line 3", "NUL"]),
    "a short row": ("".join([*LINES[:5], "1,2\n", *LINES[5:]]), ["line 6", "2 values"]),
    "a long field": ("".join([*LINES[:5], '"' + "x" * 200_000 + '"\n']), ["line 6", "limit"]),
    "text": (with_cell("far"), ["line 2", "time", "'far'"]),
    "digits in groups": (with_cell("1_0"), ["line 2", "'1_0'"]),
    "no time": (with_cell(""), ["time", "nan"]),
    "a header alone": (LINES[0], ["empty"]),
    "units below the header": (
        LINES[0] + ",".join(["m"] * len(LINES[0].split(","))) + "\n" + "".join(LINES[1:]),
        ["line 2", "'m'"],
    ),
    "mixed commas and points": (csv_text(SOUND, ";", comma).replace(",", ".", 9), ["line"]),
    "a name in capitals": (TEXT.replace("time", "Time", 1), ["time", "Time"]),
    "bytes": (np.random.default_rng(0).bytes(3000), []),
    "an axis that lacks": (
        TEXT.replace("marker_position/4/y", "marker_position/4/q"),
        ["garment/marker_position/4/y", "missing"],
    ),
    "a joint that lacks": (TEXT.replace("joint_position/4/", "joint_position/9/"), ["joint 4"]),
    "one marker in two ways": (
        TEXT.replace("marker_position/4/", "marker_position/03/"),
        ["marker_position/03", "once"],
    ),
}


@pytest.mark.parametrize("case", BAD)
def test_what_is_no_table_of_numbers_is_refused(read: Read, tmp_path: Path, case: str) -> None:
    content, words = BAD[case]
    with pytest.raises(UserError) as error:
        read(content)
    for word in [str(tmp_path / "lab.csv"), *words]:
        assert word in str(error.value)


NUMBERS = {
    "one lacks": ([0, 1, 2, 4, 5, 6, 7, 8], "marker 3"),
    "one twice": ([0, 1, 2, 3, 3, 5, 6, 7], "marker 3"),
    "from 1": (range(1, 9), "marker 0"),
    "from -1": (range(-1, 7), "marker 7"),
    "fractions": ([k + 0.5 for k in range(8)], "marker 0"),
    "no number": (["nan"] * 8, "marker nan"),
    "one empty": (["", *range(1, 8)], "marker: one is empty"),
}


@pytest.mark.parametrize("case", NUMBERS)
def test_numbers_of_markers_are_those_of_the_columns(read: Read, tmp_path: Path, case: str) -> None:
    numbers, word = NUMBERS[case]
    with pytest.raises(UserError) as error:
        read(TEXT, places_text(PLACES, numbers))
    assert str(tmp_path / "lab.markers.csv") in str(error.value)
    assert word in str(error.value)
    assert "0 to 7" in str(error.value)


@pytest.mark.parametrize("places", ["", "marker,x,y,z\n", places_text(PLACES[:-1]), b"\xff\xfe\0"])
def test_places_that_lack_are_told(read: Read, tmp_path: Path, places: str | bytes) -> None:
    with pytest.raises(UserError) as error:
        read(TEXT, places)
    assert str(tmp_path / "lab.markers.csv") in str(error.value)


@pytest.mark.parametrize("seed", range(3))
def test_the_order_of_places_says_nothing(read: Read, seed: int) -> None:
    order = np.random.default_rng(seed).permutation(8)
    assert_sound(read(TEXT, places_text(PLACES[order], order)))


def test_markers_may_have_names_and_begin_at_any_number(read: Read) -> None:
    def renamed(name: Callable[[int], str]) -> str:
        text = TEXT
        for k in reversed(range(8)):
            text = text.replace(f"marker_position/{k}/", f"marker_position/{name(k)}/")
        return text

    for name in (lambda k: f"M{k}", lambda k: str(k + 1)):
        names = [name(k) for k in reversed(range(8))]
        assert_sound(read(renamed(name), places_text(PLACES[::-1], names)))
