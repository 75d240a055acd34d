"""Prediction error of the controller's garment, by time step, iterations and mesh.

    python -m benchmarks.garment_prediction out/dummy_standing-seed0/run.h5

From several times of a run, the controller's garment is simulated with the recorded motion of the
grippers and the person, so that the remaining error is the garment model's own. After 1, 2 and 3 s
the centre and direction of both armholes are compared with the plant's. Cost is the computing time
per predicted second, for the rollout alone and with the gradient with respect to the grippers. The
first row is a baseline in which each armhole moves with its gripper.
"""

from __future__ import annotations

import argparse
import itertools
import json
import sys
import time
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
import scipy.sparse as sp

from benchmarks.cloth.table import Table
from benchmarks.logged import logged_scenario
from benchmarks.parser import output_file
from drake_dress.diagrams.garment import build_garment
from drake_dress.diagrams.scenario import Scenario
from drake_dress.diagrams.sections.person import measures, posture
from drake_dress.errors import UserError
from drake_dress.file_output import write_text
from drake_dress.models.arrays import FloatArray
from drake_dress.models.cloth.elements import make_elements
from drake_dress.models.cloth.explicit.explicit_bias import ExplicitBiasCloth, ExplicitSettings
from drake_dress.models.cloth.material import Material
from drake_dress.models.control.person_model import PersonModel, person_obstacles
from drake_dress.models.dressing.sleeve import SleeveState, loop_orientation, sleeve_state
from drake_dress.models.garment.mesh import GarmentMesh
from drake_dress.models.garment.transfer import barycentric_transfer
from drake_dress.models.human.body import body_capsules, shoulder_joint
from drake_dress.models.sides import SIDES
from drake_dress.report.log import RunLog

AFTER = (1.0, 2.0, 3.0)
# Half width of the central difference for the garment's velocity, s.
SEEN = 1.0 / 30.0
_GRIPPERS = "as the grippers"


@dataclass(frozen=True)
class Variant:
    """A garment model that predicts: time step, s, inner iterations, mesh spacing, m."""

    time_step: float
    iterations: int
    spacing: float

    @property
    def name(self) -> str:
        """Name for tables."""
        return f"h = {self.time_step:g} s, {self.iterations} it., {100 * self.spacing:.1f} cm"


@dataclass(frozen=True)
class Foresight:
    """Errors of a variant (moments · 2, 3) after 1, 2, 3 s; time per predicted second, s."""

    name: str
    position: list[list[float]]
    direction: list[list[float]]
    forward: float
    gradient: float


@dataclass(frozen=True)
class Run:
    """A run to predict.

    Attributes:
        scenario: The resolved scenario. mesh: The plant's garment. path: Path of the log.
        moments: (k,) start times of the predictions, s.
        person: The controller's model of the person.
    """

    scenario: Scenario
    mesh: GarmentMesh
    path: Path
    moments: FloatArray
    person: PersonModel


def main(arguments: Sequence[str] | None = None) -> int:
    """Predicts the runs with each variant and prints a table; returns the exit status."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("log", type=Path, nargs="+", metavar="run.h5")
    parser.add_argument("--steps", type=_numbers, default=[0.05, 0.1, 0.2, 0.5, 1.0], metavar="S,…")
    parser.add_argument("--iterations", type=_numbers, default=[1, 4, 8, 16], metavar="N,…")
    parser.add_argument("--spacings", type=_numbers, default=[0.028, 0.04], metavar="M,…")
    parser.add_argument("--moments", type=int, default=12, help="of each run")
    parser.add_argument("--json", type=output_file, metavar="FILE")
    options = parser.parse_args(arguments)
    variants = [
        Variant(h, int(n), d)
        for d, h, n in itertools.product(options.spacings, options.steps, options.iterations)
    ]
    try:
        runs = [read_run(path, options.moments) for path in options.log]
    except UserError as error:
        print(f"prediction: {error}", file=sys.stderr)
        return 2
    found = []
    for result in _foresee_all(runs, variants):
        found.append(result)
        print(f"{len(found)}/{len(variants) + 1} {result.name}", file=sys.stderr, flush=True)
    print(table(found).text())
    if options.json:
        write_text(options.json, json.dumps([asdict(f) for f in found], indent=1) + "\n")
    return 0


def table(found: Sequence[Foresight]) -> Table:
    """Returns medians over start times and sleeves, and the computing times."""
    rows = []
    for f in found:
        p, d = np.median(f.position, axis=0), np.median(f.direction, axis=0)
        rows.append([f.name, *(1e3 * p), *d, 1e3 * f.forward or None, 1e3 * f.gradient or None])
    header = [f"{what} after {t:g} s" for what in ("mm", "°") for t in AFTER]
    return Table("Foresight", ["", *header, "forward, ms/s", "with gradient, ms/s"], rows)


def _numbers(text: str) -> list[float]:
    try:
        values = [float(word) for word in text.split(",")]
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} are no numbers such as 0.1,0.2") from None
    if any(not v > 0.0 for v in values):
        raise argparse.ArgumentTypeError(f"{text} must be above 0")
    return values


def read_run(path: Path, count: int) -> Run:
    """Returns the run of a log, with `count` start times that leave 3 s to predict."""
    with RunLog.open(path) as log:
        scenario = logged_scenario(log)
        mesh = build_garment(scenario.garment, scenario.plant.spacing, path.parent)
        if len(mesh.rest_position) != len(log.rest_position):
            raise UserError(str(path), "garment", "is another than this version makes of it")
        last = log.time[-1] - AFTER[-1] - 0.1
        if last <= 0.5:
            raise UserError(
                str(path), "time", f"ends at {log.time[-1]:.1f} s, expected 4 s or more"
            )
    m = measures(scenario.person)
    pose = posture(scenario.person)
    person = PersonModel(
        body_capsules(m, pose),
        np.stack([shoulder_joint(m, pose, side) for side in SIDES]),
        (m.upper_arm_radius, m.forearm_radius, m.hand_radius),
    )
    return Run(scenario, mesh, path, np.linspace(0.5, last, count), person)


def _foresee_all(runs: Sequence[Run], variants: Sequence[Variant]) -> Iterator[Foresight]:
    yield _foresee(runs, None)
    for variant in variants:
        yield _foresee(runs, variant)


def _foresee(runs: Sequence[Run], variant: Variant | None) -> Foresight:
    position, direction, forward, gradient = [], [], [], []
    for run in runs:
        spacing = 0.04 if variant is None else variant.spacing
        belief = build_garment(run.scenario.garment, spacing, run.path.parent)
        seen = barycentric_transfer(run.mesh, belief)
        cloth = None if variant is None else _cloth(run, belief, variant)
        with RunLog.open(run.path) as log:
            for moment in run.moments:
                lab = Moment(run, belief, seen, log, float(moment))
                if cloth is None or variant is None:
                    foreseen = lab.with_grippers()
                else:
                    foreseen, spent = lab.with_garment(cloth, variant.time_step)
                    forward.append(spent[0])
                    gradient.append(spent[1])
                for side in (0, 1):
                    errors = [
                        _errors(lab.sleeve(x, side), lab.sleeve(lab.plant(after), side))
                        for x, after in zip(foreseen, AFTER, strict=True)
                    ]
                    position.append([e[0] for e in errors])
                    direction.append([e[1] for e in errors])
    return Foresight(
        _GRIPPERS if variant is None else variant.name,
        position,
        direction,
        float(np.median(forward)) if forward else 0.0,
        float(np.median(gradient)) if gradient else 0.0,
    )


def _cloth(run: Run, belief: GarmentMesh, variant: Variant) -> ExplicitBiasCloth:
    return ExplicitBiasCloth(
        make_elements(belief.rest_position, belief.faces),
        Material(**vars(run.scenario.controller.material)),
        variant.time_step,
        belief.held,
        settings=ExplicitSettings(tolerance=1e-2, iterations=variant.iterations),
    )


def _errors(a: SleeveState, b: SleeveState) -> tuple[float, float]:
    """Returns the distance of two sleeves' centres, m, and the angle between sleeves, °."""
    angle = np.degrees(np.arccos(np.clip(a.v_c @ b.v_c, -1.0, 1.0)))
    return float(np.linalg.norm(a.p_c - b.p_c)), float(angle)


class Moment:
    """One start time: the recorded run around it, mapped to the controller's mesh."""

    def __init__(
        self, run: Run, belief: GarmentMesh, seen: sp.csr_array, log: RunLog, time: float
    ) -> None:
        self._run, self._belief, self._seen, self._log = run, belief, seen, log
        self._time = time
        self._signs = [loop_orientation(belief, side) for side in SIDES]

    def plant(self, after: float) -> FloatArray:
        """Returns the plant's garment (m,3) at the controller's nodes, `after` s later, m."""
        t = self._log.time
        k = int(np.clip(np.searchsorted(t, self._time + after), 1, len(t) - 1))
        share = (self._time + after - t[k - 1]) / (t[k] - t[k - 1])
        x = (1.0 - share) * self._log.garment_position(k - 1) + share * self._log.garment_position(
            k
        )
        found: FloatArray = np.asarray(self._seen @ x)
        return found

    def velocity(self) -> FloatArray:
        """Returns the plant garment's velocity (m,3) at the controller's nodes, m/s."""
        found: FloatArray = (self.plant(SEEN) - self.plant(-SEEN)) / (2.0 * SEEN)
        return found

    def motion(self, after: FloatArray) -> FloatArray:
        """Returns the displacement (k - 1,held,3) of the held nodes between k times, m."""
        counts = [len(self._belief.grasp[side]) for side in SIDES]
        return np.repeat(np.diff(self.grippers(after), axis=0), counts, axis=1)

    def sleeve(self, x: FloatArray, side: int) -> SleeveState:
        """Returns the state of a sleeve of the garment at `x`."""
        return sleeve_state(x, self._belief.loops[f"{SIDES[side]}_armhole"], self._signs[side])

    def grippers(self, after: FloatArray) -> FloatArray:
        """Returns the recorded positions (k,2,3) of the grippers, m."""
        t = self._log.time
        return np.stack(
            [
                np.stack(
                    [
                        np.interp(self._time + after, t, self._log.gripper_position[side][:, c])
                        for c in range(3)
                    ],
                    axis=1,
                )
                for side in SIDES
            ],
            axis=1,
        )

    def joints(self, after: FloatArray) -> FloatArray:
        """Returns the recorded positions (k,6,3) of the person's joints, m."""
        t, q = self._log.time, self._log.joint_position
        flat = q.reshape(len(t), 18)
        found = [np.interp(self._time + after, t, flat[:, c]) for c in range(18)]
        return np.stack(found, axis=1).reshape(-1, 6, 3)

    def with_grippers(self) -> list[FloatArray]:
        """Returns the garment with each armhole displaced like its gripper."""
        way = self.grippers(np.array([0.0, *AFTER]))
        found = []
        for now in way[1:]:
            x = self.plant(0.0)
            for i, side in enumerate(SIDES):
                x[self._belief.loops[f"{side}_armhole"]] += now[i] - way[0, i]
            found.append(x)
        return found

    def with_garment(
        self, cloth: ExplicitBiasCloth, h: float
    ) -> tuple[list[FloatArray], tuple[float, float]]:
        """Returns the predicted garment, and the time per predicted second, also with gradient."""
        steps = round(AFTER[-1] / h)
        at = h * np.arange(steps + 1, dtype=float)
        obstacles = person_obstacles(self._run.person, self.joints(at), h)
        motion = self.motion(at)
        x, v = self.plant(0.0), self.velocity()
        foreseen, tapes = [], []
        begin = time.perf_counter()
        for j in range(steps):
            x, v, _, tape = cloth.step(x, v, motion[j], obstacles[j])
            tapes.append(tape)
            if any(abs(at[j + 1] - after) < 1e-9 for after in AFTER):
                foreseen.append(x)
        spent = time.perf_counter() - begin
        x_bar, v_bar = np.ones_like(x), np.zeros_like(v)
        held = np.zeros((len(cloth.held), 3))
        for tape in reversed(tapes):
            back = cloth.vector_jacobian_product(tape, x_bar, v_bar, held)
            x_bar, v_bar = back.x, back.v
        both = time.perf_counter() - begin
        return foreseen, (spent / AFTER[-1], both / AFTER[-1])


if __name__ == "__main__":
    sys.exit(main())
