"""Writes the log of a run, `run.h5`, while it runs.

The file must be usable however the run ends:

An interrupted run closes the file with all samples complete. A full disk ends the log before an
HDF5 write fails, which HDF5 does not survive: space is allocated to the file before each write, and
space for the end is reserved. A killed process leaves the data of the last flush. For this, samples
are written in batches about once a second, rows of bulky datasets are never rewritten, and HDF5
keeps its metadata in memory between flushes, so that the file on disk is consistent except during a
flush. That memory grows with every row; closing and reopening the file every few thousand samples
frees it.

Writing and flushing one second of samples takes tens of milliseconds. A thread does it, so that no
command waits. A write error is raised when a later sample is appended.
"""

from __future__ import annotations

import os
import time as clock
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Any

import h5py
import numpy as np
import numpy.typing as npt

from drake_dress.errors import UserError
from drake_dress.file_output import remove_results
from drake_dress.models.sides import SIDES, Side
from drake_dress.report.disk import give_back, keep_room, locked, reserved
from drake_dress.report.log_layout import LogContent, begin_log, label
from drake_dress.report.log_schema import COMPLETE

_FLUSH_PERIOD = 1.0  # s of wall time
# Disk space reserved for the end, and upper bound of what HDF5 writes besides samples, bytes.
_RESERVE, _BESIDE = 16 << 20, 4 << 20
_MOST_WAITING = 64  # samples kept in memory between flushes
_MOST_BEHIND = 512  # samples kept while earlier ones are still being written
_MOST_OPEN = 2000  # samples written before the file is reopened


@dataclass(frozen=True)
class ArmSample:
    """Logged data of one arm.

    Attributes:
        q, q_commanded: (7,) rad. v: (7,) rad/s. torque: (7,) N·m.
        q_least, q_most: (7,) extremes since the previous sample, rad; None: current values.
        v_peak, torque_peak: (7,) largest magnitudes since the previous sample, rad/s, N·m; None:
            current values.
    """

    q: npt.ArrayLike
    v: npt.ArrayLike
    q_commanded: npt.ArrayLike
    torque: npt.ArrayLike
    q_least: npt.ArrayLike | None = None
    q_most: npt.ArrayLike | None = None
    v_peak: npt.ArrayLike | None = None
    torque_peak: npt.ArrayLike | None = None

    def rows(self) -> dict[str, npt.ArrayLike]:
        """Returns the rows to write, by name of the series."""
        now = {
            "q_least": self.q,
            "q_most": self.q,
            "v_peak": np.abs(self.v),
            "torque_peak": np.abs(self.torque),
        }
        return {name: now[name] if row is None else row for name, row in vars(self).items()}


@dataclass(frozen=True)
class ForecastSample:
    """What the controllers foresee of the person at one time.

    Attributes:
        joint_position: (6,3) joints `FORECAST_AHEAD` later, m.
        radius: (6,) of balls about them that hold the joints with probability 0.9, m.
        intent: (2,) probability that the left, the right arm moves by the person's own will.
        is_linear: 1 if a linear predictor stood in for the network, else 0.
    """

    joint_position: npt.ArrayLike
    radius: npt.ArrayLike
    intent: npt.ArrayLike
    is_linear: int


@dataclass(frozen=True)
class Sample:
    """Logged data of one time. Positions in the world frame, SI units.

    Attributes:
        time: Time, greater than that of the previous sample, s.
        garment_position: (n,3) the plant's garment, m.
        contact: (n,) 0 none, 1 stick, 2 slip; None if not known.
        contact_force: (n,3) of the person on the garment, N; None if not known.
        joint_position: (6,3) shoulder, elbow, hand of left, then of right, m.
        gripper_position: Side to (3,), m.
        gripper_force: Side to (3,) of the garment on the gripper, N.
        dressing: Side to (s, l in m, theta in rad).
        stage: (2,) index into `STAGE_NAMES`; left, right.
        global_solve_time, local_solve_time: Duration of the last solve, s; NaN if none ended.
        global_solves, local_solves: Number of solves since the previous sample; None: 1 if there is
            a solve time, else 0.
        estimate_garment_position: (m,3) the controller's estimate, m; None if there is none.
        estimate_joint_position: (6,3) the controller's estimate, m; None if there is none.
        capsule_a, capsule_b: (c,3) ends of the person's capsules, m; None if not logged.
        arms: Data of the arm on each side, if there are arms.
        clearance: (3,) least distance since the previous sample between the arms, and from the left
            and the right one to the person, m, if there are arms.
        safety: (2,) flags of `models.control.safety.Verdict` raised since the previous sample;
            left, right.
        intent: (2,) 0 the arm rests or follows the garment, 1 it moves by the person's own will;
            left, right; None if not known.
        forecast: What the controllers foresee; None if they do not.
    """

    time: float
    garment_position: npt.ArrayLike
    contact: npt.ArrayLike | None
    contact_force: npt.ArrayLike | None
    joint_position: npt.ArrayLike
    gripper_position: dict[str, npt.ArrayLike]
    gripper_force: dict[str, npt.ArrayLike]
    dressing: Mapping[Side, tuple[float, float, float]]
    stage: npt.ArrayLike
    global_solve_time: float = np.nan
    local_solve_time: float = np.nan
    global_solves: int | None = None
    local_solves: int | None = None
    estimate_garment_position: npt.ArrayLike | None = None
    estimate_joint_position: npt.ArrayLike | None = None
    capsule_a: npt.ArrayLike | None = None
    capsule_b: npt.ArrayLike | None = None
    safety: npt.ArrayLike = (0, 0)
    arms: Mapping[Side, ArmSample] | None = None
    clearance: npt.ArrayLike | None = None
    intent: npt.ArrayLike | None = None
    forecast: ForecastSample | None = None


class RunLogWriter:
    """Writes a run's log sample by sample; a context manager.

    Args:
        path: Path of the HDF5 file; an existing file is replaced.
        content: Data about the run as a whole.
        flush_period: Wall time between flushes, s.
        results: Names of result files of an earlier run in the same directory; they are removed
            before its log is replaced, so that results of two runs never mix.

    Raises:
        UserError: The file cannot be written.
        ValueError: A sample has another shape, or is not later than the previous one.
    """

    def __init__(
        self,
        path: str | Path,
        content: LogContent,
        flush_period: float = _FLUSH_PERIOD,
        results: Sequence[str] = (),
    ) -> None:
        self.path = Path(path)
        # first of all, since a run that cannot start must not destroy files of an earlier one
        self._reserve = reserved(self.path.parent, _RESERVE + _BESIDE)
        if self._reserve is None and os.access(self.path.parent, os.W_OK):
            raise self._no_room()
        self._file, lock = self._replace_log(str(path), results)
        self._lock: int | None = lock
        self._secure_room(lock)
        self._unflushed = 0  # bytes
        self._flush_period = flush_period
        self._count = self._count_opened = 0
        self._last_time = -np.inf
        self._waiting: list[dict[str, npt.NDArray[Any]]] = []
        self._worker = ThreadPoolExecutor(1, "log")
        self._writing: Future[None] | None = None
        self._series = begin_log(self._file, content)
        self._shapes: dict[str, tuple[int, ...]] = {
            name: dataset.shape[1:] for name, dataset in self._series.items()
        }
        self._file.flush()
        self._flushed_at = clock.monotonic()

    def append(self, sample: Sample) -> None:
        """Appends one sample; writes and flushes the samples when a flush is due.

        Raises:
            OSError: The disk is full; earlier samples are in the file.
        """
        if not sample.time > self._last_time:
            raise ValueError(f"sample at {sample.time} s is not later than {self._last_time} s")
        row = {name: np.asarray(value) for name, value in self._rows(sample).items()}
        for name, value in row.items():
            if value.shape != self._shapes[name]:
                raise ValueError(
                    f"{name}: shape {value.shape} given, {self._shapes[name]} expected"
                )
        # copy: queued samples must not change
        self._waiting.append({name: value.copy() for name, value in row.items()})
        self._last_time = sample.time
        due = clock.monotonic() - self._flushed_at >= self._flush_period
        if due or len(self._waiting) >= _MOST_WAITING:
            self._hand_over(due)

    def note(self, name: str, value: str | float) -> None:
        """Writes an attribute of the file, which may be closed already.

        Raises:
            OSError: There is not enough disk space.
        """
        with self._opened(len(str(value))) as file:
            file.attrs[name] = value

    def series(self, name: str, rows: npt.ArrayLike, unit: str) -> None:
        """Writes a separate series, whose rows do not belong to samples.

        Raises:
            OSError: There is not enough disk space.
        """
        data = np.asarray(rows, dtype=np.float64)
        with self._opened(data.nbytes) as file:
            label(file.create_dataset(name, data=data), unit, None)

    @contextmanager
    def _opened(self, size: int) -> Iterator[h5py.File]:
        """Yields the open file, with `size` bytes of disk space allocated."""
        self._drain()
        if self._file:
            self._make_room(size)
            yield self._file
            return
        number = os.open(self.path, os.O_RDWR)
        try:
            keep_room(number, os.fstat(number).st_size, size + _BESIDE)
            # HDF5's own lock would conflict with ours
            with h5py.File(self.path, "a", locking=self._lock is None) as file:
                yield file
        finally:
            give_back(number)
            os.close(number)

    def close(self) -> None:
        """Closes the file with all appended samples complete; may be called twice.

        Raises:
            OSError: The last samples could not be written.
        """
        if self._lock is None:
            return
        try:
            self._drain()
        finally:
            self._worker.shutdown()
            self._release()
            try:
                if self._file:
                    self._finish()
            finally:
                give_back(self._lock)
                os.close(self._lock)
                self._lock = None

    def __enter__(self) -> RunLogWriter:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def _replace_log(self, path: str, results: Sequence[str]) -> tuple[h5py.File, int]:
        """Removes the results of an earlier run; returns the new file and its lock.

        Args:
            path: Path as the caller wrote it, for messages.
            results: Names of files to remove.

        Raises:
            UserError: The file cannot be written.
        """
        try:
            lock = locked(self.path)
            remove_results(self.path.parent, results)
            return _open(self.path, "w"), lock
        except BlockingIOError as error:
            self._release()
            message = "cannot be written: another run writes it, or something reads it"
            raise UserError(path, "", message) from error
        except OSError as error:
            self._release()
            raise UserError(path, "", f"cannot be written as HDF5: {error}") from error

    def _secure_room(self, lock: int) -> None:
        """Reserves disk space for the beginning and the end of the log.

        Raises:
            UserError: There is not enough space; the file is removed.
        """
        try:
            if self._reserve is None:
                raise OSError
            os.ftruncate(self._reserve, _RESERVE)
            keep_room(lock, 0, _BESIDE)
        except OSError as error:
            self._release()
            self._file.close()
            os.close(lock)
            self.path.unlink()
            raise self._no_room() from error

    def _rows(self, sample: Sample) -> dict[str, Any]:
        rows: dict[str, Any] = {
            "/time": sample.time,
            "/garment/position": sample.garment_position,
            "/human/joint_position": sample.joint_position,
            "/control/stage": sample.stage,
            "/control/safety": sample.safety,
            "/control/global/solve_time": sample.global_solve_time,
            "/control/local/solve_time": sample.local_solve_time,
        }
        for name, solves, spent in (
            ("global", sample.global_solves, sample.global_solve_time),
            ("local", sample.local_solves, sample.local_solve_time),
        ):
            rows[f"/control/{name}/solves"] = np.isfinite(spent) if solves is None else solves
        for side in SIDES:
            rows[f"/gripper/{side}/position"] = sample.gripper_position[side]
            rows[f"/gripper/{side}/force"] = sample.gripper_force[side]
            for coordinate, value in zip(("s", "l", "theta"), sample.dressing[side], strict=True):
                rows[f"/dressing/{side}/{coordinate}"] = value
        if sample.arms is not None:
            for side, arm in sample.arms.items():
                rows |= {f"/arm/{side}/{name}": row for name, row in arm.rows().items()}
        optional = {
            "/garment/contact": sample.contact,
            "/garment/contact_force": sample.contact_force,
            "/arm/clearance": sample.clearance,
            "/estimate/human/joint_position": sample.estimate_joint_position,
            "/estimate/garment/position": sample.estimate_garment_position,
            "/human/intent": sample.intent,
            "/human/capsule_a": sample.capsule_a,
            "/human/capsule_b": sample.capsule_b,
        }
        if sample.forecast is not None:
            optional |= {f"/forecast/human/{k}": v for k, v in vars(sample.forecast).items()}
        for name, array in optional.items():
            if name in self._shapes:
                # not the dataset's shape: reading it would wait for the thread that writes
                rows[name] = np.full(self._shapes[name], np.nan) if array is None else array
        return rows

    def _hand_over(self, flush: bool) -> None:
        """Passes the queued samples to the writing thread, unless it is still busy."""
        busy = self._writing is not None and not self._writing.done()
        if busy and len(self._waiting) < _MOST_BEHIND:
            return
        self._drain()
        try:
            self._make_room(_bytes(self._waiting))
        except OSError:
            self.close()
            raise
        batch, self._waiting = self._waiting, []
        self._writing = self._worker.submit(self._write, batch, flush)
        if flush:
            self._flushed_at = clock.monotonic()

    def _drain(self) -> None:
        """Waits until the thread has written its samples.

        Raises:
            OSError: The thread could not write them.
        """
        writing, self._writing = self._writing, None
        if writing is not None:
            writing.result()

    def _write(self, batch: list[dict[str, npt.NDArray[Any]]], flush: bool) -> None:
        """Writes a batch of samples, one dataset after the other."""
        if batch:
            count = self._count + len(batch)
            for name in batch[0]:
                dataset = self._series[name]
                dataset.resize(count, axis=0)
                dataset[self._count :] = np.stack([row[name] for row in batch])
            self._count = count
        if flush:
            self._file.flush()
            self._unflushed = 0
            if self._count - self._count_opened >= _MOST_OPEN:
                self._open_anew()

    def _open_anew(self) -> None:
        """Reopens the file, to free HDF5's in-memory metadata, all of which is on disk."""
        self._file.close()
        self._file = _open(self.path, "r+")
        self._series = {name: self._file[name] for name in self._series}
        self._count_opened = self._count

    def _make_room(self, size: int) -> None:
        """Allocates `size` more bytes of disk space to the open file.

        Raises:
            OSError: There is not enough space.
        """
        assert self._lock is not None
        needed = self._unflushed + size
        try:
            keep_room(self._lock, self._file.id.get_filesize(), needed + _BESIDE)
        except OSError as error:
            raise OSError(error.errno, error.strerror, str(self.path)) from error
        self._unflushed = needed

    def _finish(self) -> None:
        """Writes the queued samples and closes the open file."""
        try:
            self._make_room(_bytes(self._waiting))
            self._write(self._waiting, flush=False)
            self._waiting = []
            # An interrupt may have left a sample incomplete.
            for dataset in self._series.values():
                if dataset.shape[0] != self._count:
                    dataset.resize(self._count, axis=0)
            self._file.attrs.modify(COMPLETE, True)
        finally:
            self._file.close()

    def _no_room(self) -> UserError:
        least = (_RESERVE + _BESIDE) >> 20
        return UserError(str(self.path), "", f"no room on the disk, expected {least} MB at least")

    def _release(self) -> None:
        """Releases the reserved disk space."""
        if self._reserve is not None:
            os.close(self._reserve)
            self._reserve = None


def _bytes(rows: list[dict[str, npt.NDArray[Any]]]) -> int:
    return sum(value.nbytes for row in rows for value in row.values())


def _open(path: Path, mode: str) -> h5py.File:
    """Opens an HDF5 file that keeps its metadata in memory until it is flushed."""
    file = h5py.File(path, mode, locking=False)
    configuration = file.id.get_mdc_config()
    configuration.evictions_enabled = False
    configuration.incr_mode = 0
    configuration.flash_incr_mode = 0
    configuration.decr_mode = 0
    file.id.set_mdc_config(configuration)
    return file
