"""The replay opens from a file, without a server, and moves."""

from __future__ import annotations

import base64
import re
import zlib
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from drake_dress.errors import UserError
from drake_dress.report.log import RunLog
from drake_dress.report.person_skin import logged_skin
from drake_dress.report.replay_html import _encode, _frames, _skin_blob, write_replay_html
from tests.present import present
from tests.report import synthetic
from tests.report.browser import needs_chromium, screenshot


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("replay")
    garment = synthetic.coat(0.05)
    path = synthetic.write(folder / "run.h5", garment, synthetic.dressing(garment))
    with RunLog.open(path) as log:
        write_replay_html(log, folder / "replay.html")
    return folder / "replay.html"


def test_nothing_is_loaded_from_elsewhere(page: Path) -> None:
    text = page.read_text()
    assert not re.search(r"https?://|src=|@import|<link", text)
    assert "@positions@" not in text
    assert "@META@" not in text


@needs_chromium
def test_limbs_that_grow_toward_their_ends_look_thicker(page: Path, tmp_path: Path) -> None:
    garment = synthetic.coat(0.05)
    grown = synthetic.write(tmp_path / "run.h5", garment, synthetic.dressing(garment), taper=1.8)
    with RunLog.open(grown) as log:
        write_replay_html(log, tmp_path / "replay.html")

    def skin(of: Path, name: str) -> float:
        picture = screenshot(f"{of.as_uri()}#t=0", tmp_path, name)[170:530]
        red, blue = picture[:, :, 0], picture[:, :, 2]
        return float(((red > blue + 0.12) & (red > 0.4)).mean())

    plain = skin(page, "plain")
    assert plain > 0.002
    assert skin(tmp_path / "replay.html", "grown") > 1.15 * plain


BODY = "person: {body: {sex: male, age: 50, height: 1.8, weight: 85}}\n"


def test_skin_is_posed_from_what_the_page_holds(tmp_path: Path) -> None:
    """Vertices at rest, motions of bones and weights give the vertices of each frame."""
    garment = synthetic.coat(0.06)
    data = synthetic.dressing(garment, count=4)
    path = synthetic.write(tmp_path / "run.h5", garment, data, scenario=BODY)
    with RunLog.open(path) as log:
        skin = present(logged_skin(log))
        n, count = len(skin.skin.vertices), len(skin.faces)
        packed = zlib.decompress(base64.b64decode(_skin_blob(skin, np.arange(4))))
        ends = np.cumsum([0, 12 * n, 4 * 9 * 12 * 4, 6 * count, 9 * n])
        assert len(packed) == ends[-1]
        rest, moving, faces, weights = (packed[a:b] for a, b in pairwise(ends))
        assert np.array_equal(np.frombuffer(faces, "<u2").reshape(-1, 3), skin.faces)
        w = np.frombuffer(weights, "u1").reshape(n, 9).astype(float)
        w /= w.sum(axis=1, keepdims=True)
        motions = np.frombuffer(moving, "<f4").reshape(4, 9, 3, 4).astype(float)
        at_rest = np.column_stack([np.frombuffer(rest, "<f4").reshape(n, 3), np.ones(n)])
        for i in range(4):
            found = np.einsum("nb,bij,nj->ni", w, motions[i], at_rest)
            # 1/255 of a weight, for two bones that are a hand's breadth apart
            assert found == pytest.approx(skin.vertices(i), abs=2e-3)


@needs_chromium
def test_page_shows_the_skin(page: Path, tmp_path: Path) -> None:
    garment = synthetic.coat(0.05)
    data = synthetic.dressing(garment)
    path = synthetic.write(tmp_path / "run.h5", garment, data, scenario=BODY)
    with RunLog.open(path) as log:
        write_replay_html(log, tmp_path / "replay.html")
    assert (tmp_path / "replay.html").stat().st_size - page.stat().st_size < 300_000

    def skin(of: Path, name: str) -> float:
        picture = screenshot(f"{of.as_uri()}#t=0", tmp_path, name)[170:530]
        red, blue = picture[:, :, 0], picture[:, :, 2]
        return float(((red > blue + 0.12) & (red > 0.4)).mean())

    with_skin, without = skin(tmp_path / "replay.html", "skin"), skin(page, "cones")
    # the synthetic person of cones is thin and has no legs
    assert with_skin > 1.5 * without


@needs_chromium
def test_garment_moves_and_the_rest_stays(page: Path, tmp_path: Path) -> None:
    first = screenshot(f"{page.as_uri()}#t=0", tmp_path, "first")
    again = screenshot(f"{page.as_uri()}#t=0", tmp_path, "again")
    later = screenshot(f"{page.as_uri()}#t=10", tmp_path, "later")
    assert np.abs(first - again).max() < 0.05

    def garment(picture: np.ndarray) -> np.ndarray:
        blue = picture[:, :, 2] > picture[:, :, 0] + 0.2
        blue[:170] &= False  # the panels
        blue[530:] &= False
        return blue

    before, after = garment(first), garment(later)
    assert before.mean() > 0.02
    assert after.mean() > 0.02
    moved = np.abs(first - later).max(axis=2) > 0.1
    assert moved[before ^ after].mean() > 0.9
    # far from the garment, the ground and the background are as they were
    assert not moved[200:520, :150].any()
    assert not moved[200:520, -150:].any()


@needs_chromium
def test_plays_by_itself(page: Path, tmp_path: Path) -> None:
    opened = screenshot(f"{page.as_uri()}#t=0", tmp_path, "opened")
    playing = screenshot(page.as_uri(), tmp_path, "playing")
    moved = np.abs(opened - playing).max(axis=2) > 0.1
    # How many frames fit into the page's time is the machine's affair; the panels do not count.
    assert moved[170:530].mean() > 1e-3


def test_encoding_is_undone_exactly() -> None:
    steps = np.random.default_rng(0).integers(0, 65001, size=(4, 5, 3))
    raw = np.frombuffer(zlib.decompress(base64.b64decode(_encode(steps))), dtype=np.uint8)
    half = len(raw) // 2
    zigzag = raw[:half].astype(np.int64) | (raw[half:].astype(np.int64) << 8)
    difference = (zigzag >> 1) ^ -(zigzag & 1)
    decoded = np.cumsum(difference.reshape(4, 3, 5), axis=0) % 65536
    np.testing.assert_array_equal(decoded.transpose(0, 2, 1), steps)


def test_frames_keep_first_and_last() -> None:
    time = np.arange(0.0, 2.0, 0.013)
    frames = _frames(time, 15.0)
    assert frames[0] == 0
    assert frames[-1] == len(time) - 1
    assert np.all(np.diff(frames) > 0)
    np.testing.assert_allclose(np.diff(time[frames]), 1 / 15, atol=0.014)
    assert _frames(time[:1], 15.0).tolist() == [0]


def test_size_is_kept_below_its_limit(page: Path, tmp_path: Path) -> None:
    limit = page.stat().st_size - 2_000
    with RunLog.open(page.parent / "run.h5") as log:
        write_replay_html(log, tmp_path / "small.html", max_bytes=limit)
    assert (tmp_path / "small.html").stat().st_size <= limit


def test_long_logs_have_fewer_frames_a_second(page: Path, tmp_path: Path) -> None:
    """Half of them, and half of that, until as many are left as may be."""

    def count(**limits: int) -> tuple[int, int]:
        with RunLog.open(page.parent / "run.h5") as log:
            write_replay_html(log, tmp_path / "some.html", **limits)
            meta = re.search(r'"frames": (\d+)', (tmp_path / "some.html").read_text())
            return int(present(meta).group(1)), len(log.rest_position)

    every, nodes = count()
    few, _ = count(max_nodes=every * nodes // 3)
    assert every // 6 < few <= every // 3
    assert count(max_nodes=1)[0] >= 1


def test_empty_log_is_refused(tmp_path: Path) -> None:
    path = synthetic.write(tmp_path / "run.h5", synthetic.coat(0.06), [])
    with RunLog.open(path) as log, pytest.raises(UserError):
        write_replay_html(log, tmp_path / "replay.html")
    assert not (tmp_path / "replay.html").exists()
