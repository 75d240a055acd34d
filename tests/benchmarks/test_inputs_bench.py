"""The study of drawn inputs finds what it looks for, and draws the same again."""

from __future__ import annotations

import sys
import warnings
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from benchmarks.inputs import meshes, scenarios
from benchmarks.inputs.__main__ import table
from benchmarks.inputs.trials import Expect, Outcome, Trial, carry_out
from drake_dress.errors import UserError


def refused(text: str) -> Callable[[], str | None]:
    def use() -> str | None:
        raise UserError("a.yaml", "key", text)

    return use


def noisy() -> str | None:
    sys.stderr.write("a library warns\n")
    raise UserError("a.yaml", "", "is wrong")


def warned() -> str | None:
    warnings.warn("a library warns", stacklevel=1)
    return None


def broken() -> str | None:
    return [None][1]


@pytest.mark.parametrize(
    ("expect", "use", "outcome", "problem"),
    [
        (Expect.REFUSE, refused("is wrong"), Outcome.REFUSED, None),
        (Expect.EITHER, refused("is wrong"), Outcome.REFUSED, None),
        (Expect.ACCEPT, refused("is wrong"), Outcome.REFUSED, "refused though sound"),
        (Expect.ACCEPT, lambda: None, Outcome.ACCEPTED, None),
        (Expect.REFUSE, lambda: None, Outcome.ACCEPTED, "accepted though impossible"),
        (Expect.EITHER, lambda: "area x 3", Outcome.ACCEPTED, "area x 3"),
        (Expect.EITHER, noisy, Outcome.REFUSED, "wrote beside"),
        (Expect.ACCEPT, warned, Outcome.ACCEPTED, "wrote beside"),
        (Expect.EITHER, broken, Outcome.TRACEBACK, "traceback"),
    ],
)
def test_each_way_to_fail_is_told(
    expect: Expect, use: Callable[[], str | None], outcome: Outcome, problem: str | None
) -> None:
    result = carry_out(3, "mesh", Trial("drawn", expect, use))
    assert result.outcome == outcome
    if problem is None:
        assert result.problem is None
    else:
        assert result.problem is not None
        assert problem in result.problem
    assert table([result], 1).rows[-1][-1] == int(problem is None)


@pytest.mark.parametrize("draw", [scenarios.draw_scenario, meshes.draw_mesh])
def test_a_seed_draws_the_same_input_again(
    draw: Callable[[np.random.Generator], Trial], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(scenarios, "place", lambda: tmp_path)
    monkeypatch.setattr(meshes, "place", lambda: tmp_path)

    def drawn(seed: int) -> tuple[str, dict[str, bytes]]:
        for path in tmp_path.iterdir():
            path.unlink()
        trial = draw(np.random.default_rng(seed))
        return trial.mutation, {p.name: p.read_bytes() for p in tmp_path.iterdir()}

    first = [drawn(seed) for seed in range(12)]
    assert first == [drawn(seed) for seed in range(12)]
    assert len({told for told, _ in first}) > 6


def test_the_unspoilt_jacket_is_the_jacket_and_a_spoilt_one_is_not() -> None:
    jacket = meshes._jacket()
    assert meshes._unlike_jacket(jacket.x, jacket.faces, True) is None
    spoilt = jacket.x.copy()
    spoilt[100] += [0.8, 0.0, 0.0]
    assert meshes._unlike_jacket(spoilt, jacket.faces, False) is not None
    half = jacket.faces[: len(jacket.faces) // 2]
    assert meshes._unlike_jacket(jacket.x, half, False) is not None
