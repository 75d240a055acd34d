"""Generates data that hide an effect: measurements of a garment that differs from the model.

The true data come from another simulation: converged Projective Dynamics on a finer mesh with a
smaller step and other random draws. Noise and drop-outs of a motion-capture system are added.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from drake_dress.diagrams.scenario import Scenario
from drake_dress.discrepancy.hidden_effect import NOTHING, draw_hidden
from drake_dress.discrepancy.lab import Numerics, SimulatedLab
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

# Mesh spacing and time step of the true simulation, relative to the scenario's.
_FINER, _SHORTER = 0.84, 0.5
# Offsets of the hanging garment: free, behind the shoulders; and in front of the limb, m.
_FREE_DISTANCE, _ABOVE_SHOULDERS, _BEFORE_LIMB, _ABOVE_LIMB = 0.8, 0.05, 0.25, 0.24
# Point of the arm over which the garment is drawn, from shoulder (0) to hand (1).
_ON_ARM = 0.55
# Abduction of the raised arm, along a hanging sleeve, rad.
_RAISED = np.deg2rad(135.0)


@dataclass(frozen=True)
class Sensors:
    """Sensors of a session.

    Attributes:
        rate: sample rate, Hz.
        markers: number of markers on the garment.
        marker_noise: standard deviation of a coordinate, m.
        force_noise: standard deviation of a component, N.
        lost: share of the time in which a marker is not seen, in bursts.
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
        motions: motions of the garment, keys of `MOTIONS`; one recording each.
        duration: duration of each recording, s.
        sensors: sample rate, number of markers, noise and drop-outs.
    """

    motions: Sequence[str] = USUAL
    duration: float = 4.0
    sensors: Sensors = Sensors()

    def check(self, source: str) -> None:
        """Raises UserError, which names `source`, if a motion is unknown or named twice."""
        for name in self.motions:
            if name not in MOTIONS:
                named = name or "an empty name"
                raise UserError(source, named, f"is no motion, expected {', '.join(MOTIONS)}")
            if self.motions.count(name) > 1:
                raise UserError(source, name, "stands twice, expected it once")


@dataclass(frozen=True)
class Dataset:
    """Recordings, and the effects hidden in them.

    Attributes:
        recordings: recordings with noise.
        hidden: effects in the data that the scenario does not have.
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
    """Returns simulated measurements of a garment on which hidden effects act.

    Args:
        scenario: scenario without the hidden effects.
        base: directory that a mesh file's name is relative to.
        hide: effects; or names, joined by "+", of effects with random parameters, `nothing` or
            `random`.
        seed: seed of all random draws.
        size: factor on the strength of effects with random parameters.
        session: motions, duration and sensors.
        workers: number of processes; by default the number of cores.
        stage: called with a description of each stage.

    Raises:
        UserError: an effect is unknown or repeated, or a parameter of this size is out of bounds.
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


def truth(scenario: Scenario, base: Path, effects: Sequence[Effect] = ()) -> SimulatedLab:
    """Returns the lab behind the data: the scenario's, with other numerics and with effects."""
    p = scenario.plant
    numerics = Numerics(_FINER * p.spacing, _SHORTER * p.time_step, "projective_dynamics")
    lab = SimulatedLab.of(scenario, base, numerics)
    return replace(lab, effects=(*lab.effects, *effects))


def stage(lab: SimulatedLab) -> Stage:
    """Returns the positions at which a lab's motions take place."""
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
        # the garment comes from beyond the left hand, so the arm enters its right cuff
        cuff=rest[lab.garment.loops["right_cuff"]].mean(axis=0) - 0.5 * (left + right),
    )


def raised_arm(lab: SimulatedLab) -> SimulatedLab:
    """Returns the lab with the person's left arm raised sideways."""
    return replace(lab, arms={**lab.arms, "left": ArmPose(abduction=_RAISED)})


def unseen(
    lab: SimulatedLab, motion: str, path: FloatArray, time: FloatArray, nodes: IntArray
) -> Recording:
    """Returns a recording of a motion in which no marker was seen.

    Args:
        lab: garment and person.
        motion: key of `MOTIONS`.
        path: (T,2,3) positions of the grippers, m.
        time: (T,) time stamps, s.
        nodes: nodes that carry markers.
    """
    posed = (raised_arm(lab) if motion in ARM_UP else lab).person([]).posed
    joints = seen_points(np.tile(posed, (len(time), 1, 1)), lab.effects)
    blank = np.full((len(time), len(nodes), 3), np.nan)
    return Recording(motion, time, path, blank, lab.garment.rest_position[nodes], None, joints)


def record(
    lab: SimulatedLab, motion: str, duration: float, sensors: Sensors, rng: np.random.Generator
) -> Recording:
    """Returns a simulated recording without noise.

    Args:
        lab: the true lab.
        motion: key of `MOTIONS`.
        duration: length of the recording, s.
        sensors: sample rate and number of markers; noise and drop-outs are not added.
        rng: random number generator for the motion and the places of the markers.
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
    """Returns a recording of each motion without noise; the simulations run in parallel.

    Args:
        scenario: scenario without the effects.
        base: directory that a mesh file's name is relative to.
        effects: effects in the true simulation.
        seed: seed of random draws; each motion has its own generator.
        session: motions, duration and sensors; noise and drop-outs are not added.
        workers: number of processes; by default the number of cores.
        done: called with the name of each motion when it is recorded.
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
    """Returns a recording with the sensors' noise and drop-outs added."""
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
