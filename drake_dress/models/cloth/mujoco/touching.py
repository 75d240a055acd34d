"""What the contacts of a MuJoCo step mean for the nodes: force, body and mode."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from drake_dress.models.arrays import FloatArray, IntArray
from drake_dress.models.cloth.contact.modes import FREE, SLIP, STICK

# Share of the friction cone from which a node counts as slipping; MuJoCo's cone is slightly soft.
_ON_THE_CONE = 0.95
# Force below which a node counts as free, N; the weight of a node is a few mN.
_LEAST = 1e-6


@dataclass(frozen=True)
class Touching:
    """The bodies' contact with the nodes.

    Attributes:
        force: (n,3) of the bodies on the nodes, N.
        owner: (n,) body that pushes a node most, -1 without one.
        mode: (n,) free, stick or slip.
    """

    force: FloatArray
    owner: IntArray
    mode: IntArray


def touching(
    mujoco: Any, model: Any, data: Any, dof: IntArray, edge: IntArray, friction: float
) -> Touching:
    """Returns the contact of nodes and bodies in the last step.

    The force of a contact acts on the nodes of its edge by MuJoCo's own weights, Jᵀ f. A node
    between two bodies has the whole force, and counts as touching the one that pushes it more.

    Args:
        mujoco: the module.
        model: MjModel.
        data: MjData after a step.
        dof: (n,3) degrees of freedom of the nodes.
        edge: (E,2) nodes of the edges of the flex that touches bodies.
        friction: coefficient of friction.
    """
    n = len(dof)
    contact, of_body = data.contact, np.zeros(0, dtype=bool)
    if data.ncon:
        of_body = (contact.geom[:, 0] >= 0) & (contact.efc_address >= 0)
    if not of_body.any():
        return Touching(np.zeros((n, 3)), np.full(n, -1, np.int32), np.zeros(n, np.int32))
    row, dim = contact.efc_address[of_body], contact.dim[of_body]
    kept = np.zeros(data.nefc)
    for k in range(int(dim.max())):
        at = row[dim > k] + k
        kept[at] = data.efc_force[at]
    moved = np.zeros(model.nv)
    mujoco.mj_mulJacTVec(model, data, moved, kept)
    force = moved[dof]

    normal_force = data.efc_force[row]
    nodes = edge[contact.elem[of_body, 1]]
    bodies = contact.geom[of_body, 0]
    weight = _weights(data.flexvert_xpos[nodes], contact.pos[of_body])
    pushes = np.zeros((n, int(bodies.max()) + 1))
    normal = np.zeros((n, 3))
    for end in range(2):
        share = weight[:, end] * normal_force
        np.add.at(pushes, (nodes[:, end], bodies), share)
        np.add.at(normal, nodes[:, end], share[:, None] * contact.frame[of_body, :3])
    touched = np.linalg.norm(force, axis=1) > _LEAST
    force[~touched] = 0.0
    owner = np.where(touched, pushes.argmax(axis=1), -1).astype(np.int32)
    return Touching(force, owner, _modes(force, normal, touched, friction))


def _weights(end: FloatArray, point: FloatArray) -> FloatArray:
    """Returns (c,2) the weights of the ends (c,2,3) of edges at their nearest points to (c,3)."""
    along = end[:, 1] - end[:, 0]
    length2 = np.maximum(np.einsum("ij,ij->i", along, along), 1e-30)
    second = np.clip(np.einsum("ij,ij->i", point - end[:, 0], along) / length2, 0.0, 1.0)
    return np.stack([1.0 - second, second], axis=1)


def _modes(force: FloatArray, normal: FloatArray, touched: Any, friction: float) -> IntArray:
    length = np.linalg.norm(normal, axis=1)
    unit = normal / np.maximum(length, 1e-300)[:, None]
    along = np.einsum("ij,ij->i", force, unit)
    across = np.linalg.norm(force - along[:, None] * unit, axis=1)
    slips = across >= _ON_THE_CONE * friction * along
    modes: IntArray = np.where(touched, np.where(slips, SLIP, STICK), FREE).astype(np.int32)
    return modes
