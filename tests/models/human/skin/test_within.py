import numpy as np
import pytest

from drake_dress.models.human.body import posed_capsules
from drake_dress.models.human.skin.body_file import PARTS
from drake_dress.models.human.skin.measures import body_measures, skin_measures
from drake_dress.models.human.skin.phenotype import Phenotype
from drake_dress.models.human.skin.posing import rest_pose
from drake_dress.models.human.skin.within import _distance, within_cones
from drake_dress.models.sides import SIDES
from tests.models.human.skin.bodies import BOY, OLD_WOMAN, skin_of

HEAVY = Phenotype("male", 45, 1.76, 130)
KEPT = ("head", "palm", "fingers", "thumb", "shin", "foot")
INSIDE = ("trunk", "neck", "upper_arm", "forearm")


@pytest.mark.parametrize("person", [OLD_WOMAN, BOY, HEAVY])
def test_covered_parts_are_inside_and_the_rest_stays(person: Phenotype) -> None:
    skin = skin_of(person)
    body = body_measures(skin_measures(skin))
    drawn = within_cones(skin, body)
    kept = np.isin(skin.parts, [PARTS.index(part) for part in KEPT])
    assert np.array_equal(drawn.vertices[kept], skin.vertices[kept])
    cones = posed_capsules(body, "standing", {side: rest_pose(skin, side) for side in SIDES})
    inside = np.isin(skin.parts, [PARTS.index(part) for part in INSIDE])
    before = _distance(skin.vertices, cones)
    assert before[inside].max() > 0.01  # there is something to draw in
    assert _distance(drawn.vertices[inside], cones).max() < 1e-3
    # what was inside already stays where it was
    moved = np.linalg.norm(drawn.vertices - skin.vertices, axis=1)
    assert moved[before < -0.005].max() == 0.0
    assert moved.max() < 0.12
