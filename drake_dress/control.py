"""Constrained optimal control without Drake: linear dynamics, quadratic costs, norm bounds.

    from drake_dress import control

    problem = control.linear_quadratic(
        start, (A, B), (Q, R), steps, input_bounds=[control.NormBound(np.eye(2), 2.0)]
    )
    solution = control.solve(problem)
    gains = control.feedback_gains(problem, solution)

The method is constrained DDP, as in the local controller of the dressing. Bounds are optional.
The names in `__all__` are public.
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
