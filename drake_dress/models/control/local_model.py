"""The local model: how sleeves follow grippers, and their bounds (Eqs. loc-func1, loc-func2).

The state is the compensation of sleeve centres and grippers, x = (Δp_cl, Δp_cr, Δp_rl, Δp_rr). The
input is the compensation of the gripper velocities. While the sleeves are near each other, each
follows its own gripper. Further apart the garment between them is taut, and each sleeve follows
both grippers. The share of the far gripper grows with its distance, up to one half.

Three things differ from the paper. First, k grows with the distance to the far gripper from a share
of φ_f on, not from φ_c. The sleeves of a coat that is held at its shoulders are further from each
other than from the far gripper (0.59 m against 0.54 m), so the paper's quotient has the wrong sign.
Second, the distance between the grippers is bounded as well. Third, the speed cost applies to the
compensation, not to its sum with the plan. Otherwise it would stop a gripper that the plan moves to
turn or stretch the garment, which the local model does not represent.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from drake_dress.models.arrays import FloatArray
from drake_dress.models.control.local_problem import LocalProblem
from drake_dress.models.control.norm_bounds import NormBounds
from drake_dress.models.garment.geodesics import Reach

_EYE, _NONE = np.eye(3), np.zeros((3, 3))
# Differences whose length is bounded, as blocks of (p_cl, p_cr, p_rl, p_rr).
_PAIRS = (
    np.hstack([_EYE, _NONE, _NONE, -_EYE]),
    np.hstack([_NONE, _EYE, -_EYE, _NONE]),
    np.hstack([_EYE, -_EYE, _NONE, _NONE]),
    np.hstack([_NONE, _NONE, _EYE, -_EYE]),
)


@dataclass(frozen=True)
class LocalParameters:
    """Settings of the local problem.

    Attributes:
        time_step: s. horizon: number of steps N.
        position: W, weight of the position error, 1/m².
        speed: R, weight of the compensation of the gripper velocities, s²/m².
        max_speed: speed limit of a gripper, m/s.
        beside: greatest distance of the armhole of a sleeve on its arm from the arm axis, m (φ_x).
        beside_speed: greatest speed of that armhole across the arm, m/s (φ_v).
        return_speed: speed at which exceeded bounds are restored if there is no plan, m/s.
        stretch: share of the garment's reach, φ_c and φ_f, that is used. A taut garment is pulled
            by both arms.
        dragged: displacement of a hand from the plan's assumption that is attributed to the
            garment, m; only the excess is followed.
        prepare_correction: share of a sleeve's current deviation from the plan that is corrected
            while it is prepared; dress_correction: while it is drawn on.
        taut_share: share of φ_f above which a sleeve also follows the far gripper.
        coupled_share: share of φ_c above which the sleeves are coupled; released_share: share below
            which they are released.
    """

    time_step: float = 0.05
    horizon: int = 20
    position: float = 1.0
    speed: float = 0.1
    max_speed: float = 0.12
    beside: float = 0.04
    beside_speed: float = 0.05
    return_speed: float = 0.05
    stretch: float = 1.0
    dragged: float = 0.04
    prepare_correction: float = 0.0
    dress_correction: float = 1.0
    taut_share: float = 0.8
    coupled_share: float = 0.85
    released_share: float = 0.8


@dataclass(frozen=True)
class Nominal:
    """Nominal motion: that of the global plan.

    Attributes:
        sleeve: (N+1,2,3) armhole centres, m. gripper: (N+1,2,3) m. velocity: (N,2,3) of the
            grippers, m/s. Left, then right.
        planned: whether it comes from a plan with the garment model. Such a plan may exceed a
            bound, because its model of cloth and contact is more accurate than the bound.
    """

    sleeve: FloatArray
    gripper: FloatArray
    velocity: FloatArray
    planned: bool = False


@dataclass(frozen=True)
class SleeveGoal:
    """Goal of one sleeve at the N+1 times.

    Attributes:
        target: (N+1,3) m. weight: factor on W; 0 leaves the sleeve free.
        on_arm: whether contact with the arm bounds it.
        arm: (N+1,3) point of the arm axis for the armhole of a sleeve on its arm, m.
        axis: (N+1,3) unit direction of the arm there.
    """

    target: FloatArray
    weight: float
    on_arm: bool
    arm: FloatArray
    axis: FloatArray


def is_coupled(was: bool, distance: float, reach: Reach, parameters: LocalParameters) -> bool:
    """Returns whether armholes at a `distance`, m, are coupled: ‖p_cl − p_cr‖ ≥ φ_c.

    The threshold has hysteresis, so that the dynamics do not switch with every change of distance.
    """
    share = parameters.released_share if was else parameters.coupled_share
    return distance >= share * reach.between_sleeves


def influence(distance: float, reach: float, taut_share: float) -> float:
    """Returns k, from 0 to ½: the share by which a sleeve follows the far gripper.

    Args:
        distance: between sleeve and far gripper, m.
        reach: greatest such distance, φ_f, m.
        taut_share: share of `reach` above which k is positive.
    """
    slack = taut_share * reach
    return float(np.clip(0.5 * (distance - slack) / (reach - slack), 0.0, 0.5))


def input_matrix(
    nominal: Nominal, coupled: bool, reach: Reach, parameters: LocalParameters
) -> FloatArray:
    """Returns (12,6) B of x_{j+1} = x_j + B v_j."""
    share = np.eye(2)
    if coupled:
        for i in (0, 1):
            far = float(np.linalg.norm(nominal.sleeve[0, i] - nominal.gripper[0, 1 - i]))
            k = influence(far, reach.to_far_gripper[i], parameters.taut_share)
            share[i, i], share[i, 1 - i] = 1.0 - k, k
    b: FloatArray = parameters.time_step * np.vstack([np.kron(share, _EYE), np.eye(6)])
    return b


def local_problem(
    nominal: Nominal,
    goals: tuple[SleeveGoal, SleeveGoal],
    coupled: bool,
    reach: Reach,
    parameters: LocalParameters,
) -> LocalProblem:
    """Returns the problem whose optimum compensates the global plan (Eq. loc_mpc).

    Args:
        nominal: nominal motion of the plan.
        goals: of left and right sleeve.
        coupled: see `is_coupled`.
        reach: reach of the controller's garment.
        parameters: settings.
    """
    p, n = parameters, parameters.horizon
    b = input_matrix(nominal, coupled, reach, p)
    weight, target = _tracking(nominal, goals, p)
    on_states, on_inputs = _distance_bounds(nominal, reach, p), _speed_bounds(nominal, p)
    for i, goal in enumerate(goals):
        if goal.on_arm:
            _bind_to_arm(on_states, on_inputs, i, goal, nominal, b, p)
    state_radius, input_radius = _reachable_radii(on_states, on_inputs, nominal.planned, p)
    return LocalProblem(
        start=np.zeros(12),
        input_matrix=b,
        state_weight=weight,
        state_target=target,
        input_weight=np.full((n, 6), p.speed),
        input_target=np.zeros((n, 6)),
        state_bounds=replace(on_states, radius=state_radius),
        input_bounds=replace(on_inputs, radius=input_radius),
    )


def _tracking(
    nominal: Nominal, goals: tuple[SleeveGoal, SleeveGoal], p: LocalParameters
) -> tuple[FloatArray, FloatArray]:
    """Returns weights and targets (N+1,12) of the state; grippers have none."""
    weight, target = np.zeros((p.horizon + 1, 12)), np.zeros((p.horizon + 1, 12))
    for i, goal in enumerate(goals):
        rows = _rows(i)
        weight[:, rows] = p.position * goal.weight
        target[:, rows] = goal.target - nominal.sleeve[:, i]
    return weight, target


def _distance_bounds(nominal: Nominal, reach: Reach, p: LocalParameters) -> NormBounds:
    """Returns the bounds on states: four distances, then an unused row for each sleeve's arm."""
    n = p.horizon
    where = np.concatenate([nominal.sleeve, nominal.gripper], axis=1).reshape(n + 1, 12)
    matrix, offset = np.zeros((n + 1, 6, 3, 12)), np.zeros((n + 1, 6, 3))
    radius = np.full((n + 1, 6), np.inf)
    matrix[:, :4] = _PAIRS
    offset[:, :4] = np.einsum("kab,tb->tka", matrix[0, :4], where)
    distances = [*reach.to_far_gripper, reach.between_sleeves, reach.between_grippers]
    radius[:, :4] = p.stretch * np.array(distances)
    return NormBounds(matrix, offset, radius)


def _speed_bounds(nominal: Nominal, p: LocalParameters) -> NormBounds:
    """Returns the bounds on inputs: an unused row for each sleeve's arm, then gripper speeds."""
    n = p.horizon
    velocity = nominal.velocity.reshape(n, 6)
    matrix, offset = np.zeros((n, 4, 3, 6)), np.zeros((n, 4, 3))
    radius = np.full((n, 4), np.inf)
    for i in (0, 1):
        rows = _rows(i)
        matrix[:, 2 + i, :, rows], offset[:, 2 + i] = _EYE, velocity[:, rows]
        radius[:, 2 + i] = p.max_speed
    return NormBounds(matrix, offset, radius)


def _bind_to_arm(
    on_states: NormBounds,
    on_inputs: NormBounds,
    i: int,
    goal: SleeveGoal,
    nominal: Nominal,
    b: FloatArray,
    p: LocalParameters,
) -> None:
    """Fills the rows that keep sleeve `i` near its arm axis and limit its speed across it."""
    rows = _rows(i)
    across = _EYE - goal.axis[:, :, None] * goal.axis[:, None, :]
    away = nominal.sleeve[:, i] - goal.arm
    on_states.matrix[:, 4 + i, :, rows] = across
    on_states.offset[:, 4 + i] = np.einsum("tab,tb->ta", across, away)
    on_states.radius[:, 4 + i] = p.beside
    on_inputs.matrix[:, i] = across[:-1] @ b[rows]
    on_inputs.offset[:, i] = np.einsum("tab,tb->ta", across[:-1], np.diff(away, axis=0))
    on_inputs.radius[:, i] = p.beside_speed * p.time_step


def _reachable_radii(
    on_states: NormBounds, on_inputs: NormBounds, planned: bool, p: LocalParameters
) -> tuple[FloatArray, FloatArray]:
    """Returns the radii (N+1,6) and (N,4), widened where the nominal motion exceeds a bound.

    A plan with the garment model may exceed a bound. Without one, a bound that is exceeded already
    is restored gradually, because it cannot be restored at once.
    """
    along = np.linalg.norm(on_states.offset, axis=2)
    if planned:
        moved = np.linalg.norm(on_inputs.offset, axis=2)
        return np.maximum(on_states.radius, along), np.maximum(on_inputs.radius, moved)
    returning = along[0] - p.return_speed * p.time_step * np.arange(p.horizon + 1)[:, None]
    return np.maximum(on_states.radius, returning), on_inputs.radius


def _rows(i: int) -> slice:
    """Returns the rows of a sleeve's centre in the state, and of its gripper in the input."""
    return slice(3 * i, 3 * i + 3)
