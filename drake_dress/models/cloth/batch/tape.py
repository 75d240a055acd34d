"""What a step of a batch leaves behind, and the derivative that comes of it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import warp as wp

from drake_dress.models.cloth.batch.arrays import DeviceArray, Kind, SharedTensors
from drake_dress.models.cloth.batch.bodies import Bodies
from drake_dress.models.cloth.batch.contact_kernels import Proximity
from drake_dress.models.cloth.batch.friction_kernels import Friction
from drake_dress.models.cloth.batch.parameters import Parameters
from drake_dress.models.cloth.elements import IntArray
from drake_dress.models.cloth.filtered_cg import FREE, HELD


@dataclass(frozen=True)
class ContactTypes:
    """Contact that is held instead of found, (B,n) each.

    Attributes:
        owner: the body that a node touches, -1 for nodes that touch none.
        mode: STICK, SLIP or, for nodes that take off, FREE; velocity_mode: likewise of the
            velocity at the end of the step. Those of nodes that touch nothing do not matter.
    """

    owner: IntArray
    mode: IntArray
    velocity_mode: IntArray


@dataclass(frozen=True)
class Contact:
    """Garments in contact; Warp arrays (B,n) unless said otherwise.

    Attributes:
        near: the nodes that touch something.
        touches, slips: (B,) 1 for garments with nodes that touch, that slip.
        stick_mode: types with all touching nodes sticking; stick_motion: Δx then.
        prescribed, target_change: Δx and Δv of sticking nodes.
        friction: contact types, and what follows from the force of sticking.
        multiplier, change_multiplier: ν of slipping nodes in Δx, kg·m, and in Δv, kg·m/s.
    """

    near: Proximity
    touches: wp.array
    slips: wp.array
    stick_mode: wp.array
    stick_motion: wp.array
    prescribed: wp.array
    target_change: wp.array
    friction: Friction
    multiplier: wp.array
    change_multiplier: wp.array


@dataclass(frozen=True)
class Tape:
    """What a step leaves for its adjoint; Warp arrays (B,n) unless said otherwise.

    Attributes:
        kind: library of the arrays that the step took.
        x, v: the state before, shared with the caller if it was a torch tensor or Warp array: do
            not write to it before the adjoint, which raises RuntimeError if a tensor was.
        parameters: the fabrics. bodies: what was touched.
        base_solve: (B,) how garments that touch nothing are solved.
        base_mode: HELD or FREE, of all nodes.
        contact: None if nothing touches in any garment.
        motion, change: Δx and Δv.
        shared: the tensors whose memory this is.
    """

    kind: Kind
    x: wp.array
    v: wp.array
    parameters: Parameters
    bodies: Bodies
    base_solve: wp.array
    base_mode: wp.array
    contact: Contact | None
    motion: wp.array
    change: wp.array
    shared: SharedTensors

    @property
    def types(self) -> ContactTypes:
        """The contact of this step, to hold in another; copied to the host."""
        if self.contact is None:
            nothing = np.full(self.base_mode.shape, -1, dtype=np.int32)
            free = np.full(self.base_mode.shape, FREE, dtype=np.int32)
            return ContactTypes(nothing, free, free)
        friction = self.contact.friction
        arrays: list[DeviceArray] = [self.contact.near.owner, friction.mode, friction.velocity_mode]
        owner, mode, velocity_mode = (a.numpy() for a in arrays)
        return ContactTypes(
            owner,
            np.where(mode == HELD, FREE, mode).astype(np.int32),
            np.where(velocity_mode == HELD, FREE, velocity_mode).astype(np.int32),
        )

    @property
    def mode(self) -> IntArray:
        """(B,n) FREE, STICK, SLIP or HELD of every node; copied to the host."""
        where: DeviceArray = self.base_mode
        if self.contact is not None:
            where = self.contact.friction.mode
        mode: IntArray = where.numpy()
        return mode


@dataclass(frozen=True)
class Gradient:
    """Derivative of a scalar with respect to the inputs of a step, in the step's kind of array.

    Attributes:
        x, v: (B,n,3). held_motion: (B,k,3).
        stretch_stiffness, bending_stiffness, surface_density, friction: (B,), each per its unit;
            None if not asked for.
    """

    x: Any
    v: Any
    held_motion: Any
    stretch_stiffness: Any = None
    bending_stiffness: Any = None
    surface_density: Any = None
    friction: Any = None
