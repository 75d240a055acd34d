"""Starts a lab and a run in a network namespace that has only a loopback device.

Nothing reaches any other address. It requires `unshare` and the right to use it; see `available`.
"""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path

import psutil

from benchmarks.parser import UNUSABLE

_ROOT = Path(__file__).parents[2]
_NETWORK = "ip link set lo up && ip route add 224.0.0.0/4 dev lo"
_BEGUN = "commands come"
_POLL = 0.02
# Time after which a lab is interrupted if its run ended before any command, s.
_ALONE = 5.0


@dataclass(frozen=True)
class Plan:
    """Settings of both processes, and actions on them.

    Attributes:
        scenario: Scenario file.
        out: Output directory of both.
        settings: Settings of both processes. lab_settings: Of the lab. run_settings: Of the run.
        rate: Simulated seconds per second.
        kill_at: Time of SIGKILL to the run, after the first command, s.
        fill_at: Time at which the run's disk is filled, after the first command, s.
        timeout: Timeout of the whole, s.
        sampled: Whether to sample memory once per second from the first command on.
        report: Whether to write report and replay in addition to log and summary.
    """

    scenario: str
    out: str
    settings: list[str] = field(default_factory=list)
    lab_settings: list[str] = field(default_factory=list)
    run_settings: list[str] = field(default_factory=list)
    rate: float = 1.0
    kill_at: float | None = None
    fill_at: float | None = None
    timeout: float = 600.0
    sampled: bool = False
    report: bool = False


@dataclass(frozen=True)
class Outcome:
    """Exit status and output of both processes, and their memory once per second, MB."""

    lab_status: int
    run_status: int
    lab_words: str
    run_words: str
    lab_memory: list[float]
    run_memory: list[float]


def available() -> bool:
    """Returns whether this user may create a network namespace here."""
    probe = ["unshare", "-nm", "sh", "-c", _NETWORK]
    try:
        return subprocess.run(probe, capture_output=True, check=False).returncode == 0
    except OSError:
        return False


def play(plan: Plan) -> Outcome:
    """Executes a lab and a run and returns the outcome.

    Raises:
        RuntimeError: They could not be started.
    """
    # imported here, since the process that only starts others must not spend seconds on it
    from drake_dress.diagrams.lab import OPEN

    with tempfile.TemporaryDirectory() as place:
        paper, answer = Path(place) / "plan.json", Path(place) / "outcome.json"
        paper.write_text(json.dumps(asdict(plan)), encoding="utf-8")
        inside = f"{_NETWORK} && exec {sys.executable} -m {__spec__.name} {paper} {answer} '{OPEN}'"
        done = subprocess.run(
            ["unshare", "-nm", "sh", "-c", inside],
            cwd=_ROOT,
            capture_output=True,
            text=True,
            check=False,
        )
        if not answer.exists():
            raise RuntimeError(f"lab and run could not be started: {done.stderr.strip()}")
        return Outcome(**json.loads(answer.read_text(encoding="utf-8")))


def play_usable(plan: Plan) -> Outcome:
    """Executes a lab and a run and returns the outcome if both started.

    Raises:
        RuntimeError: One of them did not start; the message ends with its last line of output.
    """
    done = play(plan)
    for name, status, words in (
        ("lab", done.lab_status, done.lab_words),
        ("run", done.run_status, done.run_words),
    ):
        if status == UNUSABLE:
            raise RuntimeError(f"the {name} did not begin: {words.strip().splitlines()[-1]}")
    return done


def _inside(plan: Plan, lab_open: str) -> Outcome:
    out = Path(plan.out)
    run_out = out / "run"
    run_out.mkdir(parents=True, exist_ok=True)
    if plan.fill_at is not None:
        # a separate disk that can be filled
        subprocess.run(
            ["mount", "-t", "tmpfs", "-o", "size=48m", "tmpfs", str(run_out)], check=True
        )
    files = {name: (out / f"{name}.log").open("w") for name in ("lab", "run")}
    common = ["--realtime-rate", str(plan.rate), "--report" if plan.report else "--no-report"]
    words = {
        "lab": ["sim-station", plan.scenario, "--out", str(out / "lab"), *common],
        "run": ["run", plan.scenario, "--no-meshcat", "--out", str(run_out), *common],
    }
    sets = {
        "lab": [*plan.settings, *plan.lab_settings],
        "run": [*plan.settings, "station.kind=hardware", *plan.run_settings],
    }
    # each process has one core; more threads would slow both down
    environment = os.environ | {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}

    def started(name: str) -> subprocess.Popen[bytes]:
        return subprocess.Popen(
            [sys.executable, "-m", "drake_dress", *words[name], *_set(sets[name])],
            stdout=files[name],
            stderr=subprocess.STDOUT,
            env=environment,
        )

    # start both at once: the run waits for the lab, and each takes seconds to load
    process = {name: started(name) for name in words}
    watch = _Watch(plan, process, lab_open)
    while any(p.poll() is None for p in process.values()):
        time.sleep(_POLL)
        watch.look(time.monotonic())
    for file in files.values():
        file.close()
    if plan.fill_at is not None:
        _keep(run_out, out / "run-kept")
    return Outcome(
        process["lab"].returncode,
        process["run"].returncode,
        (out / "lab.log").read_text(),
        (out / "run.log").read_text(),
        watch.memory["lab"],
        watch.memory["run"],
    )


class _Watch:
    """Executes a plan's actions on the running lab and run, and samples their memory.

    Args:
        plan: The plan.
        process: Processes of `lab` and `run`.
        lab_open: Line that a lab prints when it is open.
    """

    def __init__(
        self, plan: Plan, process: Mapping[str, subprocess.Popen[bytes]], lab_open: str
    ) -> None:
        self.memory: dict[str, list[float]] = {"lab": [], "run": []}
        self._plan, self._process, self._lab_open = plan, process, lab_open
        self._out = Path(plan.out)
        self._begin = time.monotonic()
        self._begun: float | None = None
        self._alone_since: float | None = None
        self._sent_away = self._filled = False

    def look(self, now: float) -> None:
        """Executes the actions due at `now`, in time of the monotonic clock, s."""
        if now - self._begin > self._plan.timeout:
            for p in self._process.values():
                p.kill()
        if self._process["run"].poll() is not None and self._begun is None:
            self._leave_lab_alone(now)
        if self._begun is None and _BEGUN in self._lab_words():
            self._begun = now
        if self._begun is not None:
            self._act(now - self._begun)

    def _lab_words(self) -> str:
        return (self._out / "lab.log").read_text()

    def _leave_lab_alone(self, now: float) -> None:
        """Interrupts the open lab after a while if the run ended before its first command."""
        if self._alone_since is None and self._lab_open in self._lab_words():
            self._alone_since = now
        is_long = self._alone_since is not None and now - self._alone_since > _ALONE
        if is_long and not self._sent_away:
            self._sent_away = True
            self._process["lab"].send_signal(signal.SIGINT)

    def _act(self, since: float) -> None:
        """Executes the actions due `since` s after the first command."""
        plan = self._plan
        if plan.kill_at is not None and since >= plan.kill_at:
            self._process["run"].kill()
        if plan.fill_at is not None and since >= plan.fill_at and not self._filled:
            self._filled = True
            fill(self._out / "run" / "filler")
        if plan.sampled and since >= len(self.memory["lab"]):
            for name, p in self._process.items():
                self.memory[name].append(memory_of(p.pid))


def _keep(run_out: Path, kept: Path) -> None:
    """Copies the files on the run's own disk, which disappears with the mount namespace."""
    (run_out / "filler").unlink(missing_ok=True)
    kept.mkdir(exist_ok=True)
    for path in run_out.iterdir():
        (kept / path.name).write_bytes(path.read_bytes())


def _set(values: list[str]) -> list[str]:
    return [word for value in values for word in ("--set", value)]


def fill(path: Path) -> None:
    """Writes a file that fills its disk."""
    try:
        with path.open("wb") as file:
            while True:
                file.write(bytes(1 << 20))
                file.flush()
    except OSError:
        pass


def memory_of(pid: int) -> float:
    """Returns the unique memory of a process and its descendants, MB."""
    try:
        first = psutil.Process(pid)
        of_all = [p.memory_full_info().uss for p in (first, *first.children(recursive=True))]
        return float(sum(of_all)) / 2.0**20
    except psutil.Error:
        return float("nan")


if __name__ == "__main__":
    given = Plan(**json.loads(Path(sys.argv[1]).read_text(encoding="utf-8")))
    Path(sys.argv[2]).write_text(json.dumps(asdict(_inside(given, sys.argv[3]))), encoding="utf-8")
