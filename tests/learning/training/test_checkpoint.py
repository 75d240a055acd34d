"""Checkpoints: written whole, read as they were, and refused by name if they are damaged."""

from __future__ import annotations

import pickle
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from safetensors.numpy import load_file, save_file

from drake_dress.errors import UserError
from drake_dress.learning.training.checkpoint import Checkpoint

LIKE = {"w": np.arange(6, dtype=np.float32).reshape(2, 3), "b": np.ones(3, dtype=np.float32)}


def some(steps: int = 5) -> tuple[Checkpoint, torch.optim.Optimizer, dict[str, torch.Tensor]]:
    """Returns the checkpoint of a training after some steps."""
    tensors = {k: torch.tensor(v, requires_grad=True) for k, v in LIKE.items()}
    optimiser = torch.optim.AdamW(list(tensors.values()), lr=0.1)
    for _ in range(steps):
        optimiser.zero_grad()
        (tensors["w"].square().sum() + tensors["b"].sin().sum()).backward()
        optimiser.step()
    return Checkpoint.of(steps, tensors, optimiser, LIKE, 0.1 + 0.2, 3), optimiser, tensors


def written(path: Path) -> Path:
    some()[0].write(path)
    return path


def changed(path: Path, change: Any) -> None:
    """Writes the file again with other arrays or metadata."""
    from safetensors import safe_open

    with safe_open(path, framework="numpy") as file:
        told = dict(file.metadata())
    arrays = load_file(path)
    change(arrays, told)
    save_file(arrays, path, told)


def test_a_checkpoint_comes_back_to_the_bit(tmp_path: Path) -> None:
    made = some()[0]
    path = tmp_path / "c.safetensors"
    made.write(path)
    found = Checkpoint.read(path, LIKE)
    assert found is not None
    assert (found.step, found.error, found.misses) == (5, 0.1 + 0.2, 3)
    for name in ("weights", "best", "moments"):
        one, other = getattr(made, name), getattr(found, name)
        # in the order that their gradients are added up in
        assert list(one) == list(other)
        for key in one:
            np.testing.assert_array_equal(one[key], other[key])


def test_moments_go_on_in_another_optimiser_as_in_the_first(tmp_path: Path) -> None:
    made, optimiser, tensors = some()
    other = {k: torch.tensor(v, requires_grad=True) for k, v in made.weights.items()}
    again = torch.optim.AdamW(list(other.values()), lr=0.1)
    made.load_moments(again, other)
    for these, optimised in ((tensors, optimiser), (other, again)):
        for _ in range(3):
            optimised.zero_grad()
            (these["w"].square().sum() + these["b"].sin().sum()).backward()
            optimised.step()
    for name in LIKE:
        torch.testing.assert_close(tensors[name], other[name], rtol=0.0, atol=0.0)


def test_error_that_is_not_finite_comes_back(tmp_path: Path) -> None:
    path = tmp_path / "c.safetensors"
    Checkpoint.new(LIKE).write(path)
    found = Checkpoint.read(path, LIKE)
    assert found is not None
    assert found.error == np.inf
    assert (found.step, found.misses, found.moments) == (0, 0, {})


def test_no_file_is_no_checkpoint(tmp_path: Path) -> None:
    assert Checkpoint.read(tmp_path / "none.safetensors", LIKE) is None


@pytest.mark.parametrize(
    "change",
    [
        lambda arrays, told: arrays.pop("weights/w"),
        lambda arrays, told: arrays.pop("best/b"),
        lambda arrays, told: arrays.pop("moments/exp_avg/w"),
        lambda arrays, told: [arrays.pop(k) for k in list(arrays) if k.startswith("moments")],
        lambda arrays, told: arrays.update({"weights/w": np.zeros((3, 2), dtype=np.float32)}),
        lambda arrays, told: arrays.update({"weights/w": np.zeros((2, 3))}),
        lambda arrays, told: arrays.update({"best/more": np.zeros(2, dtype=np.float32)}),
        lambda arrays, told: arrays.update({"moments/exp_avg_sq/b": np.zeros(4, dtype=np.float32)}),
        lambda arrays, told: told.pop("step"),
        lambda arrays, told: told.update(step="many"),
        lambda arrays, told: told.update(error="small"),
        lambda arrays, told: told.clear(),
    ],
)
def test_checkpoint_of_another_network_or_with_parts_missing_is_refused(
    change: Any, tmp_path: Path
) -> None:
    path = written(tmp_path / "c.safetensors")
    changed(path, change)
    with pytest.raises(UserError, match="remove it to begin anew") as caught:
        Checkpoint.read(path, LIKE)
    assert str(caught.value).startswith(str(path))


@given(data=st.data())
@settings(max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_damaged_checkpoint_is_refused_or_holds_other_numbers(
    data: st.DataObject, tmp_path: Path
) -> None:
    path = written(tmp_path / "c.safetensors")
    content = bytearray(path.read_bytes())
    at = data.draw(st.integers(0, len(content) - 1))
    if data.draw(st.booleans()):
        content[at] ^= data.draw(st.integers(1, 255))
    else:
        del content[at:]
    path.write_bytes(content)
    try:
        found = Checkpoint.read(path, LIKE)
    except UserError as error:
        assert str(error).startswith(str(path))
    else:
        assert found is not None
        assert list(found.weights) == list(LIKE)
        assert all(found.weights[k].shape == LIKE[k].shape for k in LIKE)


@pytest.mark.parametrize("content", [b"", b"garbage", pickle.dumps({"weights/w": 1})])
def test_files_that_are_no_checkpoints_are_refused(content: bytes, tmp_path: Path) -> None:
    path = tmp_path / "c.safetensors"
    path.write_bytes(content)
    with pytest.raises(UserError, match="cannot be read"):
        Checkpoint.read(path, LIKE)
    with pytest.raises(UserError, match="cannot be read"):
        Checkpoint.read(tmp_path, LIKE)
