"""The force at a tool, from joint torques."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drake_dress.models.arm.external_load import tool_force
from drake_dress.models.arm.panda import LIMITS, panda

ARM = panda(np.eye(4))
HOME = np.array([0.0, -0.4, 0.0, -2.2, 0.0, 1.9, 0.8])
forces = st.lists(st.floats(-40.0, 40.0), min_size=3, max_size=3).map(np.array)
shares = st.lists(st.floats(0.25, 0.75), min_size=7, max_size=7).map(np.array)


@given(forces, shares)
def test_force_is_found_from_its_own_torques(force: np.ndarray, share: np.ndarray) -> None:
    q = LIMITS.lower + share * (LIMITS.upper - LIMITS.lower)
    moves = ARM.tool_jacobian(ARM.links(q))[:3]
    found = tool_force(moves, moves.T @ force)
    least = np.linalg.svd(moves, compute_uv=False)[-1]
    # damping keeps s² / (s² + 0.01²) of it
    assert np.linalg.norm(found - force) <= np.linalg.norm(force) * 1e-4 / (least**2 + 1e-4) + 1e-9


def test_a_stretched_arm_invents_no_force_along_itself() -> None:
    q = np.zeros(7)
    moves = ARM.tool_jacobian(ARM.links(q))[:3]
    noise = np.random.default_rng(0).normal(0.0, 0.1, 7)
    assert np.linalg.norm(tool_force(moves, noise)) < 5.0


def test_noise_of_the_torques_is_little_at_home() -> None:
    moves = ARM.tool_jacobian(ARM.links(HOME))[:3]
    rng = np.random.default_rng(1)
    found = np.array([tool_force(moves, rng.normal(0.0, 0.05, 7)) for _ in range(200)])
    assert np.sqrt((found**2).mean()) == pytest.approx(0.1, abs=0.08)
