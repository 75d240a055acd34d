"""Error of a garment against a finer one after parts of a dressing's motion.

The reference has half the spacing of `fine` and a quarter of its time step. It starts from the
logged garment and is simulated for a while, so that the coarser mesh has no more influence. Each
compared garment then starts from its state. Parts last one second: over longer times the direction
of buckling dominates, and not even repeated references agree.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.plant.motion import DressingMotion
from benchmarks.plant.replaying import Replayed, replay
from drake_dress.diagrams.garment import build_garment
from drake_dress.diagrams.scenario import Scenario
from drake_dress.diagrams.scenario.fidelity import FIDELITIES
from drake_dress.diagrams.setup import station_parameters
from drake_dress.diagrams.station import plant_integrator
from drake_dress.models.arrays import FloatArray
from drake_dress.models.cloth.layered import Integrator
from drake_dress.models.garment.mesh import GarmentMesh
from drake_dress.models.garment.transfer import barycentric_transfer
from drake_dress.report.log import RunLog

# Duration until the initial mesh has no more influence on the reference, and of each part, s.
_FORGETTING, _PART = 0.3, 1.0
# Start of the first part, s; before it, the coat hangs still.
_FIRST = 3.0
_LAST = 0.04  # unused time at the end of the motion, s


@dataclass(frozen=True)
class Setting:
    """Settings of a compared garment, m and s; default: the plain law and implicit Euler."""

    name: str
    spacing: float
    time_step: float
    implicitness: float = 1.0
    buckling_wavelength: float = 0.0
    tolerance: float = 5e-3
    self_collision: bool = False

    @staticmethod
    def of_fidelity(name: str, self_collision: bool = False) -> Setting:
        """Returns the setting of a value of `plant.fidelity`."""
        shown = f"{name}, layers collide" if self_collision else name
        given = {k: v for k, v in FIDELITIES[name].items() if k in Setting.__dataclass_fields__}
        return Setting(shown, **given, self_collision=self_collision)

    def of(self, scenario: Scenario, folder: Path) -> tuple[GarmentMesh, Integrator]:
        """Returns the scenario's garment with this setting, and its integrator."""
        mesh = build_garment(scenario.garment, self.spacing, folder)
        numerics = {k: v for k, v in vars(self).items() if k not in ("name", "spacing")}
        p = replace(station_parameters(scenario, mesh), integrator="implicit", **numerics)
        return mesh, plant_integrator(p)


# The reference for all settings: half the spacing of `fine` and a quarter of its time step, with
# the plain law. Coats cannot be finer than this.
REFERENCE = Setting("reference", 0.01, 0.001)


@dataclass(frozen=True)
class Part:
    """The reference at the start and at the end of a part of the motion; (n,3) m and m/s."""

    begin: float
    x: FloatArray
    v: FloatArray
    end: FloatArray
    grippers: FloatArray
    person: FloatArray


def part_begins(motion: DressingMotion, count: int) -> FloatArray:
    """Returns the start times of the parts, s."""
    return np.linspace(_FIRST, motion.time[-1] - _PART - _LAST, count)


def reference_part(
    fine: tuple[GarmentMesh, Integrator],
    coarse: GarmentMesh,
    log: RunLog,
    motion: DressingMotion,
    begin: float,
) -> Part:
    """Simulates the reference `fine` over one part of a log of the garment `coarse`."""
    mesh, cloth = fine
    finer = barycentric_transfer(coarse, mesh)
    sample = int(np.searchsorted(motion.time, begin - _FORGETTING))
    x = finer @ log.garment_position(sample)
    moved = log.garment_position(sample + 1) - log.garment_position(sample - 1)
    v = finer @ (moved / (motion.time[sample + 1] - motion.time[sample - 1]))
    start = float(motion.time[sample])
    begun = replay(cloth, mesh, motion, x, v, start, begin - start).state
    done = replay(cloth, mesh, motion, begun.x, begun.v, begin, _PART)
    return Part(begin, begun.x, begun.v, done.state.x, done.grippers, done.person)


def compared(
    setting: Setting,
    scenario: Scenario,
    folder: Path,
    fine: GarmentMesh,
    motion: DressingMotion,
    parts: Sequence[Part],
) -> Iterator[dict[str, Any]]:
    """Yields, for each part, a garment's errors, mm and N, and its step times, ms."""
    mesh, cloth = setting.of(scenario, folder)
    coarser = barycentric_transfer(fine, mesh)
    for part in parts:
        done = replay(cloth, mesh, motion, coarser @ part.x, coarser @ part.v, part.begin, _PART)
        yield _off(done, part, coarser @ part.end) | {"case": asdict(setting)}


def _off(done: Replayed, part: Part, end: FloatArray) -> dict[str, Any]:
    distance = 1e3 * np.linalg.norm(done.state.x - end, axis=1)
    return {
        "begin": part.begin,
        "mean_mm": float(distance.mean()),
        "p95_mm": float(np.quantile(distance, 0.95)),
        "grippers_N": float(np.linalg.norm(done.grippers - part.grippers, axis=1).mean()),
        "person_N": float(np.linalg.norm(done.person - part.person)),
        "step_ms": 1e3 * float(np.median(done.step)),
        "mean_step_ms": 1e3 * float(done.step.mean()),
        "iterations": done.iterations,
    }
