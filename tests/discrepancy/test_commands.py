"""What a user sees of `drake-dress explain` beside its verdict."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest

from drake_dress.discrepancy.explanation import Cause, Explanation, Score
from drake_dress.discrepancy.measured_log import write_recordings
from drake_dress.discrepancy.motions import MOTIONS
from drake_dress.discrepancy.sentences import headline
from drake_dress.discrepancy.suggestion import suggest
from drake_dress.models.effects.air import Wind
from drake_dress.models.effects.contact import Adhesion, Friction
from drake_dress.models.effects.registry import EFFECTS
from tests.discrepancy.data import QUICK, SCENARIO, quick_scenario, recordings
from tests.present import present


def cause(name: str, confidence: float = 0.95, **values: float) -> Cause:
    return Cause(name, EFFECTS[name](**values), {}, 0.1, confidence)


def found(verdict: str, *causes: Cause, scores: Sequence[Score] = ()) -> Explanation:
    none = (0.0, 0.0)
    # no sentence looks at the simulations
    untold: Any = None
    return Explanation(
        verdict,
        list(causes),
        list(scores),
        {},
        (0.0, 0.0, 0.0),
        none,
        none,
        none,
        0.0,
        untold,
        untold,
    )


def suggested(explanation: Explanation) -> str:
    return present(suggest(explanation, quick_scenario(), SCENARIO.parent))


FRICTION = {"added": 0.3}


def test_a_motion_is_suggested_that_tells_two_candidates_apart() -> None:
    # without contact both do nothing
    pair = cause("friction", **FRICTION), cause("adhesion", strength=100.0)
    told = suggested(found("ambiguous", *pair))
    chosen = [m for m in MOTIONS if f"(motion {m})" in told]
    assert chosen
    assert chosen[0] in ("drag", "shift", "dress")
    assert "friction" in told
    assert "clings" in told


def test_a_cause_that_is_doubted_is_told_as_likely_and_held_against_the_next_best() -> None:
    scores = [
        Score("friction", 0.2, 0.3, Friction(**FRICTION)),
        Score("wind", 0.01, None, Wind(x=1.0)),
        Score("adhesion", 0.1, -0.5, Adhesion(strength=100.0)),
    ]
    doubted = found("named", cause("friction", 0.61, **FRICTION), scores=scores)
    assert "likely" in headline(doubted)
    assert "61 %" in headline(doubted)
    told = suggested(doubted)
    assert "friction" in told
    assert "clings" in told


def test_of_several_causes_the_doubted_one_is_told() -> None:
    pair = cause("wind", 0.97, x=1.0), cause("friction", 0.5, **FRICTION)
    assert "confidence 50 % in the friction" in headline(found("named", *pair))


@pytest.mark.parametrize("verdict", ["nothing", "named"])
def test_nothing_is_suggested_where_nothing_is_open(verdict: str) -> None:
    causes = [] if verdict == "nothing" else [cause("friction", **FRICTION)]
    sure = found(verdict, *causes)
    assert suggest(sure, quick_scenario(), SCENARIO.parent) is None
    assert "likely" not in headline(sure)


def test_where_the_list_lacks_the_cause_more_recordings_are_asked_for() -> None:
    assert "Record each of" in suggested(found("unexplained"))


def test_ctrl_c_ends_at_once_and_leaves_nothing_half_written(tmp_path: Path) -> None:
    log, out = tmp_path / "measured.h5", tmp_path / "out"
    write_recordings(log, recordings(("sway", "lift"), duration=4.0), "scenario: text")
    words = [sys.executable, "-m", "drake_dress", "explain", str(log), "--out", str(out)]
    words += ["--scenario", str(SCENARIO), *(w for value in QUICK for w in ("--set", value))]
    # a terminal sends the signal to all processes of the group
    process = subprocess.Popen(
        words,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
        # tests that run in the background inherit that the signal is passed over
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )
    for line in present(process.stderr):
        if "screening" in line:
            break
    time.sleep(0.5)
    os.killpg(process.pid, signal.SIGINT)
    _, errors = process.communicate(timeout=60)
    assert process.returncode == 130
    assert "Traceback" not in errors
    assert not out.exists()
