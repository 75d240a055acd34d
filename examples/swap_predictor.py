"""Replaces the controllers' predictor of the person's arms by your own."""

import numpy as np

from drake_dress import dressing


class LastStep:
    """Predicts that both arms repeat their last step for half a second, then stop."""

    history_length = 2  # samples
    sample_period = 0.1  # s

    def __init__(self) -> None:
        self.asked = 0

    def predict(self, history: np.ndarray, time_step: float, steps: int) -> np.ndarray:
        """Returns predicted joints (steps+1,6,3), m, from a history (T,6,3), newest last."""
        self.asked += 1
        velocity = np.nan_to_num(np.diff(history, axis=0)[-1]) / self.sample_period
        ahead = np.minimum(time_step * np.arange(steps + 1), 0.5)
        return history[-1] + ahead[:, None, None] * velocity


predictor = LastStep()
scenario = dressing.load_scenario("active_standing", ["plant.fidelity=quick", "duration=2"])
result = dressing.run(scenario, "out/own_predictor", dressing.OwnParts(predictor), report=False)
print(f"asked {predictor.asked} times in {result.summary['simulated_time_s']:.1f} s")
