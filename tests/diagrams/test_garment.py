import copy
import json
import os
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from drake_dress.diagrams import garment
from drake_dress.diagrams.scenario import load_scenario
from drake_dress.diagrams.scenario.schema import Coat, Garment, Mesh
from drake_dress.diagrams.scenario.text import resolved_yaml
from drake_dress.diagrams.setup import read_setup
from drake_dress.diagrams.station import hung_garment, settled
from drake_dress.errors import UserError
from drake_dress.models.cloth.elements import make_elements
from drake_dress.models.cloth.layers.piercing import piercing_edges
from drake_dress.models.garment.coat import COATS, make_coat
from drake_dress.models.garment.load import WholeGarment, read_garment
from tests.present import present

JACKET = make_coat(COATS["jacket"], 0.06)
SCENARIO = Path(__file__).parents[2] / "scenarios" / "dummy_standing.yaml"


def write(path: Path, y_up: bool = False) -> None:
    x = JACKET.rest_position[:, [1, 2, 0]] if y_up else JACKET.rest_position
    lines = [f"v {a} {b} {c}" for a, b, c in x]
    lines += [f"f {a} {b} {c}" for a, b, c in JACKET.faces + 1]
    path.write_text("\n".join(lines) + "\n")


@pytest.fixture
def reads(monkeypatch: pytest.MonkeyPatch) -> list[Path]:
    """Records the files that are read."""
    count = []

    def counted(*args: Any) -> WholeGarment:
        count.append(args[0])
        return read_garment(*args)

    monkeypatch.setattr(garment, "read_garment", counted)
    monkeypatch.setattr(garment, "_kept", type(garment._kept)())
    return count


def test_a_file_is_read_once_at_any_spacing_until_it_or_its_keys_change(
    tmp_path: Path, reads: list[Path]
) -> None:
    path = tmp_path / "coat.obj"
    write(path)
    wanted = Garment(mesh=Mesh(file="coat.obj"))
    first = garment.build_garment(wanted, 0.05, tmp_path)
    garment.build_garment(wanted, 0.07, tmp_path)
    again = garment.build_garment(wanted, 0.05, tmp_path)
    assert len(reads) == 1
    assert np.array_equal(first.rest_position, again.rest_position)
    assert first.rest_position is not again.rest_position
    garment.build_garment(Garment(mesh=Mesh(file="coat.obj", weld=1e-4)), 0.05, tmp_path)
    assert len(reads) == 2
    os.utime(path, ns=(1, 1))
    garment.build_garment(wanted, 0.05, tmp_path)
    assert len(reads) == 3


def test_keys_of_a_mesh_reach_the_file(tmp_path: Path, reads: list[Path]) -> None:
    write(tmp_path / "coat.obj", y_up=True)
    wanted = Garment(mesh=Mesh(file="coat.obj", up="y"))
    mesh = garment.build_garment(wanted, 0.06, tmp_path)
    assert np.allclose(
        np.ptp(mesh.rest_position, axis=0), np.ptp(JACKET.rest_position, axis=0), atol=0.03
    )
    with pytest.raises(UserError, match=r"garment\.mesh\.up: y"):
        garment.build_garment(Garment(mesh=Mesh(file="coat.obj")), 0.06, tmp_path)


@pytest.mark.parametrize(
    ("override", "reason"),
    [
        ("garment.mesh.up=w", "garment.mesh.up: is 'w', expected z or y"),
        ("garment.mesh.weld=0.5", "garment.mesh.weld: is 0.5, expected 0 to 0.02"),
        ("garment.mesh.weld=-1", "garment.mesh.weld: is -1"),
        ("garment.mesh.leave_out=Button", "garment.mesh.leave_out: is 'Button', expected a list"),
        ("garment.mesh.leave_out=[5]", r"garment.mesh.leave_out\[0\]: is 5, expected text"),
    ],
)
def test_wrong_keys_are_told_by_the_scenario(override: str, reason: str) -> None:
    with pytest.raises(UserError, match=reason):
        load_scenario(SCENARIO, ["garment.mesh.file=coat.obj", override])


def test_a_scenario_with_all_keys_loads() -> None:
    scenario = load_scenario(
        SCENARIO,
        [
            "garment.mesh.file=coat.obj",
            "garment.mesh.up=-y",
            "garment.mesh.weld=1e-4",
            'garment.mesh.leave_out=[Button, "<0.05 m"]',
        ],
    )
    mesh = present(scenario.garment.mesh)
    assert mesh.up == "-y"
    assert mesh.leave_out == ["Button", "<0.05 m"]


@pytest.mark.parametrize("opening", ["front", "back"])
@pytest.mark.parametrize("side", ["behind", "front"])
def test_a_garment_must_open_toward_the_person(opening: str, side: str) -> None:
    mesh = garment.build_garment(Garment(coat=Coat(opens=opening)), 0.05, Path())
    if (opening == "front") == (side == "behind"):
        garment.check_opening(mesh, side, "s.yaml")
        return
    with pytest.raises(UserError, match=f"s.yaml: station.side: is {side}.*opens at the {opening}"):
        garment.check_opening(mesh, side, "s.yaml")


def test_a_gown_like_the_nominal_one_has_its_nodes() -> None:
    nominal = Garment(coat=Coat(opens="back"))
    drawn = Garment(coat=Coat(opens="back", chest=1.3))
    first = garment.build_garment(nominal, 0.05, Path())
    like = garment.build_garment_like(drawn, nominal, 0.05, Path())
    assert np.array_equal(like.loops["left_cuff"], first.loops["left_cuff"])
    assert np.array_equal(np.sort(like.faces[:, 0]), np.sort(first.faces[:, 0]))
    assert np.abs(like.rest_position - first.rest_position).max() < 0.05


@pytest.mark.parametrize(
    "other", ["coat: {grasp: seam}", "mesh: {file: a.obj, grasp: {left: [1, 2, 3, 4]}}"]
)
def test_a_garment_is_held_in_one_place_only(other: str, tmp_path: Path) -> None:
    path = tmp_path / "s.yaml"
    path.write_text(f"garment: {{hold: edges, {other}}}\n")
    with pytest.raises(
        UserError, match=r"garment\.hold: is edges, but garment\.(coat|mesh)\.grasp"
    ):
        load_scenario(path)
    path.write_text(f"garment: {{{other}}}\n")
    assert load_scenario(path).garment.hold == "shoulders"


def test_a_coat_like_the_nominal_one_is_held_at_its_nodes() -> None:
    nominal = Garment(coat=Coat(), hold="edges")
    first = garment.build_garment(nominal, 0.05, Path())
    drawn = Garment(coat=Coat(armhole_girth=0.64, chest=1.3), hold="edges")
    like = garment.build_garment_like(drawn, nominal, 0.05, Path())
    assert first.hold == like.hold == "edges"
    for side in ("left", "right"):
        assert np.array_equal(first.grasp[side], like.grasp[side])


def test_a_narrow_front_does_not_hang_through_itself_at_the_start() -> None:
    coat = {"preset": "raincoat", "size": "XXL", "size_table": "women"}
    words = [f"garment.coat={json.dumps(coat)}", "plant.spacing=0.035", "garment.hold=edges"]
    scenario = load_scenario(SCENARIO, words)
    p = read_setup(scenario, SCENARIO).station
    elements = make_elements(p.mesh.rest_position, p.mesh.faces)
    left = p.mesh.rest_position[:, 1] > 0.0
    hung = hung_garment(p)

    def hooked(layered: bool) -> int:
        """Returns how many edges of one half pass through the other half."""
        found = piercing_edges(settled(replace(p, self_collision=layered), hung), elements)
        return int(
            np.sum(left[elements.edge[found[:, 0], 0]] != left[elements.triangle[found[:, 1], 0]])
        )

    assert hooked(layered=False) > 10
    assert hooked(layered=True) == 0


def test_a_coat_and_a_file_in_one_scenario_contradict_each_other(tmp_path: Path) -> None:
    path = tmp_path / "s.yaml"
    for coat in ("{preset: jacket}", "{}", "{chest: 1.2, scale: 0.9}"):
        path.write_text(f"garment: {{coat: {coat}, mesh: {{file: coat.obj}}}}\n")
        with pytest.raises(UserError, match=r"garment\.mesh: is given beside garment\.coat"):
            load_scenario(path)
    path.write_text("garment: {coat: {preset: jacket}, mesh: null}\n")
    replaced = load_scenario(path, ["garment.mesh.file=coat.obj"])
    assert present(replaced.garment.mesh).file == "coat.obj"
    # a scenario that was written with all its keys loads again, as from a log
    path.write_text(resolved_yaml(replaced))
    assert load_scenario(path) == replaced


@pytest.mark.parametrize("scale", [0.93, 1.08])
def test_a_garment_like_the_nominal_one_has_its_nodes(scale: float, tmp_path: Path) -> None:
    write(tmp_path / "jacket.obj")
    for nominal in (Garment(), Garment(mesh=Mesh(file="jacket.obj"))):
        drawn = copy.deepcopy(nominal)
        drawn.coat.scale *= scale
        if drawn.mesh is not None:
            drawn.mesh.scale *= scale
        first = garment.build_garment(nominal, 0.06, tmp_path)
        like = garment.build_garment_like(drawn, nominal, 0.06, tmp_path)
        np.testing.assert_allclose(
            like.rest_position, scale * first.rest_position, atol=0.02 * abs(scale - 1.0) + 1e-12
        )
        np.testing.assert_array_equal(like.loops["left_cuff"], first.loops["left_cuff"])


def test_keys_of_a_file_reach_its_reader(tmp_path: Path) -> None:
    write(tmp_path / "coat.obj", y_up=True)
    cuff = JACKET.rest_position[JACKET.loops["left_cuff"][0], [1, 2, 0]]
    place = "near ({:.3f}, {:.3f}, {:.3f}) m".format(*cuff)
    (tmp_path / "s.yaml").write_text(
        "garment:\n  mesh:\n    file: coat.obj\n    up: y\n    facing: z\n"
        f"    take: ['>0.5 m']\n    loops: {{left_cuff: '{place}'}}\n"
    )
    scenario = load_scenario(tmp_path / "s.yaml")
    mesh = garment.build_garment(scenario.garment, 0.06, tmp_path)
    assert len(mesh.loops) == 4
    nodes = JACKET.loops["left_cuff"].tolist()
    (tmp_path / "s.yaml").write_text(
        f"garment: {{mesh: {{file: coat.obj, up: y, loops: {{left_cuff: {nodes}}}}}}}\n"
    )
    again = garment.build_garment(load_scenario(tmp_path / "s.yaml").garment, 0.06, tmp_path)
    np.testing.assert_array_equal(again.faces, mesh.faces)


def test_what_was_mended_is_told_once(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], reads: list[Path]
) -> None:
    path = tmp_path / "coat.obj"
    write(path)
    lines = path.read_text().splitlines()
    path.write_text("\n".join([*lines, lines[-1]]) + "\n")
    wanted = Garment(mesh=Mesh(file="coat.obj"))
    garment.build_garment(wanted, 0.06, tmp_path)
    garment.build_garment(wanted, 0.07, tmp_path)
    told = [line for line in capsys.readouterr().err.splitlines() if line.startswith("coat.obj: ")]
    assert len(told) == 1
    assert "1 triangles are given twice" in told[0]
