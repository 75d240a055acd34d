"""The local problem as a second-order cone programme, solved by Clarabel through Drake."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
from pydrake.solvers import ClarabelSolver, MathematicalProgram, SolverOptions

from drake_dress.models.arrays import FloatArray
from drake_dress.models.control.local_problem import LocalProblem
from drake_dress.models.control.norm_bounds import NormBounds
from drake_dress.models.control.solution import Solution


def solve_cone_programme(
    problem: LocalProblem, tolerance: float = 1e-8, spills: bool = False
) -> tuple[Solution, float]:
    """Returns the optimum of a local problem, without multipliers, and Clarabel's own time, s.

    Args:
        problem: any local problem.
        tolerance: Clarabel's tolerance of gap and feasibility.
        spills: whether bounds may be exceeded, at the problem's price; otherwise a problem may be
            infeasible.
    """
    p = problem
    steps, m = p.input_weight.shape
    n = len(p.start)
    program = MathematicalProgram()
    v = program.NewContinuousVariables(steps, m, "v")
    x = program.NewContinuousVariables(steps, n, "x")
    b = p.input_matrix
    dynamics = np.hstack([np.eye(n), -np.eye(n), -b])
    for j in range(steps):
        if j == 0:
            program.AddLinearEqualityConstraint(
                np.hstack([np.eye(n), -b]), p.start, np.concatenate([x[0], v[0]])
            )
        else:
            program.AddLinearEqualityConstraint(
                dynamics, np.zeros(n), np.concatenate([x[j], x[j - 1], v[j]])
            )
        _add_cost(program, p.state_weight[j + 1], p.state_target[j + 1], x[j])
        _add_cost(program, p.input_weight[j], p.input_target[j], v[j])
        _add_bounds(program, p.state_bounds, j + 1, x[j], p.price if spills else None)
        _add_bounds(program, p.input_bounds, j, v[j], p.price if spills else None)
    options = SolverOptions()
    for name in ("tol_gap_abs", "tol_gap_rel", "tol_feas"):
        options.SetOption(ClarabelSolver.id(), name, tolerance)
    result = ClarabelSolver().Solve(program, None, options)
    inputs = result.GetSolution(v)
    details = result.get_solver_details()
    solution = Solution(
        v=inputs,
        x=p.states(inputs),
        state_multiplier=np.zeros(p.state_bounds.radius.shape),
        input_multiplier=np.zeros(p.input_bounds.radius.shape),
        cost=p.cost(inputs),
        violation=p.violation(inputs),
        sweeps=0,
        interior_steps=int(details.iterations),
        converged=result.is_success(),
    )
    return solution, float(details.solve_time)


def cone_programme(problem: LocalProblem, before: Solution | None) -> Solution:
    """Solves a local problem as a cone programme; Clarabel has no warm start."""
    return solve_cone_programme(problem, spills=True)[0]


def _add_cost(
    program: MathematicalProgram, weight: FloatArray, target: FloatArray, z: npt.NDArray[Any]
) -> None:
    if np.any(weight > 0.0):
        program.AddQuadraticCost(
            np.diag(2.0 * weight), -2.0 * weight * target, float(weight @ target**2), z, True
        )


def _add_bounds(
    program: MathematicalProgram,
    bounds: NormBounds,
    t: int,
    z: npt.NDArray[Any],
    price: float | None,
) -> None:
    for matrix, offset, radius in zip(
        bounds.matrix[t], bounds.offset[t], bounds.radius[t], strict=True
    ):
        if not np.isfinite(radius):
            continue
        used = np.any(matrix != 0.0, axis=0)
        if price is None:
            a = np.vstack([np.zeros((1, int(used.sum()))), matrix[:, used]])
            program.AddLorentzConeConstraint(a, np.concatenate([[radius], offset]), z[used])
            continue
        spilled = program.NewContinuousVariables(1, "t")
        program.AddBoundingBoxConstraint(0.0, np.inf, spilled)
        program.AddLinearCost(np.array([price]), 0.0, spilled)
        # (φ² + 2 φ t) · 1 ≥ ‖·‖²
        a = np.zeros((5, int(used.sum()) + 1))
        a[0, -1], a[2:, :-1] = 2.0 * radius, matrix[:, used]
        program.AddRotatedLorentzConeConstraint(
            a, np.concatenate([[radius**2, 1.0], offset]), np.concatenate([z[used], spilled])
        )
