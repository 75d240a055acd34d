"""Adds your own controller to the diagram: both grippers rise and slow down under load."""

from collections.abc import Callable

import numpy as np
from pydrake.systems.framework import BasicVector, Context, InputPort, LeafSystem

from drake_dress import dressing

SPEED, ENOUGH = 0.05, 6.0  # m/s, N


class Rise(LeafSystem):
    """Computes velocity requests from forces; its ports are connected by name."""

    def __init__(self) -> None:
        super().__init__()
        for side in ("left", "right"):
            force = self.DeclareVectorInputPort(f"{side}_gripper_force", 3)
            self.DeclareVectorOutputPort(f"{side}_velocity_request", 3, self._rise(force))
        self.DeclareVectorOutputPort("request_time", 1, self._now)

    def _rise(self, force: InputPort) -> Callable[[Context, BasicVector], None]:
        def calc(context: Context, output: BasicVector) -> None:
            load = np.linalg.norm(force.Eval(context))
            output.SetFromVector([0.0, 0.0, SPEED * max(0.0, 1.0 - float(load) / ENOUGH)])

        return calc

    def _now(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector([context.get_time()])


scenario = dressing.load_scenario("dummy_standing", ["plant.fidelity=quick", "duration=2"])
result = dressing.run(scenario, "out/own", dressing.OwnParts(controller=Rise), report=False)
with result.open_log() as log:
    z = log.gripper_position["left"][:, 2]
    print(f"the left gripper rose by {100 * (z[-1] - z[0]):.1f} cm")
