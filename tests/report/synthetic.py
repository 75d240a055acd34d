"""Small made-up runs: a coat that moves onto a person without any physics."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from drake_dress.models.arrays import FloatArray
from drake_dress.models.garment.coat import CoatParameters, make_coat
from drake_dress.models.garment.mesh import GarmentMesh
from drake_dress.models.sides import SIDES
from drake_dress.report.log_layout import LogContent
from drake_dress.report.log_writer import ForecastSample, RunLogWriter, Sample

SHOULDER_HEIGHT = 1.4  # m
ARM_RADIUS = 0.035  # m


def coat(spacing: float = 0.04) -> GarmentMesh:
    """Returns a coat."""
    return make_coat(CoatParameters(), spacing)


def dressed_joints(garment: GarmentMesh) -> FloatArray:
    """Returns (6,3) joints of arms that run through the sleeves of a coat at shoulder height."""
    x = garment.rest_position + [0.0, 0.0, SHOULDER_HEIGHT]
    joints = []
    for side in SIDES:
        armhole = x[garment.loops[f"{side}_armhole"]].mean(axis=0)
        cuff = x[garment.loops[f"{side}_cuff"]].mean(axis=0)
        along = cuff - armhole
        joints += [armhole + 0.05 * along, armhole + 0.45 * along, armhole + 1.08 * along]
    return np.array(joints)


def capsules(joints: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Returns ends (6,3), (6,3) and radius (6,) of four limbs, a trunk and a head."""
    trunk = np.array([[0.0, 0.0, 0.75], [0.0, 0.0, 1.62]])
    end = np.array([[0.0, 0.0, 1.2], [0.0, 0.0, 1.62]])
    return (
        np.concatenate([joints[[0, 1, 3, 4]], trunk]),
        np.concatenate([joints[[1, 2, 4, 5]], end]),
        np.array([ARM_RADIUS] * 4 + [0.08, 0.09]),
    )


def dressing(
    garment: GarmentMesh,
    count: int = 21,
    duration: float = 10.0,
    travel: float = 1.0,
    beside: bool = False,
) -> list[Sample]:
    """Returns samples of a coat that comes from behind and ends on the person.

    Args:
        garment: the coat.
        count: of samples.
        duration: s.
        travel: 1: it comes from behind, through the person; 0: it is on from the start.
        beside: the coat ends in front of the arms, which stay outside, but s says 2: the false
            success.
    """
    joints = dressed_joints(garment)
    a, b, _ = capsules(joints)
    samples = []
    for i, time in enumerate(np.linspace(0.0, duration, count)):
        share = i / (count - 1)
        end = 0.5 if beside else 0.0
        away = travel * (1.0 - share)
        offset = np.array([end - 0.5 * away, 0.0, SHOULDER_HEIGHT + 0.1 * away])
        position = garment.rest_position + offset
        force = np.zeros_like(position)
        force[:5, 0] = 0.2 * share
        on = np.clip([2.4 * share, 2.4 * share - 0.3], 0.0, 2.0)
        samples.append(
            Sample(
                time=float(time),
                garment_position=position,
                contact=(np.linalg.norm(force, axis=1) > 0).astype(np.int8),
                contact_force=force,
                joint_position=joints,
                gripper_position={
                    side: position[garment.grasp[side]].mean(axis=0) for side in SIDES
                },
                gripper_force={
                    "left": np.array([0.0, 0.0, -3.0 - 10.0 * share]),
                    "right": np.array([0.0, 2.0, -3.0]),
                },
                dressing={
                    side: (float(on[k]), 0.05 * (1.0 - share), 0.3 * share)
                    for k, side in enumerate(SIDES)
                },
                stage=np.where(on >= 1.9, 2, np.where(on > 0.5, 1, 0)),
                global_solve_time=0.3 if i % 5 == 0 else np.nan,
                local_solve_time=0.004,
                local_solves=3,
                estimate_garment_position=position,
                estimate_joint_position=joints,
                capsule_a=a,
                capsule_b=b,
                intent=(on > [0.5, 1.5]).astype(np.int8),
            )
        )
    return samples


def stretched(sample: Sample, garment: GarmentMesh, factor: float) -> Sample:
    """Returns a sample with its garment enlarged about its middle."""
    position = np.asarray(sample.garment_position)
    middle = position.mean(axis=0)
    return replace(sample, garment_position=middle + factor * (position - middle))


def foreseen(samples: list[Sample]) -> list[Sample]:
    """Returns samples with forecasts: the left hand is foreseen 10 cm too high, and unlike data."""
    off = np.zeros((6, 3))
    off[2, 2] = 0.1
    return [
        replace(
            sample,
            forecast=ForecastSample(
                np.asarray(sample.joint_position) + off,
                np.linspace(0.05, 0.1, 6),
                np.array([0.9, 0.1]),
                int(k % 2),
            ),
        )
        for k, sample in enumerate(samples)
    ]


def content(garment: GarmentMesh, **fields: Any) -> LogContent:
    """Returns what a log says about a run of which it says little else than `fields`."""
    return LogContent(garment, "", "", 0, np.ones(6), **fields)


def write(
    path: Path,
    garment: GarmentMesh,
    samples: list[Sample],
    seed: int = 3,
    scenario: str = "seed: 3\n",
    taper: float = 1.0,
) -> Path:
    """Writes samples to a log and returns its path; limbs end with `taper` times their radius."""
    _, _, radius = capsules(dressed_joints(garment))
    with RunLogWriter(
        path,
        LogContent(
            garment=garment,
            scenario_text=scenario,
            version="0.0",
            seed=seed,
            radius=np.full(6, ARM_RADIUS),
            capsule_radius=np.column_stack([radius, taper * radius]),
            estimate_garment=garment,
            forecast=bool(samples) and samples[0].forecast is not None,
        ),
    ) as log:
        for sample in samples:
            log.append(sample)
    return path
