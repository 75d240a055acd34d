"""Runs trials in a worker process, which may hang or crash without harm to the study."""

from __future__ import annotations

import multiprocessing
from collections.abc import Callable, Sequence
from multiprocessing.connection import Connection
from pathlib import Path

import numpy as np

from benchmarks.inputs import measurements
from benchmarks.inputs.meshes import draw_mesh
from benchmarks.inputs.messages import draw_message
from benchmarks.inputs.scenarios import draw_scenario
from benchmarks.inputs.trials import Expect, Outcome, Result, Trial, carry_out

# Function that draws a trial, by kind of input.
KINDS: dict[str, Callable[[np.random.Generator], Trial]] = {
    "scenario": draw_scenario,
    "mesh": draw_mesh,
    "measured": measurements.draw_measurement,
    "message": draw_message,
}
# Timeout for a process to start and compile its kernels, s.
_STARTING = 300.0


class Worker:
    """Runs one trial at a time.

    Args:
        kinds: Kinds of input that will be requested.
        base: Folder with the valid inputs that trials start from.
        limit: Time without an answer after which a trial counts as silent, s.
    """

    def __init__(self, kinds: Sequence[str], base: Path, limit: float) -> None:
        self._kinds, self._base, self._limit = tuple(kinds), base, limit
        self._start()

    def run(self, seed: int, index: int, kind: str) -> Result:
        """Runs the trial `index` of a kind of input and returns its result."""
        self._pipe.send((seed, index, kind))
        mutation = ""
        try:
            if self._pipe.poll(self._limit):
                mutation = self._pipe.recv()
            if mutation and self._pipe.poll(self._limit):
                result: Result = self._pipe.recv()
                return result
            outcome, problem = Outcome.SILENT, f"no answer within {self._limit:g} s"
        except EOFError:
            self._process.join()
            outcome = Outcome.DIED
            problem = f"the process ended with status {self._process.exitcode}"
        self.close()
        self._start()
        return Result(index, kind, mutation, Expect.EITHER, outcome, "", self._limit, problem)

    def close(self) -> None:
        """Kills the worker process."""
        self._process.kill()
        self._process.join()

    def _start(self) -> None:
        context = multiprocessing.get_context("spawn")
        self._pipe, other = context.Pipe()
        self._process = context.Process(
            target=_serve, args=(other, self._kinds, self._base), daemon=True
        )
        self._process.start()
        other.close()
        if not self._pipe.poll(_STARTING):
            raise RuntimeError(f"a process did not start within {_STARTING:g} s")
        self._pipe.recv()


def draw(seed: int, index: int, kind: str) -> Trial:
    """Draws a trial from seed and index."""
    return KINDS[kind](np.random.default_rng([seed, index]))


def _serve(pipe: Connection, kinds: Sequence[str], base: Path) -> None:
    measurements.use_base(base)
    # compile kernels and read files now, so that trials do not include it
    for kind in kinds:
        carry_out(0, kind, draw(0, 0, kind))
    pipe.send("ready")
    while True:
        try:
            seed, index, kind = pipe.recv()
        except EOFError:
            return
        trial = draw(seed, index, kind)
        pipe.send(f"{kind} {trial.mutation}")
        pipe.send(carry_out(index, kind, trial))
