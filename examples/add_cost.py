"""Adds a cost to the global controller's plan that keeps the grippers below a ceiling."""

from dataclasses import dataclass

import numpy as np

from drake_dress import dressing

CEILING, WEIGHT = 1.1, 50.0  # m, 1/m²


@dataclass(frozen=True)
class Ceiling:
    """w Σ max(0, z − ceiling)² over both grippers; z is the mean height of held nodes, m."""

    height: float = CEILING
    weight: float = WEIGHT

    def above(self, step: dressing.PlannedStep) -> np.ndarray:
        """Returns the excess height (2,) of left and right gripper, m."""
        z = [step.x[step.grip.nodes[of], 2].mean() for of in step.grip.of_side]
        return np.maximum(0.0, np.array(z) - self.height)

    def value(self, step: dressing.PlannedStep) -> float:
        """Returns the cost."""
        return self.weight * float(np.sum(self.above(step) ** 2))

    def add_slope(self, step: dressing.PlannedStep, slope: dressing.Slope) -> None:
        """Adds its derivative by the mean position of each gripper's held nodes."""
        slope.grippers[:, 2] += 2.0 * self.weight * self.above(step)


scenario = dressing.load_scenario("dummy_standing", ["plant.fidelity=quick", "duration=3"])
for name, costs in (("without", ()), ("with", (Ceiling(),))):
    own = dressing.OwnParts(costs=costs)
    with dressing.run(scenario, f"out/{name}", own, report=False).open_log() as log:
        height = np.mean([log.gripper_position[side][-1, 2] for side in ("left", "right")])
    print(f"{name} the cost, the grippers are at {height:.2f} m after 3 s")
