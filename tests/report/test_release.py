"""A coat stays on if both sleeves are on some seconds after the grippers have let go."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from drake_dress.models.garment.mesh import GarmentMesh
from drake_dress.report.log import RunLog
from drake_dress.report.log_writer import Sample
from drake_dress.report.summary import SuccessRules, summarize
from tests.report import synthetic

LETS_GO = "controller: {method: full, finish: {release: true}}\n"
HOLDS = "controller: {method: full, finish: {release: false}}\n"
COUNT, LAID = 101, 60  # samples of 0.1 s, and the first one in which the coat is laid
# The made-up arms begin below the shoulders, where the armholes are.
SHOULDERS = ([0.0, 0.19, 1.4], [0.0, -0.19, 1.4])
NECK = ([0.04, 0.0, 1.4], [0.04, 0.0, 1.52])  # as thick as a head, and clear of the collar
SummaryOf = Callable[..., dict[str, Any]]


@pytest.fixture(scope="module")
def garment() -> GarmentMesh:
    return synthetic.coat(0.05)


@pytest.fixture
def summary_of(tmp_path: Path, garment: GarmentMesh) -> SummaryOf:
    def summary(
        opened: int,
        s: float,
        off: float = 0.0,
        scenario: str = LETS_GO,
        before: float = 2.0,
        tilt: float = 0.0,
    ) -> dict[str, Any]:
        """Summarizes a run with sleeves at `s` after the release, and the coat `off`, m, above.

        Before, the sleeves are at `before`. The upper arms are moved outward by `tilt`, m, at their
        elbows.
        """
        samples: list[Sample] = []
        for i, sample in enumerate(synthetic.dressing(garment, COUNT, 10.0, travel=0.0)):
            stage = 2 if i < LAID else 3 if i < opened else 4
            after = s if i >= opened else before
            position = np.asarray(sample.garment_position)
            if i >= opened:
                position = position + [0.0, 0.0, off]
            a, b = (np.array(end) for end in (sample.capsule_a, sample.capsule_b))
            a[-1], b[-1] = NECK
            joints = np.array(sample.joint_position)
            joints[[0, 3]] = SHOULDERS
            joints[[1, 4], 1] += [tilt, -tilt]
            samples.append(
                replace(
                    sample,
                    capsule_a=a,
                    capsule_b=b,
                    joint_position=joints,
                    stage=np.array([stage, stage]),
                    garment_position=position,
                    dressing={side: (after, 0.0, 0.0) for side in ("left", "right")},
                )
            )
        path = synthetic.write(tmp_path / "run.h5", garment, samples, scenario=scenario)
        with RunLog.open(path) as log:
            return summarize(log, wall_time=20.0, rules=SuccessRules(max_penetration=0.1))

    return summary


def test_sleeves_that_sink_on_the_shoulders_stay_on(summary_of: SummaryOf) -> None:
    summary = summary_of(70, 1.75)
    assert summary["stays_on"] is True
    assert summary["success"] is True, summary["reason"]
    assert summary["s_left"] == 1.75
    assert summary["s_dressed_left"] == 2.0
    assert summary["dressing_time_s"] == 0.0


@pytest.mark.parametrize(
    ("opened", "s", "off", "reason"),
    [
        (70, 1.2, 0.0, "left sleeve slid down after the release"),
        (90, 1.75, 0.0, "watched for 1.0 s"),
        (COUNT, 1.75, 0.0, "the coat was not let go"),
        (70, 1.75, 1.5, "left sleeve came off after the release"),
        (70, 1.75, 0.07, "from the neck"),
    ],
)
def test_a_coat_that_does_not_stay_on_is_no_success(
    summary_of: SummaryOf, opened: int, s: float, off: float, reason: str
) -> None:
    summary = summary_of(opened, s, off)
    assert summary["success"] is False
    assert reason in summary["reason"]
    assert summary["stays_on"] is (None if opened == COUNT else "neck" in reason)


def test_a_scenario_that_holds_the_coat_is_judged_while_it_is_held(summary_of: SummaryOf) -> None:
    summary = summary_of(COUNT, 2.0, scenario=HOLDS)
    assert summary["stays_on"] is None
    assert summary["success"] is True


def test_the_collars_distance_is_that_to_the_nape(summary_of: SummaryOf) -> None:
    near, far = (summary_of(70, 1.75, off)["collar_to_neck_m"] for off in (0.1, 0.2))
    assert 0.07 < far - near <= 0.1 + 1e-6


def test_of_sleeves_on_arms_that_hang_less_is_asked_if_the_coat_is_let_go(
    summary_of: SummaryOf,
) -> None:
    rules = SuccessRules()
    low = rules.min_hanging_s + 0.01
    on = summary_of(65, 1.8, before=low)
    assert (on["success"], on["s_asked_left"]) == (True, rules.min_hanging_s)
    assert on["dressing_time_s"] == 0.0
    lower = summary_of(65, 1.8, before=rules.min_hanging_s - 0.01)
    assert "sleeve not on" in lower["reason"]
    held = summary_of(COUNT, low, scenario=HOLDS, before=low)
    assert (held["success"], held["s_asked_right"]) == (False, rules.min_s)
    away = summary_of(65, 1.8, before=low, tilt=0.4)
    assert (away["success"], away["s_asked_left"]) == (False, rules.min_s)
