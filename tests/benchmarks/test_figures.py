"""What the file of a benchmark holds beside its results."""

import json
from pathlib import Path

import pytest

from benchmarks.cloth.comparison import figures_beside_peers
from benchmarks.figures import Figure, at_least, at_most, every, write_figures
from benchmarks.kept import read_results, write_results
from drake_dress import __version__

KEYS = {"figures", "machine", "version", "seeds"}


@pytest.mark.parametrize(
    ("figure", "met"),
    [
        (at_most("force", 3.0, "N", 3.0), True),
        (at_most("force", 3.1, "N", 3.0), False),
        (at_least("rate", 1.0, "", 1.0), True),
        (at_least("rate", 0.9, "", 1.0), False),
        (every("cases", 4, 4), True),
        (every("cases", 3, 4), False),
        (Figure("time", 1.0, "s"), None),
    ],
)
def test_a_figure_is_met_where_it_keeps_what_is_asked(figure: Figure, met: bool | None) -> None:
    assert figure.met is met


def test_a_file_holds_figures_machine_version_and_seeds_beside_its_results(tmp_path: Path) -> None:
    path = tmp_path / "bench.json"
    write_figures(path, [at_most("force", float("nan"), "N", 3.0)], [1, 2], table=[1.0])
    found = json.loads(path.read_text())
    assert set(found) == KEYS | {"table"}
    asked = {"name": "force", "value": None, "unit": "N", "asked": 3.0, "met": False}
    assert found["figures"] == [asked]
    assert (found["version"], found["seeds"]) == (__version__, [1, 2])
    assert found["machine"]["cores"] >= 1


def test_results_are_read_again_from_new_files_and_old_ones(tmp_path: Path) -> None:
    runs = {f"run-{k}": {"case": {"seed": k}, "summary": {"s": 0.5 * k}} for k in (3, 1)}
    new, old = tmp_path / "new.json", tmp_path / "old.json"
    write_results(new, runs, [every("dressed", 1, 2)])
    old.write_text(json.dumps(list(runs.values())))
    found = json.loads(new.read_text())
    assert set(found) == KEYS | {"runs"}
    assert found["seeds"] == [1, 3]
    for path in (new, old):
        assert read_results(path, lambda case: f"run-{case['seed']}", "made up") == runs


def test_a_scheme_is_compared_with_mujoco_where_cloth_touches() -> None:
    def run(engine: str, hanging: float, touching: float | None) -> dict[str, object]:
        contact = {} if touching is None else {"contact_most": 9, "step_in_contact_s": touching}
        return {"engine": engine, "step_median_s": hanging, **contact}

    def scene(name: str, *runs: dict[str, object]) -> dict[str, object]:
        return {"scene": name, "height_at_s": 1.0, "runs": list(runs)}

    laid = scene("laid", run("implicit", 1.0, 4.0), run("MuJoCo 3 flex", 20.0, 80.0))
    hung = scene("hung", run("implicit", 1.0, None), run("MuJoCo 3 flex", 5.0, None))
    alone = scene("alone", run("implicit", 1.0, None))
    found = figures_beside_peers({"placement": {"peers": laid}, "other": [], "x": hung, "y": alone})
    assert [(f.name.split(":")[0], f.value, f.met) for f in found] == [
        ("laid", 0.05, True),
        ("hung", 0.2, False),
    ]
