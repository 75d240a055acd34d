"""Moves a predicted garment to what was observed of it, as far as its prediction is uncertain.

The displacement d of the nodes minimises

    Σ w (J d − r)² + (d − d₀)ᵀ K (d − d₀),   K = (a I + b L) / σ²,

with the observations' equations J d = r and weights w, the displacement d₀ that the prediction
stands for, and L the graph Laplacian of the mesh: neighbours are wrong alike. Held nodes stay. The
equations are solved by conjugate gradients, preconditioned by the factored K.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
import scipy.sparse as sp
from scipy.sparse.linalg import LinearOperator, cg, splu

from drake_dress.models.arrays import FloatArray, IntArray
from drake_dress.models.garment.edges import unique_edges
from drake_dress.models.immutable import Immutable
from drake_dress.models.perception.pulls import Pulls


@dataclass(frozen=True)
class CorrectionSettings:
    """How far observations move the prediction.

    Attributes:
        deviation: standard deviation of a prediction over one second, m; its variance σ² grows with
            time.
        alone: a, weight of each node's own displacement.
        together: b, weight of differences between neighbours.
        tolerance: relative residual of the solve.
        iterations: largest number of its iterations.
    """

    deviation: float = 0.5
    alone: float = 1.0
    together: float = 30.0
    tolerance: float = 1e-3
    iterations: int = 100


class Correction(Immutable):
    """The prior of a mesh, factored.

    Args:
        faces: (F,3).
        count: number of nodes.
        held: (k,) nodes that stay.
        settings: how far observations move the prediction.
    """

    def __init__(
        self,
        faces: IntArray,
        count: int,
        held: npt.NDArray[np.integer],
        settings: CorrectionSettings = CorrectionSettings(),
    ) -> None:
        s = settings
        prior = (s.alone * sp.eye_array(count) + s.together * _laplacian(faces, count)).tocsr()
        self._prior = prior
        self._free = np.setdiff1d(np.arange(count), held)
        self._prior_of_free = self._prior[self._free][:, self._free]
        self._factor = splu(sp.csc_matrix(self._prior_of_free))
        self._settings = settings
        self._count = count

    def __getstate__(self) -> dict[str, Any]:
        # a factor of SuperLU cannot be pickled
        return {name: value for name, value in vars(self).items() if name != "_factor"}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state)
        self._factor = splu(sp.csc_matrix(self._prior_of_free))

    def displacement(
        self, pulls: Pulls, before: FloatArray | None = None, since: float = 0.2
    ) -> FloatArray:
        """Returns (n,3) the displacement of the nodes from where the pulls were found, m.

        Args:
            pulls: what the observations ask.
            before: (n,3) displacement that leads back to the prediction, d₀, m; zero by default.
            since: time that was predicted, s.
        """
        certainty = 1.0 / (self._settings.deviation**2 * since)
        n, free = self._count, self._free
        back = np.zeros((n, 3)) if before is None else before
        column = (3 * free[:, None] + np.arange(3)).ravel()
        matrix = sp.csr_array(pulls.matrix[:, column])
        transposed = sp.csr_array(matrix.T)

        def applied(d: FloatArray) -> FloatArray:
            asked = transposed @ (pulls.weight * (matrix @ d))
            prior = self._prior_of_free @ d.reshape(-1, 3)
            return np.asarray(asked + certainty * prior.ravel())

        def preconditioned(d: FloatArray) -> FloatArray:
            return np.asarray(self._factor.solve(d.reshape(-1, 3)).ravel() / certainty)

        right = transposed @ (pulls.weight * pulls.residual)
        right = right + certainty * (self._prior @ back)[free].ravel()
        shape = (len(column), len(column))
        found, _ = cg(
            LinearOperator(shape, applied, dtype=float),
            right,
            rtol=self._settings.tolerance,
            maxiter=self._settings.iterations,
            M=LinearOperator(shape, preconditioned, dtype=float),
        )
        moved = np.zeros((n, 3))
        moved[free] = found.reshape(-1, 3)
        return moved


def _laplacian(faces: IntArray, count: int) -> sp.csr_array:
    """Returns the graph Laplacian (n,n) of a mesh."""
    first, second = unique_edges(faces).T
    ones = np.ones(2 * len(first))
    ends = np.concatenate([first, second]), np.concatenate([second, first])
    neighbours = sp.coo_array((ones, ends), shape=(count, count)).tocsr()
    return sp.csr_array(sp.diags_array(neighbours.sum(axis=1)) - neighbours)
