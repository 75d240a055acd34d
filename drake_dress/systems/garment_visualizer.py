"""The garment, the grippers and their targets, live in Meshcat."""

from __future__ import annotations

import numpy as np
from pydrake.common.value import Value
from pydrake.geometry import Meshcat
from pydrake.systems.framework import Context, EventStatus, LeafSystem

from drake_dress.models.arrays import IntArray
from drake_dress.models.human.learned.forecast import Forecast
from drake_dress.report.log_schema import FORECAST_AHEAD
from drake_dress.report.scene import DressingScene


class GarmentVisualizer(LeafSystem):
    """Publishes the garment to Meshcat at a fixed rate.

    .. pydrake_system::

        name: GarmentVisualizer
        input_ports:
        - garment_position
        - targets (optional)
        - stage (optional)
        - gripper_position (optional)
        - forecast (optional)
        output_ports: []

    garment_position: (3n,) row-major (n,3), m. targets: (6,) target positions of the left and
    the right armhole, m; NaN hides one. stage: (2,) index into `STAGE_NAMES`; written above
    the garment. gripper_position: (6,) left, right, m. forecast: a `Forecast`, of which
    elbows and hands `FORECAST_AHEAD` from now are drawn. All in the world frame. The person is
    drawn by Drake's MeshcatVisualizer.

    Args:
        meshcat: Meshcat instance to draw in.
        faces: (F,3) triangles; their normals point outward.
        node_count: n.
        period: Period of publishing, s.
        path: Path in Meshcat's tree under which everything is drawn.
    """

    def __init__(
        self,
        meshcat: Meshcat,
        faces: IntArray,
        node_count: int,
        period: float = 1.0 / 15.0,
        path: str = "dressing",
    ) -> None:
        super().__init__()
        self._faces = np.asfortranarray(np.asarray(faces, dtype=np.int32).T)
        self._scene = DressingScene(meshcat, self._faces, path)
        self._garment = self.DeclareVectorInputPort("garment_position", 3 * node_count)
        self._targets = self.DeclareVectorInputPort("targets", 6)
        self._stage = self.DeclareVectorInputPort("stage", 2)
        self._grippers = self.DeclareVectorInputPort("gripper_position", 6)
        self._forecast = self.DeclareAbstractInputPort("forecast", Value[object](None))
        self.DeclarePeriodicPublishEvent(period, 0.0, self._publish)
        self.DeclareForcedPublishEvent(self._publish)

    def _publish(self, context: Context) -> EventStatus:
        self._scene.show_garment(self._garment.Eval(context).reshape(-1, 3))
        if self._targets.HasValue(context):
            self._scene.show_targets(self._targets.Eval(context).reshape(2, 3))
        if self._grippers.HasValue(context):
            self._scene.show_grippers(self._grippers.Eval(context).reshape(2, 3))
        if self._stage.HasValue(context):
            self._scene.show_stage(self._stage.Eval(context))
        if self._forecast.HasValue(context):
            forecast: Forecast = self._forecast.Eval(context)
            soon = np.array([context.get_time() + FORECAST_AHEAD])
            self._scene.show_forecast(forecast.mean_at(soon)[0], forecast.radius_at(soon)[0])
        return EventStatus.Succeeded()
