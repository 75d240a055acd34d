"""Moves a point mass to the origin with a bounded force, a speed limit and a wall."""

import numpy as np

from drake_dress import control

STEP, STEPS = 0.1, 40  # s
FORCE, SPEED, WALL = 2.0, 0.6, 0.2  # N, m/s, m

# x = (position, velocity) in the plane, v = force on a mass of 1 kg
A, B = np.eye(4), np.zeros((4, 2))
A[:2, 2:] = STEP * np.eye(2)
B[:2], B[2:] = 0.5 * STEP**2 * np.eye(2), STEP * np.eye(2)
Q, R = np.diag([1.0, 1.0, 0.1, 0.1]), 0.02 * np.eye(2)

position, velocity = np.eye(4)[:2], np.eye(4)[2:]
problem = control.linear_quadratic(
    [1.0, 0.5, 0.0, 0.0],
    (A, B),
    (Q, R),
    STEPS,
    state_bounds=[
        control.NormBound(velocity, SPEED),
        control.NormBound.interval(position[1], WALL, 1.0),
    ],
    input_bounds=[control.NormBound(np.eye(2), FORCE)],
)
solution = control.solve(problem)
print(f"converged: {solution.converged}, cost {solution.cost:.3f}")
print(f"largest force {np.linalg.norm(solution.v, axis=1).max():.3f} N")
print(f"largest speed {np.linalg.norm(solution.x[:, 2:], axis=1).max():.3f} m/s")
print(f"nearest to the wall {solution.x[1:, 1].min():.3f} m")

# feedback gains correct the forces between two solves
gains = control.feedback_gains(problem, solution)
error = np.array([0.0, 0.01, 0.0, 0.0])
print(f"an error of 1 cm changes the first force by {gains[0] @ error} N")
