"""Whole dressings by the simulator, as sequences to test on: nothing is trained on them."""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, Literal

import numpy as np

from drake_dress import __version__
from drake_dress.cluster import completed_on
from drake_dress.diagrams.scenario import load_scenario
from drake_dress.diagrams.scenario.drawn_coat import own_size
from drake_dress.errors import FailedError
from drake_dress.file_output import RUN_FILES
from drake_dress.interrupt import Interrupt
from drake_dress.learning.motion.dataset import DRESSING
from drake_dress.learning.motion.making import COMMAND, Workplace
from drake_dress.learning.motion.motion_file import MotionArrays, MotionFile, Origin
from drake_dress.learning.motion.sequence import PERIOD, is_moving
from drake_dress.learning.motion.sequence import Sequence as MotionSequence
from drake_dress.models.arrays import FloatArray, IndexArray
from drake_dress.models.dressing.linking import arm_linking_number, torso_interior
from drake_dress.models.dressing.sleeve import loop_orientation, sleeve_state
from drake_dress.models.human.active import ActiveParameters
from drake_dress.models.human.motions import Wave
from drake_dress.models.human.skin.drawing import draw_phenotype
from drake_dress.models.human.skin.measures import skin_measures
from drake_dress.models.human.skin.phenotype import phenotype_skin
from drake_dress.models.sides import SIDES
from drake_dress.report.log import RunLog
from drake_dress.report.summary import read_summary
from drake_dress.seeds import drawn_seeds
from drake_dress.shipped import shipped_scenario
from drake_dress.side_by_side import completed

Person = Literal["passive_standing", "passive_sitting", "active"]
# The persons of every four runs, and the shipped scenario of each.
PERSONS: tuple[Person, ...] = ("passive_standing", "passive_sitting", "active", "active")
_SCENARIOS: dict[Person, str] = {
    "passive_standing": "passive_standing",
    "passive_sitting": "passive_sitting",
    "active": "active_standing",
}
_VARIED = "dummy_varied"  # the scenario whose variation of coat, body and pose is used
# Keep the draws of motions and bodies apart from those of a run's variation, which has the seed
# itself.
_OF_MOTIONS, _OF_BODY = 3, 4
# Motions of an active person, and how probable each but the first is.
_WITHIN, _PUSH = (0.2, 0.3), 0.05  # reach, m
_PROBABLE = 0.5
_TURN, _TURN_START, _TURN_TIME = (5.0, 30.0), (5.0, 25.0), (2.0, 5.0)  # degrees, s, s
_START = 3.0, 25.0  # withdrawal and wave, s
_WITHDRAW_TIME, _WITHDRAW = (1.5, 4.0), (0.05, 0.2)  # s, m
_WAVE_TIME, _AMPLITUDE, _FREQUENCY = (2.0, 4.0), (0.03, 0.1), (0.6, 1.5)  # s, m, Hz
_DIGITS = 3  # after the point, of drawn values; amplitudes are rounded down
_LOOK = 0.5  # s, period of checking for a signal that ends a run
_RATE = 1.0 / PERIOD  # Hz, of the log


@dataclass(frozen=True)
class Dressing:
    """A run of the simulator.

    Attributes:
        number: within the set.
        person: who is dressed.
        seed: of the run.
    """

    number: int
    person: Person
    seed: int

    @property
    def name(self) -> str:
        """Name of its file."""
        return f"dressing-{self.person}-{self.seed}.h5"

    @property
    def scenario(self) -> Path:
        """File of its scenario."""
        return shipped_scenario(_SCENARIOS[self.person])

    def settings(self) -> list[str]:
        """Returns the KEY=VALUE settings of its scenario."""
        varied = load_scenario(shipped_scenario(_VARIED)).variation
        settings = ["plant.fidelity=quick", f"log.rate={_RATE:g}", *_body_and_coat(self.seed)]
        settings += [f"variation.{name}={value}" for name, value in vars(varied).items()]
        if self.person == "active":
            settings.append(f"person.behaviour.motions={json.dumps(draw_motions(self.seed))}")
        return settings


def drawn_dressings(count: int, seed: int) -> list[Dressing]:
    """Returns the dressings of a set; a larger number of them begins with the smaller one.

    Their seeds are drawn among those for reporting.
    """
    persons = [PERSONS[n % len(PERSONS)] for n in range(count)]
    seeds = drawn_seeds("report", count, seed)
    return [Dressing(n, *each) for n, each in enumerate(zip(persons, seeds, strict=True))]


def _body_and_coat(seed: int) -> list[str]:
    """Returns the settings of a drawn adult and of a jacket in their size."""
    person = draw_phenotype(np.random.default_rng((seed, _OF_BODY)))
    chest, _, _ = skin_measures(phenotype_skin(person)).trunk.chest
    table = "women" if person.sex == "female" else "men"
    coat = {"preset": "jacket", "size_table": table, "size": own_size(table, chest)}
    body = {key: getattr(person, key) for key in ("sex", "age", "height", "weight")}
    return [f"garment.coat={json.dumps(coat)}", f"person.body={json.dumps(body)}"]


def draw_motions(seed: int) -> list[dict[str, dict[str, Any]]]:
    """Returns the motions of an active person, as the scenario key lists them.

    The person always reaches for the armholes. A turn, a withdrawal and a wave each occur in half
    of the runs. The amplitude of a wave is limited by the person's hand speed.
    """
    rng = np.random.default_rng((seed, _OF_MOTIONS))

    def drawn(low: float, high: float) -> float:
        return round(float(rng.uniform(low, high)), _DIGITS)

    def side() -> str:
        return str(rng.choice([*SIDES, "both"]))

    reach = {"side": "both", "within": drawn(*_WITHIN), "push": _PUSH}
    angle = drawn(*_TURN) * float(rng.choice([-1.0, 1.0]))
    others: dict[str, dict[str, Any]] = {
        "turn": {"angle_deg": angle, "start": drawn(*_TURN_START), "duration": drawn(*_TURN_TIME)},
        "withdraw": {
            "side": side(),
            "start": drawn(*_START),
            "duration": drawn(*_WITHDRAW_TIME),
            "distance": drawn(*_WITHDRAW),
        },
        "wave": {
            "side": side(),
            "start": drawn(*_START),
            "duration": drawn(*_WAVE_TIME),
            "amplitude": drawn(*_AMPLITUDE),
            "frequency": drawn(*_FREQUENCY),
        },
    }
    wave = others["wave"]
    wave["amplitude"] = min(wave["amplitude"], _largest(wave["duration"], wave["frequency"]))
    does = rng.random(len(others)) < _PROBABLE
    chosen = zip(others.items(), does, strict=True)
    return [{"reach": reach}, *({name: keys} for (name, keys), it in chosen if it)]


def run_all(
    dressings: Sequence[Dressing], set_seed: int, place: Workplace, stop: Interrupt
) -> Iterator[tuple[Dressing, MotionFile]]:
    """Yields each dressing with its content as soon as it is done.

    Args:
        dressings: to be run.
        set_seed: seed of the set.
        place: where; each run takes one core.
        stop: once it is set, runs are ended and lost.

    Raises:
        UserError: There is no such cluster.
        FailedError: A run gave no result.
    """
    if place.ray is not None:
        on_node = partial(_run_on_node, set_seed=set_seed)
        runs = completed_on(place.ray, on_node, dressings, stop, command=COMMAND)
    else:
        here = partial(_run_here, set_seed=set_seed, stop=stop)
        runs = completed(here, dressings, place.jobs, stop)
    for dressing, content in runs:
        if content is not None:
            yield dressing, content


def run_dressing(
    dressing: Dressing, folder: Path, set_seed: int, stop: Interrupt | None = None
) -> MotionFile | None:
    """Executes a run in another process; returns its content, or None if `stop` ended it.

    Args:
        dressing: to be run.
        folder: for the files of the run.
        set_seed: seed of the set.
        stop: ends the run once it is set.

    Raises:
        FailedError: The run gave no result.
    """
    command = [sys.executable, "-m", "drake_dress", "run", str(dressing.scenario)]
    command += ["--no-meshcat", "--no-report", "--one-process"]
    command += ["--out", str(folder), "--seed", str(dressing.seed)]
    for setting in dressing.settings():
        command += ["--set", setting]
    status, errors = _executed(command, stop)
    if stop is not None and stop.is_set():
        return None
    if status not in (0, 1):
        last = (errors.strip().splitlines() or ["no message"])[-1]
        raise FailedError(f"{dressing.name}: the run ended with status {status}: {last}")
    with RunLog.open(folder / RUN_FILES[0]) as log:
        data = MotionArrays.of([sequence_of(log)])
        scenario = log.scenario_text
    summary = read_summary(folder / RUN_FILES[1])
    notes = {
        "person": dressing.person,
        "run_seed": dressing.seed,
        "dressed": bool(summary["success"]),
        "reason": summary["reason"] or "",
        "scenario": scenario,
    }
    return MotionFile(Origin(DRESSING, set_seed, dressing.number, __version__), data, notes)


def sequence_of(log: RunLog) -> MotionSequence:
    """Returns the motion in a log that has the rate of sequences.

    Raises:
        FailedError: The log has no samples, or another rate.
    """
    if not len(log) or not np.allclose(log.time, PERIOD * np.arange(len(log))):
        message = (
            f"{len(log)} samples that are not {PERIOD} s apart, expected a log at {_RATE:g} Hz"
        )
        raise FailedError(f"{log.path}: {message}")
    sleeves, on = _sleeves(log)
    intent = np.zeros((len(log), 2), dtype=np.int64) if log.intent is None else log.intent
    intent = np.where(is_moving(log.joint_position[:, [2, 5]]), intent, 0)
    return MotionSequence(log.joint_position, sleeves, intent, on)


def _sleeves(log: RunLog) -> tuple[FloatArray, IndexArray]:
    """Returns centre, m, and direction (T,2,6) of the garment's armholes, and which arms are in.

    A garment that is not finite has no sleeves: NaN, and no arm is in.
    """
    count = len(log)
    sleeves, on = np.full((count, 2, 6), np.nan), np.zeros((count, 2), dtype=np.int64)
    loops = [log.loops[f"{side}_armhole"] for side in SIDES]
    signs = [loop_orientation(log, side) for side in SIDES]
    for k in range(count):
        x, joints = log.garment_position(k), log.joint_position[k]
        if not np.isfinite(x).all():
            continue
        interior = torso_interior(joints[0], joints[3])
        for i, (loop, sign) in enumerate(zip(loops, signs, strict=True)):
            state = sleeve_state(x, loop, sign)
            sleeves[k, i] = [*state.p_c, *state.v_c]
            shoulder, elbow, hand = joints[3 * i : 3 * i + 3]
            on[k, i] = abs(arm_linking_number(x[loop], shoulder, elbow, hand, interior)) == 1
    return sleeves, on


def _largest(duration: float, frequency: float) -> float:
    """Returns the largest amplitude, m, of a wave that keeps the person's hand speed."""
    fastest = Wave(duration=duration, amplitude=1.0, frequency=frequency).speed
    scale = 10.0**_DIGITS
    return float(np.floor(scale * ActiveParameters.max_hand_speed / fastest) / scale)


def _executed(command: Sequence[str], stop: Interrupt | None) -> tuple[int, str]:
    """Returns status and messages of a command, which is ended once `stop` is set."""
    with subprocess.Popen(
        command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True
    ) as process:
        while True:
            try:
                _, errors = process.communicate(timeout=_LOOK)
                return process.returncode, errors
            except subprocess.TimeoutExpired:
                if stop is not None and stop.is_set():
                    process.terminate()


def _run_here(dressing: Dressing, set_seed: int, stop: Interrupt) -> MotionFile | None:
    with tempfile.TemporaryDirectory() as place:
        return run_dressing(dressing, Path(place), set_seed, stop)


def _run_on_node(dressing: Dressing, folder: Path, set_seed: int) -> MotionFile | None:
    return run_dressing(dressing, folder, set_seed)
