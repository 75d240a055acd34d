"""Resistance of pairs to approach, which keeps layers apart within an implicit step.

A correction after the step does not know how stiff cloth is. When a coat's tension pressed layers
together, the solver pushed them through each other at every step and the correction pushed them
back, by 5 to 7 mm at 8 ms, and edges there were stretched by 40 %. With the pairs in the solver's
system, corrections are below 1 mm, and edges are stretched as they are without layers.

A pair has weights c, unit direction n, distance s = n·Σ c x and rate u = n·Σ c w at which it grows.
If it would come closer than the thickness T, it gets the impulse

    J = κ max(0, r − u),   r = (T − s) / h, a share of it where s < T.

For active pairs it is linear in w: κ (c ⊗ n)(c ⊗ n)ᵀ is added to the matrix, κ r (c ⊗ n) to the
right-hand side. A semismooth Newton iteration finds the active pairs: after a solve, those with
u < r. Layers push and do not pull. When all pairs that were about to come too close were active,
those that would have separated by themselves were glued together. Folds of some hundred such pairs
became unstable within a tenth of a second, and in one of 200 dressings the coat flew apart.
"""

from __future__ import annotations

from dataclasses import dataclass

import numba as nb
import numpy as np

from drake_dress.models.arrays import BoolArray, FloatArray, IntArray

# Pull of pairs, relative to the push of the others, above which a step is solved again.
_PULLING = 0.2
# Excess approach of an inactive pair in a step, m, above which the step is solved again; less is
# left to the correction.
_CLOSER = 1e-3


@dataclass(frozen=True)
class Bonds:
    """Pairs that resist approach.

    Attributes:
        node: (P,4) nodes of each pair.
        row: (P,4,3) c ⊗ n.
        resistance: (P,) κ, kg.
        rate: (P,) r, least rate at which a pair is to separate, m/s.
        closing: (P,) whether it is active in the first solve of a step.
    """

    node: IntArray
    row: FloatArray
    resistance: FloatArray
    rate: FloatArray
    closing: BoolArray

    def chosen(self, which: BoolArray) -> Bonds:
        """Returns the bonds for which `which` (P,) is true."""
        return Bonds(*(values[which] for values in vars(self).values()))

    def lacking(self, velocity: FloatArray) -> FloatArray:
        """Returns (P,) r − u at `velocity` (n,3), m/s: positive where layers push."""
        lacking = self.rate.copy()
        _take_off_rate(self.node, self.row, velocity, lacking)
        return lacking

    def drive(self, count: int) -> FloatArray:
        """Returns (count,3) Σ κ r (c ⊗ n) on the nodes, N s."""
        impulse = np.zeros((count, 3))
        _add_drive(self.node, self.row, self.resistance * self.rate, impulse)
        return impulse

    def stiffened(self, facing: FloatArray, light: FloatArray) -> FloatArray:
        """Returns (n,), 1/kg, `light` reduced where the nodes' normals lie along bonds.

        Args:
            facing: (n,3) unit normals of the nodes.
            light: (n,) compliance from `normal_response`.
        """
        left = light.copy()
        _stiffen(self.node, self.row, self.resistance, facing, left)
        return left


NO_BONDS = Bonds(
    np.zeros((0, 4), dtype=np.int32),
    np.zeros((0, 4, 3)),
    np.zeros(0),
    np.zeros(0),
    np.zeros(0, dtype=np.bool_),
)


class ActingBonds:
    """The active bonds of a step, updated after its solves.

    Attributes:
        now: the active bonds.
        drive: (n,3) their impulse, N s.

    Args:
        bonds: all pairs that may become active.
        count: n, number of the garment's nodes.
        time_step: h, s.
    """

    def __init__(self, bonds: Bonds, count: int, time_step: float) -> None:
        self._bonds, self._count, self._h = bonds, count, time_step
        self._act(bonds.closing)

    def __len__(self) -> int:
        return len(self._bonds.node)

    def update(self, velocity: FloatArray) -> bool:
        """Activates the bonds that push at `velocity` (n,3), m/s; returns whether to solve again.

        That is needed if active pairs pulled with more than a share of what the others pushed with,
        or if inactive pairs came much too close.
        """
        lacking = self._bonds.lacking(velocity)
        acting = lacking > 0.0
        if np.array_equal(acting, self._acted):
            return False
        impulse = (self._bonds.resistance * lacking)[self._acted]
        push, pull = impulse[impulse > 0.0].sum(), -impulse[impulse < 0.0].sum()
        closer = self._h * np.max(lacking[~self._acted], initial=0.0)
        self._act(acting)
        return bool(pull > _PULLING * push or closer > _CLOSER)

    def _act(self, which: BoolArray) -> None:
        self._acted = which
        self.now = self._bonds.chosen(which)
        self.drive = self.now.drive(self._count)


@nb.njit(cache=True, nogil=True)
def bond_product(z, node, row, resistance, out):  # type: ignore[no-untyped-def]
    """Adds Σ κ (c ⊗ n)(c ⊗ n)ᵀ z to `out`, both (n,3) or wider."""
    for p in range(node.shape[0]):
        along = 0.0
        for m in range(4):
            i = node[p, m]
            along += row[p, m, 0] * z[i, 0] + row[p, m, 1] * z[i, 1] + row[p, m, 2] * z[i, 2]
        along *= resistance[p]
        for m in range(4):
            i = node[p, m]
            out[i, 0] += along * row[p, m, 0]
            out[i, 1] += along * row[p, m, 1]
            out[i, 2] += along * row[p, m, 2]


@nb.njit(cache=True, nogil=True)
def _take_off_rate(node, row, velocity, out):  # type: ignore[no-untyped-def]
    for p in range(node.shape[0]):
        for m in range(4):
            for c in range(3):
                out[p] -= row[p, m, c] * velocity[node[p, m], c]


@nb.njit(cache=True, nogil=True)
def _stiffen(node, row, resistance, facing, light):  # type: ignore[no-untyped-def]
    for p in range(node.shape[0]):
        for m in range(4):
            i = node[p, m]
            along = 0.0
            for c in range(3):
                along += row[p, m, c] * facing[i, c]
            light[i] /= 1.0 + light[i] * resistance[p] * along * along


@nb.njit(cache=True, nogil=True)
def _add_drive(node, row, impulse, out):  # type: ignore[no-untyped-def]
    for p in range(node.shape[0]):
        for m in range(4):
            for c in range(3):
                out[node[p, m], c] += impulse[p] * row[p, m, c]
