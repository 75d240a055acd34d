import sys
from pathlib import Path

import numpy as np
import pytest

from tests.drawing import drawn_seed

sys.path.insert(0, str(Path(__file__).parents[2] / "benchmarks"))
import safety


def test_no_failure_of_controller_or_sensors_gets_past_the_limits() -> None:
    seed = drawn_seed()
    print(f"python benchmarks/safety.py --commands 10000 --seed {seed}")
    found = safety.run(10000, seed)
    assert sum(w.commands for w in found) >= 10000
    assert {w.failure: w.broken() for w in found if w.broken()} == {}
    # there was something to hold: full speed, braking, and forces at the limit
    assert max(w.speed for w in found) > 0.8 * safety.LIMITS.max_speed
    assert max(w.acceleration for w in found) > 0.99 * safety.LIMITS.max_braking
    assert sum(np.isfinite(w.pull) for w in found) > 8
    assert max(w.force for w in found if w.force_bound is not None) > safety.LIMITS.hard_force


def test_broken_limits_are_told() -> None:
    limits, bound, over = safety.LIMITS, 30.0, 1.001
    worst = safety.Worst(
        "x",
        1,
        over * limits.max_speed,
        over * limits.max_braking,
        1e-3,
        over * limits.max_lead,
        over * bound,
        bound,
    )
    assert worst.broken() == ["speed", "acceleration", "pull", "lead", "force"]


def test_table_and_status_tell_what_was_measured(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "argv", ["safety.py", "--commands", "100", "--seed", "7"])
    assert safety.main() == 0
    out = capsys.readouterr().out
    assert out.startswith("seed 7\n")
    assert len(out.splitlines()) == 4 + len(safety.REQUESTS) + len(safety.SENSORS) + 1
