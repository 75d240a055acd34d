"""A run into the directory of an earlier one, ended at a given time by a signal or a full disk.

Takes two arguments: a file with the plan, and one for the result, both JSON. For a full disk, a
small disk is mounted, for which the process needs its own mount namespace: `unshare -m`.
"""

from __future__ import annotations

import json
import os
import re
import shutil
import signal
import subprocess
import sys
import threading
import time
from dataclasses import asdict, dataclass
from pathlib import Path

from benchmarks.hardware.two_processes import fill

# Size of the disk to fill: enough for all files of such a run, and little more.
_DISK = "size=40m"
_POLL = 0.01
_STAGE_LINE = re.compile(r" *([\d.]+) s  left ")


@dataclass(frozen=True)
class Plan:
    """The run and the way to end it.

    Attributes:
        scenario: Scenario file.
        earlier: Folder with the files of the earlier run.
        out: Output folder; the earlier files are copied there first.
        settings: KEY=VALUE settings of the scenario.
        seed: Seed of the run.
        how: `kill`, `terminate`, `disk_full`, or `group`: SIGTERM to the first process and then to
            all of the run's several processes; empty: the run is not disturbed.
        moment: Time since the process started, s.
        timeout: Timeout of the run, s.
    """

    scenario: str
    earlier: str
    out: str
    settings: list[str]
    seed: int
    how: str
    moment: float
    timeout: float = 300.0


@dataclass(frozen=True)
class Ended:
    """Result of the ended run.

    Attributes:
        status: Exit status of the process, negative for a signal.
        words: Output of the process.
        wall: Duration of the process, s.
        acted: Time at which it was ended, s; None if the run finished before.
        told: Last simulated time on its progress lines, s, and the time of that line, s.
    """

    status: int
    words: str
    wall: float
    acted: float | None
    told: tuple[float, float]


def play(plan: Plan) -> Ended:
    """Executes a plan; `disk_full` needs a mount namespace of this process."""
    out = Path(plan.out)
    out.mkdir(parents=True, exist_ok=True)
    place = _place(plan, out)
    for path in Path(plan.earlier).iterdir():
        shutil.copy(path, place / path.name)
    begin = time.monotonic()
    process = subprocess.Popen(
        _command(plan, place),
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        start_new_session=True,
    )
    lines: list[str] = []
    told = [0.0, 0.0]

    def listen() -> None:
        assert process.stdout is not None
        for line in process.stdout:
            lines.append(line)
            found = _STAGE_LINE.match(line)
            if found:
                told[:] = [float(found.group(1)), time.monotonic() - begin]

    listener = threading.Thread(target=listen)
    listener.start()
    acted: float | None = None
    while process.poll() is None:
        time.sleep(_POLL)
        now = time.monotonic() - begin
        if plan.how and acted is None and now >= plan.moment:
            acted = now
            _act(plan.how, process, place)
        if now > plan.timeout:
            os.killpg(process.pid, signal.SIGKILL)
    wall = time.monotonic() - begin
    listener.join()
    if place != out:
        (place / "filler").unlink(missing_ok=True)
        for path in place.iterdir():
            shutil.copy(path, out / path.name)
    return Ended(process.returncode, "".join(lines), wall, acted, (told[0], told[1]))


def _place(plan: Plan, out: Path) -> Path:
    """Returns the folder of the run, on a small separate disk if that is to be filled."""
    if plan.how != "disk_full":
        return out
    place = out / "disk"
    place.mkdir()
    subprocess.run(["mount", "-t", "tmpfs", "-o", _DISK, "tmpfs", str(place)], check=True)
    return place


def _command(plan: Plan, place: Path) -> list[str]:
    command = [sys.executable, "-m", "drake_dress", "run", plan.scenario, "--no-meshcat"]
    command += ["--out", str(place), "--seed", str(plan.seed)]
    if plan.how != "group":
        command.append("--one-process")
    return command + [word for value in plan.settings for word in ("--set", value)]


def _act(how: str, process: subprocess.Popen[str], place: Path) -> None:
    """Ends a run in the given way."""
    if how == "disk_full":
        fill(place / "filler")
    elif how == "group":
        # as `timeout` does
        process.terminate()
        os.killpg(process.pid, signal.SIGTERM)
    else:
        process.send_signal(signal.SIGKILL if how == "kill" else signal.SIGTERM)


if __name__ == "__main__":
    given = Plan(**json.loads(Path(sys.argv[1]).read_text(encoding="utf-8")))
    Path(sys.argv[2]).write_text(json.dumps(asdict(play(given))), encoding="utf-8")
