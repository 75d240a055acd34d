"""Random local problems: sleeves and grippers on a trajectory, with feasible bounds."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from drake_dress.models.arrays import FloatArray
from drake_dress.models.control.local_problem import LocalProblem
from drake_dress.models.control.norm_bounds import NormBounds

HORIZON, TIME_STEP = 20, 0.05
# Usual bounds: sleeve to far gripper, twice; sleeve to sleeve; sleeve off its arm's axis, twice, m.
_RADIUS = (0.35, 0.35, 0.3, 0.03, 0.03)
# Usual bounds: speed of sleeves across their arms, twice; speed of grippers, twice, m/s.
_SPEED = (0.05, 0.05, 0.15, 0.15)
_ON_ARM, _TETHERED = 0.6, 0.6


def random_problem(rng: np.random.Generator) -> tuple[LocalProblem, FloatArray]:
    """Returns a problem with 12 states, 6 inputs and 20 steps, and feasible inputs (N,6).

    Sleeves and grippers move randomly; targets are about 10 cm away and drift. A sleeve may be on
    its arm, and may be tethered to the other. Bounds are the usual ones, widened if necessary so
    that a random trajectory is feasible; some fifty of them are active at a typical optimum.
    """
    n, h = HORIZON, TIME_STEP
    eye = np.eye(3)
    left, right = rng.uniform(0.0, 0.5, 2) if rng.random() < _TETHERED else (0.0, 0.0)
    share = np.array([[1.0 - left, left], [right, 1.0 - right]])
    b = h * np.vstack([np.kron(share, eye), np.eye(6)])
    velocity = np.cumsum(rng.normal(0.0, 0.03, (n, 6)), axis=0) + rng.normal(0.0, 0.08, 6)
    position = rng.normal(0.0, 0.2, 12) + _path(velocity, b)
    wander = np.cumsum(rng.normal(0.0, 0.02, (n + 1, 6)), axis=0)
    target = np.zeros((n + 1, 12))
    target[:, :6] = rng.normal(0.0, 0.1, 6) + wander
    weight = np.zeros((n + 1, 12))
    weight[:, :6] = rng.uniform(0.2, 3.0, 6)
    input_weight = np.tile(10.0 ** rng.uniform(-3.0, -1.0, 6), (n, 1))

    obeying = np.cumsum(rng.normal(0.0, 0.05, (n, 6)), axis=0) + rng.normal(0.0, 0.05, 6)
    arm = position[:, :6] + np.cumsum(rng.normal(0.0, 0.01, (n + 1, 6)), axis=0)
    across = []
    for _ in range(2):
        axis = rng.normal(0.0, 1.0, 3)
        axis /= np.linalg.norm(axis)
        across.append(eye - np.outer(axis, axis))
    on_arm = rng.random(2) < _ON_ARM
    beside = position.copy()
    beside[:, :6] -= arm
    state_bounds = _state_bounds(position, beside, across)
    needed = state_bounds.norms(_path(obeying, b))
    usual = np.array(_RADIUS) * rng.uniform(0.5, 1.5, 5)
    radius = np.maximum(usual, 1.001 * needed + 1e-3)
    radius[:, 3:][:, ~on_arm] = np.inf

    input_bounds = _input_bounds(velocity, beside, across, b)
    needed = input_bounds.norms(obeying)
    usual = np.array(_SPEED) * np.array([h, h, 1.0, 1.0])
    input_radius = np.maximum(usual, 1.001 * needed + 1e-4)
    input_radius[:, :2][:, ~on_arm] = np.inf
    problem = LocalProblem(
        start=np.zeros(12),
        input_matrix=b,
        state_weight=weight,
        state_target=target,
        input_weight=input_weight,
        input_target=-velocity,
        state_bounds=replace(state_bounds, radius=radius),
        input_bounds=replace(input_bounds, radius=input_radius),
    )
    return problem, obeying


def _state_bounds(position: FloatArray, beside: FloatArray, across: list[FloatArray]) -> NormBounds:
    """Returns bounds, without radii, on spans between sleeves and grippers, and beside the arms."""
    eye, none = np.eye(3), np.zeros((3, 3))
    matrix = np.zeros((len(position), 5, 3, 12))
    for k, blocks in enumerate(
        ((eye, none, none, -eye), (none, eye, -eye, none), (eye, -eye, none, none))
    ):
        matrix[:, k] = np.hstack(blocks)
    for i in (0, 1):
        matrix[:, 3 + i, :, 3 * i : 3 * i + 3] = across[i]
    offset = np.einsum("tkab,tb->tka", matrix, position)
    offset[:, 3:] = np.einsum("tkab,tb->tka", matrix[:, 3:], beside)
    return NormBounds(matrix, offset, np.empty((len(position), 5)))


def _input_bounds(
    velocity: FloatArray, beside: FloatArray, across: list[FloatArray], b: FloatArray
) -> NormBounds:
    """Returns bounds, without radii, on speeds beside the arms and on those of the grippers."""
    n = len(velocity)
    matrix, offset = np.zeros((n, 4, 3, 6)), np.zeros((n, 4, 3))
    for i in (0, 1):
        rows = slice(3 * i, 3 * i + 3)
        matrix[:, i] = across[i] @ b[rows]
        offset[:, i] = np.diff(beside, axis=0)[:, rows] @ across[i]
        matrix[:, 2 + i, :, rows] = np.eye(3)
        offset[:, 2 + i] = velocity[:, rows]
    return NormBounds(matrix, offset, np.empty((n, 4)))


def _path(velocity: FloatArray, b: FloatArray) -> FloatArray:
    """Returns the states (N+1,n) reached from zero with inputs (N,m)."""
    moved: FloatArray = np.cumsum(velocity @ b.T, axis=0)
    return np.concatenate([np.zeros((1, len(b))), moved])
