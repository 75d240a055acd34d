import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2] / "benchmarks"))
from contact_derivatives import STEPS, run


def test_adjoint_of_random_contact_states_is_that_of_finite_differences() -> None:
    found = run(30)
    assert {c.time_step for c in found} == set(STEPS)
    assert sum(c.slipping for c in found) > 50
    assert min(c.cosine_held for c in found) > 0.999
    assert max(c.error_held for c in found) < 1e-3
