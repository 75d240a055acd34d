"""Marks tests that step a garment in MuJoCo."""

import importlib.util

import pytest

needs_mujoco = pytest.mark.skipif(
    importlib.util.find_spec("mujoco") is None,
    reason="needs MuJoCo: pip install -e '.[mujoco]'",
)
