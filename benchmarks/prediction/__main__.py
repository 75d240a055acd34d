"""Measures how well intent and motion of a person are predicted, beside simple predictors.

    drake-dress dataset motion --out out/motion --dressings 40
    drake-dress bench prediction --data out/motion --into docs/prediction.md
    drake-dress bench prediction --recordings recordings/*.csv reach.npz:up=y,rate=30
    drake-dress bench prediction --data out/motion --only sleeves --sleeveless out/sleeveless
    drake-dress bench prediction --data out/motion --recordings persons/*/*.csv --only persons

Held-out sequences are those of the set that nothing was trained on; whole dressings come from the
simulator of garment and person. Recordings are files of joint positions of people, see the section
"Your own recordings" of the documentation. All errors are means over shoulder, elbow and hand of an
arm and over the steps of the horizon.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable, Iterable, Sequence
from functools import partial
from pathlib import Path

import numpy as np

from benchmarks.cloth.table import Table
from benchmarks.figures import Figure, at_least, at_most, write_figures
from benchmarks.parser import (
    at_least_one,
    bench_parser,
    exit_with,
    number_between,
    output_file,
    some_of,
)
from benchmarks.prediction.hidden import ELBOW, HAND, hidden_errors, mean_errors
from benchmarks.prediction.likeness import likeness
from benchmarks.prediction.persons import OWN_RIDGE, SHIPPED_RIDGE, across_persons, folds, gain
from benchmarks.prediction.sleeves import told_by_sleeves, ways_to_see
from benchmarks.prediction.streams import Told, delays_of
from benchmarks.section import add_into_option, around, write_between
from drake_dress.errors import UserError
from drake_dress.learning.evaluation.baselines import mean_of, plain_baselines
from drake_dress.learning.evaluation.held_out import (
    HeldOut,
    begins,
    compared,
    goes_on,
    held_out_batches,
    intent_score,
    rests,
)
from drake_dress.learning.evaluation.stream import followed
from drake_dress.learning.motion.dataset import MotionData, read_dressings, read_motion
from drake_dress.learning.motion.sequence import KINDS, Kind
from drake_dress.learning.motion.sequence import PERIOD as SAMPLED
from drake_dress.learning.motion.windows import Batch, Sequences
from drake_dress.learning.recordings import Listed, RecordingOptions, listed, read_all
from drake_dress.learning.recordings.listed import FORM, RATES, UNITS
from drake_dress.learning.recordings.reading import UPS
from drake_dress.learning.timed_motion import TimedMotion
from drake_dress.learning.training.motion import MotionTraining
from drake_dress.models.arrays import BoolArray, FloatArray
from drake_dress.models.human.learned.forecast import PersonHistory
from drake_dress.models.human.learned.predictor import LearnedPredictor, Networks
from drake_dress.models.human.learned.recurrent import recurrent_motion
from drake_dress.models.human.learned.ridge import RidgePredictor
from drake_dress.models.human.learned.weights import (
    RECURRENT,
    SHIPPED,
    networks,
    recurrent_predictor,
)

_NAME = "prediction"
SECTIONS = (
    "held_out",
    "intent",
    "sleeves",
    "hidden",
    "dressings",
    "likeness",
    "recordings",
    "persons",
    "speed",
)
_NOISES = (0.004, 0.0)
_DRESSED: tuple[Kind, ...] = ("passive", "active")
_HIDDEN_SEQUENCES, _HIDDEN = 60, (1.0, 3.0)  # of each kind, s
_CALLS = 200
# Arms of active persons by what they will do: the first cannot be known.
_ACTING: dict[str, Callable[[Batch], BoolArray]] = {
    "begins a movement within 2 s": begins,
    "goes on with one": goes_on,
    "follows or rests": rests,
}
_SEEN_WITHIN = 0.5  # s


def main(arguments: Sequence[str] | None = None) -> int:
    """Measures and prints the tables; returns the exit status."""
    options = _parser().parse_args(arguments)
    if options.into is not None:
        around(options.into, _NAME)
    needs = {"held_out", "intent", "sleeves", "hidden", "dressings", "likeness", "persons"}
    only = options.only or [
        s
        for s in SECTIONS
        if (s in needs and s != "persons" and options.data)
        or (s == "recordings" and options.recordings)
        or s == "speed"
    ]
    for section in only:
        if section in needs and options.data is None:
            raise UserError("bench", "--data", f"is missing, {section} needs a set of motion")
    study = Study(networks(options.weights), options)
    tables: list[Table] = []
    figures: list[Figure] = []
    for section in only:
        made, told = getattr(study, section)()
        for table in made:
            print(f"\n{table.text()}", flush=True)
        tables += made
        figures += told
    if options.json is not None:
        rows = [{"title": t.title, "header": t.header, "rows": t.rows} for t in tables]
        write_figures(options.json, figures, [], tables=rows)
    if options.into is not None:
        write_between(options.into, _NAME, "\n\n".join(t.text() for t in tables))
    return 0


class Study:
    """The measurements, each a section of tables and figures.

    Args:
        weights: of the predictor.
        options: of the command line.
    """

    def __init__(self, weights: Networks, options: argparse.Namespace) -> None:
        self._networks, self._options = weights, options
        self._predictor = LearnedPredictor(weights)
        self._baselines = dict(plain_baselines(RidgePredictor(weights.linear)))
        self._more: dict[str, Callable[[Batch], FloatArray]] = {}
        if (options.weights / RECURRENT).is_file():
            recurrent = recurrent_predictor(options.weights)
            self._baselines["recurrent"] = mean_of(recurrent)
            self._more["recurrent"] = lambda b: recurrent_motion(recurrent.weights, b.arms.tokens)

    def held_out(self) -> tuple[list[Table], list[Figure]]:
        """Errors on held-out sequences."""
        rows, acting = [], []
        both: dict[float, list[HeldOut]] = {noise: [] for noise in _NOISES}
        kinds: tuple[Kind, ...] = (*_DRESSED, "free")
        for kind in kinds:
            for noise in _NOISES:
                batches = held_out_batches(self._data(kind), noise)
                windows = compared(batches, self._networks, self._more)
                found, name = windows.mean(), f"{kind}, {1e3 * noise:g} mm"
                if kind in _DRESSED:
                    both[noise].append(found)
                rows.append(_held_out_row(name, found))
                if (kind, noise) != ("active", _NOISES[0]):
                    continue
                for what, which in _ACTING.items():
                    chosen = np.concatenate([which(batch) for batch in batches])
                    acting.append(_held_out_row(f"{name}: {what}", windows.mean(chosen)))
        rows += acting
        for noise, found_of in both.items():
            rows.append(_held_out_row(f"both, {1e3 * noise:g} mm", _together(found_of)))
        figures = _held_out_figures(_together(both[_NOISES[0]]))
        names = list(_together(both[_NOISES[0]]).errors)
        header = ["mm after 1 s / 2 s", *names, "best of 20", "90 % region, %"]
        return [Table("Held-out sequences, by noise of the observed joints", header, rows)], figures

    def intent(self) -> tuple[list[Table], list[Figure]]:
        """Intent on held-out sequences."""
        data = self._data(*_DRESSED)
        batches = {noise: held_out_batches(data, noise) for noise in _NOISES}
        scores = {
            (n, noise): intent_score(windows, self._networks.intent, n)
            for noise, windows in batches.items()
            for n in (20, 10)
        }
        rows = [
            [
                f"after {n} steps, {1e3 * noise:g} mm",
                100 * s.accuracy,
                100 * s.balanced,
                s.area,
                s.count,
                100 * s.willed,
            ]
            for (n, noise), s in scores.items()
        ]
        header = [
            "intent",
            "right, %",
            "right, both alike, %",
            "area under the curve",
            "windows",
            "of them by will, %",
        ]
        figures = [
            at_least(f"intent after {n} steps, {which}", 100 * share, "%", asked)
            for n, asked in ((20, 97.0), (10, 92.0))
            for which, share in (
                ("all windows", scores[n, _NOISES[0]].accuracy),
                ("both intents alike", scores[n, _NOISES[0]].balanced),
            )
        ]
        return [Table("Intent on held-out sequences", header, rows)], figures

    def sleeves(self) -> tuple[list[Table], list[Figure]]:
        """What sleeves tell: held-out sequences with and without them."""
        without = self._options.sleeveless
        ways = ways_to_see(self._networks, None if without is None else networks(without))
        return told_by_sleeves({kind: self._data(kind) for kind in _DRESSED}, ways, _NOISES[0])

    def hidden(self) -> tuple[list[Table], list[Figure]]:
        """Hidden joints on held-out sequences."""
        rows: list[list[object]] = []
        figures = []
        motions = {kind: _motions(self._data(kind))[:_HIDDEN_SEQUENCES] for kind in _DRESSED}
        for joint, name in ((HAND, "hand"), (ELBOW, "elbow")):
            for duration, most in zip(_HIDDEN, (30.0, 40.0), strict=True):
                found = {
                    kind: list(hidden_errors(some, self._predictor, joint, duration, _NOISES[0]))
                    for kind, some in motions.items()
                }
                both = [hidden for some in found.values() for hidden in some]
                for kind, some in (*found.items(), ("both", both)):
                    filled, held = (1e3 * mean for mean in mean_errors(some))
                    what = f"{name}, {duration:g} s, {kind}"
                    rows.append([what, filled, held, filled / held, len(some)])
                what = f"{name} hidden for {duration:g} s"
                figures += [
                    at_most(what, filled, "mm", most),
                    at_most(f"{what}, over holding its place", filled / held, "1", 0.5),
                ]
        header = ["hidden", "filled in, mm", "held, mm", "ratio", "arms"]
        return [Table("Joints that are hidden", header, rows)], figures

    def dressings(self) -> tuple[list[Table], list[Figure]]:
        """Whole dressings, followed from beginning to end."""
        rows, everything, delays = [], Told(), []
        by_person: dict[str, Told] = {}
        for file in read_dressings(self._options.data):
            motion = _motions(file.data, file.notes["person"])[0]
            found = list(followed(motion, self._predictor, self._baselines))
            delays.append(delays_of(found))
            everything.add(found)
            by_person.setdefault(file.notes["person"], Told()).add(found)
            print(f"followed {file.notes['person']} {file.notes['run_seed']}", flush=True)
        for name, told in (*by_person.items(), ("all", everything)):
            rows += _told_rows(name, told)
        late = np.concatenate(delays)
        seen = float(np.mean(late <= _SEEN_WITHIN)) if len(late) else float("nan")
        median = float(np.median(late)) if len(late) else float("nan")
        figures = [
            at_least("area under the curve of intent, whole dressings", everything.area, "1", 0.97),
            at_most("a switch of intent is seen after, median", median, "s", _SEEN_WITHIN),
            Figure("switches of intent seen within 0.5 s", 100.0 * seen, "%"),
            _region("90 % region covers, whole dressings", everything.covered),
        ]
        text = (
            f"Whole dressings: area under the curve of intent {everything.area:.3f}; of "
            f"{len(late)} switches to active {100 * seen:.0f} % are seen within {_SEEN_WITHIN} s "
            f"(median {median:.2f} s)"
        )
        return [Table(text, self._header("person"), rows)], figures

    def likeness(self) -> tuple[list[Table], list[Figure]]:
        """What the networks see of whole dressings, beside held-out sequences."""
        dressings = [file.data for file in read_dressings(self._options.data)]
        table, figures = likeness(self._data(*_DRESSED), dressings, _NOISES[0])
        return [table], figures

    def recordings(self) -> tuple[list[Table], list[Figure]]:
        """Recordings of people."""
        rows, figures, everything = [], [], Told()
        for motion in read_all(self._recordings(), _note):
            told = Told()
            found = list(followed(motion, self._predictor, self._baselines))
            told.add(found)
            everything.add(found)
            rows += _told_rows(motion.name, told)
        rows += _told_rows("all", everything)
        for name in ("still", "constant velocity", "damped velocity"):
            ratio = everything.mean("learned", "moving") / everything.mean(name, "moving")
            figures.append(at_most(f"recordings, moving arms: over {name}", ratio, "1", 1.0))
        if everything.resting:
            ratio = everything.mean("learned", "resting") / everything.mean("still", "resting")
            figures.append(at_most("recordings, resting arms: over still", ratio, "1", 1.1))
        return [Table("Recordings of people", self._header("recording"), rows)], figures

    def persons(self) -> tuple[list[Table], list[Figure]]:
        """Recordings of some persons, predicted by what learned from others."""
        files = self._recordings()
        motions = read_all(files, _note)
        durations = [float(m.time[-1] - m.time[0]) for m in motions]
        parts = folds([file.path for file in files], durations)
        base = MotionTraining(
            read_motion(self._options.data, KINDS, "training"),
            {kind: read_motion(self._options.data, (kind,), "validation") for kind in KINDS},
            self._networks.intent,
        )
        say = partial(print, flush=True)
        found = across_persons(motions, parts, base, self._networks, self._options.steps, say)
        rows = [row for name, told in found.items() for row in _told_rows(name, told)]
        told = list(found.values())
        figures = [
            at_least(f"trained on other persons, below {name} by", 100 * gain(told, name), "%", 15)
            for name in (SHIPPED_RIDGE, OWN_RIDGE)
        ]
        header = _header("recording", told[0].first)
        return [Table("Recordings, learned from those of other persons", header, rows)], figures

    def speed(self) -> tuple[list[Table], list[Figure]]:
        """Time of one call."""
        rng = np.random.default_rng(0)
        predictor, memory, spent = self._predictor, self._predictor.begin(), []
        pose = np.array([[0, 0.18, 1.4], [0, 0.3, 1.15], [0.1, 0.35, 0.9]])
        pose = np.concatenate([pose, pose * [1.0, -1.0, 1.0]])
        path = np.cumsum(0.005 * rng.normal(size=(_CALLS + 20, 6, 3)), axis=0) + pose
        sleeves = np.concatenate([path[:, [2, 5]], np.tile([0.0, 0.0, 1.0], (len(path), 2, 1))], 2)
        for k in range(_CALLS):
            history = PersonHistory(0.1 * k, path[k : k + 20], sleeves[k : k + 20])
            begin = time.perf_counter()
            _, memory = predictor.forecast(history, memory)
            spent.append(1e3 * (time.perf_counter() - begin))
        median, p95 = float(np.median(spent)), float(np.quantile(spent, 0.95))
        table = Table("One call, both arms", ["", "ms"], [["median", median], ["95 %", p95]])
        return [table], [at_most("one call, both arms, median", median, "ms", 10.0)]

    def _recordings(self) -> list[Listed]:
        common = RecordingOptions(self._options.rate, self._options.up, self._options.unit)
        return [listed(text, common) for text in self._options.recordings]

    def _data(self, *kinds: Kind) -> MotionData:
        return read_motion(self._options.data, kinds, "test")

    def _header(self, what: str) -> list[str]:
        return _header(what, [*self._baselines, "learned"])


def _parser() -> argparse.ArgumentParser:
    parser = bench_parser(_NAME, __doc__)
    parser.add_argument(
        "--data", type=Path, metavar="DIR", help="set of drake-dress dataset motion"
    )
    parser.add_argument(
        "--recordings",
        nargs="+",
        default=[],
        metavar=FORM,
        help="of people; KEY: up, rate or unit of this file, else those that follow",
    )
    parser.add_argument("--rate", type=number_between(*RATES), metavar="HZ")
    parser.add_argument("--up", choices=UPS, help="axis of the recordings that points up")
    parser.add_argument("--unit", type=number_between(*UNITS), metavar="M", help="in metres")
    parser.add_argument(
        "--weights",
        type=Path,
        default=SHIPPED,
        metavar="DIR",
        help="of drake-dress train; default: those of the package",
    )
    parser.add_argument(
        "--sleeveless",
        type=Path,
        metavar="DIR",
        help="sleeves: weights of drake-dress train --no-sleeves, to be compared, too",
    )
    parser.add_argument(
        "--only", type=some_of(SECTIONS), metavar="NAME,…", help=", ".join(SECTIONS)
    )
    parser.add_argument(
        "--steps",
        type=at_least_one,
        metavar="N",
        help="persons: at most so many steps of each training; for a try",
    )
    parser.add_argument("--json", type=output_file, metavar="FILE")
    add_into_option(parser, _NAME)
    return parser


def _note(line: str) -> None:
    print(f"note: {line}", flush=True)


def _header(what: str, predictors: Iterable[str]) -> list[str]:
    return [what, "arms", *predictors, "best of 20", "90 % region, %", "linear, %"]


def _motions(data: Sequences, name: str = "sequence") -> list[TimedMotion]:
    """Returns sequences of a sample each `SAMPLED` s as motions over time."""
    stamps = SAMPLED * np.arange(data.joint_position.shape[1], dtype=np.float64)
    return [
        TimedMotion(
            f"{name} {k}",
            stamps,
            data.joint_position[k].astype(np.float64),
            data.sleeve[k].astype(np.float64),
            data.intent[k].astype(np.int64),
        )
        for k in range(len(data.joint_position))
    ]


def _together(found: Sequence[HeldOut]) -> HeldOut:
    """Returns the means over kinds, each counted alike."""
    mean: Callable[[list[float]], float] = lambda values: float(np.mean(values))  # noqa: E731
    first = found[0].errors
    return HeldOut(
        {n: {h: mean([f.errors[n][h] for f in found]) for h in first[n]} for n in first},
        mean([f.best for f in found]),
        mean([f.covered for f in found]),
        sum(f.count for f in found),
    )


def _held_out_row(name: str, found: HeldOut) -> list[object]:
    cells = [
        " / ".join(f"{1e3 * error:.1f}" for error in errors.values())
        for errors in found.errors.values()
    ]
    return [name, *cells, f"{1e3 * found.best:.1f}", f"{100 * found.covered:.1f}"]


def _held_out_figures(found: HeldOut) -> list[Figure]:
    figures = []
    for horizon in ("1 s", "2 s"):
        of = {name: errors[horizon] for name, errors in found.errors.items()}
        gain = 100.0 * (1.0 - of["learned"] / of["ridge"])
        figures.append(at_least(f"mean error over {horizon} below ridge by", gain, "%", 25.0))
        for name in ("last velocity", "constant velocity"):
            ratio = of["learned"] / of[name]
            figures.append(at_most(f"mean error over {horizon} over {name}", ratio, "1", 1.0 / 3.0))
    ratio = found.best / found.errors["learned"]["2 s"]
    figures.append(at_most("best of 20 over the mean's error", ratio, "1", 0.6))
    figures.append(_region("90 % region covers, held-out sequences", [found.covered]))
    return figures


def _region(name: str, covered: Sequence[float]) -> Figure:
    share = 100.0 * float(np.mean(covered)) if len(covered) else float("nan")
    return Figure(name, share, "%", 90.0, bool(87.0 <= share <= 93.0))


def _told_rows(name: str, told: Told) -> list[list[object]]:
    rows: list[list[object]] = []
    for which, part in (("moving", told.moving), ("resting", told.resting)):
        if not part:
            continue
        cells: list[object] = [f"{name}, {which}", len(part["learned"])]
        cells += [1e3 * told.mean(n, which) for n in part]
        rows.append([*cells, None, None, None])
    if rows:
        rows[0][-3:] = [
            1e3 * float(np.mean(told.best)),
            100.0 * float(np.mean(told.covered)),
            100.0 * told.linear / max(told.count, 1),
        ]
    return rows


if __name__ == "__main__":
    exit_with(main)
