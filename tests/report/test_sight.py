"""Errors of the estimated garment, from a log."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from drake_dress.report.log import RunLog
from drake_dress.report.sight import sight_figures
from tests.report import synthetic

CAMERAS = "perception: {kind: cameras}\n"


def figures(path: Path, scenario: str, off: np.ndarray) -> dict[str, float]:
    garment = synthetic.coat(0.06)
    samples = [
        replace(s, estimate_garment_position=np.asarray(s.garment_position) + off)
        for s in synthetic.dressing(garment)
    ]
    synthetic.write(path, garment, samples, scenario=scenario)
    with RunLog.open(path) as log:
        return sight_figures(log)


def test_an_estimate_that_is_off_by_so_much_is_told(tmp_path: Path) -> None:
    found = figures(tmp_path / "run.h5", CAMERAS, np.array([0.03, 0.0, -0.04]))
    assert found["estimate_garment_rms_m"] == pytest.approx(0.05, abs=1e-4)
    assert found["estimate_armhole_median_m"] == pytest.approx(0.05, abs=1e-4)


@pytest.mark.parametrize("scenario", ["", "perception: {kind: oracle}\n", "seed: 1\n"])
def test_nothing_is_told_where_no_camera_is_used(tmp_path: Path, scenario: str) -> None:
    assert figures(tmp_path / "run.h5", scenario, np.zeros(3)) == {}
