"""Drawn coats on drawn bodies: which pairs there are, which are run, what is made of results."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchmarks.fit import __main__ as bench
from benchmarks.fit.drawing import (
    SIZES,
    STEPS,
    Case,
    body_of,
    coat_of,
    pairs,
    run,
    scenario_of,
    size_for,
)
from benchmarks.fit.looks import (
    CALLED,
    FITTING,
    TOO_TIGHT,
    all_looks,
    chosen,
    look_at,
    looks_file,
)
from benchmarks.fit.tables import figures, tables, told
from drake_dress.diagrams.scenario import load_scenario
from drake_dress.diagrams.scenario.coat import COAT_MEASURES, coat_parameters
from drake_dress.diagrams.scenario.schema import Coat, Variation
from drake_dress.errors import UserError

CASES = pairs(range(6), range(5), "standing")


def look(called: str, armhole: float = 1.8, size: str = "L") -> dict[str, Any]:
    return {
        "preset": "blazer",
        "size_table": "men",
        "size": size,
        "own_size": "M",
        **{"sex": "male", "age": 40.2, "height": 1.78, "weight": 80.0},
        "called": called,
        "tightest": "armhole_girth",
        "ratios": {"cuff_girth": 1.2, "armhole_girth": armhole, "back_width": 0.95},
    }


def result(case: Case, reason: str | None = None, stays: bool | None = True) -> dict[str, Any]:
    summary = {
        "success": reason is None,
        "reason": reason,
        "stays_on": stays,
        "dressing_time_s": 30.0 if stays is not None else None,
    }
    return {"case": asdict(case), "status": int(reason is not None), "summary": summary}


LOOKS = {
    case.name: look(
        FITTING[k % 2] if k % 3 else TOO_TIGHT, 1.8 if k % 3 else 1.55, SIZES[k % len(SIZES)]
    )
    for k, case in enumerate(CASES)
}


def test_every_cut_meets_every_body_once() -> None:
    assert len({case.name for case in CASES}) == len({case.seed for case in CASES}) == 30
    assert {(case.cut, case.body) for case in CASES} == {(c, b) for c in range(6) for b in range(5)}
    # more cuts or bodies change no pair
    assert set(CASES) <= set(pairs(range(7), range(9), "standing"))
    assert all(case.seed >= 1000 for case in CASES)
    others = pairs(range(6), range(5), "standing", "none")
    assert [case.seed for case in others] == [case.seed for case in CASES]
    assert not {case.name for case in others} & {case.name for case in CASES}


def test_a_cut_stays_the_same_on_all_bodies_but_for_its_size() -> None:
    coats = [coat_of(Case(4, body, 1000)) for body in range(3)]
    assert len({(coat.preset, coat.size_table) for coat in coats}) == 1
    made = []
    for body, coat in enumerate(coats):
        own = SIZES.index(size_for(body, coat.size_table))
        assert any(SIZES.index(str(coat.size)) == min(max(own + d, 0), 8) for d in STEPS)
        plain = coat_parameters(
            Coat(preset=coat.preset, size=coat.size, size_table=coat.size_table)
        )
        own_lengths, lengths = coat_parameters(coat).lengths, plain.lengths
        made.append({name: own_lengths[name] / lengths[name] for name in lengths})
    for other in made[1:]:
        assert other == pytest.approx(made[0])


def test_a_pair_is_a_scenario_with_its_coat_body_and_variation() -> None:
    case = CASES[7]
    scenario = scenario_of(case, ["duration=5"])
    person = body_of(case.body)
    assert scenario.seed == case.seed
    assert scenario.duration == 5.0
    assert scenario.person.body is not None
    assert scenario.person.body.height == person.height
    assert scenario.garment.coat.preset == coat_of(case).preset
    for name in COAT_MEASURES:
        drawn = getattr(coat_of(case), name)
        assert getattr(scenario.garment.coat, name) == (drawn and pytest.approx(drawn, abs=1e-5))
    assert scenario.variation.plant_friction > 0.0
    assert scenario.variation.coat_measures == scenario.variation.person_scale == 0.0
    sitting = scenario_of(Case(case.cut, case.body, case.seed, "sitting", "none"))
    assert sitting.variation == Variation()
    assert (scenario.person.posture, sitting.person.posture) == ("standing", "sitting")


def test_a_run_has_the_scenario_of_its_pair(monkeypatch: pytest.MonkeyPatch) -> None:
    case, ran = CASES[3], []

    def kept(case: Case, scenario: Path, keep: Any, settings: list[str], seed: int) -> Any:
        ran.append(load_scenario(scenario, settings, seed))
        return {"case": asdict(case), "summary": {"success": True, "bulky": [1] * 1000}}

    monkeypatch.setattr("benchmarks.fit.drawing.run_case", kept)
    found = run(case, None)
    assert ran == [scenario_of(case)]
    assert found["summary"]["success"]
    assert "bulky" not in found["summary"]


@given(
    fitting=st.integers(1, 40), tight=st.integers(1, 40), root=st.integers(0, 2**32), part=st.data()
)
def test_runs_are_drawn_from_both_verdicts(
    fitting: int, tight: int, root: int, part: st.DataObject
) -> None:
    found = chosen(CASES, LOOKS, fitting, tight, root)
    called = [LOOKS[case.name]["called"] for case in found]
    counts = (sum(word in FITTING for word in called), called.count(TOO_TIGHT))
    assert counts == (min(fitting, 20), min(tight, 10))
    assert len(set(found)) == len(found)
    # any first part has its share of both, within one
    first = part.draw(st.integers(1, len(found)))
    share = sum(word in FITTING for word in called[:first])
    assert abs(share - first * counts[0] / len(found)) <= 1.0
    # a larger draw goes on where a smaller one ended
    more = chosen(CASES, LOOKS, fitting + 3, tight + 3, root)
    assert set(found) <= set(more)


def test_looks_are_kept_and_not_repeated(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    seen = []

    def looked(case: Case) -> dict[str, Any]:
        seen.append(case)
        return LOOKS[case.name]

    monkeypatch.setattr("benchmarks.fit.looks.look_at", looked)
    file = looks_file(tmp_path / "fit.json")
    assert file.name == "fit_looks.json"
    first, _ = all_looks(CASES[:4], file)
    every, stop = all_looks(CASES, file)
    assert every == LOOKS
    assert first == {name: LOOKS[name] for name in first}
    assert len(seen) == len(set(seen)) == len(CASES)
    assert not stop.is_set()
    assert told(every) == "Verdicts of 30 pairs: fits 10, tight 10, too tight 10."
    # other limits give other verdicts
    monkeypatch.setattr("benchmarks.fit.looks._LIMITS", [[1.0, 0.0, 0.0]])
    all_looks(CASES, file)
    assert len(seen) == 2 * len(CASES)
    file.write_text("{}", encoding="utf-8")
    with pytest.raises(UserError, match="bench fit"):
        all_looks(CASES, file)


def test_the_look_tells_what_is_drawn_and_what_is_tight() -> None:
    found = look_at(CASES[0])
    assert found["called"] in CALLED
    assert found["size"] == coat_of(CASES[0]).size
    assert found["sex"] == body_of(0).sex
    assert set(found["ratios"]) == {"cuff_girth", "armhole_girth", "back_width"}
    assert found["tightest"] in found["ratios"]


def test_success_is_told_by_verdict_and_group() -> None:
    done = [result(case) for case in CASES]
    fit = next(k for k, case in enumerate(CASES) if LOOKS[case.name]["called"] == FITTING[0])
    done[fit] = result(CASES[fit], "left sleeve slid down after the release: s = 1.2 < 1.5", False)
    title = {t.title: t for t in tables(done, LOOKS)}
    rows = {row[0]: row[1:] for row in title["What the look calls the pairs"].rows}
    # pairs, runs, dressed and staying on, share
    assert rows["fits"][:4] == [10, 10, 9, "90"]
    assert rows["too tight"][:4] == [10, 10, 10, "100"]
    assert rows["fits or tight"][:4] == [20, 20, 19, "95"]
    assert rows["fits or tight"][5:7] == [20, "19 of 20"]
    by_armhole = title["All runs by girth of armhole over that of upper arm"].rows
    assert [row[0] for row in by_armhole] == ["1.46 to 1.60", "1.75 to 1.90"]
    (failed,) = title["Runs that failed"].rows
    assert failed[0] == CASES[fit].name
    assert "slid down" in failed[-1]
    assert all(len(row) == len(t.header) for t in title.values() for row in t.rows)


def test_shares_are_beside_what_is_asked() -> None:
    tight = [case for case in CASES if LOOKS[case.name]["called"] == TOO_TIGHT]
    others = [case for case in CASES if case not in tight]
    done = [*(result(case) for case in others), *(result(c, "off", None) for c in tight[1:])]
    found = {f.name: f for f in figures([*done, result(tight[0])], LOOKS)}
    assert found["fitting: dressed and staying on, of 20"].met
    assert found["fitting: staying on, of 20 that were let go"].value == 100.0
    failed = found["too tight: failed, of 10"]
    assert (failed.value, failed.asked, failed.met) == (90.0, 90.0, True)
    assert figures([], LOOKS) == []


def test_the_command_runs_a_part_and_goes_on(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    ran: list[Case] = []

    def dress(case: Case, keep: Any, settings: Any) -> dict[str, Any]:
        ran.append(case)
        return result(case)

    monkeypatch.setattr("benchmarks.fit.looks.look_at", lambda case: look(FITTING[0]))
    monkeypatch.setattr(bench, "run", dress)
    page = tmp_path / "page.md"
    page.write_text("before\n<!-- bench fit -->\n<!-- end -->\nafter\n", encoding="utf-8")
    command = ["--purpose", "develop", "--root", "3", "--cuts", "3", "--bodies", "2"]
    command += ["--json", str(tmp_path / "fit.json"), "--limit"]
    assert bench.main([*command, "2"]) == 0
    assert len(ran) == 2
    assert bench.main([*command, "5", "--kept"]) == 0
    assert len(ran) == 2
    assert bench.main([*command, "5", "--jobs", "1", "--into", str(page)]) == 0
    assert len(ran) == len(set(ran)) == 5
    text = page.read_text(encoding="utf-8")
    assert "`--purpose develop --root 3`" in text
    assert "5 that fit or are tight, 0 too tight" in text
    assert "5 runs, 3 of them not run yet" in capsys.readouterr().out


def bad(*words: str) -> Callable[[], int]:
    return lambda: bench.main(list(words))


def test_bad_arguments_are_told_in_one_line(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(UserError, match="at most 100 to develop"):
        bad("--purpose", "develop", "--cuts", "101")()
    with pytest.raises(SystemExit) as ended:
        bad("--posture", "lying")()
    assert ended.value.code == 2
    assert "lying" in capsys.readouterr().err
