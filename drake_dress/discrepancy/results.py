"""Makes the other files of `drake-dress explain`: explanation.json and extended.yaml."""

from __future__ import annotations

import json
from collections.abc import Collection, Sequence
from pathlib import Path
from typing import Any

from drake_dress import __version__
from drake_dress.diagrams.scenario import Scenario, resolved_yaml
from drake_dress.diagrams.sections.effects import effects
from drake_dress.discrepancy.experiment import Experiment
from drake_dress.discrepancy.explanation import DISCRETISATION, Explanation
from drake_dress.discrepancy.prediction_windows import Windows
from drake_dress.discrepancy.residual_map import Spot, worst
from drake_dress.file_output import write_text
from drake_dress.models.effects.registry import EFFECTS, own_effects
from drake_dress.yaml_text import read_yaml, write_yaml


def as_json(
    explanation: Explanation,
    spots: list[Spot],
    alone: Windows,
    suggestion: str | None,
    notes: Sequence[str] = (),
) -> dict[str, Any]:
    """Returns the content of explanation.json; `notes` say which data were dropped or changed."""
    x = explanation
    causes = []
    for c in x.causes:
        units = {} if c.effect is None else {p.name: p.unit for p in c.effect.parameters()}
        values = {} if c.effect is None else c.effect.values()
        causes.append(
            {
                "effect": c.name,
                "parameters": {
                    n: {"value": v, "std": c.std.get(n, 0.0), "unit": units[n]}
                    for n, v in values.items()
                },
                "gain": c.gain,
                "confidence": c.confidence,
            }
        )
    return {
        "schema": "drake_dress.explanation/1",
        "version": __version__,
        "verdict": x.verdict,
        "causes": causes,
        "candidates": [
            {
                "effect": s.name,
                "score": s.screened if s.fitted is None else s.fitted,
                "screened": s.screened,
                "fitted": s.fitted,
                "parameters": {} if s.effect is None else s.effect.values(),
            }
            for s in x.scores
        ],
        "suggestion": suggestion,
        "residual": {
            name: {"marker_m": pair[0], "force_N": pair[1]}
            for name, pair in (("before", x.before), ("after", x.after), ("noise", x.noise))
        },
        "gain": {"value": x.gain[0], "low": x.gain[1], "high": x.gain[2], "level": 0.9},
        "numerics_m": x.numerics,
        "alone": {
            "horizon_s": list(alone.horizon),
            "within_horizon_m": dict(zip(("before", "after"), alone.strayed, strict=True)),
            "whole_m": dict(zip(("before", "after"), alone.whole, strict=True)),
            "noise_m": alone.noise,
        },
        "loss": x.loss,
        "where": [vars(s) for s in worst(spots)],
        "notes": list(notes),
    }


def extended_yaml(scenario: Scenario, experiment: Experiment, explanation: Explanation) -> str:
    """Returns the scenario extended by the causes found, as YAML for `drake-dress run`."""
    content = read_yaml("scenario", resolved_yaml(scenario))
    found: dict[str, Any] = {}
    for effect in effects(scenario.effects):
        found[effect.NAME] = effect.values()
    for c in explanation.causes:
        if c.effect is None:
            continue
        found[c.name] = {
            key: value
            for n, v in c.effect.values().items()
            for key, value in ((n, v), (f"{n}_std", c.std.get(n, 0.0)))
        }
    content["effects"] = found
    if any(c.name == DISCRETISATION for c in explanation.causes):
        n = experiment.numerics["refined"]
        content["plant"].update(
            spacing=n.spacing,
            time_step=n.time_step,
            iterations=n.iterations,
            tolerance=n.tolerance,
        )
    # absent groups are left out, because the loader refuses empty ones
    text = write_yaml(_without_none(content))
    head = "# The scenario with what `drake-dress explain` found; *_std are standard deviations.\n"
    return head + _how_to_load(found) + text


def _how_to_load(names: Collection[str]) -> str:
    """Returns a YAML comment on which effects are not the package's, and where they are defined."""
    own = [f"{name} of {EFFECTS[name].__module__}" for name in names if name in own_effects()]
    if not own:
        return ""
    return (
        f"# Effects that --plugin, or register_effect in Python, loads first: {', '.join(own)}.\n"
    )


def write_json(path: Path, content: dict[str, Any]) -> None:
    """Writes JSON; the file is complete or absent."""
    write_text(path, json.dumps(content, indent=1, allow_nan=False) + "\n")


def _without_none(value: Any) -> Any:
    if isinstance(value, dict):
        return {k: _without_none(v) for k, v in value.items() if v is not None}
    return value
