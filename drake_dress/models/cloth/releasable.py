"""A plant's garment whose held nodes can be let go."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from drake_dress.models.arrays import FloatArray, IntArray
from drake_dress.models.cloth.contact.obstacles import Obstacles
from drake_dress.models.cloth.influences import NO_INFLUENCES, Influences
from drake_dress.models.cloth.layered import Integrator, LayeredCloth
from drake_dress.models.cloth.state import ClothState


class ReleasableCloth:
    """Two integrators of one garment: one that holds nodes, and one that holds none.

    The second one is made at the first step without held nodes, because its factor takes as long
    as many steps, and most users of a plant never let go.

    Args:
        make: makes an integrator that holds the given nodes.
        held: (k,) nodes that the grippers hold.
    """

    def __init__(self, make: Callable[[IntArray], Integrator], held: IntArray) -> None:
        self._make = make
        self._holding = make(held)
        self._free: Integrator | None = None
        inner = self._holding
        # whether layers of the garment collide
        self.has_layers = isinstance(inner, LayeredCloth)
        self.elements, self.material = inner.elements, inner.material
        self.time_step, self.held = inner.time_step, inner.held
        self.mass, self.gravity = inner.mass, inner.gravity

    def step(
        self,
        state: ClothState,
        obstacles: Obstacles,
        held_velocity: FloatArray,
        influences: Influences = NO_INFLUENCES,
        guess: FloatArray | None = None,
    ) -> tuple[ClothState, Any]:
        """Returns the state one time step later; see `ImplicitCloth.step`.

        Args:
            state: present state.
            obstacles: the person at the start of the step.
            held_velocity: (k,3) velocity of the held nodes, m/s; (0,3) once they are let go.
            influences: other effects on the garment.
            guess: (n,3) estimate of the mean velocity, m/s.
        """
        inner = self._holding
        if len(held_velocity) == 0 and len(self.held) > 0:
            if self._free is None:
                self._free = self._make(np.zeros(0, dtype=np.int32))
            inner = self._free
        return inner.step(state, obstacles, held_velocity, influences, guess)
