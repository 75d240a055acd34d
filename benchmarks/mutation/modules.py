"""The modules to mutate, and the tests that cover each."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Module:
    """A part of the program that has its own quick tests.

    Attributes:
        files: Files to mutate, relative to the root of the repository.
        tests: Tests that should catch the mutants.
        timeout: Timeout of the tests, several times their duration, since a mutant may never end,
            s.
    """

    files: tuple[str, ...]
    tests: tuple[str, ...]
    timeout: float = 120.0


_MODELS = "drake_dress/models"
# The safety layer between commands and the person, the plausibility checks that end a run, the test
# that an arm is in its sleeve, the solver of the control loop, and the regression that identifies
# causes.
MODULES = {
    "safety": Module((f"{_MODELS}/control/safety.py",), ("tests/models/control/test_safety.py",)),
    "supervision": Module(
        tuple(
            f"{_MODELS}/supervision/{name}.py"
            for name in (
                "supervision",
                "watch",
                "order",
                "person_pose",
                "person_belief",
                "garment_shape",
                "garment_belief",
            )
        ),
        ("tests/models/supervision",),
    ),
    "linking": Module(
        (f"{_MODELS}/dressing/linking.py",), ("tests/models/dressing/test_linking.py",)
    ),
    "constrained_ddp": Module(
        (
            f"{_MODELS}/control/constrained_ddp.py",
            f"{_MODELS}/control/ddp_passes.py",
            f"{_MODELS}/control/linear_dynamics.py",
        ),
        (
            "tests/models/control/test_constrained_ddp.py",
            "tests/models/control/test_linear_quadratic.py",
        ),
    ),
    "regression": Module(
        ("drake_dress/discrepancy/regression.py",),
        ("tests/discrepancy/test_regression.py", "tests/discrepancy/test_fitting.py"),
    ),
}
