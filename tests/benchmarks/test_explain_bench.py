"""The study of `drake-dress explain`: its cases and its tables, from results made up here."""

import dataclasses
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest

from benchmarks.explain.__main__ import main, name_of
from benchmarks.explain.cases import study
from benchmarks.explain.tables import (
    parameter_error,
    reliability,
    right,
    right_but_for_numerics,
    tables,
)
from benchmarks.kept import read_results, write_results
from drake_dress.discrepancy.hidden_effect import SIZES
from drake_dress.errors import UserError
from tests.models.effects.own import registered


def result(
    group: str = "effect",
    hide: str = "friction",
    named: Sequence[str] = ("friction",),
    verdict: str = "named",
    **changes: Any,
) -> dict[str, Any]:
    hidden = {} if hide == "nothing" else {n: {"added": 0.2} for n in hide.split("+")}
    confidence = changes.pop("confidence", 0.95)
    case = {"group": group, "hide": hide, "seed": 1, "size": 1.0, "marker_noise": 1e-3}
    case.update({k: changes.pop(k) for k in ("seed", "size", "marker_noise") if k in changes})
    return {
        "case": case,
        "hidden": hidden,
        "verdict": verdict,
        "causes": [
            {"effect": n, "values": {"added": 0.21}, "confidence": confidence} for n in named
        ],
        "gain": [0.9, 0.8, 1.0],
        "loss": {"refined": 1.5},
        "seconds": 100.0,
        "workers": 2,
        **changes,
    }


def test_a_study_has_all_groups_at_its_centre_and_effects_beside_it() -> None:
    draws = {"effect": 2, "nothing": 3, "pair": 1, "coarse": 1, "outside": 1}
    found = study(list(draws), draws, 7, [1.0, 2.0], [1e-3, 3e-3], 1)
    assert len({c.name for c in found}) == len(found)
    assert sum(c.hide == "nothing" and c.group == "nothing" for c in found) == 3
    beside = [c for c in found if (c.size, c.marker_noise) != (1.0, 1e-3)]
    assert len(beside) == 2 * len(SIZES)
    assert {(c.size, c.marker_noise) for c in beside} == {(2.0, 1e-3), (1.0, 3e-3)}
    assert [c.hide for c in beside[0::2]] == [c.hide for c in beside[1::2]]  # as far as it got
    assert all(c.force_noise == pytest.approx(50.0 * c.marker_noise) for c in found)


def test_a_study_hides_registered_effects_too() -> None:
    with registered():
        found = study(["effect"], {"effect": 1}, 7, [1.0], [1e-3], 1)
    assert [c.hide for c in found] == [*SIZES, "hem_chain"]


def test_only_the_whole_truth_and_nothing_else_is_right() -> None:
    assert right(result())
    assert not right(result(named=("friction", "wind")))
    assert not right(result(named=("adhesion",)))
    assert not right(result(verdict="ambiguous", named=("friction", "adhesion")))
    assert right(result(group="pair", hide="friction+wind", named=("wind", "friction")))
    assert not right(result(group="pair", hide="friction+wind"))
    assert right(result(group="nothing", hide="nothing", named=(), verdict="nothing"))
    assert right(result(group="coarse", hide="nothing", named=("discretisation",)))


def test_numerics_that_are_named_too_are_counted_apart() -> None:
    both = result(named=("discretisation", "friction"))
    assert right_but_for_numerics(both)
    assert not right(both)
    assert not right_but_for_numerics(result())
    assert not right_but_for_numerics(result(named=("discretisation",)))
    assert not right_but_for_numerics(result(named=("discretisation", "adhesion")))
    assert not right_but_for_numerics(result(group="coarse", hide="nothing"))


def test_what_no_list_has_is_right_where_it_is_not_believed() -> None:
    kin: dict[str, Any] = {"group": "outside", "hide": "snag", "named": ("local_mass",)}
    assert right(result(**kin, verdict="unexplained", confidence=1.0))
    assert right(result(**kin, confidence=0.5))
    assert not right(result(**kin, confidence=0.9))
    assert not right(result(group="outside", hide="snag", named=(), verdict="nothing"))


def test_a_kin_of_what_no_list_has_has_no_parameters_to_compare() -> None:
    cuff = result(
        group="outside", hide="magnetised_cuff", named=("local_mass",), verdict="unexplained"
    )
    cuff["hidden"] = {"magnetised_cuff": {"strength": 1.0}}
    assert right(cuff)
    assert parameter_error(cuff) is None
    assert tables([cuff])


def test_tables_tell_centre_and_what_is_beside_it_apart() -> None:
    found = [
        result(),
        result(seed=2, named=("adhesion",)),
        result(marker_noise=3e-3, named=()),
    ]
    by_title = {t.title: t for t in tables(found)}
    assert by_title["Each effect"].rows[0][:3] == ["friction", 2, 1]
    assert by_title["All"].rows[0][:3] == ["effect", 2, 50.0]
    # the second draw was not made at the other noise
    beside = by_title["By noise and size, the same draws at each"].rows
    assert [row[:4] for row in beside] == [["1", 1.0, 1, 1], ["3", 1.0, 1, 0]]
    assert parameter_error(found[0]) == pytest.approx(0.05)
    assert tables([]) == []


def test_reliability_counts_causes_by_their_confidence() -> None:
    found = [result(), result(named=("adhesion",)), result(confidence=0.2)]
    by_range = {(low, high): hits for low, high, hits in reliability(found)}
    assert by_range[0.95, 1.0] == [True, False]
    assert by_range[0.0, 0.5] == [True]


def test_what_a_file_of_results_holds_is_not_run_again(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "results.json"
    cases = study(["nothing"], {"nothing": 2}, 5, [1.0], [1e-3], 1)
    made_up = [result(group="nothing", hide="nothing", named=(), verdict="nothing") for _ in cases]
    for one, case in zip(made_up, cases, strict=True):
        one["case"] = dataclasses.asdict(case)
    write_results(path, {name_of(one["case"]): one for one in made_up})
    assert list(read_results(path, name_of, "explain")) == [case.name for case in cases]
    words = ["--only", "nothing", "--draws", "2", "--seed", "5", "--json", str(path)]
    assert main([*words, "--cache", str(tmp_path)]) == 0
    said = capsys.readouterr().out
    assert "2 cases, 0 of them not run yet" in said
    assert "nothing" in said
    assert "100" in said
    assert main([*words, "--only", "nothing,coarse", "--kept"]) == 0
    assert "2 cases, 0 of them not run yet" in capsys.readouterr().out


@pytest.mark.parametrize("content", ["{", "[1]", '[{"case": {"group": "effect"}}]', "[{}]"])
def test_a_file_of_something_else_is_refused(content: str, tmp_path: Path) -> None:
    path = tmp_path / "results.json"
    path.write_text(content)
    with pytest.raises(UserError, match="expected results"):
        read_results(path, name_of, "explain")
    assert path.read_text() == content


@pytest.mark.parametrize("words", [["--noise", "x"], ["--size", "0"], ["--only", "all"]])
def test_bad_options_are_refused(words: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as exit_:
        main(words)
    assert exit_.value.code == 2
    assert len(capsys.readouterr().err.strip().splitlines()) == 1
