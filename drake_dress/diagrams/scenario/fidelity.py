"""Presets of the resolution at which a scenario's garment is simulated.

`drake-dress bench plant` measures the cost and the error of each preset; docs/cloth.md has the
table.
"""

from __future__ import annotations

from typing import Any

# Values of `plant` by `plant.fidelity`, for keys that the scenario does not give; m, s, numbers.
FIDELITIES: dict[str, dict[str, float]] = {
    "fine": {
        "spacing": 0.02,
        "time_step": 0.004,
        "body_time_step": 0.004,
        "implicitness": 0.7,
        "buckling_wavelength": 3.0,
        "tolerance": 1e-2,
    },
    "standard": {
        "spacing": 0.025,
        "time_step": 0.010,
        "body_time_step": 0.010,
        "implicitness": 0.7,
        "buckling_wavelength": 3.0,
        "tolerance": 0.1,
    },
    "quick": {
        "spacing": 0.03,
        "time_step": 0.010,
        "body_time_step": 0.010,
        "implicitness": 0.7,
        "buckling_wavelength": 3.0,
        "tolerance": 0.1,
    },
}


def fill_in_fidelity(content: dict[str, Any]) -> None:
    """Adds the values of a scenario's fidelity for keys that its content does not give.

    Values of a wrong type, and unknown words, are not changed. Later checks report them.
    """
    plant = content.setdefault("plant", {})
    if not isinstance(plant, dict):
        return
    fidelity = plant.get("fidelity", "standard")
    if not isinstance(fidelity, str):
        return
    for key, value in FIDELITIES.get(fidelity, {}).items():
        plant.setdefault(key, value)
