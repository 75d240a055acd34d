"""What the simulation's own numerics may be off is no discrepancy: the verdict on made-up data."""

from collections.abc import Callable, Sequence

import numpy as np
import pytest

from drake_dress.discrepancy import search
from drake_dress.discrepancy.explanation import Explanation, explain
from drake_dress.models.effects.effect import Effect
from drake_dress.models.effects.fabric import StretchStiffness
from drake_dress.models.effects.mass import SurfaceDensity
from tests.discrepancy.made_up import DECOY, NOISE, MadeUp, probe_of

EFFECTS = (SurfaceDensity(added=0.03), StretchStiffness(added=0.03 * DECOY))


@pytest.fixture
def explained(monkeypatch: pytest.MonkeyPatch) -> Callable[..., Explanation]:
    """Returns what is found in a made-up lab, among some effects."""

    def run(lab: MadeUp, effects: Sequence[Effect] = EFFECTS) -> Explanation:
        monkeypatch.setattr(search, "probe", probe_of(lab, effects))
        return explain(lab)

    return run


@pytest.mark.parametrize("seed", range(16))
def test_where_nothing_is_hidden_numerics_of_any_size_are_not_called_unexplained(
    explained: Callable[..., Explanation], seed: int
) -> None:
    rng = np.random.default_rng(seed)
    numerics = rng.uniform(0.5, 3.0) * NOISE
    # refining took away no more than is left
    lab = MadeUp(rng, truth=0.0, numerics=numerics, off=rng.uniform(0.3, 1.0) * numerics)
    found = explained(lab)
    assert found.numerics / found.noise[0] == pytest.approx(numerics / NOISE, rel=0.15)
    assert found.verdict in ("nothing", "named")
    assert {c.name for c in found.causes} <= {"discretisation"}


@pytest.mark.parametrize("seed", range(3))
def test_what_exceeds_the_numerics_stays_unexplained(
    explained: Callable[..., Explanation], seed: int
) -> None:
    rng = np.random.default_rng(seed)
    numerics = rng.uniform(0.5, 3.0) * NOISE
    found = explained(MadeUp(rng, truth=0.0, numerics=numerics, off=3.0 * numerics))
    assert found.verdict == "unexplained"


@pytest.mark.parametrize("seed", range(3))
def test_a_cause_is_named_whatever_the_numerics_are(
    explained: Callable[..., Explanation], seed: int
) -> None:
    rng = np.random.default_rng(seed)
    numerics = rng.uniform(0.5, 3.0) * NOISE
    found = explained(MadeUp(rng, np.inf, numerics=numerics, off=0.5 * numerics), EFFECTS[:1])
    assert found.verdict == "named"
    assert "surface_density" in {c.name for c in found.causes}
