"""Constrained optimal control without Drake: linear dynamics, quadratic costs, bounds on norms.

    from drake_dress import control

    problem = control.linear_quadratic(
        start, (A, B), (Q, R), steps, input_bounds=[control.NormBound(np.eye(2), 2.0)]
    )
    solution = control.solve(problem)
    gains = control.feedback_gains(problem, solution)

The method is constrained DDP, as the local controller of the dressing uses it. A bound is left out
where there is none. What stands in `__all__` is public.
"""

from drake_dress.models.control.constrained_ddp import Settings, feedback_gains, solve
from drake_dress.models.control.linear_quadratic import LinearQuadraticProblem, linear_quadratic
from drake_dress.models.control.norm_bounds import NormBound
from drake_dress.models.control.solution import Solution

__all__ = [
    "LinearQuadraticProblem",
    "NormBound",
    "Settings",
    "Solution",
    "feedback_gains",
    "linear_quadratic",
    "solve",
]
