"""Reads the log of a run, `run.h5`, lazily."""

from __future__ import annotations

import json
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from types import TracebackType
from typing import Any, NamedTuple

import h5py
import numpy as np
import numpy.typing as npt
import yaml

from drake_dress.errors import UserError
from drake_dress.hdf5_state import Hdf5State, look_at
from drake_dress.models.arrays import BoolArray, FloatArray, IndexArray, IntArray
from drake_dress.models.sides import SIDES
from drake_dress.report.log_schema import COMPLETE, LOOPS, check_log


class LoggedForecast(NamedTuple):
    """What the controllers foresaw of the person, at T samples.

    Attributes:
        joint_position: (T,6,3) joints `FORECAST_AHEAD` later, m.
        radius: (T,6) of balls about them that hold the joints with probability 0.9, m.
        intent: (T,2) probability that the left, the right arm moves by the person's own will.
        is_linear: (T,) 1 where a linear predictor stood in for the network, else 0.
    """

    joint_position: FloatArray
    radius: FloatArray
    intent: FloatArray
    is_linear: FloatArray


@dataclass(frozen=True)
class RunLog:
    """A run's log, opened for reading; large datasets are read one sample at a time.

    Open it with `RunLog.open`, which checks the schema and the presence and shapes of datasets. It
    is a context manager.

    Attributes:
        path: Path of the file.
        file: The open HDF5 file, for data without a property here.
    """

    path: Path
    file: h5py.File

    @staticmethod
    def open(path: str | Path) -> RunLog:
        """Opens a log.

        Raises:
            UserError: The file is missing, being written, truncated, not HDF5 or of another schema,
                or a dataset is missing or has the wrong shape.
        """
        path = Path(path)
        try:
            found = look_at(path)
        except FileNotFoundError as error:
            raise UserError(str(path), "", "no such file; expected a run.h5") from error
        except (OSError, ValueError) as error:
            message = f"cannot be read: {getattr(error, 'strerror', None) or error}"
            raise UserError(str(path), "", f"{message}; expected a run.h5") from error
        if found.state is Hdf5State.OPEN:
            message = "is still being written by a run; wait until it has ended"
            raise UserError(str(path), "", message)
        if found.state not in (Hdf5State.SOUND, Hdf5State.KILLED):
            raise UserError(str(path), "", f"{found.message}; expected a run.h5")
        try:
            file = h5py.File(path, "r")
        except OSError as error:
            if found.state is Hdf5State.KILLED:
                message = f"{found.message}, and cannot be read; expected a run.h5"
            else:
                message = "is damaged: HDF5 cannot open it; expected a run.h5"
            raise UserError(str(path), "", message) from error
        try:
            check_log(str(path), file)
        except (OSError, RuntimeError, KeyError) as error:
            file.close()
            message = f"is damaged: {error}; expected a run.h5"
            raise UserError(str(path), "", message) from error
        except BaseException:
            file.close()
            raise
        return RunLog(path, file)

    @property
    def estimated(self) -> bool:
        """Whether garment and person are estimates, because the truth was not known."""
        return str(self.file.attrs.get("source", "")) == "estimate"

    @property
    def commands(self) -> tuple[FloatArray, FloatArray] | None:
        """Times of hardware commands (K,), s, and ages (K,2) of the statuses they respond to, s."""
        if "/station/command_time" not in self.file:
            return None
        names = ("/station/command_time", "/station/status_age")
        times, ages = (np.asarray(self.file[name], dtype=np.float64) for name in names)
        return times, ages

    @property
    def start_up(self) -> float | None:
        """Time from the start of the process to its first command to hardware, s."""
        value = self.file.attrs.get("start_up")
        return None if value is None else float(value)

    @property
    def dropped_messages(self) -> dict[str, int] | None:
        """Number of repeated and late messages dropped in a hardware run, by source."""
        text = self.file.attrs.get("dropped_messages")
        return None if text is None else dict(json.loads(str(text)))

    @property
    def behind(self) -> float | None:
        """Real time by which a hardware run fell behind the requested rate, s."""
        value = self.file.attrs.get("behind")
        return None if value is None else float(value)

    @property
    def ended_by(self) -> str | None:
        """The station fault that ended the run; None if there was none."""
        text = self.file.attrs.get("ended_by")
        return None if text is None else str(text)

    @property
    def killed(self) -> bool:
        """Whether the writing process ended without closing the log; flushed data is kept."""
        return not self.file.attrs.get(COMPLETE, True) and self.ended_by is None

    @property
    def events(self) -> list[str]:
        """Changes at the station: lines with a time, s, and a description."""
        return str(self.file.attrs.get("events", "")).splitlines()

    def close(self) -> None:
        """Closes the file."""
        self.file.close()

    def __enter__(self) -> RunLog:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def __len__(self) -> int:
        return len(self.time)

    @cached_property
    def time(self) -> FloatArray:
        """(T,) s, strictly increasing."""
        return self._read("/time")

    @property
    def scenario_text(self) -> str:
        """The resolved scenario, YAML."""
        return str(self.file.attrs.get("scenario", ""))

    @cached_property
    def scenario(self) -> Any:
        """The content of the resolved scenario; None if it is not YAML."""
        try:
            return yaml.safe_load(self.scenario_text)
        except yaml.YAMLError:
            return None

    @property
    def version(self) -> str:
        """Version of drake_dress that wrote the log."""
        return str(self.file.attrs.get("version", ""))

    @property
    def seed(self) -> int:
        """Seed of the run."""
        return int(self.file.attrs.get("seed", 0))

    @cached_property
    def faces(self) -> IntArray:
        """(F,3) node indices."""
        return np.asarray(self.file["/garment/faces"], dtype=np.int32)

    @cached_property
    def rest_position(self) -> FloatArray:
        """(n,3) rest shape, garment frame, m."""
        return self._read("/garment/rest_position")

    @cached_property
    def loops(self) -> dict[str, IndexArray]:
        """Node indices of the loop around each opening, by name."""
        return {n: np.asarray(self.file[f"/garment/loops/{n}"], dtype=np.int64) for n in LOOPS}

    def garment_position(self, sample: int) -> FloatArray:
        """Returns the plant's garment (n,3) at a sample, m."""
        return np.asarray(self.file["/garment/position"][sample], dtype=np.float64)

    def contact(self, sample: int) -> npt.NDArray[np.int8] | None:
        """Returns (n,) 0 none, 1 stick, 2 slip at a sample; None if not logged."""
        if "/garment/contact" not in self.file:
            return None
        return np.asarray(self.file["/garment/contact"][sample], dtype=np.int8)

    def contact_force(self, sample: int) -> FloatArray | None:
        """Returns forces (n,3) of the person on the garment at a sample, N; None if not logged."""
        if "/garment/contact_force" not in self.file:
            return None
        return np.asarray(self.file["/garment/contact_force"][sample], dtype=np.float64)

    @cached_property
    def joint_position(self) -> FloatArray:
        """(T,6,3) shoulder, elbow, hand of left, then of right, m."""
        return self._read("/human/joint_position")

    @cached_property
    def joint_radius(self) -> FloatArray:
        """(6,) limb radius at these joints, m."""
        return self._read("/human/radius")

    @cached_property
    def capsules(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Ends (T,c,3), (T,c,3) and radii (c,2) at both ends of the person's capsules, m.

        If the log has none: the four limbs between the joints, with the joints' radii.
        """
        if "/human/capsule_radius" in self.file:
            radius = self._read("/human/capsule_radius")
            end = "/human/capsule_end_radius"
            return (
                self._read("/human/capsule_a"),
                self._read("/human/capsule_b"),
                np.column_stack([radius, self._read(end) if end in self.file else radius]),
            )
        first, second = [0, 1, 3, 4], [1, 2, 4, 5]
        radii = np.column_stack([self.joint_radius[first], self.joint_radius[second]])
        return self.joint_position[:, first], self.joint_position[:, second], radii

    @cached_property
    def of_chair(self) -> BoolArray:
        """(c,) whether each capsule is of the person's wheelchair."""
        name = "/human/capsule_of_chair"
        if name in self.file:
            return np.asarray(self.file[name]).astype(bool)
        return np.zeros(len(self.capsules[2]), dtype=bool)

    @cached_property
    def intent(self) -> IndexArray | None:
        """(T,2) 0 the arm rests or follows the garment, 1 the person moves it; left, right.

        None if not logged: in runs on hardware and in older logs.
        """
        if "/human/intent" not in self.file:
            return None
        return np.asarray(self.file["/human/intent"], dtype=np.int64)

    @cached_property
    def forecast(self) -> LoggedForecast | None:
        """What the controllers foresaw of the person; None if not logged."""
        names = {f: f"/forecast/human/{f}" for f in LoggedForecast._fields}
        if any(name not in self.file for name in names.values()):
            return None
        return LoggedForecast(
            **{f: np.asarray(self.file[name], dtype=np.float64) for f, name in names.items()}
        )

    @cached_property
    def gripper_position(self) -> dict[str, FloatArray]:
        """Side to (T,3), m."""
        return {side: self._read(f"/gripper/{side}/position") for side in SIDES}

    @cached_property
    def gripper_force(self) -> dict[str, FloatArray]:
        """Side to (T,3), of the garment on the gripper, N."""
        return {side: self._read(f"/gripper/{side}/force") for side in SIDES}

    @cached_property
    def dressing(self) -> dict[str, FloatArray]:
        """Side to (T,3): s, l in m, theta in rad."""
        return {
            side: np.stack([self._read(f"/dressing/{side}/{n}") for n in ("s", "l", "theta")], 1)
            for side in SIDES
        }

    @cached_property
    def stage(self) -> IndexArray:
        """(T,2) indices into `STAGE_NAMES`; left, right."""
        return np.asarray(self.file["/control/stage"], dtype=np.int64)

    @cached_property
    def safety(self) -> IndexArray | None:
        """(T,2) flags of `models.control.safety.Verdict`; left, right; None if not logged."""
        if "/control/safety" not in self.file:
            return None
        return np.asarray(self.file["/control/safety"], dtype=np.int64)

    def solve_time(self, controller: str) -> FloatArray:
        """Returns (T,) of the `global` or `local` controller, s; NaN if no solve ended."""
        name = f"/control/{controller}/solve_time"
        return self._read(name) if name in self.file else np.full(len(self), np.nan)

    @cached_property
    def plan_delay(self) -> float | None:
        """Time from an observation to the use of its plan, s; None if not in the scenario."""
        try:
            return float(self.scenario["controller"]["global_mpc"]["delay"])
        except (KeyError, TypeError, ValueError):
            return None

    @cached_property
    def lets_go(self) -> bool:
        """Whether the scenario asks to lay the coat and let it go; False for older logs."""
        try:
            controller = self.scenario["controller"]
            return bool(controller["finish"]["release"]) and controller["method"] != "local"
        except (KeyError, TypeError):
            return False

    def solves(self, controller: str) -> IndexArray:
        """Returns (T,) number of solves of a controller since the previous sample.

        For older logs without this count, it is 1 for each sample that has a solve time.
        """
        name = f"/control/{controller}/solves"
        if name not in self.file:
            return np.isfinite(self.solve_time(controller)).astype(np.int64)
        return np.asarray(self.file[name], dtype=np.int64)

    def _read(self, name: str) -> FloatArray:
        return np.asarray(self.file[name], dtype=np.float64)
