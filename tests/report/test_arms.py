"""What a log tells of arms, and when a dressing does not count for it."""

from __future__ import annotations

import base64
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from drake_dress.models.arm.panda import LIMITS, panda
from drake_dress.models.sides import SIDES, Side
from drake_dress.report.arm_extremes import ArmExtremes
from drake_dress.report.arms import arm_poses, measure_arms
from drake_dress.report.log import RunLog
from drake_dress.report.log_writer import ArmSample, RunLogWriter, Sample
from drake_dress.report.replay_html import write_replay_html
from drake_dress.report.summary import SuccessRules, summarize
from tests.present import present
from tests.report import synthetic

HOME = np.array([0.0, -0.4, 0.0, -2.2, 0.0, 1.9, 0.8])
STILL = np.zeros(7)


def bases(spread: float = 1.0) -> dict[Side, np.ndarray]:
    both: dict[Side, np.ndarray] = {}
    for side, y in zip(SIDES, (0.5 * spread, -0.5 * spread), strict=True):
        both[side] = np.eye(4)
        both[side][:3, 3] = [-1.3, y, 0.9]
    return both


def summary(
    path: Path, arm: ArmSample, spread: float = 1.0
) -> tuple[dict[str, object], list[Sample]]:
    garment = synthetic.coat()
    samples = synthetic.dressing(garment)
    with RunLogWriter(
        path / "run.h5",
        synthetic.content(
            garment,
            capsule_radius=synthetic.capsules(np.asarray(samples[0].joint_position))[2],
            bases=bases(spread),
        ),
    ) as writer:
        for i, sample in enumerate(samples):
            odd = arm if i == 3 else ArmSample(HOME, STILL, HOME, STILL)
            both: dict[Side, ArmSample] = {
                "left": odd,
                "right": ArmSample(HOME, STILL, HOME, STILL),
            }
            writer.append(replace(sample, arms=both, clearance=np.zeros(3)))
    with RunLog.open(path / "run.h5") as log:
        # the made-up garment goes through the made-up trunk
        rules = SuccessRules(max_penetration=1.0, max_edge_strain=1.0)
        return summarize(log, wall_time=1.0, rules=rules), samples


def test_arms_at_rest_are_as_placed(tmp_path: Path) -> None:
    found, _ = summary(tmp_path, ArmSample(HOME, STILL, HOME + 0.001, STILL))
    assert found["success"] is True, found["reason"]
    assert found["max_joint_speed_share"] == 0.0
    assert found["min_joint_margin_rad"] == pytest.approx(
        np.minimum(HOME - LIMITS.lower, LIMITS.upper - HOME).min()
    )
    with RunLog.open(tmp_path / "run.h5") as log:
        measures = measure_arms(log)
    assert measures is not None
    arm = panda(bases()["left"])
    off = np.linalg.norm(arm.tool_position(HOME + 0.001) - arm.tool_position(HOME))
    assert measures.off[3, 0] == pytest.approx(off)
    # 1 m between bases, less what reaches inward
    assert 0.6 < measures.apart[0] < 1.0


@pytest.mark.parametrize(
    ("arm", "spread", "expected"),
    [
        (ArmSample(LIMITS.upper + 0.01, STILL, HOME, STILL), 1.0, "beyond its limits"),
        (ArmSample(HOME, 1.01 * LIMITS.speed, HOME, STILL), 1.0, "beyond its limits"),
        (ArmSample(HOME, STILL, HOME, -1.01 * LIMITS.torque), 1.0, "beyond its limits"),
        (ArmSample(HOME, STILL, HOME, STILL, q_least=LIMITS.lower - 0.01), 1.0, "beyond its"),
        (ArmSample(HOME, STILL, HOME, STILL, q_most=LIMITS.upper + 0.01), 1.0, "beyond its"),
        (ArmSample(HOME, STILL, HOME, STILL, v_peak=1.01 * LIMITS.speed), 1.0, "beyond its"),
        (ArmSample(HOME, STILL, HOME, STILL, torque_peak=1.01 * LIMITS.torque), 1.0, "beyond its"),
        (ArmSample(HOME, STILL, HOME, STILL), 0.2, "arms too near"),
    ],
)
def test_a_dressing_by_arms_that_broke_a_rule_is_none(
    arm: ArmSample, spread: float, expected: str, tmp_path: Path
) -> None:
    found, _ = summary(tmp_path, arm, spread)
    assert found["success"] is False
    assert expected in str(found["reason"])


def test_arms_are_seen_where_their_joints_put_them(tmp_path: Path) -> None:
    summary(tmp_path, ArmSample(HOME + 0.3, STILL, HOME, STILL))
    with RunLog.open(tmp_path / "run.h5") as log:
        poses = arm_poses(log, np.array([2, 3]))
        write_replay_html(log, tmp_path / "replay.html")
        frames = len(log)
    np.testing.assert_allclose(poses[1, 0], panda(bases()["left"]).links(HOME + 0.3)[:-1])
    # the other arm did not move
    np.testing.assert_array_equal(poses[0, 1], poses[1, 1])
    page = (tmp_path / "replay.html").read_text(encoding="utf-8")
    assert '"arms": 2,' in page
    found = re.search(r'id="armPoses">([^<]*)<', page)
    shown = np.frombuffer(base64.b64decode(present(found)[1]), "<f4").reshape(-1, 2, 8, 7)
    assert len(shown) <= frames
    np.testing.assert_allclose(shown[-1, 1, :, 4:], poses[1, 1, :, :3, 3], atol=1e-6)


def test_a_log_without_arms_has_no_such_figures(tmp_path: Path) -> None:
    garment = synthetic.coat()
    synthetic.write(tmp_path / "run.h5", garment, synthetic.dressing(garment))
    with RunLog.open(tmp_path / "run.h5") as log:
        assert measure_arms(log) is None
        assert arm_poses(log, np.arange(3)).shape == (3, 0, 8, 4, 4)
        assert "arm_tracking_mm" not in summarize(log, wall_time=1.0)


def test_what_joints_came_to_between_samples_is_kept_once() -> None:
    rng = np.random.default_rng(0)
    q, v, torque = rng.normal(size=(3, 20, 7))
    extremes = ArmExtremes()
    for row in zip(q, v, torque, strict=True):
        extremes.see(*row)
    extremes.see(*np.full((3, 7), np.nan))
    least, most, fastest, strongest = extremes.taken()
    np.testing.assert_array_equal(least, q.min(axis=0))
    np.testing.assert_array_equal(most, q.max(axis=0))
    np.testing.assert_array_equal(fastest, np.abs(v).max(axis=0))
    np.testing.assert_array_equal(strongest, np.abs(torque).max(axis=0))
    assert np.isnan(extremes.taken()).all()
