"""Records what the cameras of a dressing see, with the truth, to track it with many settings."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import Context, EventStatus

from drake_dress.diagrams.assemble import Parts, parts, wired
from drake_dress.diagrams.dressing import Dressing
from drake_dress.diagrams.scenario import Scenario, apply_variation
from drake_dress.diagrams.setup import read_setup
from drake_dress.models.arrays import FloatArray, IntArray
from drake_dress.models.sides import SIDES

_TICK = 1.0 / 30.0  # s
_TENTH_OF_A_MILLIMETRE = 1e4


@dataclass(frozen=True)
class Recording:
    """A dressing as its controller could see it, and the truth.

    Attributes:
        time: (T,) s.
        garment: (T,n,3) true nodes, m.
        grippers: (T,2,3), m.
        joints: (T,6,3) true joints, m.
        are_open: (T,) 1 once the grippers have let go.
        exposed: (I,) times of exposures, s.
        depth: (I,C,h,w) uint16, tenths of a millimetre, 0 where there is none.
        labels: (I,C,h,w) uint8.
    """

    time: FloatArray
    garment: FloatArray
    grippers: FloatArray
    joints: FloatArray
    are_open: FloatArray
    exposed: FloatArray
    depth: IntArray
    labels: IntArray

    def save(self, path: Path) -> None:
        """Writes it as one compressed file."""
        np.savez_compressed(path, **vars(self))

    @staticmethod
    def load(path: Path) -> Recording:
        """Reads what `save` wrote."""
        with np.load(path) as file:
            return Recording(**{name: file[name] for name in file.files})

    def depth_of(self, number: int) -> FloatArray:
        """Returns (C,h,w) depth of an exposure, m."""
        return np.asarray(self.depth[number] / _TENTH_OF_A_MILLIMETRE)


def oracle_parts(scenario: Scenario, source: Path) -> Parts:
    """Returns the parts of a scenario whose controller knows the truth while its cameras see.

    Args:
        scenario: with cameras.
        source: its file.
    """
    setup = read_setup(apply_variation(scenario), source)
    blind = replace(setup, garments=replace(setup.garments, tracked=None))
    return replace(parts(blind), setup=setup)


def record(p: Parts, duration: float) -> Recording:
    """Runs a dressing and returns what its cameras saw.

    Args:
        p: its parts.
        duration: longest simulated time, s.
    """
    dressing = wired(p)
    watcher = _Watcher(dressing, [c.name for c in p.setup.station.cameras])
    simulator = Simulator(dressing.diagram)
    simulator.set_monitor(watcher)
    simulator.Initialize()
    root = simulator.get_context()
    mpc = dressing.mpc.GetMyContextFromRoot(root)
    end, now = duration, 0.0
    while now < end:
        now = min(end, now + 0.1)
        simulator.AdvanceTo(now)
        if end == duration and dressing.mpc.is_finished(mpc):
            end = min(duration, now + dressing.mpc.watch_time)
        if dressing.station.fault(root):
            break
    return watcher.recording()


class _Watcher:
    """Collects samples at the end of steps."""

    def __init__(self, dressing: Dressing, cameras: list[str]) -> None:
        self._dressing, self._cameras = dressing, cameras
        self._next = 0
        self._rows: list[tuple[FloatArray, ...]] = []
        self._images: list[tuple[float, Any, Any]] = []

    def __call__(self, root: Context) -> EventStatus:
        if root.get_time() < self._next * _TICK - 1e-9:
            return EventStatus.DidNothing()
        self._next += 1
        station = self._dressing.station.diagram
        context = station.GetMyContextFromRoot(root)

        def value(port: str) -> FloatArray:
            return np.array(station.GetOutputPort(port).Eval(context))

        grippers = np.stack([value(f"{side}_gripper.position_measured") for side in SIDES])
        self._rows.append(
            (
                np.array(root.get_time()),
                value("cheat_garment_position").reshape(-1, 3).astype(np.float32),
                grippers,
                value("cheat_joint_position").reshape(6, 3),
                value("grippers_open")[0],
            )
        )
        times = [float(value(f"{name}.image_time")[0]) for name in self._cameras]
        last = self._images[-1][0] if self._images else -1.0
        if times and times[0] > last:
            images = [
                np.stack(
                    [
                        station.GetOutputPort(f"{name}.{kind}_image").Eval(context).data[..., 0]
                        for name in self._cameras
                    ]
                )
                for kind in ("depth", "label")
            ]
            depth = np.rint(images[0] * _TENTH_OF_A_MILLIMETRE).astype(np.uint16)
            self._images.append((times[0], depth, images[1].astype(np.uint8)))
        return EventStatus.Succeeded()

    def recording(self) -> Recording:
        rows = [np.stack(column) for column in zip(*self._rows, strict=True)]
        images = [np.stack(column) for column in zip(*self._images, strict=True)]
        return Recording(*rows, *images)
