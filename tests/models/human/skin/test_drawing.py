import numpy as np
import pytest

from drake_dress.models.human.skin.drawing import _draw, draw_phenotype
from drake_dress.models.human.skin.phenotype import phenotype_skin


def test_same_seed_draws_the_same_person() -> None:
    first, second = (draw_phenotype(np.random.default_rng(7)) for _ in range(2))
    assert first == second


def test_drawn_persons_have_bodies() -> None:
    rng = np.random.default_rng(3)
    for _ in range(5):
        person = draw_phenotype(rng)
        assert 18.0 <= person.age <= 90.0
        assert phenotype_skin(person).stature == pytest.approx(person.height, abs=1e-3)


def test_drawn_persons_have_the_means_of_the_survey() -> None:
    rng = np.random.default_rng(5)
    persons = [_draw(rng) for _ in range(4000)]
    for sex, height, weight in (("male", 1.757, 88.8), ("female", 1.618, 76.4)):
        own = [p for p in persons if p.sex == sex]
        assert len(own) == pytest.approx(2000, abs=130)  # 4 standard deviations
        # ages are uniform here, so the mean is older than that of the survey
        assert np.mean([p.height for p in own]) == pytest.approx(height, abs=0.012)
        assert np.mean([p.weight for p in own]) == pytest.approx(weight, rel=0.03)


def test_old_people_are_shorter() -> None:
    rng = np.random.default_rng(11)
    women = [p for p in (_draw(rng) for _ in range(4000)) if p.sex == "female"]
    old, young = ([p.height for p in women if (p.age > 70) == is_old] for is_old in (True, False))
    assert np.mean(young) - np.mean(old) > 0.02
