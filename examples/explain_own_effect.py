"""Registers an effect, hides it in simulated data, and finds it: explain_own_effect.py."""

from dataclasses import dataclass

import numpy as np

from drake_dress import explain

QUICK = ["plant.spacing=0.06", "plant.time_step=0.008", "plant.tolerance=2e-3"]


@explain.register_effect
@dataclass(frozen=True)
class HemChain(explain.MassEffect):
    """A chain sewn into the hem: its mass, kg, is spread over the lowest 6 cm of the garment."""

    NAME = "hem_chain"
    IN_WORDS = "a chain in the hem"
    mass: float = explain.parameter("kg", low=0.0, high=1.0, typical=0.05)

    def apply(self, sheet: explain.Sheet) -> np.ndarray:
        """Returns the added mass of each node (n,), kg."""
        return self.mass * self.derivative("mass", sheet)

    def derivative(self, name: str, sheet: explain.Sheet) -> np.ndarray:
        """Returns the derivative of the added mass by the parameter."""
        height = sheet.rest_position[:, 2]
        area = np.where(height < height.min() + 0.06, sheet.elements.node_area, 0.0)
        return area / area.sum()


if __name__ == "__main__":
    explain.check_effect(HemChain)
    session = explain.Session(motions=["sway"], duration=1.6)
    lab = explain.simulate("measured", HemChain(mass=0.1), QUICK, session=session)
    tried = ["air_drag", "surface_density", "hem_chain"]  # all effects without this line
    found = explain.explain(lab.recordings, "measured", QUICK, effects=tried)
    for score in found.candidates:
        print(f"{score.name}: explains {score.screened:.0%} of the residual at first sight")
    print(found)
