"""Steps the garment in-process or in a worker, in parallel with the rest of the diagram.

A step starts with all its inputs, and its result is read one period later. Both variants give the
same numbers.
"""

from __future__ import annotations

import contextlib
import gc
import multiprocessing
import os
from dataclasses import dataclass
from multiprocessing.connection import Connection
from typing import Any, Protocol

import cloudpickle
import numpy as np
import numpy.typing as npt

from drake_dress.models.arrays import FloatArray
from drake_dress.models.cloth.contact.obstacles import Obstacles
from drake_dress.models.cloth.layered import Integrator
from drake_dress.models.cloth.state import ClothState
from drake_dress.systems.shared_memory import SharedMemory
from drake_dress.worker_pool import end_with, kill_at_exit, start_process

# Fields of a state: vectors per node, integers per node, and the warm start of the solvers.
_VECTORS, _NUMBERS = ("x", "v", "reaction", "acceleration"), ("mode", "owner", "tangled")
_SOLVER = "solver"
# Message that starts a step: it continues from the last state, or from a given one.
_GO_ON, _FROM_GIVEN = b"\0", b"\1"


@dataclass(frozen=True)
class Surroundings:
    """Packs all inputs of a step other than the garment into one array.

    Attributes:
        radius: (m,2) radii of the limbs at both ends, m.
        held_count: Number of nodes with prescribed motion.
    """

    radius: FloatArray
    held_count: int

    @property
    def size(self) -> int:
        """Size of the array."""
        return 12 * len(self.radius) + 3 * self.held_count + 1

    def flat(self, capsules: Obstacles, held_velocity: FloatArray) -> FloatArray:
        """Returns the array of `size` that packs limbs and the held nodes' velocities (k,3).

        The velocities are (0,3) once the nodes are let go.
        """
        c = capsules
        held = np.zeros((self.held_count, 3))
        is_holding = len(held_velocity) > 0
        if is_holding:
            held[:] = held_velocity
        parts = (c.a, c.b, c.velocity, c.angular_velocity, held, np.array([float(is_holding)]))
        return np.concatenate([p.ravel() for p in parts])

    def of(self, flat: FloatArray) -> tuple[Obstacles, FloatArray]:
        """Returns the limbs and held velocities (k,3), or (0,3), packed in an array."""
        end = 12 * len(self.radius)
        a, b, velocity, omega = flat[:end].reshape(4, -1, 3)
        held = flat[end:-1].reshape(-1, 3)
        return Obstacles(a, b, self.radius, velocity, omega), held if flat[-1] > 0.5 else held[:0]


class Steps(Protocol):
    """Steps a garment, one step at a time."""

    def begin(self, state: ClothState, around: FloatArray) -> None:
        """Starts a step from `state`, with `around` packed by `Surroundings`.

        A step that was started but not ended is discarded.
        """

    def end(self) -> ClothState:
        """Returns the state after the last step started.

        The step after the next one may overwrite its arrays.

        Raises:
            ValueError: The state is not finite.
            RuntimeError: No step was started, or the worker process has ended.
        """


class StepsHere:
    """Computes a step in this process when its result is requested.

    Args:
        cloth: Integrator of the garment.
        surroundings: Layout of the surroundings.
    """

    def __init__(self, cloth: Integrator, surroundings: Surroundings) -> None:
        self._cloth, self._surroundings = cloth, surroundings
        self._begun: tuple[ClothState, FloatArray] | None = None

    def begin(self, state: ClothState, around: FloatArray) -> None:
        """See `Steps`."""
        self._begun = state, around

    def end(self) -> ClothState:
        """See `Steps`."""
        if self._begun is None:
            raise RuntimeError("no step was begun")
        (state, around), self._begun = self._begun, None
        return self._cloth.step(state, *self._surroundings.of(around))[0]


class StepsInWorker:
    """Steps the garment in a worker process.

    States are double-buffered in shared memory, so that one is read while the next is computed.
    The worker starts at once and ends with this process, even if this process crashes.

    Args:
        cloth: Integrator of the garment; it is copied.
        surroundings: Layout of the surroundings.
    """

    def __init__(self, cloth: Integrator, surroundings: Surroundings) -> None:
        # with fork from a process that has threads, Numba and BLAS may hang
        context = multiprocessing.get_context("spawn")
        shared = _Shared(cloth.elements.node_count, surroundings.size)
        self._places, self._around = shared.states(), shared.around()
        self._pipe, other = context.Pipe()
        self._process = context.Process(
            target=_serve,
            args=(shared, other, os.getpid()),
            daemon=True,
            name="garment",
        )
        start_process(self._process)
        kill_at_exit(self._process)
        other.close()
        # If the process has already ended, the first step reports it.
        with contextlib.suppress(OSError):
            # the worker may be unable to import the class of an effect
            self._pipe.send_bytes(cloudpickle.dumps((cloth, surroundings)))
        self._under_way = False
        self._place = 0
        self._last: ClothState | None = None

    def begin(self, state: ClothState, around: FloatArray) -> None:
        """See `Steps`."""
        if self._under_way:
            self._answer()
        goes_on = state is self._last
        self._place = 1 - self._place
        if not goes_on:
            _copy(state, self._places[self._place])
        self._around[:] = around
        try:
            self._pipe.send_bytes(_GO_ON if goes_on else _FROM_GIVEN)
        except OSError as error:
            raise RuntimeError(self._gone()) from error
        self._under_way = True

    def end(self) -> ClothState:
        """See `Steps`."""
        if not self._under_way:
            raise RuntimeError("no step was begun")
        problem = self._answer()
        if problem:
            raise ValueError(problem)
        self._last = self._places[self._place]
        return self._last

    def _answer(self) -> str:
        """Waits for the step in progress; returns its error message, empty if it succeeded."""
        self._under_way, self._last = False, None
        try:
            return self._pipe.recv_bytes().decode()
        except (EOFError, OSError) as error:
            raise RuntimeError(self._gone()) from error

    def _gone(self) -> str:
        self._process.join(1.0)
        return f"the process that steps the garment has ended (exit {self._process.exitcode})"


class _Shared:
    """Memory shared by the two processes: two states and the surroundings.

    Args:
        n: Number of nodes.
        size: Size of the surroundings' array.
    """

    def __init__(self, n: int, size: int) -> None:
        self._n, self._size = n, size
        self._block = SharedMemory(8 * size + 2 * self._state_bytes)

    @property
    def _state_bytes(self) -> int:
        n = self._n
        return n * (3 * 8 * len(_VECTORS) + 4 * len(_NUMBERS)) + 4 * 2 * (n + 1)

    def around(self) -> FloatArray:
        """Returns the array of the surroundings."""
        return np.frombuffer(self._block.memory, np.float64, self._size)

    def states(self) -> list[ClothState]:
        """Returns the two states, whose arrays are views of the shared memory."""
        found, memory, n = [], self._block.memory, self._n
        for k in range(2):
            at = 8 * self._size + k * self._state_bytes
            arrays: dict[str, npt.NDArray[Any]] = {}
            for name in _VECTORS:
                arrays[name] = np.frombuffer(memory, np.float64, 3 * n, at).reshape(-1, 3)
                at += 24 * n
            for name in _NUMBERS:
                arrays[name] = np.frombuffer(memory, np.int32, n, at)
                at += 4 * n
            solver = np.frombuffer(memory, np.int32, 2 * (n + 1), at)
            arrays[_SOLVER] = solver.reshape(2, -1)
            found.append(ClothState(**arrays))
        return found


def _copy(source: ClothState, target: ClothState) -> None:
    for name in (*_VECTORS, *_NUMBERS, _SOLVER):
        getattr(target, name)[:] = getattr(source, name)


def _serve(shared: _Shared, pipe: Connection, parent: int) -> None:
    end_with(parent)
    try:
        cloth, surroundings = pipe.recv()
    except (EOFError, OSError):
        return
    gc.freeze()
    places, around = shared.states(), shared.around()
    place, state = 0, places[0]
    while True:
        try:
            word = pipe.recv_bytes()
        except EOFError:
            return
        place = 1 - place
        if word == _FROM_GIVEN:
            state = ClothState(**{k: np.array(a) for k, a in vars(places[place]).items()})
        try:
            state, _ = cloth.step(state, *surroundings.of(around.copy()))
        except ValueError as error:
            pipe.send_bytes(str(error).encode())
            continue
        _copy(state, places[place])
        pipe.send_bytes(b"")
