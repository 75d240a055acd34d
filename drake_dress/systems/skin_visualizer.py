"""The skin of the person, live in Meshcat."""

from __future__ import annotations

import numpy as np
from pydrake.geometry import Meshcat
from pydrake.systems.framework import Context, EventStatus, LeafSystem

from drake_dress.models.arrays import FloatArray
from drake_dress.models.human.skin.person_skin import PersonSkin
from drake_dress.report.scene import show_skin

# A joint has to move by this for the skin to be sent anew, m: less is not seen.
_SEEN = 1e-3


class SkinVisualizer(LeafSystem):
    """Publishes the person's skin to Meshcat at a fixed rate, while the arms move.

    .. pydrake_system::

        name: SkinVisualizer
        input_ports:
        - joint_position
        output_ports: []

    joint_position: (18,) row-major (6,3): shoulder, elbow, hand of left, then of right, m, world.
    Where a joint is not known, the skin stays as it was.

    Args:
        meshcat: Meshcat instance to draw in.
        skin: the person's skin.
        period: Period of publishing, s.
        path: Path in Meshcat's tree.
    """

    def __init__(
        self,
        meshcat: Meshcat,
        skin: PersonSkin,
        period: float = 1.0 / 15.0,
        path: str = "dressing/skin",
    ) -> None:
        super().__init__()
        self._meshcat, self._skin, self._path = meshcat, skin, path
        self._shown: FloatArray = np.full((6, 3), np.inf)
        self.DeclareVectorInputPort("joint_position", 18)
        self.DeclarePeriodicPublishEvent(period, 0.0, self._publish)
        self.DeclareForcedPublishEvent(self._publish)

    def _publish(self, context: Context) -> EventStatus:
        joints = self.get_input_port().Eval(context).reshape(6, 3)
        if np.isfinite(joints).all() and np.abs(joints - self._shown).max() > _SEEN:
            show_skin(self._meshcat, self._path, self._skin.vertices(joints), self._skin.faces)
            self._shown = joints
        return EventStatus.Succeeded()
