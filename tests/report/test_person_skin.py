"""The skin in a replay is that of the scenario's body, at the joints of the log."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from pydrake.geometry import Meshcat, MeshcatParams

from drake_dress.models.human.skin.person_skin import person_skin
from drake_dress.models.human.skin.phenotype import Phenotype
from drake_dress.report.log import RunLog
from drake_dress.report.person_skin import logged_skin
from drake_dress.report.replay import MeshcatReplay
from tests.present import present
from tests.report import synthetic

BODY = "person: {posture: standing, body: {sex: male, age: 50, height: 1.8, weight: 85}}\n"


def logged(path: Path, scenario: str) -> RunLog:
    garment = synthetic.coat(0.06)
    data = synthetic.dressing(garment, count=3)
    return RunLog.open(synthetic.write(path, garment, data, scenario=scenario))


def test_skin_is_that_of_the_scenario_with_its_shoulders_in_place(tmp_path: Path) -> None:
    with logged(tmp_path / "run.h5", BODY) as log:
        found = present(logged_skin(log))
        expected = person_skin(Phenotype("male", 50, 1.8, 85), "standing", None).rest
        assert np.array_equal(found.skin.vertices, expected.vertices)
        for sample in range(len(log)):
            shoulders = log.joint_position[sample][[0, 3]].mean(axis=0)
            vertices = found.vertices(sample)
            rest = np.mean(
                [expected.joints[f"{side}_shoulder"] for side in ("left", "right")], axis=0
            )
            # the top of the head is above the shoulders as at rest
            top = vertices[np.argmax(vertices[:, 2]), 2] - shoulders[2]
            assert top == pytest.approx(expected.stature - rest[2], abs=1e-6)


@pytest.mark.parametrize(
    "scenario",
    [
        "seed: 3\n",
        "person: {posture: sitting}\n",
        "person: {body: null}\n",
        "person: {body: {scan: {file: a.ply}}}\n",
        "person: {body: {sex: male, age: 50, height: 1.8, weight: 999}}\n",
        "person: [",
    ],
)
def test_log_without_such_a_body_has_no_skin(tmp_path: Path, scenario: str) -> None:
    with logged(tmp_path / "run.h5", scenario) as log:
        assert logged_skin(log) is None


def test_replay_draws_the_skin(tmp_path: Path) -> None:
    meshcat = Meshcat(MeshcatParams(host="localhost"))
    for name, scenario, drawn in (("with", BODY, True), ("without", "seed: 3\n", False)):
        with logged(tmp_path / f"{name}.h5", scenario) as log:
            meshcat.Delete()
            MeshcatReplay(meshcat, log)
            assert meshcat.HasPath("dressing/skin") == drawn
            meshcat.DeleteAddedControls()
