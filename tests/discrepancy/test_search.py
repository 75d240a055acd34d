"""The search for causes, on simulations that are made up."""

from collections.abc import Callable

import numpy as np
import pytest

from drake_dress.discrepancy import search
from drake_dress.discrepancy.attribution import compare
from drake_dress.discrepancy.search import Found, Search
from drake_dress.models.effects.effect import Effect
from drake_dress.models.effects.fabric import StretchStiffness
from drake_dress.models.effects.mass import SurfaceDensity
from tests.discrepancy.made_up import DECOY, TRUTH, MadeUp, probe_of
from tests.present import present

WEIGHT, STIFFNESS = SurfaceDensity(added=0.03), StretchStiffness(added=0.03 * DECOY)


@pytest.fixture
def found(monkeypatch: pytest.MonkeyPatch) -> Callable[..., Found]:
    """Returns what a search finds in a made-up lab among the effects that are given."""

    def run(lab: MadeUp, *effects: Effect) -> Found:
        comparison = compare(lab)
        monkeypatch.setattr(search, "probe", probe_of(lab, effects))
        rng = np.random.default_rng(0)
        return Search(lab, comparison, rng, lambda _: None, None).run()

    return run


@pytest.mark.parametrize("steeper", [1.0, 2.5])
def test_a_cause_that_coarse_cloth_makes_too_large_is_polished_before_it_is_judged(
    found: Callable[..., Found], steeper: float
) -> None:
    lab = MadeUp(np.random.default_rng(0), np.inf, steeper)
    result = found(lab, WEIGHT)
    assert [n.name for n in result.named] == ["surface_density"]
    (effect,) = result.model.effects
    std = present(result.model.fit).std["surface_density"]["added"]
    assert abs(effect.values()["added"] - TRUTH / steeper) < 4.0 * std


def test_a_kin_whose_own_numerics_explain_as_much_makes_room_for_the_cause(
    found: Callable[..., Found],
) -> None:
    lab = MadeUp(np.random.default_rng(0), np.inf, besides=1e-3, during=slice(160, None))
    # alone it is refused, and what is left is told by the noise that was there before it was tried
    alone = found(lab, STIFFNESS)
    assert alone.named == ()
    assert alone.model is alone.plain
    left = np.mean((alone.comparison.whitening.data - alone.plain.predicted) ** 2)
    assert left > 2.0
    result = found(lab, STIFFNESS, WEIGHT)
    assert result.fitted["stretch_stiffness"][1] > result.fitted["surface_density"][1]
    assert [n.name for n in result.named] == ["surface_density"]
    assert result.model.effects[0].values()["added"] == pytest.approx(TRUTH, rel=0.1)
