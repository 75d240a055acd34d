"""What a user sees of `drake-dress explain` beside its verdict."""

import os
import signal
import subprocess
import sys
import time
from types import SimpleNamespace

import pytest

from drake_dress.discrepancy.explanation import Cause
from drake_dress.discrepancy.motions import MOTIONS
from drake_dress.discrepancy.suggestion import suggest
from drake_dress.discrepancy.writing import write_recordings
from drake_dress.models.effects.registry import EFFECTS
from tests.discrepancy.data import QUICK, SCENARIO, quick_scenario, recordings


def cause(name, **values):
    return Cause(name, EFFECTS[name](**values), {}, 0.1, 0.5)


def test_a_motion_is_suggested_that_tells_two_candidates_apart():
    # without contact both do nothing
    pair = [cause("friction", added=0.3), cause("adhesion", strength=100.0)]
    told = suggest(
        SimpleNamespace(verdict="ambiguous", causes=pair), quick_scenario(), SCENARIO.parent
    )
    chosen = [m for m in MOTIONS if f"(motion {m})" in told]
    assert chosen and chosen[0] in ("drag", "shift", "dress")
    assert "friction" in told and "clings" in told


@pytest.mark.parametrize("verdict", ["nothing", "named"])
def test_nothing_is_suggested_where_nothing_is_open(verdict):
    found = SimpleNamespace(verdict=verdict, causes=[cause("friction", added=0.3)])
    assert suggest(found, quick_scenario(), SCENARIO.parent) is None


def test_where_the_list_lacks_the_cause_more_recordings_are_asked_for():
    found = SimpleNamespace(verdict="unexplained", causes=[])
    assert "Record each of" in suggest(found, quick_scenario(), SCENARIO.parent)


def test_ctrl_c_ends_at_once_and_leaves_nothing_half_written(tmp_path):
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
    for line in process.stderr:
        if "screening" in line:
            break
    time.sleep(0.5)
    os.killpg(process.pid, signal.SIGINT)
    _, errors = process.communicate(timeout=60)
    assert process.returncode == 130
    assert "Traceback" not in errors
    assert not out.exists()
