"""Fits to simulations that are made up here: linear, but for cloth that folds otherwise."""

from dataclasses import replace

import numpy as np
import pytest

from drake_dress.discrepancy.attribution import Comparison, compare, screen
from drake_dress.discrepancy.candidates import Candidate, Probe
from drake_dress.discrepancy.fitting import Evidence, fit_again, fit_all, with_slopes
from drake_dress.models.effects.mass import SurfaceDensity
from tests.discrepancy.made_up import ASTRAY, COUNT, TRUTH, MadeUp


@pytest.fixture(params=[0, 1, 2])
def made_up(request: pytest.FixtureRequest) -> MadeUp:
    return MadeUp(np.random.default_rng(request.param))


def evidence(found: Comparison) -> Evidence:
    off = found.vector["refined"] - found.vector["scenario"]
    return Evidence.of(found.whitening, found.extrapolation, off)


def test_a_recording_that_coarse_cloth_folds_otherwise_is_told_by_finer_cloth(
    made_up: MadeUp,
) -> None:
    found = compare(made_up)
    start = [[SurfaceDensity(added=0.03)]]
    made_up.told_at.clear()
    (fit,) = fit_all(made_up, evidence(found), found.vector["refined"], start)
    assert abs(fit.effects[0].values()["added"] - TRUTH) < 4.0 * fit.std["surface_density"]["added"]
    # that recording and no other
    assert set(made_up.told_at) == {
        ("screening",) * COUNT,
        tuple("scenario" if i == ASTRAY else "screening" for i in range(COUNT)),
    }


def test_where_nothing_folds_otherwise_all_is_told_by_the_coarsest() -> None:
    lab = MadeUp(np.random.default_rng(0), folds_from=np.inf)
    found = compare(lab)
    lab.told_at.clear()
    (fit,) = fit_all(lab, evidence(found), found.vector["refined"], [[SurfaceDensity(added=0.03)]])
    assert abs(fit.effects[0].values()["added"] - TRUTH) < 4.0 * fit.std["surface_density"]["added"]
    assert set(lab.told_at) == {("screening",) * COUNT}


def test_screening_does_not_hold_one_such_recording_against_a_candidate(made_up: MadeUp) -> None:
    found = compare(made_up)
    typical = SurfaceDensity(added=0.03)
    candidate = Candidate("surface_density", (Probe(typical, "added", -np.inf),))
    (told,) = made_up.tell([("screening", [typical])])
    column = found.whitening.vector(told) - found.vector["screening"]
    best = screen(found, [(candidate, column[:, None])], found.vector["refined"])[0]
    others = found.whitening.recording != ASTRAY
    residual = found.whitening.data - found.vector["refined"]
    share = np.sum(residual[others] ** 2) / np.sum(residual**2)
    assert best.gain > 0.8 * share
    assert best.start.values()["added"] == pytest.approx(TRUTH, rel=0.3)


def test_whitening_can_be_undone(made_up: MadeUp) -> None:
    w = compare(made_up).whitening
    values = np.random.default_rng(0).standard_normal(len(w.data))
    np.testing.assert_allclose(w.of_size(w.size(values)), values, atol=1e-12)


def test_half_a_second_in_which_cloth_snaps_does_not_move_a_parameter() -> None:
    lab = MadeUp(np.random.default_rng(0), folds_from=np.inf)
    rows = slice(50, 75)
    # a marker or two may do anything; the whole garment, off by 10 to 30 mm, is what a snap does
    seen = lab.recordings[0].marker_position.copy()
    seen[rows] += 0.2 * lab.slope(0)[rows] + 0.005
    lab.recordings[0] = replace(lab.recordings[0], marker_position=seen)
    found = compare(lab)
    (fit,) = fit_all(lab, evidence(found), found.vector["refined"], [[SurfaceDensity(added=0.03)]])
    assert fit.effects[0].values()["added"] == pytest.approx(TRUTH, abs=1e-3)


def test_refined_slopes_lead_to_the_truth_from_where_coarse_ones_have_led(made_up: MadeUp) -> None:
    found = compare(made_up)
    (fit,) = fit_all(
        made_up, evidence(found), found.vector["refined"], [[SurfaceDensity(added=0.03)]]
    )
    off = replace(fit, effects=(SurfaceDensity(added=0.03),))
    (all_told,) = made_up.tell([("refined", off.effects)])
    told = found.whitening.vector(all_told)
    begun = with_slopes(made_up, found.whitening, off, told)
    again = fit_again(evidence(found), begun, told)
    assert (
        abs(again.effects[0].values()["added"] - TRUTH)
        < 4.0 * again.std["surface_density"]["added"]
    )
    # a bound on one side leaves a difference to the other
    lowest = next(p.low for p in SurfaceDensity.parameters())
    at_bound = with_slopes(
        made_up, found.whitening, replace(off, effects=(SurfaceDensity(added=lowest),)), told
    )
    assert np.isfinite(at_bound.slopes).all()
