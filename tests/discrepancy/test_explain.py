"""From recordings to a verdict, on a lab so coarse that it takes seconds."""

import json
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from drake_dress.diagrams.scenario import load_scenario
from drake_dress.diagrams.sections.effects import effects
from drake_dress.discrepancy.candidates import candidates
from drake_dress.discrepancy.experiment import Experiment
from drake_dress.discrepancy.explanation import Explanation, explain
from drake_dress.discrepancy.lab import Numerics
from drake_dress.discrepancy.prediction_windows import windows
from drake_dress.discrepancy.report import report_page
from drake_dress.discrepancy.residual_map import spots
from drake_dress.discrepancy.results import as_json, extended_yaml
from drake_dress.models.effects.mass import SurfaceDensity
from tests.discrepancy.data import SCENARIO, quick_scenario, recordings
from tests.present import present


@pytest.fixture(scope="module")
def heavy() -> Iterator[Experiment]:
    """An experiment whose garment is heavier than the scenario's."""
    finer = Numerics(0.05, 0.004, "projective_dynamics")
    made = recordings(("sway", "lift"), [SurfaceDensity(added=0.06)], 2.4, numerics=finer)
    with Experiment(quick_scenario(), SCENARIO.parent, made) as experiment:
        yield experiment


@pytest.fixture(scope="module")
def found(heavy: Experiment) -> Explanation:
    return explain(heavy)


def test_the_cause_is_named_with_its_size(found: Explanation) -> None:
    assert found.verdict == "named"
    assert found.causes[0].name == "surface_density"
    # on another mesh, with another integrator, and as sure as it says it is
    cause = found.causes[0]
    assert abs(present(cause.effect).values()["added"] - 0.06) < min(3.0 * cause.std["added"], 0.01)
    assert found.gain[1] <= found.gain[0] <= found.gain[2]
    assert found.after[1] < 0.65 * found.before[1]


def test_what_is_written_can_be_read_and_run_again(
    found: Explanation, heavy: Experiment, tmp_path: Path
) -> None:
    scenario = quick_scenario()
    text = extended_yaml(scenario, heavy, found)
    path = tmp_path / "extended.yaml"
    path.write_text(text)
    again = load_scenario(path)
    assert effects(again.effects) == found.effects
    assert again.effects["surface_density"]["added_std"] > 0.0
    told = found.comparison.told["refined"]
    w = found.comparison.whitening
    off = spots(
        w,
        w.vector(told),
        heavy.recordings,
        heavy.labs["scenario"].garment,
        [t.contact for t in told],
        heavy.samples,
        heavy.labs["scenario"].person(()),
    )
    alone = windows(heavy, found)
    content = json.loads(
        json.dumps(as_json(found, off, alone, None, ["sway: <note>"]), allow_nan=False)
    )
    assert content["verdict"] == "named"
    assert content["causes"][0]["parameters"]["added"]["unit"] == "kg/m²"
    assert len(content["candidates"]) == len({c["effect"] for c in content["candidates"]})
    # forces tell weight best
    assert content["where"][0]["kind"] == "signal"
    assert content["where"][0]["name"].startswith("force")
    page = report_page(found, heavy, off, alone, None, text, ["sway: <note>"])
    assert content["notes"] == ["sway: <note>"]
    assert "sway: &lt;note&gt;" in page
    assert "weight of the cloth" in page
    assert page.count("data:image/svg+xml") >= 4


def test_effects_that_need_contact_are_not_blamed_where_there_is_none(found: Explanation) -> None:
    scored = {s.name: s.screened for s in found.scores}
    assert "friction" not in scored
    assert "surface_density" in scored


def test_effects_that_are_on_already_are_not_tried() -> None:
    rest = np.random.default_rng(0).uniform(-0.3, 0.3, (50, 3))
    names = {c.name for c in candidates(rest, [SurfaceDensity(added=0.1)])}
    assert "surface_density" not in names
    assert "air_drag" in names


def test_the_extended_simulation_strays_less_on_its_own(
    heavy: Experiment, found: Explanation
) -> None:
    alone = windows(heavy, found)
    # what is left is the coarse scenario's own numerics
    assert alone.strayed[1] < 0.9 * alone.strayed[0]
    assert alone.whole[1] < 0.9 * alone.whole[0]
    assert len(alone.horizon) == len(heavy.recordings)
    # a restart is as near to the markers as the replay that is kept in step
    assert np.nanmax(alone.after[:, 0]) < 3.0 * alone.noise
    assert np.all(alone.growth[:, 0] < 1.5)
