"""Injects one fault into a run and checks the reaction against the stated one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.hardware.two_processes import Plan, play_usable
from drake_dress.errors import UserError
from drake_dress.models.arm.panda import LIMITS
from drake_dress.models.sides import SIDES
from drake_dress.report.arms import arm_extremes
from drake_dress.report.log import RunLog
from drake_dress.report.summary import read_summary

# Coarse, since only the reaction of the arms matters, not the dressing.
COARSE = [
    "plant.spacing=0.05",
    "plant.time_step=0.005",
    "plant.body_time_step=0.005",
    "controller.spacing=0.06",
    "log.rate=100",
    "lab.rest=1.0",
]
CAMERA = (
    "station.cameras=[{name: front, position: [2.2, 0.8, 1.6], target: [0.0, 0.0, 1.1], "
    "width: 160, height: 120}]"
)
# Duration of a temporary fault, and of the rest of the run after it, s.
LASTING, AFTER = 0.8, 1.0
# Longer, since an image becomes stale later and one may still be on its way.
LASTING_CAMERA = 1.5
# Duration of a fault above which the run ends, s.
PATIENCE = 3.0
# Age above which a status and an estimate are stale, s.
STALE = {"stale_status": 0.05, "stale_estimate": 0.2}
# Least achieved share of the requested rate; a slower lab is not a valid driver for the test.
KEPT_UP = 0.9
# A gripper holds once its mean speed over this time ahead is lower than this, m/s and s: a slipping
# garment tugs at a holding arm by half a millimetre, for one or two samples of the log.
STILL, STILL_OVER = 0.015, 0.06


@dataclass(frozen=True)
class Reaction:
    """Stated reaction to a fault.

    Attributes:
        source: Sources that may have the fault; one is drawn.
        within: Time limit from its start until both grippers hold, s; None if they do not hold.
        ends: Reason with which the run ends; None if it continues.
        waits: Part of `within` that the run waits by this machine's clock before it reports the
            fault, s.
        told: Texts of which the run's log must contain one; empty if none is required.
        lasting: Duration of the fault, s.
    """

    source: tuple[str, ...]
    within: float | None
    ends: str | None
    waits: float = 0.0
    told: tuple[str, ...] = ()
    lasting: float = LASTING

    def at(self, rate: float) -> Reaction:
        """Returns the reaction in simulated time that runs at `rate` relative to real time.

        Waiting by this machine's clock takes less simulated time; all else is in simulated time.
        """
        if self.within is None:
            return self
        return replace(self, within=self.within - (1.0 - rate) * self.waits)


_ARMS = ("left_arm", "right_arm")
_ALL = (*_ARMS, "garment", "person")
# A status is stale at 50 ms, an estimate at 200 ms. Then it takes 20 ms to reach the governor,
# 10 ms to reach the arms, 60 ms for braking and 100 ms for the drives.
_HOLD, _HOLD_ESTIMATE = 0.25, 0.45
FAULTS = {
    "stale": Reaction(_ARMS, _HOLD, None, 0.05),
    "stale_estimate": Reaction(("garment", "person"), _HOLD_ESTIMATE, None, 0.2),
    # an image is stale at 0.5 s; they arrive five times per second, and one may be on its way
    "stale_camera": Reaction(("camera_front",), 1.2, None, 0.5, lasting=LASTING_CAMERA),
    "bus_lost": Reaction(("left_arm",), _HOLD, None, 0.05),
    "arm_lost": Reaction(_ARMS, _HOLD, None, 0.05),
    "malformed": Reaction(_ALL, _HOLD, None),
    "nan": Reaction(_ALL, _HOLD, None),
    "time_back": Reaction(_ALL, _HOLD, "time back"),
    "clock_jump": Reaction(_ALL, _HOLD, "clock jump"),
    "joint_limit": Reaction(_ARMS, _HOLD, "joint limit"),
    "push": Reaction(_ARMS, None, None),
    # from the run's last command: 100 ms until the next one is missed, then braking of the joints
    "killed": Reaction(("",), 0.45, None),
    # the log is written once per second; then as if the run were killed
    "disk_full": Reaction(("",), 1.6, "log: cannot be written", 1.0),
}


def _refused(source: str, *told: str, within: float = _HOLD, lasting: float = LASTING) -> Reaction:
    """Returns the reaction to an impossible estimate: it is logged, arms hold, then resume."""
    return Reaction((source,), within, None, told=told, lasting=lasting)


def _dropped(*told: str) -> Reaction:
    """Returns the reaction to dropped messages: arms continue."""
    return Reaction(_ALL, None, None, told=told)


_LOST = "at (0, 0, 0), as a lost point written as zero"
_DROPPED = "a repeated or late message is dropped"
# A point counts as frozen after 0.5 s without change, a garment after a gripper has moved 1 cm.
_FROZEN, _FROZEN_GARMENT, _LASTING_FROZEN = 0.5 + _HOLD, 1.0, 1.6
# Impossible content, and messages out of order.
BELIEFS = {
    "person_zero": _refused("person", _LOST),
    "person_hand_zero": _refused("person", f"left hand {_LOST}"),
    "person_mm": _refused("person", "coordinates are in mm"),
    "person_cm": _refused("person", "coordinates are in cm"),
    "person_swapped": _refused("person", "left and right are swapped"),
    "person_y_up": _refused("person", "coordinates are y up"),
    "person_huge": _refused("person", "shoulder width"),
    "person_limb": _refused("person", "left forearm"),
    "person_jump": _refused("person", "moved 0.19", "moved 0.2"),
    "person_offset": _refused("person", "from where the scenario's person has them"),
    "person_frozen": _refused(
        "person", "the same to the last bit", within=_FROZEN, lasting=_LASTING_FROZEN
    ),
    "garment_zero": _refused("garment", "as lost points written as zero"),
    "garment_lost": _refused("garment", "as lost points written as zero"),
    "garment_mm": _refused("garment", "coordinates are in mm"),
    "garment_y_up": _refused("garment", "coordinates are y up"),
    "garment_scrambled": _refused("garment", "nodes in another order"),
    "garment_far": _refused("garment", "nodes held by the"),
    "garment_mirrored": _refused("garment", "mirrored left and right"),
    "garment_jump": _refused("garment", "expected 0.12 m at most"),
    "garment_fast": _refused("garment", "velocity of node"),
    "garment_frozen": _refused(
        "garment", "the same to the last bit", within=_FROZEN_GARMENT, lasting=_LASTING_FROZEN
    ),
    "mode_unknown": Reaction(_ARMS, _HOLD, None, told=("robot_mode is 0 (kOther)",)),
    # by 0.3 rad from the joint's position at that time
    "joint_leap": Reaction(
        _ARMS, _HOLD, "speed limit", told=("joint 1 moved 0.29", "joint 1 moved 0.3")
    ),
    "utime_zero": Reaction(_ALL, _HOLD, None, told=("utime is 0 after",)),
    "second_sender": Reaction(_ALL, _HOLD, "time back", told=("a second sender on the channel",)),
}
# These must not make arms hold; in these tests dropped messages must not make anything stale.
OUT_OF_ORDER = {
    "reordered": _dropped(_DROPPED),
    "duplicated": _dropped(_DROPPED),
    # by less than a period, so that no estimate is late
    "set_back": _dropped(),
}
BELIEFS |= OUT_OF_ORDER
REACTIONS = FAULTS | BELIEFS


@dataclass(frozen=True)
class _Injected:
    """A fault with its source, its start and duration, s, and the rate of the run."""

    kind: str
    source: str
    start: float
    lasting: float
    rate: float

    def plan(self, scenario: str, out: Path, overrides: Sequence[str], report: bool) -> Plan:
        """Returns the plan of both processes."""
        kind, start, rate = self.kind, self.start, self.rate
        return Plan(
            scenario,
            str(out),
            [
                *COARSE,
                *([CAMERA] if kind == "stale_camera" else []),
                f"duration={start + self.lasting + AFTER + 1.0}",
                # the patience is in this machine's time
                f"station.hardware.patience={PATIENCE / rate}",
                *(_patient(rate) if kind in OUT_OF_ORDER else []),
                *overrides,
            ],
            self._of_lab(),
            rate=rate,
            kill_at=start / rate if kind == "killed" else None,
            fill_at=start / rate if kind == "disk_full" else None,
            timeout=120.0 / rate,
            report=report,
        )

    def _of_lab(self) -> list[str]:
        """Returns the lab's settings that play the fault."""
        if self.kind in ("killed", "disk_full"):
            return []
        played = self.kind.split("_")[0] if self.kind.startswith("stale") else self.kind
        return [
            f"lab.faults=[{{kind: {played}, source: {self.source or 'left_arm'}, "
            f"start: {self.start}, duration: {self.lasting}}}]"
        ]


class LabTooSlowError(RuntimeError):
    """The lab did not keep up with the requested rate on this machine."""


def inject(
    kind: str,
    seed: int,
    scenario: str,
    out: Path,
    rate: float = 1.0,
    overrides: Sequence[str] = (),
    report: bool = False,
) -> dict[str, Any]:
    """Injects a fault; returns its effects, and under "wrong" all deviations from the stated ones.

    Args:
        kind: Kind of fault, from REACTIONS.
        seed: Seed of the fault's time and source.
        scenario: Scenario file of both processes.
        out: Output directory of both.
        rate: Simulated seconds per second. Delays by other load on the machine take less simulated
            time at a lower rate.
        overrides: Further KEY=VALUE settings of both processes.
        report: Whether lab and run write report and replay, too.

    Raises:
        RuntimeError: Lab or run did not start.
        LabTooSlowError: The lab did not keep up with the rate, so that the reaction cannot be
            judged.
    """
    rng = np.random.default_rng([seed, *kind.encode()])
    stated = REACTIONS[kind].at(rate)
    start = float(rng.uniform(1.0, 4.0))
    source = str(rng.choice(stated.source))
    setup = _Injected(kind, source, start, stated.lasting, rate)
    plan = setup.plan(scenario, out, overrides, report)
    outcome = play_usable(plan)
    kept = read_summary(out / "lab" / "summary.json")["realtime_factor"]
    if kept < KEPT_UP * rate:
        raise LabTooSlowError(
            f"the lab played {kept:.2f} of time, expected {rate:g}; a slower rate may be kept"
        )
    found = _judged(kind, stated, start, stated.lasting, out)
    wrong: list[str] = found["wrong"]
    expected = -9 if kind == "killed" else 1
    if outcome.run_status != expected:
        wrong.append(f"run ended with {outcome.run_status}, expected {expected}")
    if outcome.lab_status != 1:
        wrong.append(f"lab ended with {outcome.lab_status}, expected 1")
    return {"source": source, "start": start, "rate": rate, "within": stated.within, **found}


def _patient(rate: float) -> list[str]:
    """Returns settings that keep the stale ages equal in simulated time at a lower rate."""
    return [f"station.hardware.{key}={age / rate}" for key, age in STALE.items()]


def _judged(kind: str, stated: Reaction, start: float, lasting: float, out: Path) -> dict[str, Any]:
    wrong: list[str] = []
    held: float | None = None
    share = {"speed": float("nan"), "torque": float("nan")}
    try:
        with RunLog.open(out / "lab" / "run.h5") as log:
            held, share = _lab_facts(log, kind, stated, start, lasting, wrong)
    except UserError as error:
        wrong.append(f"lab's log: {error}")
    kept = out / ("run-kept" if kind == "disk_full" else "run")
    ended: str | None = None
    try:
        with RunLog.open(kept / "run.h5") as log:
            ended = log.ended_by
            if kind in BELIEFS:
                wrong += untold(log.events, stated)
            # data flushed a second before the kill must be in the log
            if log.time[-1] < start - 1.5:
                wrong.append(f"run's log ends at {log.time[-1]:.2f} s")
    except UserError as error:
        wrong.append(f"run's log: {error}")
    if kind not in ("killed", "disk_full"):
        if stated.ends is None and ended is not None:
            wrong.append(f"ended by {ended}")
        if stated.ends is not None and (ended is None or stated.ends not in ended):
            wrong.append(f"ended by {ended}, expected {stated.ends}")
    told = (out / "run.log").read_text() if kind == "disk_full" else ""
    if kind == "disk_full" and (stated.ends is None or stated.ends not in told):
        wrong.append("does not tell that its log cannot be written")
    return {"held_after": held, **share, "ended": ended, "wrong": wrong}


def untold(events: Sequence[str], stated: Reaction) -> list[str]:
    """Returns missing or unexpected events in a run's log after arms were first allowed to move."""
    lines = [line.split(" ", 1)[1] for line in events]
    if "arms may move" not in lines:
        return ["arms were never permitted to move"]
    lines = lines[lines.index("arms may move") + 1 :]
    wrong = []
    if stated.told and not any(told in line for told in stated.told for line in lines):
        wrong.append(f"does not tell {' or '.join(map(repr, stated.told))}")
    if stated.within is None and "arms hold" in lines:
        wrong.append(f"arms hold after {lines[max(0, lines.index('arms hold') - 1)]!r}")
    if stated.within is not None and "arms hold" not in lines:
        wrong.append("arms do not hold")
    if stated.within is not None and stated.ends is None and "arms may move" not in lines:
        wrong.append("arms do not move on afterwards")
    return wrong


def _lab_facts(
    log: RunLog, kind: str, stated: Reaction, start: float, lasting: float, wrong: list[str]
) -> tuple[float | None, dict[str, float]]:
    time = log.time
    speed = np.maximum(*(_speed(time, log.gripper_position[side]) for side in SIDES))
    share = {"speed": 0.0, "torque": 0.0}
    for side in SIDES:
        least, most, speeds, torques = arm_extremes(log, side)
        if np.any((least < LIMITS.lower) | (most > LIMITS.upper)):
            wrong.append(f"{side} arm beyond a joint's limit")
        share["speed"] = max(share["speed"], float((speeds / LIMITS.speed).max()))
        share["torque"] = max(share["torque"], float((torques / LIMITS.torque).max()))
    wrong += [f"{name} at {x:.2f} of its limit" for name, x in share.items() if x > 1.0]
    if not speed[(time > 0.5) & (time < start)].max(initial=0.0) > 0.03:
        wrong.append("nothing moved before the fault")
    end = time[-1] if kind in ("killed", "disk_full") or stated.ends else start + lasting
    # the look-ahead must not extend beyond the end of the fault
    during = (time >= start) & (time <= end - STILL_OVER)
    moving = time[during & (speed > STILL)]
    held = float(moving.max() - start) if len(moving) else 0.0
    if stated.within is not None and held > stated.within:
        wrong.append(f"held after {held:.2f} s, stated {stated.within:g} s")
    return held, share


def _speed(time: np.ndarray, position: np.ndarray) -> np.ndarray:
    """Returns the mean speed of a point over STILL_OVER after each time, m/s.

    Args:
        time: (T,) increasing times, s.
        position: (T, 3) positions, m.
    """
    end = np.minimum(time + STILL_OVER, time[-1])
    begin = np.minimum(time, time[-1] - STILL_OVER)

    def at(when: np.ndarray) -> np.ndarray:
        return np.stack([np.interp(when, time, x) for x in position.T], axis=1)

    return np.linalg.norm(at(end) - at(begin), axis=1) / (end - begin)
