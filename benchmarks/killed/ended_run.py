"""A run into the directory of an earlier one, ended at a moment by a signal or a full disk.

Takes two arguments: a file with the plan, and one to write what became of it, both JSON. A disk
that can be filled is mounted for that, for which the process needs a mount namespace of its own:
`unshare -m`.
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

# Of the disk that is filled: room for all files of such a run, and little more.
_DISK = "size=40m"
_POLL = 0.01
_STAGE_LINE = re.compile(r" *([\d.]+) s  left ")


@dataclass(frozen=True)
class Plan:
    """What is run and how it ends.

    Attributes:
        scenario: file.
        earlier: folder with the files of the earlier run.
        out: folder to run in; the earlier files are copied there first.
        settings: KEY=VALUE.
        seed: of the run.
        how: `kill`, `terminate`, `disk_full`, or `group`: SIGTERM to its processes, of which it has
            several, and once more to the first; empty: it is left alone.
        moment: since the process began, s.
        timeout: s.
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
    """How it ended.

    Attributes:
        status: of the process, negative for a signal.
        words: what it printed.
        wall: from its beginning to its end, s.
        acted: when it was done to it, s; None if the run was over before.
        told: last simulated time that it had told on its progress lines, s, and when, s.
    """

    status: int
    words: str
    wall: float
    acted: float | None
    told: tuple[float, float]


def play(plan: Plan) -> Ended:
    """Carries out a plan; the disk of `disk_full` has to be this process's own."""
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
    """Returns the folder of the run: on a small disk of its own where that is to be filled."""
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
    """Does to a run what ends it."""
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
