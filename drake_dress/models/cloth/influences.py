"""What acts on a garment during one step beside its material, gravity and the bodies it touches.

Physical effects (`drake_dress/models/effects`) write it, integrators read it.
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
        adhesion: (n,) pull that a contact can bear before it is released, N.
    """

    friction: FloatArray
    adhesion: FloatArray


@dataclass(frozen=True)
class Influences:
    """Other effects on the garment during a step. None has no effect.

    Attributes:
        force: (n,3) forces on the nodes, N.
        friction: (n,) coefficients of friction that replace the material's.
        adhesion: (n,) pull that a contact can bear before it is released, N. It adds to the normal
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
        """Returns what contact does with `count` nodes; `friction` is the material's."""
        mu = np.full(count, friction) if self.friction is None else self.friction
        return ContactLaw(mu, np.zeros(count) if self.adhesion is None else self.adhesion)

    def stiffened(self, elements: Elements) -> Elements:
        """Returns the elements, their areas scaled where stretch has another stiffness."""
        if self.stretch_factor is None:
            return elements
        area = elements.triangle_area * self.stretch_factor
        lanes = elements.gradient_lanes.copy()
        lanes[:, 4] = in_lanes(area[:, None])[:, 0]
        return replace(elements, triangle_area=area, gradient_lanes=lanes)


NO_INFLUENCES = Influences()
