"""The distance of the grippers from a wheelchair, and the verdict on it."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from drake_dress.report.chair import gripper_to_chair
from drake_dress.report.log import RunLog
from drake_dress.report.log_writer import RunLogWriter, Sample
from drake_dress.report.summary import summarize
from tests.report import synthetic

# One capsule far from the made-up person and the coat, and its radius, m.
END, OTHER, RADIUS = [-0.3, 2.8, 0.9], [-0.3, 3.2, 0.9], 0.02
COUNT = 5


def with_chair(sample: Sample, gripper: list[float]) -> Sample:
    a, b = (
        np.vstack([np.asarray(x), [end]])
        for x, end in zip((sample.capsule_a, sample.capsule_b), (END, OTHER), strict=True)
    )
    position = dict(sample.gripper_position) | {"right": np.array(gripper)}
    return replace(sample, capsule_a=a, capsule_b=b, gripper_position=position)


def written(path: Path, gripper: list[float], of_chair: bool = True) -> Path:
    garment = synthetic.coat()
    samples = synthetic.dressing(garment, COUNT)
    radius = synthetic.capsules(np.asarray(samples[0].joint_position))[2]
    content = replace(
        synthetic.content(garment),
        capsule_radius=np.append(radius, RADIUS),
        of_chair=[0] * len(radius) + [int(of_chair)],
    )
    with RunLogWriter(path, content) as writer:
        for i, sample in enumerate(samples):
            # the last sample has the right gripper at the given place
            last = gripper if i == COUNT - 1 else [0.0, -1.0, 2.0]
            writer.append(with_chair(sample, last))
    return path


@pytest.mark.parametrize(
    ("gripper", "distance"),
    [
        ([-0.3, 3.0, 1.0], 0.1 - RADIUS),
        ([-0.3, 3.5, 0.9], 0.3 - RADIUS),
        ([-0.3, 3.1, 0.91], 0.01 - RADIUS),
    ],
)
def test_distance_is_that_to_the_surface(
    tmp_path: Path, gripper: list[float], distance: float
) -> None:
    with RunLog.open(written(tmp_path / "run.h5", gripper)) as log:
        assert log.of_chair.tolist() == [False] * (len(log.of_chair) - 1) + [True]
        found = gripper_to_chair(log)
        assert found is not None
        assert found.shape == (COUNT, 2)
        assert found[-1, 1] == pytest.approx(distance)
        summary = summarize(log, wall_time=1.0)
    assert summary["min_gripper_to_chair_m"] == pytest.approx(min(found.min(), distance))
    inside = summary["reason"] is not None and "inside the wheelchair" in summary["reason"]
    assert inside == (distance < 0.0)


def test_a_run_without_a_chair_tells_nothing_of_it(tmp_path: Path) -> None:
    path = written(tmp_path / "run.h5", [-0.3, 3.0, 0.9], of_chair=False)
    with RunLog.open(path) as log:
        assert "/human/capsule_of_chair" not in log.file
        assert not log.of_chair.any()
        assert gripper_to_chair(log) is None
        assert "min_gripper_to_chair_m" not in summarize(log, wall_time=1.0)


def test_what_is_not_known_has_no_distance(tmp_path: Path) -> None:
    with RunLog.open(written(tmp_path / "run.h5", [np.nan, 3.0, 0.9])) as log:
        found = gripper_to_chair(log)
    assert found is not None
    assert np.isnan(found[-1]).all()
    assert np.isfinite(found[:-1]).all()
