"""What `drake-dress bench prediction` tells of motions that were followed."""

import json
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from benchmarks.prediction.__main__ import main
from benchmarks.prediction.hidden import HAND, hidden_errors
from benchmarks.prediction.likeness import likeness
from benchmarks.prediction.persons import folds
from benchmarks.prediction.streams import Told, delays_of, switch_delays
from drake_dress.errors import UserError
from drake_dress.learning.evaluation.baselines import plain_baselines
from drake_dress.learning.evaluation.stream import Compared, followed
from drake_dress.learning.motion.commands import Wanted, write_motion_set
from drake_dress.learning.motion.dataset import read_motion
from drake_dress.learning.motion.making import Workplace
from drake_dress.learning.timed_motion import TimedMotion
from drake_dress.learning.training.commands import TrainOptions, train_command
from drake_dress.models.human.learned.predictor import LearnedPredictor
from drake_dress.models.human.learned.ridge import RidgePredictor
from drake_dress.models.human.learned.weights import networks

TIME = 0.05 * np.arange(160, dtype=np.float64)


@pytest.fixture(scope="module")
def trained(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """Returns a small set of motion, and weights that were trained on it for a moment."""
    data, out = tmp_path_factory.mktemp("data"), tmp_path_factory.mktemp("out")
    counts: Any = {"passive": 7, "active": 7, "free": 7}
    assert write_motion_set(data, Wanted(0, counts, 0), Workplace(1, None)) == 0
    for name in ("intent", "motion"):
        assert train_command(name, TrainOptions(data, out, steps=3)) == 0
    return data, out


def motion(speed: float = 0.1) -> TimedMotion:
    left = np.array([[0.0, 0.18, 1.4], [0.02, 0.22, 1.12], [0.1, 0.24, 0.85]])
    pose = np.concatenate([left, left * [1.0, -1.0, 1.0]])
    way = np.zeros((len(TIME), 6, 3))
    way[:, :, 0] = speed * TIME[:, None]
    return TimedMotion("some", TIME, pose + way, np.full((len(TIME), 2, 6), np.nan))


def test_delay_of_a_switch_is_the_time_until_it_is_told() -> None:
    times = 0.1 * np.arange(60, dtype=np.float64)
    truth = ((times >= 2.0) & (times < 4.0)).astype(int)
    for late in (0.0, 0.3, 1.0):
        told = np.where((times >= 2.0 + late - 1e-9) & (times < 4.0), 0.9, 0.1)
        np.testing.assert_allclose(switch_delays(times, told, truth), [late], atol=1e-9)
    assert switch_delays(times, np.zeros(60), truth).tolist() == [np.inf]
    # an arm that was hardly passive before, or is active for a moment only, has not switched
    for some in (times >= 0.2, (times >= 2.0) & (times < 2.3)):
        assert not len(switch_delays(times, np.zeros(60), some.astype(int)))


def test_figures_and_tables_of_all_sections_are_written(
    trained: tuple[Path, Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    data, out = trained
    recording = tmp_path / "person.npz"
    made = motion(0.05)
    np.savez(recording, time=made.time, joint_position=made.joints)
    told = tmp_path / "told.json"
    page = tmp_path / "page.md"
    page.write_text("before\n<!-- bench prediction -->\n<!-- end -->\nafter\n")
    words = ["--data", str(data), "--weights", str(out), "--recordings", str(recording)]
    words += ["--only", "held_out,intent,hidden,recordings,speed", "--json", str(told)]
    assert main([*words, "--into", str(page)]) == 0
    kept = json.loads(told.read_text())
    names = [figure["name"] for figure in kept["figures"]]
    assert "mean error over 2 s below ridge by" in names
    assert "one call, both arms, median" in names
    assert len(names) == len(set(names))
    assert {"machine", "version", "seeds", "tables"} <= set(kept)
    assert "Recordings of people" in page.read_text()
    assert "note: person.npz: unit m" in capsys.readouterr().out


def test_persons_are_predicted_by_what_learned_from_others(
    trained: tuple[Path, Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    data, out = trained
    files = []
    for name, speed in (("a", 0.05), ("b", 0.1), ("c", 0.15)):
        made = motion(speed)
        (tmp_path / name).mkdir()
        files.append(tmp_path / name / "walk.npz")
        np.savez(files[-1], time=2.0 * made.time, joint_position=made.joints)
    words = ["--data", str(data), "--weights", str(out), "--only", "persons", "--steps", "2"]
    told = tmp_path / "told.json"
    assert main([*words, "--recordings", *map(str, files), "--json", str(told)]) == 0
    kept = json.loads(told.read_text())
    asked = {figure["name"]: figure["asked"] for figure in kept["figures"]}
    assert asked == {
        "trained on other persons, below ridge by": 15,
        "trained on other persons, below ridge of the same recordings by": 15,
    }
    assert capsys.readouterr().out.count("learns from 2 recordings") == 3
    with pytest.raises(UserError, match="are in 1 folders, expected 3 or more"):
        main([*words, "--recordings", str(files[0])])


def test_sleeves_that_are_not_shown_change_the_predictions_of_persons_in_them(
    trained: tuple[Path, Path], tmp_path: Path
) -> None:
    data, out = trained
    told = tmp_path / "told.json"
    words = ["--data", str(data), "--only", "sleeves", "--sleeveless", str(out)]
    assert main([*words, "--json", str(told)]) == 0
    kept = json.loads(told.read_text())
    found = {figure["name"]: figure for figure in kept["figures"]}
    not_seen = found["passive, sleeves not seen: error higher by"]
    assert not_seen["value"] != 0.0
    assert not_seen["asked"] == 20.0
    assert found["active, sleeves not seen: error higher by"]["asked"] is None
    # the weights of the fixture have hardly learned
    assert found["passive, sleeves never seen in training: error higher by"]["value"] > 20.0
    (table,) = kept["tables"]
    assert [row[0] for row in table["rows"]][:2] == [
        "passive, sleeves seen",
        "passive, sleeves not seen",
    ]


def test_folders_are_dealt_out_by_their_duration() -> None:
    paths = [Path(f"/rec/{name}.npz") for name in ("a/1", "a/2", "b/1", "c/1", "d/1")]
    assert folds(paths, [5.0, 5.0, 8.0, 2.0, 1.0]) == [[0, 1], [2], [3, 4]]


def test_sections_that_need_data_ask_for_it(
    trained: tuple[Path, Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    with pytest.raises(UserError, match=r"--data: is missing, intent needs a set of motion"):
        main(["--weights", str(trained[1]), "--only", "intent"])


def test_interrupted_training_says_how_to_go_on_and_other_data_are_refused(
    trained: tuple[Path, Path], tmp_path: Path
) -> None:
    with pytest.raises(UserError, match=r"motion.json: no such file"):
        train_command("intent", TrainOptions(tmp_path, tmp_path / "out"))
    with pytest.raises(UserError, match=r"intent.safetensors: no such file"):
        train_command("motion", TrainOptions(trained[0], tmp_path / "out"))
    figures = json.loads((trained[1] / "figures.json").read_text())
    assert set(figures) == {"intent", "motion"}
    assert figures["intent"]["command"].startswith("drake-dress train intent --seed 0 --steps ")
    assert "drake-dress dataset motion" in figures["motion"]["data"]


def test_hidden_hand_of_a_person_who_moves_as_a_whole_is_filled_in(
    trained: tuple[Path, Path],
) -> None:
    predictor = LearnedPredictor(networks(trained[1]))
    found = list(hidden_errors([motion(0.2), motion(0.2)], predictor, HAND, 1.0, 0.0))
    assert len(found) == 2
    for one in found:
        assert one.held == pytest.approx(0.2, abs=1e-6)
        # the arm goes along with the shoulder, whatever a hardly trained network adds
        assert one.filled < 0.1


def test_sums_are_those_of_the_comparisons(trained: tuple[Path, Path]) -> None:
    weights = networks(trained[1])
    predictor, baselines = (
        LearnedPredictor(weights),
        plain_baselines(RidgePredictor(weights.linear)),
    )
    compared: list[Compared] = list(followed(motion(), predictor, baselines))
    told = Told()
    told.add(compared)
    assert told.count == len(compared)
    assert len(told.covered) == 2 * len(compared)
    # 0.1 m/s over 2 s: a person who is taken to stand is missed by 10.5 cm on average
    assert told.mean("still") == pytest.approx(0.105, abs=1e-3)
    assert told.mean("constant velocity") < 1e-6
    assert np.isnan(told.area)
    assert not len(delays_of(compared))


def test_sequences_are_like_themselves_and_faster_sleeves_are_told(
    trained: tuple[Path, Path],
) -> None:
    data = read_motion(trained[0], ("passive", "active"), "training")
    sleeve = data.sleeve.copy()
    sleeve[..., :3] += 5.0 * (sleeve[..., :3] - sleeve[:, :1, :, :3])
    shares = {}
    for name, other in (
        ("same", data),
        ("fast", SimpleNamespace(**vars(data) | {"sleeve": sleeve})),
    ):
        _, figures = likeness(data, [other], 0.0)
        shares[name] = {figure.name: float(figure.value) for figure in figures}
    speed, place = "dressings outside, armhole, speed", "dressings outside, upper arm"
    assert max(shares["same"].values()) < 2.5
    assert shares["fast"][speed] > 20.0
    assert shares["fast"][place] == shares["same"][place]
