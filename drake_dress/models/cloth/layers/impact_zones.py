"""The last resort: nodes that impulses could not separate move together as one rigid body.

A zone is a set of nodes linked by pairs that would still cross (Provot 1997). Its displacement is
replaced by the mass-weighted best-fitting twist t + ω × r, which conserves momentum and angular
momentum and adds no energy. Nodes that share a twist cannot cross, because no distance shrinks
along it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drake_dress.models.arrays import FloatArray, IntArray

# Weight of a node whose motion is prescribed, in units of the zone's free mass.
_PRESCRIBED = 1e8


@dataclass(frozen=True)
class Zone:
    """One replacement of displacements by a twist.

    Attributes:
        node: (z,) its nodes.
        gain: (6,3z) maps displacements to the twist.
        basis: (3z,6) maps the twist to displacements.
        keep: (z,3,3) part of its own displacement that a node keeps: all, one direction or nothing.
    """

    node: IntArray
    gain: FloatArray
    basis: FloatArray
    keep: FloatArray

    def apply(self, dx: FloatArray) -> None:
        """Replaces the displacements (n,3) of the zone in place."""
        own = dx[self.node]
        shared = (self.basis @ (self.gain @ own.ravel())).reshape(-1, 3)
        dx[self.node] = shared + np.einsum("zij,zj->zi", self.keep, own - shared)

    def transpose(self, bar: FloatArray) -> None:
        """Runs the transposed replacement on `bar` (n,3) in place."""
        own = bar[self.node]
        kept = np.einsum("zij,zj->zi", self.keep, own)
        shared = self.gain.T @ (self.basis.T @ (own - kept).ravel())
        bar[self.node] = kept + shared.reshape(-1, 3)


def make_zone(node: IntArray, x: FloatArray, inverse_mass: FloatArray, barred: FloatArray) -> Zone:
    """Returns the zone of `node` (z,) at positions `x` (n,3).

    Args:
        node: (z,) its nodes.
        x: (n,3) m.
        inverse_mass: (n,) 1/kg, 0 where the motion is prescribed: these nodes determine the twist.
        barred: (n,3) unit directions along which nodes keep their own motion, or zero.
    """
    w = inverse_mass[node]
    free = w > 0.0
    mass = np.ones(len(node))
    mass[free] = 1.0 / w[free]
    if free.any():
        mass[~free] = _PRESCRIBED * mass[free].sum()
    centre: FloatArray = mass @ x[node] / mass.sum()
    arm: FloatArray = x[node] - centre
    size = max(float(np.abs(arm).max()), 1e-9)
    basis = np.zeros((len(node), 3, 6))
    basis[:, :, :3] = np.eye(3)
    for axis in range(3):
        basis[:, :, 3 + axis] = np.cross(np.eye(3)[axis], arm / size)
    flat = basis.reshape(-1, 6)
    root = np.sqrt(np.repeat(mass, 3))
    scaled: FloatArray = root[:, None] * flat
    gain = np.asarray(np.linalg.pinv(scaled, rcond=1e-7) * root[None, :], dtype=np.float64)
    keep: FloatArray = np.einsum("zi,zj->zij", barred[node], barred[node])
    keep[~free] = np.eye(3)
    return Zone(node, gain, flat, keep)


class Union:
    """Disjoint sets of nodes."""

    def __init__(self) -> None:
        self._parent: dict[int, int] = {}

    def find(self, node: int) -> int:
        """Returns the representative of the set of `node`."""
        root = self._parent.setdefault(node, node)
        while self._parent[root] != root:
            root = self._parent[root]
        while self._parent[node] != root:
            self._parent[node], node = root, self._parent[node]
        return root

    def link(self, nodes: list[int]) -> None:
        """Puts `nodes` into one set."""
        root = min(self.find(k) for k in nodes)
        for k in nodes:
            self._parent[self.find(k)] = root

    def sets(self) -> list[IntArray]:
        """Returns the sets, sorted."""
        members: dict[int, list[int]] = {}
        for node in sorted(self._parent):
            members.setdefault(self.find(node), []).append(node)
        return [np.array(v, dtype=np.int32) for _, v in sorted(members.items())]
