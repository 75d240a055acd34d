"""The verdict follows from the log alone, and cannot be fooled by s."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from drake_dress.models.control.safety import Verdict
from drake_dress.models.garment.mesh import GarmentMesh
from drake_dress.report.log import RunLog
from drake_dress.report.log_writer import Sample
from drake_dress.report.measures import first_lasting, penetration_depth, unique_edges
from drake_dress.report.summary import SuccessRules, summarize, write_summary
from tests.report import synthetic

Summarize = Callable[..., dict[str, Any]]

KEYS = {
    "success",
    "reason",
    "s_left",
    "s_right",
    "arm_inside_left",
    "arm_inside_right",
    "hand_through_cuff_left",
    "hand_through_cuff_right",
    "dressing_time_s",
    "max_gripper_force_N",
    "max_contact_force_N",
    "max_edge_strain",
    "max_penetration_m",
    "layers_crossed_at_end",
    "realtime_factor",
    "wall_time_s",
    "safety_cut_s",
    "global_rate_hz",
    "local_rate_hz",
    "global_solve_ms",
    "late_plans",
    "armhole_to_shoulder_left_m",
    "armhole_to_shoulder_right_m",
    "local_solve_ms",
    "seed",
    "version",
}


@pytest.fixture(scope="module")
def garment() -> GarmentMesh:
    return synthetic.coat(0.05)


@pytest.fixture
def summary_of(tmp_path: Path, garment: GarmentMesh) -> Summarize:
    def summary(samples: list[Sample], **options: Any) -> dict[str, Any]:
        path = synthetic.write(tmp_path / "run.h5", garment, samples)
        with RunLog.open(path) as log:
            return summarize(log, wall_time=20.0, **options)

    return summary


def _dressed(garment: GarmentMesh) -> list[Sample]:
    return synthetic.dressing(garment, travel=0.0)


def test_coat_that_is_on_succeeds(
    summary_of: Summarize, garment: GarmentMesh, tmp_path: Path
) -> None:
    summary = summary_of(_dressed(garment))
    assert KEYS <= set(summary)
    assert summary["success"] is True
    assert summary["reason"] is None
    assert summary["arm_inside_left"]
    assert summary["arm_inside_right"]
    assert summary["hand_through_cuff_left"]
    assert summary["hand_through_cuff_right"]
    assert summary["realtime_factor"] == pytest.approx(0.5)
    assert summary["max_gripper_force_N"] == pytest.approx(13.0)
    assert summary["max_contact_force_N"] == pytest.approx(0.2, rel=1e-6)
    assert summary["global_solve_ms"] == {
        "median": pytest.approx(300.0),
        "p99": pytest.approx(300.0),
        "p95": pytest.approx(300.0),
    }
    assert summary["global_rate_hz"] == pytest.approx(0.5)
    # three between two samples, though only the last one's time is kept
    assert summary["local_rate_hz"] == pytest.approx(0.3 * len(_dressed(garment)))
    # s of the right sleeve reaches 1.9 at (1.9 + 0.3) / 2.4 of ten seconds
    assert summary["dressing_time_s"] == pytest.approx(9.5)
    write_summary(summary, tmp_path / "summary.json")
    assert json.loads((tmp_path / "summary.json").read_text()) == summary


def test_s_of_two_with_the_arms_outside_is_no_success(
    summary_of: Summarize, garment: GarmentMesh
) -> None:
    summary = summary_of(synthetic.dressing(garment, beside=True))
    assert summary["s_left"] == summary["s_right"] == 2.0
    assert summary["success"] is False
    assert summary["reason"] == "left arm outside the sleeve: linking number 0"
    assert not summary["arm_inside_left"]
    assert not summary["arm_inside_right"]
    assert summary["dressing_time_s"] is None


def test_what_safety_cut_is_summed_by_side_and_flag(
    summary_of: Summarize, garment: GarmentMesh
) -> None:
    samples = _dressed(garment)
    flags = Verdict.FORCE | Verdict.BRAKING
    samples[3] = replace(samples[3], safety=[int(flags), 0])
    samples[4] = replace(samples[4], safety=[int(Verdict.FORCE), 0])
    assert summary_of(samples)["safety_cut_s"] == {
        "left": {"force": pytest.approx(1.0), "braking": pytest.approx(0.5)},
        "right": {},
    }


@pytest.mark.parametrize(("delay", "late"), [("0.2", 1.0), ("0.4", 0.0), ("soon", None)])
def test_plans_are_late_that_took_longer_than_was_modelled(
    tmp_path: Path, garment: GarmentMesh, delay: str, late: float | None
) -> None:
    scenario = f"controller: {{global_mpc: {{delay: {delay}}}}}\n"
    path = synthetic.write(tmp_path / "run.h5", garment, _dressed(garment), scenario=scenario)
    with RunLog.open(path) as log:
        assert summarize(log, wall_time=20.0)["late_plans"] == late


def test_one_sleeve_is_no_success(summary_of: Summarize, garment: GarmentMesh) -> None:
    samples = _dressed(garment)
    on = samples[-1].dressing
    samples[-1] = replace(samples[-1], dressing={**on, "left": (1.42, 0.0, 0.0)})
    summary = summary_of(samples)
    left = summary["armhole_to_shoulder_left_m"]
    assert summary["reason"].startswith("left sleeve not on: s = 1.42 < 1.9, armhole ")
    assert f"{100.0 * left:.1f} cm from the shoulder" in summary["reason"]
    shoulder, elbow, _ = np.asarray(samples[-1].joint_position)[:3]
    # the axis cuts the corner at a bent elbow by less than a twentieth
    assert left == pytest.approx(0.58 * np.linalg.norm(shoulder - elbow), rel=0.05)
    assert summary["armhole_to_shoulder_right_m"] == 0.0


def test_force_at_one_sample_breaks_the_rule(summary_of: Summarize, garment: GarmentMesh) -> None:
    samples = _dressed(garment)
    force = samples[4].gripper_force | {"right": np.array([0.0, 41.0, 0.0])}
    samples[4] = replace(samples[4], gripper_force=force)
    summary = summary_of(samples)
    assert summary["success"] is False
    assert summary["reason"] == "right gripper force too high: 41.0 N > 40 N at t = 2.00 s"
    assert summary["max_gripper_force_N"] == pytest.approx(41.0)


def test_strain_at_one_sample_breaks_the_rule(summary_of: Summarize, garment: GarmentMesh) -> None:
    samples = _dressed(garment)
    samples[6] = synthetic.stretched(samples[6], garment, 1.12)
    summary = summary_of(samples, rules=SuccessRules(max_penetration=1.0))
    assert summary["reason"] == ("edges over-strained: 99th percentile 12.0 % > 10 % at t = 3.00 s")
    assert summary["max_edge_strain"] == pytest.approx(0.12, abs=1e-4)


def test_one_percent_of_edges_may_be_strained(summary_of: Summarize, garment: GarmentMesh) -> None:
    samples = _dressed(garment)
    position = np.array(samples[6].garment_position)
    position[garment.loops["left_cuff"][0]] += [0.0, 0.03, 0.0]
    samples[6] = replace(samples[6], garment_position=position)
    summary = summary_of(samples)
    assert summary["success"] is True
    assert summary["max_edge_strain_all"] > 0.2


def test_penetration_at_one_sample_breaks_the_rule(
    summary_of: Summarize, garment: GarmentMesh
) -> None:
    samples = _dressed(garment)
    position = np.array(samples[3].garment_position)
    # the whole coat lifted a little: the sleeves' lower side comes into the arms
    samples[3] = replace(samples[3], garment_position=position + [0.0, 0.0, 0.05])
    summary = summary_of(samples)
    assert summary["reason"].startswith("garment penetrates the person: ")
    assert summary["reason"].endswith("mm > 5 mm at t = 1.50 s")


def test_diverged_run_is_named(summary_of: Summarize, garment: GarmentMesh) -> None:
    samples = _dressed(garment)
    position = np.array(samples[10].garment_position)
    position[0] = np.nan
    samples[10] = replace(samples[10], garment_position=position)
    summary = summary_of(samples)
    assert "diverged" in summary["reason"]
    json.dumps(summary, allow_nan=False)


def test_empty_log_is_no_success(summary_of: Summarize) -> None:
    summary = summary_of([])
    assert summary["success"] is False
    assert summary["reason"] == "nothing was logged"
    assert KEYS <= set(summary)
    json.dumps(summary, allow_nan=False)


def test_penetration_counts_what_lies_between_nodes() -> None:
    # A triangle over a thin limb: all three nodes are outside, its middle is 2 cm deep.
    x = np.array([[-0.1, -0.1, 0.0], [0.1, -0.1, 0.0], [0.0, 0.2, 0.0]])
    faces = np.array([[0, 1, 2]], dtype=np.int32)
    a, b = np.array([[0.0, 0.0, -1.0]]), np.array([[0.0, 0.0, 1.0]])
    depth = penetration_depth(x, faces, unique_edges(faces), a, b, np.array([0.02]))
    assert depth == pytest.approx(0.02)
    beside = penetration_depth(x + 1.0, faces, unique_edges(faces), a, b, np.array([0.02]))
    assert beside == 0.0


def test_lasting_means_to_the_end() -> None:
    assert first_lasting(np.array([True, False, True, True])) == 2
    assert first_lasting(np.array([True, True])) == 0
    assert first_lasting(np.array([True, False])) is None
    assert first_lasting(np.array([], dtype=bool)) is None
