"""What keeps layers apart within an implicit step: resistance to approach, pair by pair.

A correction after the step knows nothing of how stiff cloth is: layers that a coat's tension
presses together were pushed through each other by the solver and back by the correction at every
step, by 5 to 7 mm at 8 ms, and edges there were stretched by 40 %. With the pairs in the system the
solver knows: corrections are below 1 mm, and edges are stretched as they are without layers.

Of a pair with weights c and unit direction n, s = n·Σ c x the distance and u = n·Σ c w the rate at
which it grows, one that would come closer than the thickness T gets the impulse

    J = κ max(0, r − u),   r = (T − s) / h, a share of it where s < T.

Of the pairs that act it is linear in w: κ (c ⊗ n)(c ⊗ n)ᵀ is added to the matrix, κ r (c ⊗ n) to
the right-hand side. Which pairs act is found by a semismooth Newton iteration: after a solve, those
with u < r do. Layers push and do not pull: while all pairs acted that were about to come too close,
those that would have parted by themselves were glued together. Folds of some hundred such pairs
shook themselves up within a tenth of a second, and in one of 200 dressings the coat flew apart.
"""

from __future__ import annotations

from dataclasses import dataclass

import numba as nb
import numpy as np

from drake_dress.models.arrays import BoolArray, FloatArray, IntArray

# Pull of pairs, by the push of the others, from which a step is solved again.
_PULLING = 0.2
# Approach of a pair that did not act beyond what it may in a step, m, from which a step is solved
# again; what is less is corrected.
_CLOSER = 1e-3


@dataclass(frozen=True)
class Bonds:
    """Pairs that resist approach.

    Attributes:
        node: (P,4).
        row: (P,4,3) c ⊗ n.
        resistance: (P,) κ, kg.
        rate: (P,) r, at which a pair is to part at least, m/s.
        closing: (P,) whether it resists before anything is known of the step.
    """

    node: IntArray
    row: FloatArray
    resistance: FloatArray
    rate: FloatArray
    closing: BoolArray

    def chosen(self, which: BoolArray) -> Bonds:
        """Returns those that are true in `which` (P,)."""
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
        """Returns (n,), 1/kg, what is left of `light` where nodes face along bonds.

        Args:
            facing: (n,3) unit normals of the nodes.
            light: of `normal_response`.
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
    """Those of a step's bonds that push, as far as its solves have shown.

    Attributes:
        now: they.
        drive: (n,3) of them, N s.

    Args:
        bonds: all pairs that may.
        count: n, of the garment's nodes.
        time_step: h, s.
    """

    def __init__(self, bonds: Bonds, count: int, time_step: float) -> None:
        self._bonds, self._count, self._h = bonds, count, time_step
        self._act(bonds.closing)

    def __len__(self) -> int:
        return len(self._bonds.node)

    def update(self, velocity: FloatArray) -> bool:
        """Lets those act that push at `velocity` (n,3), m/s; returns whether it was far from that.

        Far: pairs that pull do so with a share of what the others push with, or pairs that did not
        act come much too close.
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
