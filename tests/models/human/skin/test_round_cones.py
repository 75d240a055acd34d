import numpy as np
import pytest

from drake_dress.models.human.skin.phenotype import Phenotype
from drake_dress.models.human.skin.round_cones import cone_distance, fit_round_cones
from tests.models.human.skin.bodies import PERSONS, skin_of

START, END = np.array([0.0, 0.0, 0.1]), np.array([0.3, 0.1, -0.2])


@pytest.mark.parametrize("radii", [(0.06, 0.03), (0.02, 0.09), (0.05, 0.05)])
def test_distance_is_that_from_the_nearest_sphere_of_the_hull(radii: tuple[float, float]) -> None:
    points = np.random.default_rng(0).uniform(-0.5, 0.5, size=(200, 3))
    share = np.linspace(0.0, 1.0, 2001)[:, None]
    centres = START + share * (END - START)
    spheres = radii[0] + share[:, 0] * (radii[1] - radii[0])
    expected = np.min(np.linalg.norm(points[:, None] - centres[None], axis=2) - spheres, axis=1)
    assert cone_distance(points, START, END, radii) == pytest.approx(expected, abs=1e-6)


@pytest.mark.parametrize("person", PERSONS)
def test_round_cones_fit_arms_better_than_capsules(person: Phenotype) -> None:
    cones, capsules = (fit_round_cones(skin_of(person), tapered) for tapered in (True, False))
    # measured 3 to 5 mm; limbs are no circles
    assert cones.mean < 5.5e-3
    assert cones.greatest < 0.02
    assert abs(cones.bias) < 2e-3
    assert cones.mean < 0.65 * capsules.mean
