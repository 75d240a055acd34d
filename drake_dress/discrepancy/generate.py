"""Data that hides an effect: what a lab would measure if the garment were not quite the model's.

The truth is another simulation: Projective Dynamics to convergence on a finer mesh with a smaller
step, other random draws, and a motion-capture system's noise and drop-outs on what it says.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from drake_dress.diagrams.scenario import Scenario
from drake_dress.discrepancy.hidden_effect import NOTHING, draw_hidden
from drake_dress.discrepancy.lab import Lab, Numerics
from drake_dress.discrepancy.motions import ARM_UP, MOTIONS, USUAL, Stage
from drake_dress.discrepancy.recording import Recording
from drake_dress.discrepancy.replay import Replayer
from drake_dress.discrepancy.workers import answers, submit
from drake_dress.errors import UserError
from drake_dress.machine import worker_count
from drake_dress.models.arrays import FloatArray, IntArray
from drake_dress.models.effects.composition import seen_points
from drake_dress.models.effects.effect import Effect
from drake_dress.models.garment.sampling import spread_out
from drake_dress.models.human.body import ArmPose
from drake_dress.worker_pool import WorkerPool

# How much finer the truth is simulated than the scenario.
_FINER, _SHORTER = 0.84, 0.5
# Where the garment hangs: free, before the person, and just before the limb, m.
_FREE_DISTANCE, _ABOVE_SHOULDERS, _BEFORE_LIMB, _ABOVE_LIMB = 0.8, 0.05, 0.25, 0.24
# Where along the arm it is drawn over, from shoulder (0) to hand (1).
_ON_ARM = 0.55
# Abduction of the arm that is held up: along a sleeve as it hangs, rad.
_RAISED = np.deg2rad(135.0)


@dataclass(frozen=True)
class Sensors:
    """What measures, SI units.

    Attributes:
        rate: Hz.
        markers: number on the garment.
        marker_noise: standard deviation of a coordinate, m.
        force_noise: of a component, N.
        lost: share of the time that a marker is not seen, in bursts.
    """

    rate: float = 100.0
    markers: int = 48
    marker_noise: float = 1e-3
    force_noise: float = 0.05
    lost: float = 0.03


@dataclass(frozen=True)
class Session:
    """What is recorded.

    Attributes:
        motions: what is done with the garment, of `MOTIONS`; a recording each.
        duration: of each recording, s.
        sensors: what measures.
    """

    motions: Sequence[str] = USUAL
    duration: float = 4.0
    sensors: Sensors = Sensors()

    def check(self, source: str) -> None:
        """Raises UserError, which names `source`, where a motion is unknown or named twice."""
        for name in self.motions:
            if name not in MOTIONS:
                named = name or "an empty name"
                raise UserError(source, named, f"is no motion, expected {', '.join(MOTIONS)}")
            if self.motions.count(name) > 1:
                raise UserError(source, name, "stands twice, expected it once")


@dataclass(frozen=True)
class Dataset:
    """Recordings, and what is hidden in them.

    Attributes:
        recordings: as measured, with noise.
        hidden: effects of the truth that the scenario does not know.
    """

    recordings: list[Recording]
    hidden: tuple[Effect, ...]


def make_dataset(
    scenario: Scenario,
    base: Path,
    hide: str | Sequence[Effect],
    seed: int = 0,
    size: float = 1.0,
    session: Session = Session(),
    workers: int | None = None,
    stage: Callable[[str], None] = lambda _: None,
) -> Dataset:
    """Returns what would be measured of a garment on which effects act.

    Args:
        scenario: that knows nothing of the effects.
        base: directory that a mesh file's name is relative to.
        hide: effects, or names joined by "+" of effects that are drawn, `nothing` or `random`.
        seed: of all that is drawn.
        size: of what is drawn, times what matters.
        session: what is recorded.
        workers: processes; by default as many as there are cores.
        stage: told what is being done.

    Raises:
        UserError: an effect has no such name, or cannot be so large.
    """
    name = hide if isinstance(hide, str) else "+".join(e.NAME for e in hide) or NOTHING
    seeds = [seed, *name.encode()]
    rng = np.random.default_rng(seeds)
    hidden = draw_hidden(name, rng, size) if isinstance(hide, str) else list(hide)
    stage(f"recording {', '.join(session.motions)}")
    clean = record_all(
        scenario,
        base,
        hidden,
        seeds,
        session,
        workers,
        lambda motion: stage(f"recorded {motion}"),
    )
    return Dataset([measured(r, session.sensors, rng) for r in clean], tuple(hidden))


def truth(scenario: Scenario, base: Path, effects: Sequence[Effect] = ()) -> Lab:
    """Returns the lab behind the data: the scenario's, simulated otherwise, with effects."""
    p = scenario.plant
    numerics = Numerics(_FINER * p.spacing, _SHORTER * p.time_step, "projective_dynamics")
    lab = Lab.of(scenario, base, numerics)
    return replace(lab, effects=(*lab.effects, *effects))


def stage(lab: Lab) -> Stage:
    """Returns where a lab's motions take place."""
    joints = lab.person([]).posed
    shoulder, hand = joints[0], joints[2]
    rest = lab.garment.rest_position
    left, right = (rest[lab.garment.grasp[side]].mean(axis=0) for side in ("left", "right"))
    along = (hand - shoulder) / np.linalg.norm(hand - shoulder)
    limb = shoulder + _ON_ARM * (hand - shoulder)
    middle = 0.5 * (joints[0] + joints[3])
    raised = raised_arm(lab).person([]).posed
    up = (raised[2] - raised[1]) / np.linalg.norm(raised[2] - raised[1])
    return Stage(
        free=middle + np.array([-_FREE_DISTANCE, 0.0, _ABOVE_SHOULDERS]),
        before=limb + np.array([_BEFORE_LIMB, 0.0, _ABOVE_LIMB]),
        along=along,
        across=np.array([-1.0, 0.0, 0.0]),
        spread=left - right,
        hand=raised[2],
        up=up,
        # the garment comes from outside, so it is the other side's
        cuff=rest[lab.garment.loops["right_cuff"]].mean(axis=0) - 0.5 * (left + right),
    )


def raised_arm(lab: Lab) -> Lab:
    """Returns the lab whose person holds the left arm up sideways."""
    return replace(lab, arms={**lab.arms, "left": ArmPose(abduction=_RAISED)})


def unseen(lab: Lab, motion: str, path: FloatArray, time: FloatArray, nodes: IntArray) -> Recording:
    """Returns a recording of a motion in which no marker was seen.

    Args:
        lab: with the garment and the person.
        motion: of `MOTIONS`.
        path: (T,2,3) of the grippers, m.
        time: (T,) s.
        nodes: that carry markers.
    """
    posed = (raised_arm(lab) if motion in ARM_UP else lab).person([]).posed
    joints = seen_points(np.tile(posed, (len(time), 1, 1)), lab.effects)
    blank = np.full((len(time), len(nodes), 3), np.nan)
    return Recording(motion, time, path, blank, lab.garment.rest_position[nodes], None, joints)


def record(
    lab: Lab, motion: str, duration: float, sensors: Sensors, rng: np.random.Generator
) -> Recording:
    """Returns what would be measured without noise.

    Args:
        lab: the truth.
        motion: of `MOTIONS`.
        duration: s.
        sensors: their rate and number are used.
        rng: draws the motion and where markers sit.
    """
    time = np.arange(round(duration * sensors.rate) + 1) / sensors.rate
    path = MOTIONS[motion](stage(lab), duration, rng)
    rest = lab.garment.rest_position
    nodes = spread_out(rest, sensors.markers, int(rng.integers(len(rest))))
    blank = unseen(lab, motion, path(time), time, nodes.astype(np.int32))
    told = Replayer(lab, blank).run(gain=0.0)
    return replace(
        blank,
        marker_position=told.marker_position,
        gripper_force=told.gripper_force,
        marker_noise=sensors.marker_noise,
        force_noise=sensors.force_noise,
    )


def record_all(
    scenario: Scenario,
    base: Path,
    effects: Sequence[Effect],
    seed: Sequence[int],
    session: Session,
    workers: int | None = None,
    done: Callable[[str], None] = lambda _: None,
) -> list[Recording]:
    """Returns a recording of each motion without noise; they run side by side.

    Args:
        scenario: that knows nothing of the effects.
        base: directory that a mesh file's name is relative to.
        effects: of the truth.
        seed: of what is drawn; each motion draws from its own source.
        session: what is recorded; of its sensors, rate and number are used.
        workers: processes; by default as many as there are cores.
        done: told the name of each motion that is there.
    """
    motions, duration, sensors = session.motions, session.duration, session.sensors
    lab = truth(scenario, base, effects)
    names = iter(motions)
    with WorkerPool(min(len(motions), workers or worker_count())) as pool:
        futures = [
            submit(pool, record, lab, name, duration, sensors, np.random.default_rng([*seed, k]))
            for k, name in enumerate(motions)
        ]
        recordings: list[Recording] = answers(futures, lambda: done(next(names)))
    return recordings


def measured(recording: Recording, sensors: Sensors, rng: np.random.Generator) -> Recording:
    """Returns a recording with the sensors' noise and drop-outs."""
    markers = recording.marker_position
    markers = markers + sensors.marker_noise * rng.standard_normal(markers.shape)
    count, number = markers.shape[:2]
    burst = max(2, round(0.08 * sensors.rate))
    for m in range(number):
        for _ in range(rng.poisson(sensors.lost * count / burst)):
            begin = rng.integers(count)
            markers[begin : begin + rng.integers(2, 2 * burst), m] = np.nan
    force = recording.gripper_force
    if force is not None:
        force = force + sensors.force_noise * rng.standard_normal(force.shape)
    return replace(
        recording,
        marker_position=markers,
        gripper_force=force,
        marker_noise=sensors.marker_noise,
        force_noise=sensors.force_noise,
    )
