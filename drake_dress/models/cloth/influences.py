"""Influences on a garment during one step, apart from its material, gravity and contact.

Physical effects (`drake_dress/models/effects`) write them; integrators read them.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from drake_dress.models.arrays import FloatArray
from drake_dress.models.cloth.elements import Elements, in_lanes
from drake_dress.models.cloth.layers.bonds import Bonds


@dataclass(frozen=True)
class ContactLaw:
    """Friction and adhesion of the nodes.

    Attributes:
        friction: (n,) Coulomb coefficient.
        adhesion: (n,) tension that a contact bears before it is released, N.
    """

    friction: FloatArray
    adhesion: FloatArray


@dataclass(frozen=True)
class Influences:
    """Additional influences on a garment during one step; None has no effect.

    Attributes:
        force: (n,3) forces on the nodes, N.
        friction: (n,) coefficients of friction that replace the material's.
        adhesion: (n,) tension that a contact bears before it is released, N. It adds to the normal
            force in friction.
        stretch_factor: (F,) factors on the stretch stiffness of each triangle.
        bonds: pairs of layers that resist approach. Only the linearly implicit scheme uses them.
    """

    force: FloatArray | None = None
    friction: FloatArray | None = None
    adhesion: FloatArray | None = None
    stretch_factor: FloatArray | None = None
    bonds: Bonds | None = None

    def contact_law(self, friction: float, count: int) -> ContactLaw:
        """Returns the contact law of `count` nodes; `friction` is the material's coefficient."""
        mu = np.full(count, friction) if self.friction is None else self.friction
        return ContactLaw(mu, np.zeros(count) if self.adhesion is None else self.adhesion)

    def stiffened(self, elements: Elements) -> Elements:
        """Returns the elements with their areas scaled by `stretch_factor`."""
        if self.stretch_factor is None:
            return elements
        area = elements.triangle_area * self.stretch_factor
        lanes = elements.gradient_lanes.copy()
        lanes[:, 4] = in_lanes(area[:, None])[:, 0]
        return replace(elements, triangle_area=area, gradient_lanes=lanes)


NO_INFLUENCES = Influences()
