"""Tests whether the gradient of a plan is a descent direction, at several times of runs.

    python -m benchmarks.plan_gradient out/dummy_standing-seed0/run.h5

At each time, central differences of the global controller's cost are computed with 1 cm/s in each
velocity, a typical change of a plan. The exact gradient and the one with frozen contact are
compared with them, by step of the plan: cosine and ratio of norms. Then a plan is made with each
gradient, starting from the recorded gripper motion; the table gives the relative cost reduction.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.cloth.table import Table
from benchmarks.logged import logged_policy
from drake_dress.errors import UserError
from drake_dress.models.arrays import FloatArray
from drake_dress.models.cloth.contact.obstacles import Obstacles
from drake_dress.models.control.global_mpc import GlobalController
from drake_dress.models.control.person_model import person_obstacles
from drake_dress.models.control.policy import DressingPolicy
from drake_dress.models.control.situation import Situation, SleeveTarget
from drake_dress.models.dressing.stages import Stage, StageState
from drake_dress.models.human.heading import heading
from drake_dress.models.sides import SIDES
from drake_dress.report.log import RunLog

# Half width of the central differences, m/s.
_REACH = 0.01
_KINDS = {"exact": False, "contact frozen": True}


@dataclass(frozen=True)
class Moment:
    """Inputs of a plan.

    Garment (n,3), its velocity, targets, person, initial plan (N,2,3), the person's left (N,3).
    """

    x: FloatArray
    v: FloatArray
    targets: tuple[SleeveTarget, SleeveTarget]
    person: list[Obstacles]
    start: FloatArray
    leftward: FloatArray


@dataclass(frozen=True)
class Found:
    """Results at one time: nodes in contact; cosines (N,), ratios (N,), descent by gradient."""

    touching: int
    cosine: dict[str, FloatArray]
    ratio: dict[str, FloatArray]
    descent: dict[str, float]


def main(arguments: Sequence[str] | None = None) -> int:
    """Evaluates the runs and prints the tables; returns the exit status."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("log", type=Path, nargs="+", metavar="run.h5")
    parser.add_argument("--moments", type=int, default=20, help="of each run")
    parser.add_argument("--at", type=float, metavar="S", help="this moment alone")
    parser.add_argument("--save", type=Path, metavar="FILE.npz", help="keep the moment, for tests")
    options = parser.parse_args(arguments)
    found: list[Found] = []
    try:
        for path in options.log:
            with RunLog.open(path) as log:
                _, policy = logged_policy(log)
                times = np.linspace(2.0, log.time[-1] - 1.5, options.moments)
                for time in times if options.at is None else [options.at]:
                    moment = _moment(policy, log, time)
                    if options.save:
                        _save(options.save, policy, moment)
                    found.append(_held_against(policy.controller, moment))
                    print(f"{path} {time:.1f} s", file=sys.stderr, flush=True)
    except UserError as error:
        print(f"plan_gradient: {error}", file=sys.stderr)
        return 2
    for few, title in ((True, "Fewer than 10 nodes in contact"), (False, "10 nodes or more")):
        of = [f for f in found if (f.touching < 10) == few]
        if of:
            print(_table(f"{title}: {len(of)} moments", of).text(), end="\n\n")
    return 0


def _moment(policy: DressingPolicy, log: RunLog, time: float) -> Moment:
    p, at = policy.parameters, log.time
    k = int(np.searchsorted(at, time))
    seen = log.file["/estimate/garment/position"]
    x = np.asarray(seen[k], dtype=np.float64)
    v = (np.asarray(seen[k + 1], dtype=np.float64) - seen[k - 1]) / (at[k + 1] - at[k - 1])
    joints = np.asarray(log.file["/estimate/human/joint_position"][k], dtype=np.float64)
    ahead = np.tile(joints, (p.horizon + 1, 1, 1))
    stage = (Stage(log.stage[k][0]), Stage(log.stage[k][1]))
    first = 0 if stage[0] > stage[1] else 1
    stages = StageState(stage=stage, first=first, since=(time, time))
    _, assignment = policy.planner.assign(stages, x, joints, time)
    targets = policy.planner.targets(assignment, policy.planner.sleeves(x), ahead, p.time_step)
    ends = time + p.time_step * np.arange(p.horizon + 1)
    way = np.stack(
        [
            np.stack([np.interp(ends, at, log.gripper_position[s][:, c]) for c in range(3)], axis=1)
            for s in SIDES
        ],
        axis=1,
    )
    start = np.diff(way, axis=0) / p.time_step
    # steps that were not planned yet repeat the first step after the committed ones
    start[p.committed_steps + 1 :] = start[p.committed_steps]
    speed = np.linalg.norm(start, axis=2, keepdims=True)
    start *= np.minimum(1.0, p.max_speed / np.maximum(speed, 1e-12))
    leftward = np.tile(heading(joints).leftward, (p.horizon, 1))
    return Moment(
        x, v, targets, list(person_obstacles(policy.person, ahead, p.time_step)), start, leftward
    )


def _save(path: Path, policy: DressingPolicy, m: Moment) -> None:
    mesh, body = policy.mesh, m.person[0]
    arrays: dict[str, Any] = {f"loop_{name}": nodes for name, nodes in mesh.loops.items()}
    arrays |= {f"grasp_{name}": nodes for name, nodes in mesh.grasp.items()}
    for side, target in zip(SIDES, m.targets, strict=True):
        arrays[f"target_{side}"] = np.hstack([target.position, target.direction])
        arrays[f"weights_{side}"] = [
            target.position_weight,
            target.direction_weight,
            target.entering,
        ]
    np.savez_compressed(
        path,
        rest_position=mesh.rest_position.astype(np.float32),
        faces=mesh.faces.astype(np.int16),
        region=mesh.region,
        x=m.x.astype(np.float32),
        v=m.v.astype(np.float32),
        start=m.start,
        a=body.a,
        b=body.b,
        radius=body.radius,
        **arrays,
    )


def _held_against(controller: GlobalController, m: Moment) -> Found:
    situation = Situation(m.x, m.v, m.targets, m.person, m.leftward)

    def cost(velocity: FloatArray) -> float:
        return controller._rollout(situation, velocity).cost

    slope = np.empty_like(m.start)
    for index in np.ndindex(slope.shape):
        step = np.zeros_like(slope)
        step[index] = _REACH
        slope[index] = (cost(m.start + step) - cost(m.start - step)) / (2.0 * _REACH)
    rollout = controller._rollout(situation, m.start)
    cosine, ratio, descent = {}, {}, {}
    for name, frozen in _KINDS.items():
        controller.frozen_contact = frozen
        gradient = controller._gradient(rollout, m.start)
        size, wanted = (np.linalg.norm(g, axis=(1, 2)) for g in (gradient, slope))
        cosine[name] = np.sum(gradient * slope, axis=(1, 2)) / np.maximum(size * wanted, 1e-300)
        ratio[name] = size / np.maximum(wanted, 1e-300)
        plan = controller.solve(situation, m.start, 1)
        descent[name] = 1.0 - plan.cost / plan.initial_cost
    touching = max(len(tape.contacts.nodes) for tape in rollout.tapes)
    return Found(touching, cosine, ratio, descent)


def _table(title: str, found: Sequence[Found]) -> Table:
    steps = len(found[0].cosine["exact"])
    header = [""]
    header += [f"cosine, step {j + 1}" for j in range(steps)]
    header += [f"ratio, step {j + 1}" for j in range(steps)]
    header += ["taken away, %", "nothing taken away, %"]
    rows = []
    for name in _KINDS:
        taken = np.array([f.descent[name] for f in found])
        rows.append(
            [
                name,
                *np.median([f.cosine[name] for f in found], axis=0).tolist(),
                *np.median([f.ratio[name] for f in found], axis=0).tolist(),
                float(100.0 * np.mean(taken)),
                float(100.0 * np.mean(taken < 1e-3)),
            ]
        )
    return Table(title, header, rows)


if __name__ == "__main__":
    sys.exit(main())
