"""Adds keys to scenarios; also usable as `drake-dress run … --plugin add_scenario_key.py`."""

from dataclasses import dataclass

import numpy as np

from drake_dress import dressing


@dressing.register_cost
@dataclass(frozen=True)
class LightTouch:
    """w Σ max(0, ‖f‖² − free²) over both grippers; keys below controller.costs.light_touch."""

    NAME = "light_touch"
    weight: float = 1e-3  # 1/N²
    free: float = 1.0  # N

    def value(self, step: dressing.PlannedStep) -> float:
        """Returns the cost."""
        squares = [float(np.sum(step.force(side) ** 2)) for side in (0, 1)]
        return self.weight * sum(max(0.0, square - self.free**2) for square in squares)

    def add_slope(self, step: dressing.PlannedStep, slope: dressing.Slope) -> None:
        """Adds its derivative by the forces of the held nodes."""
        for side, mine in enumerate(step.grip.of_side):
            force = step.force(side)
            slope.reaction[mine] += 2.0 * self.weight * force * (force @ force > self.free**2)


dressing.register_predictor("swift", dressing.ConstantVelocityPredictor)

if __name__ == "__main__":
    keys = ["controller.costs.light_touch.weight=0.01", "controller.predictor=swift"]
    keys += ["plant.fidelity=quick", "duration=2"]
    scenario = dressing.load_scenario("dummy_standing", keys)
    print(scenario.controller.costs, scenario.controller.predictor)
    with dressing.run(scenario, "out/keys", report=False).open_log() as log:
        print(f"largest force {np.linalg.norm(log.gripper_force['left'], axis=1).max():.1f} N")
