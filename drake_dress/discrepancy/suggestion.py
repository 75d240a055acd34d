"""Suggests what to record next."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

from drake_dress.diagrams.scenario import Scenario
from drake_dress.discrepancy.experiment import levels
from drake_dress.discrepancy.explanation import Explanation
from drake_dress.discrepancy.generate import stage as stage_of
from drake_dress.discrepancy.generate import unseen
from drake_dress.discrepancy.lab import Numerics, SimulatedLab
from drake_dress.discrepancy.motions import MOTIONS
from drake_dress.discrepancy.recording import Recording
from drake_dress.discrepancy.replay import Replayer
from drake_dress.discrepancy.sentences import plain
from drake_dress.models.effects.effect import Effect

_DURATION, _RATE, _MARKERS = 4.0, 50.0, 40
_WORDS = {
    "sway": "sway the garment to and fro in the open",
    "lift": "heave and twist the garment in the open",
    "drag": "press the garment against the held-out arm and draw it up and down",
    "shift": "press the garment against the held-out arm and draw it along the arm",
    "drop": "let the garment down fast and catch it, in the open",
    "dress": "draw a sleeve over the arm held up sideways, from its cuff",
    "pull": "draw the garment taut between the grippers",
}


def suggest(
    explanation: Explanation,
    scenario: Scenario,
    base: Path,
    stage: Callable[[str], None] = lambda _: None,
) -> str | None:
    """Returns a sentence on which motion to record; None if no question is open.

    For unexplained data, it suggests to record each motion on its own. Otherwise every motion is
    simulated with each of two rivals: the ambiguous causes, or a doubted cause and the next best
    candidate. The motion in which markers and forces differ most, in units of typical noise (1 mm,
    0.05 N), distinguishes them best.

    Args:
        explanation: result of the search.
        scenario: scenario of the lab.
        base: directory that a mesh file's name is relative to.
        stage: called with a description of each stage.
    """
    if explanation.verdict == "unexplained":
        return (
            f"Record each of {', '.join(MOTIONS)} on its own, a few times, to see in "
            "which the residual appears; the list of effects may lack its cause."
        )
    rivals = _rivals(explanation)
    if rivals is None:
        return None
    first, second = rivals
    beside = [e for e in explanation.effects if e not in rivals]
    p = scenario.plant
    numerics = levels(Numerics(p.spacing, p.time_step, p.integrator, p.iterations, p.tolerance))
    lab = SimulatedLab.of(scenario, base, numerics["screening"])
    scores = {}
    for name in MOTIONS:
        stage(f"simulating {name} under both candidates")
        told = []
        for rival in rivals:
            told.append(Replayer(lab, _blank(lab, name)).run([*beside, rival], gain=0.0))
        markers = (told[0].marker_position - told[1].marker_position) / 1e-3
        forces = (told[0].gripper_force - told[1].gripper_force) / 0.05
        scores[name] = float(np.mean(markers**2) + np.mean(forces**2))
    best = max(scores, key=lambda n: scores[n])
    return (
        f"To tell {plain(first.NAME)} from {plain(second.NAME)}, {_WORDS.get(best, best)} "
        f"(motion {best}): there the two differ by "
        f"{np.sqrt(scores[best]):.1f} times typical noise (1 mm, 0.05 N)."
    )


def _rivals(explanation: Explanation) -> tuple[Effect, Effect] | None:
    """Returns two effects that the data do not distinguish; None if no question is open.

    The rival of a cause with low confidence is the best of the other candidates.
    """
    found = explanation.effects
    if explanation.verdict == "ambiguous":
        return found[-2], found[-1]
    doubted = explanation.doubted
    if explanation.verdict != "named" or doubted is None or doubted.effect is None:
        return None
    others = [s for s in explanation.scores if s.effect and s.name not in {e.NAME for e in found}]
    # a fit may have diverged, so the screened gain counts as well
    best = max(others, key=lambda s: max(s.screened, s.fitted or 0.0), default=None)
    return (doubted.effect, best.effect) if best and best.effect else None


def _blank(lab: SimulatedLab, motion: str) -> Recording:
    time = np.arange(round(_DURATION * _RATE) + 1) / _RATE
    path = MOTIONS[motion](stage_of(lab), _DURATION, np.random.default_rng(0))
    nodes = np.linspace(0, len(lab.garment.rest_position) - 1, _MARKERS).astype(np.int32)
    return unseen(lab, motion, path(time), time, nodes)
