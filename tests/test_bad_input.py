"""Unusable input is reported in one line, with status 2, and leaves no files behind."""

import os
from pathlib import Path

import pytest

from drake_dress.__main__ import main
from drake_dress.diagrams.scenario import load_scenario

# scenario text, then words that the line must contain
BAD_YAML = {
    "unknown key": ("sede: 3", ["sede", "seed"]),
    "unknown nested key": ("plant: {materiel: {}}", ["plant.materiel", "material"]),
    "unknown deep key": (
        "controller: {global_mpc: {weights: {positon: 1}}}",
        ["controller.global_mpc.weights.positon", "position"],
    ),
    "text for a number": ("duration: long", ["duration", "number"]),
    "list for a number": ("plant: {spacing: [1, 2]}", ["plant.spacing", "number"]),
    "fraction for a whole number": ("seed: 1.5", ["seed", "whole number"]),
    "bool for a number": ("duration: true", ["duration", "number"]),
    "value for a group": ("plant: 3", ["plant", "keys"]),
    "empty group": ("plant:", ["plant", "keys"]),
    "number for text": ("person: {posture: 3}", ["person.posture", "standing"]),
    "hardware without arms": (
        "station: {kind: hardware}",
        ["station.arms.model", "floating", "expected panda"],
    ),
    "no bus": (
        "station: {hardware: {lcm_url: nonsense}}",
        ["station.hardware.lcm_url", "nonsense", "udpm://"],
    ),
    "camera without a name": (
        "station: {cameras: [{position: [1, 0, 1], target: [0, 0, 1]}]}",
        ["station.cameras[0].name", "front"],
    ),
    "camera that looks down": (
        "station: {cameras: [{name: a, position: [0, 0, 2], target: [0, 0, 1]}]}",
        ["station.cameras[0].target", "straight above or below"],
    ),
    "camera at no place": (
        "station: {cameras: [{name: a, position: [0, 0], target: [0, 0, 1]}]}",
        ["station.cameras[0].position", "x, y, z"],
    ),
    "fault of an unknown kind": (
        "lab: {faults: [{kind: earthquake}]}",
        ["lab.faults[0].kind", "earthquake", "bus_lost"],
    ),
    "fault of another source": (
        "lab: {faults: [{kind: person_mm, source: garment}]}",
        ["lab.faults[0].source", "garment", "expected person with kind person_mm"],
    ),
    "bound of a belief": (
        "station: {hardware: {beliefs: {point_error: 0.5}}}",
        ["station.hardware.beliefs.point_error", "0.001 to 0.1"],
    ),
    "fault of an unknown source": (
        "lab: {faults: [{source: camera_front}]}",
        ["lab.faults[0].source", "camera_front", "left_arm"],
    ),
    "fault before the run": (
        "lab: {faults: [{start: -1}]}",
        ["lab.faults[0].start", "0 to"],
    ),
    "chair of one who stands": ("person: {chair: {}}", ["person.chair", "posture: sitting"]),
    "arm in the chair": (
        "person: {posture: sitting, chair: {}}",
        ["person.left_arm", "inside the wheelchair", "abduction_deg"],
    ),
    "narrow chair": (
        "person: {posture: sitting, chair: {seat_width: 0.2}}",
        ["person.chair.seat_width", "width of the hips"],
    ),
    "unknown armrests": (
        "person: {posture: sitting, chair: {armrests: up}}",
        ["person.chair.armrests", "both or left or right or none"],
    ),
    "unknown posture": ("person: {posture: lying}", ["person.posture", "standing or sitting"]),
    "unknown person": (
        "person: {behaviour: {kind: robot}}",
        ["person.behaviour.kind", "dummy or passive or active"],
    ),
    "unknown motion": (
        "person: {behaviour: {kind: active, motions: [{turm: {}}]}}",
        ["person.behaviour.motions[0].turm", "turn"],
    ),
    "unknown side": (
        "person: {behaviour: {kind: active, motions: [{turn: {}}, {wave: {side: up}}]}}",
        ["person.behaviour.motions[1].wave.side", "left or right or both"],
    ),
    "two motions in one": (
        "person: {behaviour: {kind: active, motions: [{turn: {}, wave: {}}]}}",
        ["person.behaviour.motions[0]", "turn and wave", "just one"],
    ),
    "no motion": (
        "person: {behaviour: {kind: active, motions: [{}]}}",
        ["person.behaviour.motions[0]", "nothing", "just one"],
    ),
    "motions that are no list": (
        "person: {behaviour: {kind: active, motions: {turn: {}}}}",
        ["person.behaviour.motions", "a list"],
    ),
    "motions of a dummy": (
        "person: {behaviour: {motions: [{turn: {}}]}}",
        ["person.behaviour.motions", "dummy", "kind: active"],
    ),
    "two reaches of one hand": (
        "person: {behaviour: {kind: active, motions: [{reach: {}}, {reach: {side: left}}]}}",
        ["person.behaviour.motions[1].reach.side", "left", "one reach"],
    ),
    "turn too far": (
        "person: {behaviour: {kind: active, motions: [{turn: {angle_deg: 200}}]}}",
        ["person.behaviour.motions[0].turn.angle_deg", "-90 to 90"],
    ),
    "turn too fast": (
        "person: {behaviour: {kind: active, motions: [{turn: {angle_deg: 90, duration: 1}}]}}",
        ["person.behaviour.motions[0].turn.duration", "rad/s"],
    ),
    "wave too fast": (
        "person: {behaviour: {kind: active, motions: [{wave: {amplitude: 0.2, frequency: 2}}]}}",
        ["person.behaviour.motions[0].wave", "max_hand_speed"],
    ),
    "tremor out of range": (
        "person: {behaviour: {tremor: {frequency: 50}}}",
        ["person.behaviour.tremor.frequency", "1 to 15"],
    ),
    "unknown predictor": (
        "controller: {predictor: oracle}",
        ["controller.predictor", "still or constant_velocity or ridge or recurrent or learned"],
    ),
    "unknown preset": ("garment: {coat: {preset: cape}}", ["garment.coat.preset", "jacket"]),
    "unknown station": ("station: {kind: moon}", ["station.kind", "simulated"]),
    "too long": ("duration: 1e9", ["duration", "86400"]),
    "no time": ("duration: 0", ["duration", "0.1"]),
    "negative seed": ("seed: -1", ["seed", "0"]),
    "not a number": ("plant: {time_step: .nan}", ["plant.time_step", "finite"]),
    "infinite": ("person: {measures: {chest_width: .inf}}", ["chest_width", "finite"]),
    "negative friction": ("plant: {material: {friction: -0.1}}", ["plant.material.friction"]),
    "too fine": ("plant: {spacing: 0.001}", ["plant.spacing", "0.01"]),
    "too coarse": ("controller: {spacing: 0.2}", ["controller.spacing", "0.06"]),
    "delay between steps": (
        "controller: {global_mpc: {delay: 0.25}}",
        ["controller.global_mpc.delay", "multiple of time_step"],
    ),
    "delay beyond period": (
        "controller: {global_mpc: {period: 0.5, delay: 0.6}}",
        ["controller.global_mpc.delay", "period"],
    ),
    "force limit too high": ("safety: {force_limit: 1000}", ["safety.force_limit", "200"]),
    "force limit under its old name, too": (
        "{safety: {force_limit: 20}, controller: {global_mpc: {force_limit: 21}}}",
        ["controller.global_mpc.force_limit", "safety.force_limit"],
    ),
    "soft limit over the hard one": (
        "safety: {soft_force_limit: 30}",
        ["safety.soft_force_limit", "17"],
    ),
    "braking slower than accelerating": (
        "safety: {max_acceleration: 8}",
        ["safety.max_braking", "8"],
    ),
    "stale at once": ("safety: {stale_time: 0.006}", ["safety.stale_time", "0.01"]),
    "distances that exclude each other": (
        "safety: {least_distance: 0.5, largest_distance: 0.4}",
        ["safety.largest_distance", "0.5"],
    ),
    "flat workspace": ("safety: {workspace: {low: [0, 0]}}", ["safety.workspace.low", "x, y, z"]),
    "workspace upside down": (
        "safety: {workspace: {low: [0, 0, 2], high: [1, 1, 1]}}",
        ["safety.workspace.high", "each axis"],
    ),
    "garment outside the workspace": (
        "safety: {workspace: {low: [5, 5, 5], high: [6, 6, 6]}}",
        ["safety", "outside the workspace"],
    ),
    "broken syntax": ("plant: {spacing: 0.02", ["line"]),
    "tab": ("plant:\n\tspacing: 1", ["line 2"]),
    "empty file": ("", ["empty"]),
    "a list": ("- 1\n- 2", ["list"]),
    "coat that cannot be": (
        "garment: {coat: {cuff_girth: 0.59, armhole_girth: 0.4}}",
        ["cuff_girth"],
    ),
    "coat measure out of range": ("garment: {coat: {chest: 9}}", ["chest"]),
    "missing mesh": ("garment: {mesh: {file: nowhere.obj}}", ["nowhere.obj"]),
    "key that stands twice": (
        "plant: {spacing: 0.05}\nseed: 1\nplant: {time_step: 0.01}",
        ["plant", "stands twice, lines 1 and 3"],
    ),
    "octal or decimal": ("seed: 010", ["seed", "line 1", "8 or 10"]),
    "sixties": ("duration: 1:30", ["duration", "line 1", "90"]),
    "yes for true": ("plant: {self_collision: yes}", ["plant.self_collision", "line 1", "true"]),
    "quoted number": ("duration: '3'", ["duration", "'3'", "number"]),
    "seed too large": (f"seed: {2**70}", ["seed", "line 1", "64 bits"]),
    "beyond all numbers": ("duration: 1e400", ["duration", "line 1", "1e400"]),
    "too deep": ("a: " + 1000 * "[", ["line 1", "deeper"]),
    "two documents": ("seed: 1\n---\nseed: 2", ["line 2", "second document"]),
    "unknown unit": ("garment: {mesh: {file: a.obj, unit: inch}}", ["garment.mesh.unit", "mm"]),
    "loop of words": (
        "garment: {mesh: {file: a.obj, loops: {left_cuff: [a]}}}",
        ["garment.mesh.loops.left_cuff[0]"],
    ),
}


def refused(capsys: pytest.CaptureFixture[str], arguments: list[str]) -> str:
    """Runs the command line, checks the form of its refusal, and returns the line."""
    try:
        status = main(arguments)
    except SystemExit as error:
        status = int(error.code or 0)
    captured = capsys.readouterr()
    assert status == 2
    assert captured.out == ""
    lines = captured.err.splitlines()
    assert len(lines) == 1, captured.err
    assert lines[0].startswith("drake-dress: ")
    assert "Traceback" not in lines[0]
    return lines[0]


@pytest.mark.parametrize("name", BAD_YAML)
def test_bad_scenario(name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text, words = BAD_YAML[name]
    path, out = tmp_path / "scenario.yaml", tmp_path / "out"
    path.write_text(text)
    line = refused(capsys, ["run", str(path), "--out", str(out), "--no-meshcat"])
    for word in words:
        assert word in line, line
    assert not out.exists()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["run"], ["SCENARIO"]),
        (["dance"], ["dance"]),
        ([], ["COMMAND"]),
        (["run", "no/such.yaml"], ["no/such.yaml", "no such file"]),
        (["run", "."], ["directory"]),
        (["run", "S", "--set", "plant.spacing"], ["--set", "KEY=VALUE"]),
        (["run", "S", "--set", "plant.spacng=0.02"], ["plant.spacng", "spacing"]),
        (["run", "S", "--set", "plant.spacing=wide"], ["plant.spacing", "number"]),
        (["run", "S", "--set", "seed.more=1"], ["seed.more"]),
        (["run", "S", "--set", "seed=010"], ["--set", "seed", "8 or 10"]),
        (["run", "S", "--set", "plant={spacing: 0.05, spacing: 0.03}"], ["plant", "twice"]),
        (["run", "S", "--set", "plant.self_collision=on"], ["plant.self_collision", "true"]),
        (["run", "S", "--set", "plant.spacing=[1"], ["--set", "plant.spacing", "YAML"]),
        (["run", "S", "--seed", "x"], ["--seed"]),
        (["run", "S", "--realtime-rate", "-1"], ["--realtime-rate"]),
        (["replay", "no.h5"], ["no.h5"]),
        (["bench", "dance"], ["dance", "cloth"]),
        (["bench", "cloth", "--only", "dance"], ["dance", "draping"]),
    ],
    ids=lambda value: " ".join(value) if value and isinstance(value, list) else "",
)
def test_bad_command_line(
    arguments: list[str], words: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "scenario.yaml"
    path.write_text("seed: 0")
    line = refused(capsys, [str(path) if a == "S" else a for a in arguments])
    for word in words:
        assert word in line, line


UNREADABLE = {
    "UTF-16": ("seed: 0".encode("utf-16"), "UTF-16"),
    "Latin-1": ("# größe\nseed: 0".encode("latin-1"), "line 1"),
    "NUL": (b"seed: 0\n\0\n", "NUL"),
    "huge": (b"#" * (2 << 20), "larger than 1 MB"),
}


@pytest.mark.parametrize("name", UNREADABLE)
def test_what_is_no_text_is_no_scenario(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    data, words = UNREADABLE[name]
    path = tmp_path / "scenario.yaml"
    path.write_bytes(data)
    assert words in refused(capsys, ["run", str(path)])


def test_what_is_no_regular_file_is_told_at_once(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    pipe = tmp_path / "pipe.yaml"
    os.mkfifo(pipe)
    for path in (str(pipe), "/dev/zero", "/dev/null"):
        assert "no regular file" in refused(capsys, ["run", path])
    assert "cannot be read" in refused(capsys, ["run", str(tmp_path / ("a" * 300))])
    assert "no scenario that ships" in refused(capsys, ["run", "a" * 300])


def test_a_byte_order_mark_changes_nothing(tmp_path: Path) -> None:
    path = tmp_path / "scenario.yaml"
    path.write_bytes(b"\xef\xbb\xbfseed: 3\n")
    assert load_scenario(path).seed == 3


def test_binary_file_is_no_scenario(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "scenario.yaml"
    path.write_bytes(bytes([0xFF, 0xFE, 0x00, 0x81]) * 50)
    assert "scenario.yaml" in refused(capsys, ["run", str(path)])


def _obj(vertices: list[str], faces: list[str]) -> str:
    return "\n".join([f"v {v}" for v in vertices] + [f"f {f}" for f in faces]) + "\n"


SQUARE = ["0 0 0", "1 0 0", "1 1 0", "0 1 0"]
BAD_MESHES = {
    "no faces": ("a.obj", "# nothing\n", "m", ["a.obj"]),
    "not a mesh at all": ("a.obj", "\x00\x01 nonsense", "m", ["a.obj"]),
    "unknown extension": ("a.xyz", "1 2 3", "m", ["a.xyz"]),
    "not a number": ("a.obj", _obj(["nan 0 0", *SQUARE[1:]], ["1 2 3", "1 3 4"]), "m", ["a.obj"]),
    "three faces at an edge": (
        "a.obj",
        _obj([*SQUARE, "0.5 0.5 1"], ["1 2 3", "1 3 4", "1 3 5"]),
        "m",
        ["a.obj", "manifold"],
    ),
    "wrong unit": ("a.obj", _obj(SQUARE, ["1 2 3", "1 3 4"]), "mm", ["a.obj", "unit"]),
    "flat piece": ("a.obj", _obj(SQUARE, ["1 2 3", "1 3 4"]), "m", ["a.obj", "flat"]),
}


@pytest.mark.parametrize("name", BAD_MESHES)
def test_bad_mesh(name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file, content, unit, words = BAD_MESHES[name]
    (tmp_path / file).write_text(content)
    path, out = tmp_path / "scenario.yaml", tmp_path / "out"
    path.write_text(f"garment: {{mesh: {{file: {file}, unit: {unit}}}}}")
    line = refused(capsys, ["run", str(path), "--out", str(out), "--no-meshcat"])
    for word in words:
        assert word in line, line
    assert not out.exists()


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (["explain", "none.h5", "--scenario", "SCENARIO"], ["none.h5", "no such file"]),
        (["explain", "SCENARIO", "--scenario", "SCENARIO"], ["unknown kind", ".h5"]),
        (["explain", "none.h5", "--scenario", "no.yaml"], ["no.yaml", "no such file"]),
        (
            ["dataset", "measured", "--hide", "air_drug", "--out", "OUT", "--scenario", "SCENARIO"],
            ["--hide", "air_drug", "air_drag"],
        ),
        (
            ["dataset", "measured", "--hide", "wind", "--seed", "-1", "--out", "OUT"]
            + ["--scenario", "SCENARIO"],
            ["--seed", "0 or more"],
        ),
    ],
)
def test_measured_data_that_cannot_be_used(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], words: list[str], expected: list[str]
) -> None:
    scenario = str(Path(__file__).parents[1] / "scenarios" / "measured.yaml")
    out = tmp_path / "out"
    words = [{"SCENARIO": scenario, "OUT": str(out)}.get(w, w) for w in words]
    if words[0] == "explain":
        words += ["--out", str(out)]
    assert main(words) == 2
    line = capsys.readouterr().err
    assert line.count("\n") == 1
    assert line.startswith("drake-dress: ")
    for word in expected:
        assert word in line
    assert not out.exists()
