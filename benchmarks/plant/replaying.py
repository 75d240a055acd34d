"""Simulates a garment over parts of a dressing's motion, from given states."""

from __future__ import annotations

import time
from dataclasses import dataclass, replace

import numpy as np

from benchmarks.plant.motion import DressingMotion
from drake_dress.models.arrays import FloatArray
from drake_dress.models.cloth.contact.modes import SLIP, STICK
from drake_dress.models.cloth.layered import Integrator
from drake_dress.models.cloth.state import ClothState
from drake_dress.models.garment.mesh import GarmentMesh
from drake_dress.models.sides import SIDES


@dataclass(frozen=True)
class Replayed:
    """Result of a garment over one part of a motion.

    Attributes:
        state: State at the end.
        grippers: (2,3) mean force of the garment on left and right gripper over the part, N.
        person: (3,) mean force of the garment on the person, N.
        step: (K,) wall times of the steps, s.
        iterations: Mean number of iterations of the linear solver per step.
    """

    state: ClothState
    grippers: FloatArray
    person: FloatArray
    step: FloatArray
    iterations: float


def replay(
    cloth: Integrator,
    mesh: GarmentMesh,
    motion: DressingMotion,
    x: FloatArray,
    v: FloatArray,
    begin: float,
    duration: float,
) -> Replayed:
    """Simulates the garment over a part of the motion.

    Args:
        cloth: Integrator of the garment.
        mesh: Mesh of the garment; its grasp is held.
        motion: Motion of grippers and person.
        x: (n,3) initial positions of the nodes, m.
        v: (n,3) initial velocities of the nodes, m/s.
        begin: Start of the part, s.
        duration: Duration of the part, s.
    """
    h = cloth.time_step
    side = np.repeat([0, 1], [len(mesh.grasp[s]) for s in SIDES])
    offset = x[cloth.held] - motion.grippers_at(begin)[side]
    state = replace(ClothState.at_rest(x), v=v.copy())
    count = round(duration / h)
    pulled, pressed = np.zeros((2, 3)), np.zeros(3)
    took, iterations = np.empty(count), []
    for k in range(count):
        now = begin + k * h
        person = motion.person_at(now)
        goal = motion.grippers_at(now + h)[side] + offset
        held = (goal - state.x[cloth.held]) / h
        start = time.perf_counter()
        state, info = cloth.step(state, person, held)
        took[k] = time.perf_counter() - start
        iterations.append(getattr(info, "cg_iterations", np.nan))
        for i in (0, 1):
            pulled[i] -= state.reaction[cloth.held[side == i]].sum(axis=0)
        touching = (state.mode == STICK) | (state.mode == SLIP)
        pressed -= state.reaction[touching].sum(axis=0)
    return Replayed(
        state,
        pulled / count,
        pressed / count,
        took,
        float(np.mean(iterations)),
    )
