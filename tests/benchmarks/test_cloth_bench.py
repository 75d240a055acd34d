"""Tiny versions of the cloth benchmark's scenes: their physics and the structure of the results."""

from __future__ import annotations

import importlib.util
import json
import math
import threading
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from benchmarks.cloth import __main__ as command
from benchmarks.cloth import (
    backward,
    carrying,
    comparison,
    draping,
    garments,
    growth,
    layers,
    limbs,
    measure,
    motions,
    placement,
    reference,
    tracking,
    tube,
)
from benchmarks.cloth.engines import Engine, Recipe, explicit_bias, implicit
from benchmarks.cloth.measure import Session, race, ratio
from benchmarks.cloth.peers import flat, mujoco_flex, newton_style3d, newton_vbd
from benchmarks.cloth.scene import SOFT, STIFF, Scene
from benchmarks.cloth.table import shown
from benchmarks.figures import plain
from drake_dress.models.arrays import FloatArray
from drake_dress.models.cloth.elements import make_elements
from tests.present import present

_RUN_KEYS = {
    "engine",
    "time_step_s",
    "setup_s",
    "first_step_s",
    "step_median_s",
    "step_worst_s",
    "step_spread",
    "steps",
    "wall_per_simulated_s",
    "reached_s",
    "exploded_s",
    "unconverged_steps",
    "distance_m",
    "distance_mean_m",
    "distance_max_m",
    "distance_end_m",
}
_CONTACT_KEYS = {
    "contact_most",
    "contact_most_share",
    "step_in_contact_s",
    "step_in_contact_worst_s",
    "step_at_most_contact_s",
    "penetration_m",
}


@pytest.fixture
def session(tmp_path: Path) -> Session:
    return Session(quick=True, limit=1.0, cache=tmp_path, say=lambda line: None)


@pytest.fixture
def few_engines(monkeypatch: pytest.MonkeyPatch) -> None:
    """Leaves two engines: what is tested is the frame, not each scheme again."""
    monkeypatch.setattr(comparison, "own_recipes", lambda: [explicit_bias(1), implicit()])
    monkeypatch.setattr(carrying, "own_recipes", lambda: [explicit_bias(1), implicit()])
    monkeypatch.setattr(comparison, "peer_recipes", lambda contact: [])
    # Projective Dynamics has its own tests, and at a few hundred nodes the limit is the same.
    monkeypatch.setattr(reference, "_choice", lambda scene: (implicit(), 1e-3))


def _assert_json(result: dict[str, Any]) -> None:
    """Checks that a result is written without loss but of NaN, and that its tables can be shown."""
    again = json.loads(json.dumps(plain(result), allow_nan=False))
    assert set(again) == set(result)


def _tiny_draping(duration: float = 0.2) -> Scene:
    return draping.draping_scene(garments.QUICK_SPACING, SOFT, duration, "draping")


@pytest.mark.usefixtures("few_engines")
def test_smaller_steps_come_nearer_to_the_fine_reference(session: Session) -> None:
    result = comparison.over_steps(session, _tiny_draping(0.3), (0.005, 0.05))
    assert all(run.keys() >= _RUN_KEYS for run in result["runs"])
    for engine in {run["engine"] for run in result["runs"]}:
        near, far = (
            next(r for r in result["runs"] if (r["engine"], r["time_step_s"]) == (engine, h))
            for h in (0.005, 0.05)
        )
        assert near["reached_s"] == pytest.approx(0.3)
        assert 0.0 < near["distance_mean_m"] < far["distance_mean_m"] < 0.2
    assert "draping" in comparison.steps_table(result).text()
    _assert_json(result)


@pytest.mark.usefixtures("few_engines")
def test_reference_is_computed_once_per_setting(session: Session) -> None:
    scene = _tiny_draping()
    first = reference.fine_reference(session, scene)
    begin = time.perf_counter()
    again = reference.fine_reference(session, scene)
    assert time.perf_counter() - begin < 0.2
    assert first is not None
    assert again is not None
    for k, x in first.sample.items():
        np.testing.assert_allclose(again.sample[k], x, atol=1e-6)
    reference.fine_reference(session, _tiny_draping(0.1))
    assert len(list(present(session.cache).glob("reference-*.npz"))) == 2


@pytest.mark.usefixtures("few_engines")
def test_placement_tells_cost_in_contact(session: Session) -> None:
    scene = placement.sheet_scene(12, 0.02, "laid sheet")
    # to the end, also where kernels are compiled on the way
    session.limit = 120.0
    result = comparison.against_peers(session, scene, 0.02, 0.2, accuracy=False)
    for run in result["runs"]:
        assert run.keys() >= _RUN_KEYS | _CONTACT_KEYS
        assert run["contact_most_share"] == 1.0
        assert run["penetration_m"] == 0.0
        assert 0.0 < run["step_in_contact_s"] <= run["step_in_contact_worst_s"]
    assert result["runs"][0]["ratio_to_first"] == 1.0
    assert "laid sheet" in comparison.peers_table(result).text()
    _assert_json(result)
    coat = placement.placement_scene(garments.QUICK_SPACING, SOFT, (0.3, 0.1, 0.1), "placement")
    run = race(session, coat, [explicit_bias(1)], 0.02)[0]
    assert run.contact[0] == 0
    assert max(run.contact) > 10


@pytest.mark.usefixtures("few_engines")
def test_tube_keeps_contact_with_the_limb(session: Session) -> None:
    scene = tube.tube_scene(14, 20, SOFT, 0.2, "tube")
    assert scene.penetration(scene.position) == 0.0
    result = comparison.over_steps(session, scene, (0.01,), accuracy=False)
    for run in result["runs"]:
        assert run["contact_most"] > 20
        assert run["penetration_m"] < 0.003


def test_armhole_follows_its_target(session: Session) -> None:
    result = tracking.measure(session)
    error = result["error_m"]
    assert len(error) == len(result["time_s"]) == len(result["trajectory_m"]["sleeve"])
    assert error[0] > 0.04
    assert error[-1] < 0.2 * error[0]
    assert "tracking" in tracking.tables(result)[0].text()
    _assert_json(result)


def test_grippers_feel_the_weight_they_carry(
    session: Session, monkeypatch: pytest.MonkeyPatch, few_engines: None
) -> None:
    monkeypatch.setattr(carrying, "DURATION", 0.2)
    result = carrying.measure(session)
    assert len(result["runs"]) == 4
    for run in result["runs"]:
        assert run["force_mean"] == pytest.approx(1.0, abs=0.1)
    assert "carrying" in carrying.tables(result)[0].text()
    _assert_json(result)


def test_growth_fits_an_exponent(session: Session) -> None:
    result = growth.measure(session)
    nodes = [size["nodes"] for size in result["sizes"]]
    assert nodes == sorted(nodes)
    assert nodes[0] > 300
    assert 0.3 < result["exponent"] < 2.5


def test_backward_is_finite_in_contact(session: Session) -> None:
    result = backward.measure(session)
    run = result["runs"][0]
    assert run["contacts"] > 0
    assert run["finite"]
    assert run["adjoint_median_s"] > 0.0
    assert "backward" in backward.tables(result)[0].text()
    _assert_json(result)


def test_tapered_limbs_are_touched_and_timed_beside_capsules(session: Session) -> None:
    result = limbs.measure(session)
    assert [run["step"] for run in result["runs"]] == ["plant", "controller, with adjoint"]
    for run in result["runs"]:
        assert min(run["contacts"]) > 5
        assert min(run["ratio"], run["arithmetic_ratio"]) > 0.0
        # a taper of a millionth is touched where capsules are
        assert run["contacts"][1] == pytest.approx(run["contacts"][0], rel=0.1)
    body = limbs.body_in_coat(garments.jacket(0.06), 0.2, 0.3, 0.0)
    assert result["limbs"] == body.count == 11
    np.testing.assert_allclose(body.radius[:, 0] / body.radius[:, 1], 1.5)
    assert len(limbs.figures(result)) == 4
    assert not limbs.figures(None)
    assert "11 limbs" in limbs.tables(result)[0].text()
    _assert_json(result)


class _Diverging:
    """An engine that leaves for infinity at its third step."""

    def __init__(self, scene: Scene) -> None:
        self.x, self.count = scene.position.copy(), 0

    def step(self, held: FloatArray) -> None:
        self.count += 1
        if self.count >= 3:
            self.x = self.x + np.inf

    def positions(self) -> FloatArray:
        return self.x


class _Slow(_Diverging):
    """An engine that takes ten milliseconds a step."""

    def step(self, held: FloatArray) -> None:
        time.sleep(0.01)


def _recipe(name: str, kind: Any) -> Recipe:
    def make(scene: Scene, time_step: float) -> Engine:
        engine: Engine = kind(scene)
        return engine

    return Recipe(name, make)


def test_explosion_is_told_and_the_others_go_on(session: Session) -> None:
    missing = Recipe("absent", lambda scene, h: _Slow(scene), lambda: "not installed")
    runs = race(
        session, _tiny_draping(), [explicit_bias(1), _recipe("bad", _Diverging), missing], 0.01
    )
    assert [run.name for run in runs] == ["explicit bias, 1 it.", "bad"]
    assert runs[0].exploded is None
    assert runs[0].reached == pytest.approx(0.2)
    assert runs[1].exploded == pytest.approx(0.03)


def test_a_run_is_cut_at_its_limit_and_ratios_hold(session: Session) -> None:
    session.limit = 0.05
    runs = race(session, _tiny_draping(), [_recipe("a", _Slow), _recipe("b", _Slow)], 0.01)
    assert all(0.04 < run.reached < 0.12 for run in runs)
    assert ratio(runs[1], runs[0]) == pytest.approx(1.0, rel=0.5)


def test_interrupted_race_keeps_what_was_measured(session: Session) -> None:
    threading.Timer(0.05, session.stop.set).start()
    run = race(session, _tiny_draping(5.0), [_recipe("slow", _Slow)], 0.01)[0]
    assert 0.0 < run.reached < 5.0
    assert run.step_time


def test_flat_triangles_keep_their_shape() -> None:
    mesh = garments.jacket(garments.QUICK_SPACING)
    corners = mesh.rest_position[mesh.faces]
    laid = flat.flat_triangles(mesh.rest_position, mesh.faces)
    for i, j in ((0, 1), (1, 2), (2, 0)):
        np.testing.assert_allclose(
            np.linalg.norm(laid[:, i] - laid[:, j], axis=1),
            np.linalg.norm(corners[:, i] - corners[:, j], axis=1),
            rtol=1e-12,
        )


def test_dihedral_stiffness_has_the_energy_of_a_hinge() -> None:
    x = np.array([[0.0, 0.0, 0.0], [0.02, 0.0, 0.0], [0.007, 0.015, 0.0], [0.012, -0.018, 0.0]])
    faces = np.array([[0, 1, 2], [1, 0, 3]], dtype=np.int32)
    bending, angle = 1e-4, 1e-3
    elements = make_elements(x, faces)
    bent = x.copy()
    bent[2] = [0.007, 0.015 * math.cos(angle), 0.015 * math.sin(angle)]
    vector = elements.hinge_coefficient @ bent[elements.hinge[0]]
    ours = 0.5 * bending * elements.hinge_weight[0] * float(np.sum(vector**2))
    k = flat.dihedral_stiffness(x, np.array([[0, 1]]), np.array([[2, 3]]), bending)[0]
    assert 0.5 * k * 0.02 * angle**2 == pytest.approx(ours, rel=1e-4)


@pytest.mark.parametrize(
    "mesh", [garments.tube(8, 5, 0.05, 0.2), garments.sheet(5, 0.01)], ids=["tube", "sheet"]
)
def test_meshes_are_oriented_alike(mesh: tuple[FloatArray, Any]) -> None:
    position, faces = mesh
    directed = faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    assert len(np.unique(directed, axis=0)) == len(directed)
    elements = make_elements(position, faces)
    assert elements.node_area.min() > 0.0


def test_motions_start_at_rest_where_they_are() -> None:
    held = np.array([[0.0, 0.1, 0.2], [0.0, -0.1, 0.3]])
    for motion in (
        motions.pulled(held, np.array([0.3, 0.0, 0.0]), 1.0),
        motions.laid_down(held, 0.0, 0.5, 1.0, 0.5),
    ):
        np.testing.assert_allclose(motion(0.0), held)
        assert np.abs(motion(1e-3) - held).max() < 1e-6
    end = motions.laid_down(held, 0.0, 0.5, 1.0, 0.5)(1.5)
    assert end[:, 2].min() == pytest.approx(0.0, abs=1e-12)


_PEERS = [mujoco_flex.recipe(), mujoco_flex.recipe(passive=True), newton_style3d.recipe(2)]


@pytest.mark.parametrize("recipe", [*_PEERS, newton_vbd.recipe()], ids=lambda r: r.name)
def test_peer_hangs_the_same_garment(recipe: Recipe, session: Session) -> None:
    missing = recipe.missing()
    if missing:
        pytest.skip(missing)
    scene = draping.draping_scene(garments.QUICK_SPACING, STIFF, 0.1, "draping-stiff")
    session.limit = 10.0
    runs = race(session, scene, [implicit(), recipe], 0.01)
    ours, theirs = (run.final for run in runs)
    assert runs[1].reached == pytest.approx(0.1)
    np.testing.assert_allclose(theirs[scene.held], scene.position[scene.held], atol=1e-6)
    fallen = ours[:, 2].mean() - scene.position[:, 2].mean()
    assert abs(theirs[:, 2].mean() - ours[:, 2].mean()) < 0.01
    assert fallen < 0.0
    assert theirs[:, 2].mean() < scene.position[:, 2].mean()
    assert measure.edge_strain(theirs, scene.elements()) < 0.05


def test_peer_falls_on_the_table_and_stays(session: Session) -> None:
    if importlib.util.find_spec("mujoco") is None:
        pytest.skip("mujoco is not installed")
    scene = placement.sheet_scene(8, 0.02, "laid sheet")
    for recipe in _PEERS[:2]:
        run = race(session, scene, [recipe], 0.01)[0]
        assert scene.penetration(run.final) < 0.002
        assert max(run.contact) > 0.9 * len(scene.position)


def test_command_writes_tables_json_and_plots(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file, folder = tmp_path / "a" / "bench.json", tmp_path / "png"
    arguments = ["--quick", "--only", "growth", "--json", str(file), "--png", str(folder)]
    assert command.main([*arguments, "--cache", str(tmp_path)]) == 0
    out = capsys.readouterr().out
    assert "processor:" in out
    assert "| nodes " in out
    document = json.loads(file.read_text())
    heading = {"figures", "machine", "version", "seeds"}
    assert set(document) == heading | {"about", "quick", "wall_s", "scenes"}
    assert set(document["scenes"]) == {"growth"}
    assert document["about"]["numba"]
    assert (folder / "cloth_growth.png").read_bytes()[:4] == b"\x89PNG"


@pytest.mark.parametrize(
    "arguments", [["--only", "fold"], ["--jobs", "0"], ["--limit", "x"], ["--what"], ["extra"]]
)
def test_bad_arguments_are_one_line_and_status_2(
    arguments: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as caught:
        command.main(arguments)
    assert caught.value.code == 2
    assert len(capsys.readouterr().err.strip().splitlines()) == 1


def test_numbers_are_shown_with_three_digits() -> None:
    cells = (0.01234, 1.234, 123.4, float("nan"), None, 0.0, 7)
    assert [shown(cell) for cell in cells] == ["0.0123", "1.23", "123", "–", "–", "0", "7"]


def test_layers_are_timed_with_and_without(session: Session) -> None:
    result = layers.measure(session)
    assert len(result["runs"]) == 3
    for run in result["runs"]:
        assert run["step_s"] > 0.0
        assert run["ratio"] > 0.0
    assert "two sheets" in layers.tables(result)[0].text()
    _assert_json(result)
