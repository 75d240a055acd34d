"""How finely a scenario's garment is simulated, as one word.

What each word costs, and how far it is off, is measured by `drake-dress bench plant`; the table
stands in docs/cloth.md.
"""

from __future__ import annotations

from typing import Any

# Values of `plant` by `plant.fidelity`, where the scenario gives none: m, s, and numbers.
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
    """Writes into a scenario's content what its fidelity says and the content does not.

    What is no group, or no fidelity, is left alone: it is told when types and words are looked at.
    """
    plant = content.setdefault("plant", {})
    if not isinstance(plant, dict):
        return
    fidelity = plant.get("fidelity", "standard")
    if not isinstance(fidelity, str):
        return
    for key, value in FIDELITIES.get(fidelity, {}).items():
        plant.setdefault(key, value)
