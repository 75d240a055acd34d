from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drake_dress.models.perception.segmentation_errors import SegmentationErrors, segmented

NONE = SegmentationErrors(outline=0.0, missed=0.0)
LABELS = np.zeros((200, 300), dtype=np.int32)
LABELS[50:150, 60:160] = 1
LABELS[50:150, 160:240] = 2


def test_without_errors_labels_stay() -> None:
    np.testing.assert_array_equal(segmented(LABELS, NONE, np.random.default_rng(0)), LABELS)


@given(st.floats(0.5, 4.0), st.integers(0, 2**32 - 1))
def test_only_pixels_near_an_outline_change_and_labels_stay_labels(size: float, seed: int) -> None:
    told = segmented(LABELS, replace(NONE, outline=size), np.random.default_rng(seed))
    assert set(np.unique(told)) <= {0, 1, 2}
    wrong = told != LABELS
    assert wrong.any()
    # five standard deviations of a displacement
    away = int(np.ceil(5.0 * size)) + 1
    inner = np.zeros_like(wrong)
    for left, right in ((60, 160), (160, 240)):
        inner[50 + away : 150 - away, left + away : right - away] = True
    assert not wrong[inner].any()


@pytest.mark.parametrize("share", [0.02, 0.2])
def test_the_share_that_is_missed_is_background(share: float) -> None:
    full = np.ones((400, 600), dtype=np.int32)
    errors = replace(NONE, missed=share, patch_width=4.0)
    told = segmented(full, errors, np.random.default_rng(1), background=7)
    assert set(np.unique(told)) == {1, 7}
    assert (told == 7).mean() == pytest.approx(share, rel=0.2)
