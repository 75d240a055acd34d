"""The report says how it went, on one page that needs nothing else."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from drake_dress.errors import UserError
from drake_dress.models.control.safety import Verdict
from drake_dress.report.course import _Course
from drake_dress.report.log import RunLog
from drake_dress.report.log_writer import Sample
from drake_dress.report.measures import measure
from drake_dress.report.page import chart
from drake_dress.report.report_html import write_report
from drake_dress.report.summary import SuccessRules, summarize, write_summary
from tests.report import synthetic


def _run(folder: Path, samples: list[Sample]) -> str:
    path = synthetic.write(folder / "run.h5", synthetic.coat(0.06), samples)
    with RunLog.open(path) as log:
        write_summary(summarize(log, wall_time=5.0), folder / "summary.json")
    return write_report(folder).read_text()


def test_report_of_a_success_shows_course_and_pictures(tmp_path: Path) -> None:
    text = _run(tmp_path, synthetic.dressing(synthetic.coat(0.06), travel=0.0))
    assert "Both sleeves are on" in text
    assert text.count("data:image/svg+xml") == 6
    assert text.count("data:image/png") >= 3
    assert not re.search(r'(src|href)="(?!data:)', text)
    assert "http" not in re.sub(r"base64,[^\"]*", "", text)


def test_report_shows_forecasts_only_where_there_are_some(tmp_path: Path) -> None:
    samples = synthetic.dressing(synthetic.coat(0.06), travel=0.0)
    assert "Forecast of the person" not in _run(tmp_path, samples)
    text = _run(tmp_path, synthetic.foreseen(samples))
    assert "Forecast of the person" in text
    assert text.count("data:image/svg+xml") == 7


def test_forecasts_are_compared_with_what_came(tmp_path: Path) -> None:
    samples = synthetic.foreseen(synthetic.dressing(synthetic.coat(0.06), travel=0.0))
    path = synthetic.write(tmp_path / "run.h5", synthetic.coat(0.06), samples)
    with RunLog.open(path) as log:
        figure, axes = chart(6.0, 4.0, 2)
        _Course(log, measure(log), SuccessRules())._forecast(axes)
        off, intent = axes
        left, left_radius, right, _ = (np.asarray(line.get_ydata()) for line in off.lines)
        known = log.time + 1.0 <= log.time[-1]
        np.testing.assert_allclose(left[known], 100.0)
        assert np.isnan(left[~known]).all()
        np.testing.assert_allclose(right[known], 0.0, atol=1e-9)
        np.testing.assert_allclose(left_radius, 70.0)
        np.testing.assert_allclose(np.asarray(intent.lines[0].get_ydata()), 0.9)
        np.testing.assert_array_equal(intent.lines[1].get_ydata(), log.intent[:, 0])  # type: ignore[index]
    assert figure is not None


def test_report_of_a_failure_says_the_reason(tmp_path: Path) -> None:
    text = _run(tmp_path, synthetic.dressing(synthetic.coat(0.06), beside=True))
    assert "The dressing failed" in text
    assert "left arm outside the sleeve: linking number 0" in text


def test_report_tells_what_safety_cut_and_only_then(tmp_path: Path) -> None:
    samples = synthetic.dressing(synthetic.coat(0.06), travel=0.0)
    assert "safety governor" not in _run(tmp_path, samples)
    samples[3] = replace(samples[3], safety=[0, int(Verdict.FORCE | Verdict.STOPPED)])
    text = _run(tmp_path, samples)
    assert "limited the requested motion. right: force 0.5 s, stopped 0.5 s." in text


def test_insertion_of_each_sleeve_is_pictured(tmp_path: Path) -> None:
    text = _run(tmp_path, synthetic.dressing(synthetic.coat(0.06)))
    assert "insertion of the first sleeve" in text
    assert "insertion of the second sleeve" in text


def test_empty_run_has_a_report(tmp_path: Path) -> None:
    assert "nothing was logged" in _run(tmp_path, [])


def test_missing_or_broken_summary_is_told(tmp_path: Path) -> None:
    synthetic.write(tmp_path / "run.h5", synthetic.coat(0.06), [])
    with pytest.raises(UserError):
        write_report(tmp_path)
    (tmp_path / "summary.json").write_text("{")
    with pytest.raises(UserError):
        write_report(tmp_path)
