"""Help, options and error messages of the command line."""

import errno
from pathlib import Path

import pytest

from drake_dress.__main__ import BENCHMARKS, main
from drake_dress.diagrams import run
from drake_dress.diagrams.scenario import load_scenario
from drake_dress.shipped import shipped_scenario

BENCHES = Path(__file__).resolve().parents[1] / "benchmarks"


def test_help_names_every_benchmark_that_there_is(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["bench", "--help"]) == 0
    told = capsys.readouterr().out
    there = {path.parent.name for path in BENCHES.glob("*/__main__.py")}
    assert there == set(BENCHMARKS)
    for name in there:
        assert f"  {name} " in told


def test_a_full_disk_is_told_in_one_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def full(*_: object, **__: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device", "place/run.h5")

    monkeypatch.setattr(run, "run_scenario", full)
    assert main(["run", "scenarios/dummy_standing.yaml", "--out", str(tmp_path)]) == 1
    assert capsys.readouterr().err == "drake-dress: place/run.h5: No space left on device\n"


OUTPUTS = [
    ["run", "scenarios/dummy_standing.yaml", "--out"],
    ["garment", "dummy_standing", "--out"],
    ["sim-station", "scenarios/lab.yaml", "--out"],
    ["explain", "none.h5", "--scenario", "scenarios/measured.yaml", "--out"],
    ["dataset", "measured", "--hide", "wind", "--out"],
    ["dataset", "motion", "--out"],
    ["calibrate", ".", "--out"],
    ["calibrate", "--print-board"],
    *([["bench", name, "--json"] for name in BENCHMARKS]),
    ["bench", "dressing", "--keep"],
    ["bench", "explain", "--cache"],
]


@pytest.mark.parametrize("words", OUTPUTS, ids=" ".join)
@pytest.mark.parametrize("place", ["file/sub", "long", "/proc/x/y", ""])
def test_an_output_that_cannot_be_is_told_before_any_work(
    words: list[str], place: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "file").touch()
    out = {"file/sub": str(tmp_path / "file" / "sub"), "long": str(tmp_path / ("a" * 300))}
    try:
        status = main([*words, out.get(place, place)])
    except SystemExit as error:
        status = int(error.code or 0)
    captured = capsys.readouterr()
    assert status == 2
    assert captured.out == ""
    assert words[-1] in captured.err
    assert captured.err.count("\n") == 1, captured.err
    assert [p.name for p in tmp_path.iterdir()] == ["file"]


@pytest.mark.parametrize("words", [["dataset", "measured", "--hide", "nothing", "--out", "new"]])
def test_the_programs_own_scenarios_are_found_from_anywhere(
    words: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    found: list[str] = []

    def look(hide: str, seed: int, out: Path, scenario: str, *_: object) -> None:
        found.append(scenario)

    monkeypatch.setattr("drake_dress.discrepancy.commands.write_dataset", look)
    assert main(words) == 0
    assert load_scenario(found[0]) == load_scenario(BENCHES.parent / "scenarios" / "measured.yaml")
    assert load_scenario(shipped_scenario("lab")).station.arms.model == "panda"


def test_an_error_of_the_file_system_is_one_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    for error in (OSError(errno.EROFS, "Read-only file system", "place"), OSError("odd\nerror")):

        def broken(*_: object, error: OSError = error, **__: object) -> None:
            raise error

        monkeypatch.setattr(run, "run_scenario", broken)
        assert main(["run", "scenarios/dummy_standing.yaml", "--out", str(tmp_path)]) == 1
        assert capsys.readouterr().err.count("\n") == 1


OPTIONS = [
    *(["run", "s.yaml", "--realtime-rate", bad] for bad in ("nan", "-1", "1e-9", "1e300", "x")),
    *(["dataset", "measured", "--hide", bad] for bad in ("", "wind+wind", "nothing+wind", "wnd")),
    *(["dataset", "measured", "--hide", "wind", "--size", bad] for bad in ("0", "1e5", "nan")),
    ["dataset", "measured", "--hide", "air_drag", "--size", "900"],
    *(
        ["dataset", "measured", "--hide", "wind", "--motions", m]
        for m in ("", "sway,", "lift,lift")
    ),
    *(["dataset", "measured", "--hide", "wind", "--marker-noise", bad] for bad in ("2", "-1e-3")),
    ["dataset", "measured", "--hide", "wind", "--force-noise", "1e300"],
    *(["dataset", "motion", "--seed", bad] for bad in ("-1", "0.5")),
    *(["dataset", "motion", "--passive", bad] for bad in ("-1", "x", "1e9")),
    *(["dataset", "motion", "--jobs", bad] for bad in ("0", "two")),
    ["dataset", "motion", "--passive", "0", "--active", "0", "--free", "0"],
    ["dataset", "motion", "--ray", "nowhere"],
    *(
        ["calibrate", ".", "--board", f"7x5:0.03:0.022:{dictionary}"]
        for dictionary in ("", "ArucoDetector", "DICT_0X0_1", "_native", "DICT_")
    ),
    # more squares than the dictionary has markers
    *(
        ["calibrate", ".", "--board", f"{size}:0.03:0.022:DICT_4X4_50"]
        for size in ("11x10", "9e9x3")
    ),
    *(["bench", "hardware", "--seeds", bad] for bad in ("5-2", "-1-2", "a", "1-b", "")),
    *(["bench", "dressing", "--seeds", bad] for bad in ("5-2", "x")),
    *(["bench", "hardware", option, "nan"] for option in ("--rate", "--fault-rate", "--minutes")),
    *(["bench", "hardware", "--rate", bad] for bad in ("0", "-1", "inf")),
    *(["bench", name, "--seed", "-1"] for name in ("explain", "inputs", "killed", "mutation")),
    *(["bench", "local", option, "x"] for option in ("--seed", "--problems")),
    *(["calibrate", ".", "--board", f"7x5:{sizes}:DICT_4X4_50"] for sizes in ("nan:0.02", "0:0")),
]


@pytest.mark.parametrize("words", OPTIONS, ids=" ".join)
def test_an_option_that_cannot_be_is_told_before_any_work(
    words: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = [] if words[0] in ("calibrate", "bench") else ["--out", str(tmp_path / "out")]
    try:
        status = main([*words, *out])
    except SystemExit as error:
        status = int(error.code or 0)
    captured = capsys.readouterr()
    assert status == 2
    assert captured.out == ""
    assert words[-2] in captured.err
    assert captured.err.count("\n") == 1, captured.err
    assert not list((tmp_path / "out").glob("*"))
