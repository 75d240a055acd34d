"""Where the grippers are while a coat is laid, and which way they leave."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drake_dress.models.cloth.contact.detection import find_proximity
from drake_dress.models.cloth.contact.obstacles import Obstacles
from drake_dress.models.control.laying import WornCoat, way_back
from drake_dress.models.control.person_model import person_capsules
from drake_dress.models.dressing.finish import FinishParameters
from drake_dress.models.garment.coat import COATS, make_coat
from drake_dress.models.garment.hold import held_at_edges
from drake_dress.models.garment.mesh import GarmentMesh
from drake_dress.models.garment.nape import find_nape
from drake_dress.models.human.body import ArmPose
from drake_dress.models.human.heading import heading
from drake_dress.models.sides import SIDES
from tests.plain_person import plain_joints, plain_person

PERSON = plain_person("standing")
HANGING = plain_joints("standing", ArmPose(0.2, 0.0, 0.0, 0.1))
TO = heading(HANGING)
HEIGHT = 0.04
JACKET = make_coat(COATS["jacket"], 0.05)
HOLDS = {"shoulders": JACKET, "edges": held_at_edges(JACKET, 0.4, "test")}


def worn(mesh: GarmentMesh) -> tuple[WornCoat, np.ndarray]:
    collar = find_nape(mesh.rest_position, mesh.faces, mesh.loops)
    assert collar is not None
    held = np.stack([mesh.rest_position[mesh.grasp[side]].mean(axis=0) for side in SIDES])
    return WornCoat(collar, held - collar.at(mesh.rest_position), 0.003, HEIGHT), held


@pytest.mark.parametrize("hold", HOLDS)
def test_grippers_hold_a_worn_coat_off_the_skin_where_they_hold_it_at_rest(hold: str) -> None:
    coat, held = worn(HOLDS[hold])
    found = coat.target(PERSON, HANGING[None])
    np.testing.assert_allclose(found.collar[0], coat.collar_target(PERSON, HANGING))
    places = coat.collar_target(PERSON, HANGING) + coat.grippers @ TO.rotation.T
    skin = Obstacles.resting(*person_capsules(PERSON, HANGING))
    near = find_proximity(places, skin, 0.0)
    pushed = places + np.maximum(HEIGHT - near.gap, 0.0)[:, None] * near.normal
    np.testing.assert_allclose(found.between[0], pushed[0] - pushed[1], atol=1e-9)
    assert found.height[0] == pytest.approx(pushed[:, 2].mean())
    # the left gripper is on the left, about as far as the coat is wide there
    apart = float(found.between[0] @ TO.leftward)
    assert apart == pytest.approx(float(np.linalg.norm(held[0] - held[1])), abs=0.1)
    ahead = (pushed - HANGING[[0, 3]].mean(axis=0)) @ TO.front
    assert (ahead > 0.05).all() == (hold == "edges")


@given(st.floats(0.06, 0.4), st.floats(-0.3, 0.3), st.floats(0.0, 2.0))
def test_from_in_front_of_the_person_grippers_leave_straight_away_from_the_neck(
    ahead: float, left: float, elapsed: float
) -> None:
    p, neck = FinishParameters(), HANGING[[0, 3]].mean(axis=0)
    across = TO.leftward
    grippers = np.stack([neck + ahead * TO.front + left * across, neck + 0.2 * across])
    velocity = way_back(p, TO, grippers, HANGING, 4, elapsed, 0.2)
    speed = np.linalg.norm(velocity, axis=2)
    going = elapsed + 0.2 * np.arange(4) < p.away_distance / p.away_speed
    np.testing.assert_allclose(speed, np.where(going, p.away_speed, 0.0)[:, None] * np.ones(2))
    for step in velocity[going]:
        away = (grippers[0] - neck) * [1.0, 1.0, 0.0]
        assert step[0] @ away == pytest.approx(p.away_speed * np.linalg.norm(away))
        # beside the neck it leaves the way it came
        assert step[1] @ TO.front < 0.0
        assert step[1][2] > 0.0
