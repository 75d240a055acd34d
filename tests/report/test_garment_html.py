"""The page shows the verdict, the drawings and the measures, and needs nothing else."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from drake_dress.drawing import pixels
from drake_dress.models.arrays import FloatArray
from drake_dress.report.garment_drawing import draw_garment
from drake_dress.report.garment_html import garment_page
from tests.closed_coat import closed_coat
from tests.report.browser import needs_chromium, screenshot
from tests.report.test_garment_look import COAT, look


def shown(page: str) -> str:
    """Returns the text of a page."""
    return re.sub(r"<[^>]+>", " ", re.sub(r"<style>.*?</style>", "", page, flags=re.DOTALL))


def test_a_garment_that_fits_is_told_so_on_a_page_that_needs_nothing_else() -> None:
    page = garment_page(look())
    assert "It fits" in shown(page)
    assert not re.search(r'(src|href)="(?!data:)', page)
    assert "http" not in re.sub(r"base64,[^\"]*", "", page)
    assert "coat &lt;1&gt;" in page
    assert "<1>" not in page


def test_the_same_garment_gives_the_same_page() -> None:
    assert garment_page(look()) == garment_page(look())


def test_what_cannot_go_on_is_told_with_its_reason() -> None:
    page = shown(garment_page(look(closed_coat(COAT))))
    assert "It cannot go on" in page
    assert "Closed front" in page
    small = shown(garment_page(look(COAT.scaled(0.5))))
    assert "The cuffs are narrower than the hand: 18.0 cm and 25.1 cm." in small
    assert "too narrow" in small


def test_every_opening_has_a_row_with_its_girth() -> None:
    given = look()
    page = shown(garment_page(given))
    for loop in given.sizes.loops:
        pattern = rf"{loop.name.replace('_', ' ')}\s+{100.0 * loop.girth:.1f} cm"
        assert re.search(pattern, page), loop.name


@pytest.mark.parametrize("factor", [0.4, 2.5])
def test_garments_of_any_size_are_drawn_whole(factor: float) -> None:
    picture = pixels(draw_garment(look(COAT.scaled(factor))))[:, :, :3].astype(float)
    edge = np.concatenate([picture[:3].reshape(-1, 3), picture[-3:].reshape(-1, 3)])
    assert (edge > 250.0).mean() > 0.9
    assert bluish(picture).mean() > 0.02


def test_the_back_shows_more_of_the_outside_than_the_open_front() -> None:
    picture = pixels(draw_garment(look()))[:, :, :3].astype(float)
    half = bluish(picture)[: len(picture) // 2]
    left, right = half[:, : half.shape[1] // 2], half[:, half.shape[1] // 2 :]
    # the back is closed, and the front shows the lining between its edges
    assert right.sum() > 1.2 * left.sum()


def bluish(picture: FloatArray) -> np.ndarray:
    return (picture[..., 2] - picture[..., 0] > 30.0) & (picture[..., 0] < 180.0)


@needs_chromium
def test_the_page_is_shown_by_a_browser(tmp_path: Path) -> None:
    path = tmp_path / "garment.html"
    path.write_text(garment_page(replace(look(), name="coat")))
    picture = screenshot(path.as_uri(), tmp_path, "page")
    assert bluish(255.0 * picture).mean() > 0.02
