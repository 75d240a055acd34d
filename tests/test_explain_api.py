"""The public names of `drake_dress.explain`, and the input that it accepts and refuses."""

from __future__ import annotations

import pickle
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from drake_dress import explain
from drake_dress.diagrams.scenario import load_scenario
from drake_dress.discrepancy.candidates import candidates
from drake_dress.discrepancy.hidden_effect import draw_hidden
from drake_dress.discrepancy.results import extended_yaml
from drake_dress.discrepancy.sentences import plain
from drake_dress.errors import UserError
from tests.discrepancy.data import QUICK, SCENARIO, recordings
from tests.models.effects.own import HemChain, registered


def test_an_effect_of_a_users_own_is_a_candidate_with_its_shape() -> None:
    rest = np.random.default_rng(0).uniform(-0.3, 0.3, (50, 3))
    assert "hem_chain" not in {c.name for c in candidates(rest)}
    with registered():
        (own,) = [c for c in candidates(rest) if c.name == "hem_chain"]
        # a shape parameter is no probe of its own
        assert [p.parameter for p in own.probes] == ["mass"]
        assert own.effect(np.array([1.2])) == HemChain(mass=1.2 * 0.05, height=0.05)
        assert plain("hem_chain") == "a chain in the hem"
        among = candidates(rest, among=["air_drag", "hem_chain"])
        assert [c.name for c in among] == ["air_drag", "hem_chain"]


def test_it_can_be_hidden_by_name_and_at_random() -> None:
    with registered():
        (drawn,) = draw_hidden("hem_chain", np.random.default_rng(0))
        assert isinstance(drawn, HemChain)
        assert 0.05 <= drawn.mass <= 0.1
        names = {
            e.NAME for k in range(200) for e in draw_hidden("random", np.random.default_rng(k))
        }
        assert "hem_chain" in names


def found_by_hand(scenario: Any, effect: explain.Effect) -> str:
    """Returns the extended scenario of an explanation that names an effect."""
    from drake_dress.discrepancy.explanation import Explanation

    none = (0.0, 0.0)
    cause = explain.Cause(effect.NAME, effect, {"mass": 0.01}, 0.5, 0.99)
    told: Any = None
    x = Explanation("named", [cause], [], {}, (0.5, 0.4, 0.6), none, none, none, 0.0, told, told)
    return extended_yaml(scenario, told, x)


def test_the_extended_scenario_has_it_and_says_where_it_is_from(tmp_path: Path) -> None:
    file = tmp_path / "extended.yaml"
    with registered():
        file.write_text(found_by_hand(load_scenario(SCENARIO), HemChain(mass=0.07)))
        assert "hem_chain of tests.models.effects.own" in file.read_text()
        again = load_scenario(file)
        assert again.effects["hem_chain"]["mass"] == 0.07
        assert again.effects["hem_chain"]["mass_std"] == 0.01
    with pytest.raises(UserError) as error:
        load_scenario(file)
    for word in (str(file), "effects.hem_chain: unknown effect", "--plugin FILE.py"):
        assert word in str(error.value)


def test_recordings_come_as_files_arrays_or_made_ones(tmp_path: Path) -> None:
    from drake_dress.discrepancy.measured_log import write_recordings

    (made,) = recordings(("sway",), duration=1.0)
    arrays = explain.Measurement(
        time=made.time,
        gripper_position=made.gripper_position,
        marker_position=made.marker_position,
        marker_rest_position=made.marker_rest_position,
        name="arrays",
    )
    file = tmp_path / "measured.h5"
    write_recordings(file, [made], "scenario: text")
    found = explain.check_recordings([made, arrays, file], SCENARIO, QUICK)
    assert [r.name for r in found] == ["sway", "sway", "arrays"]
    for r in found:
        np.testing.assert_array_equal(r.marker_position, made.marker_position)
    (same,) = explain.check_recordings(arrays, load_scenario(SCENARIO, QUICK))
    assert same.gripper_force is None


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: explain.explain([], "measured"), ["recordings", "are none"]),
        (lambda: explain.explain([3], "measured"), ["recordings: int", "a Measurement"]),  # type: ignore[list-item]
        (lambda: explain.explain("gone.h5", "measured"), ["gone.h5", "no such file"]),
        (lambda: explain.explain("a.h5", "mesured"), ["did you mean measured?"]),
        (
            lambda: explain.explain("a.h5", "measured", effects=["airdrag"]),
            ["effects: airdrag", "unknown effect", "register_effect"],
        ),
        (lambda: explain.explain("a.h5", "measured", effects="wind"), ["a list of names"]),
        (lambda: explain.explain("a.h5", "measured", effects=[]), ["effects", "are none"]),
        (lambda: explain.simulate("measured", "hem"), ["hem", "no effect that can be hidden"]),
        (lambda: explain.simulate("measured", seed=-1), ["seed", "0 or more"]),
        (
            lambda: explain.simulate("measured", session=explain.Session(["fly"])),
            ["session: fly", "sway"],
        ),
        (
            lambda: explain.check_recordings("a.h5", load_scenario(SCENARIO), ["seed=1"]),
            ["overrides", "expected a file"],
        ),
    ],
)
def test_what_cannot_be_used_is_told(call: Any, words: list[str]) -> None:
    with pytest.raises(UserError) as error:
        call()
    for word in words:
        assert word in str(error.value)


NOTEBOOK = """
from dataclasses import dataclass
from drake_dress import explain
from drake_dress.discrepancy.workers import Workers

@explain.register_effect
@dataclass(frozen=True)
class Moon(explain.GravityEffect):
    NAME = "moon"
    share: float = explain.parameter("1", 0.0, 1.0, 0.5)

    def apply(self, gravity):
        return (1.0 - self.share) * gravity

    def derivative(self, name, gravity):
        return -gravity

def told(common, effect):
    return common.apply(effect.share), [p.name for p in effect.parameters()], effect.is_off

workers = Workers(Moon(share=0.25), 1)
print(*workers.map(told, [(Moon(share=0.5),)]))
workers.end()
"""


def test_processes_work_with_an_effect_of_a_notebook(tmp_path: Path) -> None:
    """In a notebook, the class is in `__main__`, which has no file to import again."""
    done = subprocess.run(
        [sys.executable, "-c", NOTEBOOK], cwd=tmp_path, capture_output=True, text=True, timeout=120
    )
    assert done.stdout == "(0.375, ['share'], False)\n", done.stderr


def test_an_effect_can_be_pickled_as_other_processes_need() -> None:
    effect = HemChain(mass=0.1)
    assert pickle.loads(pickle.dumps(effect)) == effect
