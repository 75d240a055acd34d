"""Fits to simulations that are made up here: linear, but for cloth that folds otherwise."""

from dataclasses import replace

import numpy as np
import pytest

from drake_dress.discrepancy.attribution import compare, screen
from drake_dress.discrepancy.candidates import Candidate, Probe
from drake_dress.discrepancy.experiment import Told
from drake_dress.discrepancy.fitting import Evidence, fit_again, fit_all, with_slopes
from drake_dress.discrepancy.recording import Recording
from drake_dress.models.effects.mass import SurfaceDensity

COUNT, SAMPLES, MARKERS, NOISE = 4, 200, 6, 1e-3
TRUTH = 0.05
ASTRAY = 2


class MadeUp:
    """Simulations that move markers in proportion to what cloth weighs more.

    From a weight on, the coarsest one folds the cloth of one recording another way.
    """

    def __init__(self, rng, folds_from=0.02):
        time = np.arange(SAMPLES) * 0.02
        self.told_at = []
        self._folds_from = folds_from
        self._base = rng.normal(0.0, 0.1, (COUNT, SAMPLES, MARKERS, 3))
        self._slope = rng.normal(0.0, 0.1, (COUNT, SAMPLES, MARKERS, 3))
        self._other = rng.normal(0.0, 0.03, (SAMPLES, MARKERS, 3))
        self._finer = rng.normal(0.0, 0.2e-3, (2, COUNT, SAMPLES, MARKERS, 3))
        path = np.zeros((SAMPLES, 2, 3))
        self.recordings = []
        for i in range(COUNT):
            seen = self._marker("refined", i, TRUTH) + rng.normal(0.0, NOISE, (SAMPLES, MARKERS, 3))
            self.recordings.append(
                Recording(
                    f"r{i}", time, path, seen, np.zeros((MARKERS, 3)), None, None, NOISE, 0.05
                )
            )
        self.samples = [np.arange(SAMPLES)] * COUNT

    def slope(self, i):
        return self._slope[i]

    def tell(self, jobs, progress=None):
        answer = []
        for level, effects in jobs:
            levels = [level] * COUNT if isinstance(level, str) else level
            self.told_at.append(tuple(levels))
            added = sum(e.added for e in effects)
            answer.append(
                [
                    Told(self._marker(at, i, added), np.zeros((SAMPLES, 2, 3)), np.zeros(SAMPLES))
                    for i, at in enumerate(levels)
                ]
            )
        return answer

    def _marker(self, level, i, added):
        marker = self._base[i] + added * self._slope[i]
        if level in ("screening", "scenario"):
            marker = marker + self._finer[0, i]
        if level == "doubled":
            marker = marker + self._finer[1, i]
        if level == "screening" and i == ASTRAY and abs(added) > self._folds_from:
            marker = marker + self._other
        return marker


@pytest.fixture(params=[0, 1, 2])
def made_up(request):
    return MadeUp(np.random.default_rng(request.param))


def evidence(found):
    off = found.vector["refined"] - found.vector["scenario"]
    return Evidence.of(found.whitening, found.extrapolation, off)


def test_a_recording_that_coarse_cloth_folds_otherwise_is_told_by_finer_cloth(made_up):
    found = compare(made_up)
    start = [[SurfaceDensity(added=0.03)]]
    made_up.told_at.clear()
    (fit,) = fit_all(made_up, evidence(found), found.vector["refined"], start)
    assert abs(fit.effects[0].added - TRUTH) < 4.0 * fit.std["surface_density"]["added"]
    # that recording and no other
    assert set(made_up.told_at) == {
        ("screening",) * COUNT,
        tuple("scenario" if i == ASTRAY else "screening" for i in range(COUNT)),
    }


def test_where_nothing_folds_otherwise_all_is_told_by_the_coarsest():
    lab = MadeUp(np.random.default_rng(0), folds_from=np.inf)
    found = compare(lab)
    lab.told_at.clear()
    (fit,) = fit_all(lab, evidence(found), found.vector["refined"], [[SurfaceDensity(added=0.03)]])
    assert abs(fit.effects[0].added - TRUTH) < 4.0 * fit.std["surface_density"]["added"]
    assert set(lab.told_at) == {("screening",) * COUNT}


def test_screening_does_not_hold_one_such_recording_against_a_candidate(made_up):
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
    assert best.start.added == pytest.approx(TRUTH, rel=0.3)


def test_whitening_can_be_undone(made_up):
    w = compare(made_up).whitening
    values = np.random.default_rng(0).standard_normal(len(w.data))
    np.testing.assert_allclose(w.of_size(w.size(values)), values, atol=1e-12)


def test_half_a_second_in_which_cloth_snaps_does_not_move_a_parameter():
    lab = MadeUp(np.random.default_rng(0), folds_from=np.inf)
    rows = slice(50, 75)
    # a marker or two may do anything; the whole garment, off by 10 to 30 mm, is what a snap does
    seen = lab.recordings[0].marker_position.copy()
    seen[rows] += 0.2 * lab.slope(0)[rows] + 0.005
    lab.recordings[0] = replace(lab.recordings[0], marker_position=seen)
    found = compare(lab)
    (fit,) = fit_all(lab, evidence(found), found.vector["refined"], [[SurfaceDensity(added=0.03)]])
    assert fit.effects[0].added == pytest.approx(TRUTH, abs=1e-3)


def test_refined_slopes_lead_to_the_truth_from_where_coarse_ones_have_led(made_up):
    found = compare(made_up)
    (fit,) = fit_all(
        made_up, evidence(found), found.vector["refined"], [[SurfaceDensity(added=0.03)]]
    )
    off = replace(fit, effects=(SurfaceDensity(added=0.03),))
    (told,) = made_up.tell([("refined", off.effects)])
    told = found.whitening.vector(told)
    begun = with_slopes(made_up, found.whitening, off, told)
    again = fit_again(evidence(found), begun, told)
    assert abs(again.effects[0].added - TRUTH) < 4.0 * again.std["surface_density"]["added"]
    # a bound on one side leaves a difference to the other
    lowest = next(p.low for p in SurfaceDensity.parameters())
    at_bound = with_slopes(
        made_up, found.whitening, replace(off, effects=(SurfaceDensity(added=lowest),)), told
    )
    assert np.isfinite(at_bound.slopes).all()
