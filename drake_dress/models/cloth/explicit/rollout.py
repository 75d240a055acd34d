"""Rollouts of many steps, and their derivative with memory that grows as the root of their number.

A tape holds some thirty arrays of the garment, so only the states at the start of segments are
stored. The adjoint repeats the segments, last one first, and holds the tapes of one at a time. A
step is a pure function, so the second run repeats the first bit for bit.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from drake_dress.models.arrays import FloatArray
from drake_dress.models.cloth.contact.obstacles import Obstacles
from drake_dress.models.cloth.explicit.explicit_bias import ExplicitBiasCloth, Tape

Observer = Callable[[int, FloatArray, FloatArray, FloatArray], None]
# Derivatives of a loss by positions (n,3), velocities (n,3) and held reactions (k,3) of a step.
Seeds = tuple[FloatArray, FloatArray, FloatArray]


@dataclass(frozen=True)
class Rollout:
    """The stored part of a simulation of N steps, from which `roll_back` recomputes the rest.

    Attributes:
        held_motion: (N,k,3) displacement of the held nodes in each step, m.
        obstacles: obstacles of each step.
        starts: indices of the steps whose states are stored, ascending from 0.
        states: positions and velocities (n,3) before these steps.
        x: (n,3) positions at the end, m.
        v: (n,3) velocities at the end, m/s.
    """

    cloth: ExplicitBiasCloth
    held_motion: FloatArray
    obstacles: Sequence[Obstacles]
    starts: list[int]
    states: list[tuple[FloatArray, FloatArray]]
    x: FloatArray
    v: FloatArray


@dataclass
class RolloutGradient:
    """Derivative of a scalar with respect to the inputs of a rollout of N steps.

    Attributes:
        x: (n,3) by the positions at the start.
        v: (n,3) by the velocities at the start.
        held_motion: (N,k,3) by the displacements of the held nodes.
        bodies: (N,m,4,3) by position, rotation, velocity and angular velocity of each obstacle in
            each step; see `Gradient`.
        material: by the fields of `Material`, if requested.
    """

    x: FloatArray
    v: FloatArray
    held_motion: FloatArray
    bodies: FloatArray
    material: dict[str, float] = field(default_factory=dict)


def roll_out(
    cloth: ExplicitBiasCloth,
    x: FloatArray,
    v: FloatArray,
    held_motion: FloatArray,
    obstacles: Sequence[Obstacles],
    observe: Observer | None = None,
    segment: int | None = None,
) -> Rollout:
    """Simulates N steps and stores what `roll_back` needs.

    Args:
        cloth: garment.
        x: (n,3) positions at the start, m.
        v: (n,3) velocities at the start, m/s.
        held_motion: (N,k,3) displacement of the held nodes in each step, m.
        obstacles: obstacles at the start of each of the N steps.
        observe: called after each step with its index, positions, velocities and reactions of the
            held nodes (k,3), N.
        segment: number of steps whose tapes the adjoint may hold at once; √N by default.

    Raises:
        ValueError: the numbers of steps differ, or a step fails; the message names the step.
    """
    count = len(held_motion)
    if len(obstacles) != count:
        raise ValueError(
            f"{count} motions and {len(obstacles)} sets of obstacles, expected as many"
        )
    length = segment or max(1, math.isqrt(count))
    # Copies: the adjoint repeats the steps, and the caller may change the arrays before that.
    x, v, held_motion = x.copy(), v.copy(), np.array(held_motion)
    starts, states = [], []
    for j in range(count):
        if j % length == 0:
            starts.append(j)
            states.append((x, v))
        try:
            x, v, reaction, _ = cloth.step(x, v, held_motion[j], obstacles[j])
        except ValueError as error:
            raise ValueError(f"step {j}: {error}") from error
        if observe:
            observe(j, x, v, reaction[cloth.held])
    return Rollout(cloth, held_motion, obstacles, starts, states, x, v)


def roll_back(
    rollout: Rollout,
    seeds: Callable[[int, FloatArray, FloatArray, FloatArray], Seeds | None],
    by_material: bool = False,
) -> RolloutGradient:
    """Returns the derivative of a loss with respect to the inputs of a rollout.

    Args:
        rollout: result of `roll_out`.
        seeds: function that takes the index of a step and its results (positions, velocities,
            reactions of the held nodes). It returns the derivatives of the loss by these results,
            or None if the loss does not depend on them. Called once per step, last step first.
        by_material: whether to differentiate by the material's values, too.
    """
    cloth, motion, obstacles = rollout.cloth, rollout.held_motion, rollout.obstacles
    count = len(motion)
    x_bar, v_bar = np.zeros_like(rollout.x), np.zeros_like(rollout.v)
    bodies = np.zeros((count, obstacles[0].count if count else 0, 4, 3))
    held_in = np.zeros_like(motion)
    material: dict[str, float] = {}
    ends = [*rollout.starts[1:], count]
    for start, end, state in reversed(list(zip(rollout.starts, ends, rollout.states, strict=True))):
        tapes: list[tuple[Tape, FloatArray, FloatArray, FloatArray]] = []
        x, v = state
        for j in range(start, end):
            x, v, reaction, tape = cloth.step(x, v, motion[j], obstacles[j])
            tapes.append((tape, x, v, reaction[cloth.held]))
        for j in range(end - 1, start - 1, -1):
            tape, x, v, reaction = tapes.pop()
            given = seeds(j, x, v, reaction)
            reaction_bar = np.zeros_like(reaction)
            if given is not None:
                x_bar, v_bar, reaction_bar = x_bar + given[0], v_bar + given[1], given[2]
            g = cloth.vector_jacobian_product(tape, x_bar, v_bar, reaction_bar, by_material)
            x_bar, v_bar, held_in[j] = g.x, g.v, g.held_motion
            bodies[j] = np.stack([g.origin, g.rotation, g.velocity, g.angular_velocity], axis=1)
            for name, value in g.material.items():
                material[name] = material.get(name, 0.0) + value
    return RolloutGradient(x_bar, v_bar, held_in, bodies, material)
