from __future__ import annotations

import pickle

import numpy as np
import pytest
import scipy.sparse as sp
from hypothesis import given
from hypothesis import strategies as st

from drake_dress.models.garment.coat import COATS, make_coat
from drake_dress.models.perception.correction import Correction, CorrectionSettings
from drake_dress.models.perception.pulls import Pulls, joined

COAT = make_coat(COATS["jacket"], 0.06)
FACES, N = COAT.faces, len(COAT.rest_position)
HELD = np.concatenate([COAT.grasp["left"], COAT.grasp["right"]])
SETTINGS = CorrectionSettings(tolerance=1e-10, iterations=1000)
CORRECTION = Correction(FACES, N, HELD, SETTINGS)
FREE = np.setdiff1d(np.arange(N), HELD)
SINCE = 0.3  # s


def drawn_pulls(seed: int, count: int = 60) -> Pulls:
    rng = np.random.default_rng(seed)
    matrix = sp.random_array((count, 3 * N), density=9 / (3 * N), rng=rng, format="csr")
    return Pulls(sp.csr_array(matrix), rng.normal(0, 0.05, count), rng.uniform(10, 1e4, count))


@given(st.integers(0, 2**32 - 1))
def test_the_displacement_is_the_least_of_the_cost(seed: int) -> None:
    pulls, rng = drawn_pulls(seed), np.random.default_rng(seed)
    back = 0.03 * rng.normal(size=(N, 3))
    back[HELD] = 0.0
    laplacian = np.zeros((N, N))
    for a, b in {
        tuple(sorted(e)) for f in FACES for e in ((f[0], f[1]), (f[1], f[2]), (f[0], f[2]))
    }:
        laplacian[[a, b], [a, b]] += 1.0
        laplacian[[a, b], [b, a]] -= 1.0
    prior = SETTINGS.alone * np.eye(N) + SETTINGS.together * laplacian
    prior /= SETTINGS.deviation**2 * SINCE

    def gradient(d: np.ndarray) -> np.ndarray:
        asked = pulls.matrix.T @ (pulls.weight * (pulls.matrix @ d.ravel() - pulls.residual))
        return (asked.reshape(-1, 3) + prior @ (d - back))[FREE]

    found = CORRECTION.displacement(pulls, back, SINCE)
    np.testing.assert_array_equal(found[HELD], 0.0)
    assert np.abs(gradient(found)).max() < 1e-6 * np.abs(gradient(0.0 * found)).max()


def test_without_observations_the_prediction_stays() -> None:
    back = np.random.default_rng(0).normal(size=(N, 3))
    back[HELD] = 0.0
    none = joined([], N)
    np.testing.assert_array_equal(CORRECTION.displacement(none), np.zeros((N, 3)))
    np.testing.assert_allclose(CORRECTION.displacement(none, back), back, atol=1e-8)


def test_nodes_that_are_not_observed_go_along_with_their_neighbours() -> None:
    far = COAT.rest_position[FREE]
    near = FREE[np.argsort(np.linalg.norm(far - far[0], axis=1))[:12]]
    column = 3 * near + 1
    matrix = sp.csr_array((np.ones(12), (np.arange(12), column)), shape=(12, 3 * N))
    moved = CORRECTION.displacement(Pulls(matrix, np.full(12, 0.05), np.full(12, 1e5)))
    others = np.setdiff1d(FREE, near)
    assert moved[near, 1] == pytest.approx(0.05, rel=0.1)
    assert 0.001 < moved[others, 1].max() < 0.05
    assert moved[others, 1].min() > -1e-9
    np.testing.assert_allclose(moved[:, [0, 2]], 0.0, atol=1e-12)


def test_a_correction_can_be_sent_to_another_process() -> None:
    pulls = drawn_pulls(0)
    sent = pickle.loads(pickle.dumps(CORRECTION))
    np.testing.assert_array_equal(sent.displacement(pulls), CORRECTION.displacement(pulls))
