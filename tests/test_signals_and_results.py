"""However a run ends, its directory contains results of that run alone."""

from __future__ import annotations

import importlib
import json
import os
import signal
import socket
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import h5py
import pytest

from drake_dress.__main__ import main
from drake_dress.diagrams import run as run_module
from drake_dress.diagrams.assemble import wired
from drake_dress.diagrams.dressing import Dressing
from drake_dress.errors import UserError
from drake_dress.file_output import RUN_FILES, claimed
from drake_dress.interrupt import (
    Interrupt,
    Terminated,
    caught_interrupt,
    signals_deferred,
    signals_raised,
)
from drake_dress.report.log import RunLog
from drake_dress.report.web_page import open_page
from tests.report import synthetic

SCENARIO = """
duration: 0.2
plant: {spacing: 0.05, time_step: 0.01}
controller: {spacing: 0.06, global_mpc: {horizon: 3, max_iterations: 2}}
"""


@pytest.fixture(autouse=True)
def hanging_up_ends() -> Iterator[None]:
    """Restores the default action of SIGHUP, which nohup changes."""
    usual = signal.signal(signal.SIGHUP, signal.SIG_DFL)
    yield
    signal.signal(signal.SIGHUP, usual)


@pytest.fixture(scope="module")
def scenario(tmp_path_factory: pytest.TempPathFactory) -> str:
    path = tmp_path_factory.mktemp("scenario") / "short.yaml"
    path.write_text(SCENARIO)
    return str(path)


def run(scenario: str, out: Path, *words: str) -> int:
    return main(["run", scenario, "--no-meshcat", "--one-process", "--out", str(out), *words])


def test_what_an_earlier_run_left_is_removed_and_what_is_not_ours_stays(
    scenario: str, tmp_path: Path
) -> None:
    for name in (*RUN_FILES[1:], "notes.txt"):
        (tmp_path / name).write_text("earlier")
    (tmp_path / "run.h5").write_bytes(b"earlier")
    assert run(scenario, tmp_path, "--no-report") == 1
    assert set(os.listdir(tmp_path)) == {"run.h5", "summary.json", "notes.txt"}
    assert json.loads((tmp_path / "summary.json").read_text())["seed"] == 0
    with RunLog.open(tmp_path / "run.h5") as log:
        assert len(log)
        assert not log.killed


@pytest.mark.parametrize("broken", ["report", "summary", "replay"])
def test_what_cannot_be_written_takes_nothing_else_with_it(
    broken: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    garment = synthetic.coat(0.06)
    synthetic.write(tmp_path / "run.h5", garment, synthetic.dressing(garment, count=6))

    def fail(*_: object, **__: object) -> None:
        raise ValueError("no\nroom")

    names = {"summary": "write_summary", "report": "_write_report", "replay": "write_replay_html"}
    monkeypatch.setattr(run_module, names[broken], fail)
    if broken != "report":
        monkeypatch.setattr(
            run_module, "_write_report", lambda out, m: (out / "report.html").touch()
        )
    status = run_module.concluded(tmp_path, 1.0, True, None)
    file = {"summary": "summary.json", "report": "report.html", "replay": "replay.html"}[broken]
    assert set(os.listdir(tmp_path)) == set(RUN_FILES) - {file}
    captured = capsys.readouterr()
    assert captured.err == f"drake-dress: {tmp_path / file}: cannot be written: no room\n"
    assert status == (0 if "both sleeves on" in captured.out else 1)


def test_a_second_run_into_the_same_directory_is_refused(
    scenario: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with claimed("--out", tmp_path):
        (tmp_path / "summary.json").write_text("of the first")
        assert run(scenario, tmp_path) == 2
    lines = capsys.readouterr().err.splitlines()
    told = [line for line in lines if not line.startswith("compiling kernels")]
    assert len(told) == 1
    assert told[0].startswith("drake-dress: --out: ")
    assert (tmp_path / "summary.json").read_text() == "of the first"


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP])
def test_a_signal_ends_a_run_as_ctrl_c_does(
    number: signal.Signals, scenario: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"

    def kill() -> None:
        while not (out / "run.h5").exists():
            time.sleep(0.02)
        time.sleep(0.5)
        os.kill(os.getpid(), number)

    killer = threading.Thread(target=kill)
    killer.start()
    status = run(scenario, out, "--set", "duration=600", "--no-report")
    killer.join()
    assert status == 128 + number
    assert "what had run is in the log" in capsys.readouterr().out
    assert set(os.listdir(out)) == {"run.h5", "summary.json"}
    with h5py.File(out / "run.h5") as log:
        assert log.attrs["complete"]
        assert len(log["garment/position"]) == len(log["time"])


def test_a_signal_before_the_first_step_ends_a_run_as_one_after_it_does(
    scenario: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:

    def wired_meanwhile(*parts: Any) -> Dressing:
        os.kill(os.getpid(), signal.SIGTERM)
        time.sleep(0.1)
        return wired(*parts)

    monkeypatch.setattr(run_module, "wired", wired_meanwhile)
    out = tmp_path / "out"
    assert run(scenario, out, "--no-report") == 128 + signal.SIGTERM
    assert "what had run is in the log" in capsys.readouterr().out
    assert set(os.listdir(out)) == {"run.h5", "summary.json"}
    with RunLog.open(out / "run.h5") as log:
        assert not log.killed
        assert len(log) == 1


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_the_first_signal_is_a_flag_and_the_second_an_exception(number: signal.Signals) -> None:
    before = [signal.getsignal(n) for n in signal.Signals]
    with pytest.raises(KeyboardInterrupt) as raised, signals_raised():
        with caught_interrupt() as interrupt:
            os.kill(os.getpid(), number)
            assert interrupt.wait(1.0)
            assert interrupt.status == 128 + number
            assert isinstance(interrupt.error(), Terminated) == (number != signal.SIGINT)
            os.kill(os.getpid(), number)
            time.sleep(1.0)
    assert isinstance(raised.value, Terminated) == (number != signal.SIGINT)
    assert [signal.getsignal(n) for n in signal.Signals] == before


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_a_signal_inside_an_import_comes_after_it(
    number: signal.Signals, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A module may mistake the exception for a failure of an import and hide it, as here."""
    inner = f"import os\nos.kill(os.getpid(), {int(number)})\ncame = len(range(1000))\n"
    (tmp_path / "interrupted_inner.py").write_text(inner)
    outer = "try:\n    import interrupted_inner\nexcept BaseException as error:\n"
    outer += "    raise ImportError('initialization failed') from error\n"
    (tmp_path / "interrupted_outer.py").write_text(outer)
    monkeypatch.syspath_prepend(tmp_path)
    try:
        with pytest.raises(KeyboardInterrupt) as raised, signals_raised():
            module = importlib.import_module("interrupted_outer")
            assert module.interrupted_inner.came == 1000
            time.sleep(5.0)
        assert isinstance(raised.value, Terminated) == (number != signal.SIGINT)
    finally:
        for name in ("interrupted_outer", "interrupted_inner"):
            sys.modules.pop(name, None)


class Ends:
    """Sends a signal to this process when its last reference is gone."""

    def __init__(self, number: signal.Signals) -> None:
        self.number = number

    def __del__(self) -> None:
        os.kill(os.getpid(), self.number)
        len(range(1000))


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_a_signal_whose_exception_is_swallowed_comes_again(
    number: signal.Signals, capfd: pytest.CaptureFixture[str]
) -> None:
    before = sys.unraisablehook
    with pytest.raises(KeyboardInterrupt) as raised, signals_raised():
        Ends(number)
        time.sleep(5.0)
    assert isinstance(raised.value, Terminated) == (number != signal.SIGINT)
    assert sys.unraisablehook is before
    assert "Traceback" not in capfd.readouterr().err


@pytest.mark.parametrize("threads", [0, 4])
def test_a_signal_waits_where_it_is_deferred(threads: int) -> None:
    """This holds whichever thread the system chooses to receive the signal."""
    over = threading.Event()
    others = [threading.Thread(target=over.wait) for _ in range(threads)]
    for thread in others:
        thread.start()
    try:
        _defer_and_take()
    finally:
        over.set()
        for thread in others:
            thread.join()


def _defer_and_take() -> None:
    with signals_raised(), caught_interrupt() as interrupt:
        with signals_deferred():
            os.kill(os.getpid(), signal.SIGTERM)
            assert not interrupt.wait(0.05)
        assert interrupt.wait(1.0)
        assert interrupt.number == signal.SIGTERM


def test_a_signal_that_is_ignored_stays_so() -> None:
    """For example SIGHUP under nohup."""
    usual = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        with signals_raised(), caught_interrupt() as interrupt:
            os.kill(os.getpid(), signal.SIGHUP)
            assert not interrupt.wait(0.05)
    finally:
        signal.signal(signal.SIGHUP, usual)


def test_off_the_main_thread_nothing_is_set() -> None:
    found: list[Interrupt] = []

    def work() -> None:
        with signals_raised(), caught_interrupt() as interrupt:
            found.append(interrupt)

    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
    assert not found[0].is_set()


@pytest.mark.parametrize("port", ["80", "-1", "99999", "70000", "0x1F90", "7_000", "x"])
def test_a_port_that_cannot_be_is_told(port: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        main(["replay", "run.h5", f"--port={port}"])
    assert ended.value.code == 2
    assert "--port" in capsys.readouterr().err


@pytest.fixture
def taken() -> Iterator[int]:
    with socket.socket() as holder:
        holder.bind(("localhost", 0))
        holder.listen()
        yield holder.getsockname()[1]


def test_a_port_in_use_is_told(
    taken: int, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    garment = synthetic.coat(0.06)
    log = synthetic.write(tmp_path / "run.h5", garment, synthetic.dressing(garment, count=2))
    assert main(["replay", str(log), "--port", str(taken)]) == 2
    assert capsys.readouterr().err == (
        f"drake-dress: --port: port {taken} is in use, expected a free one\n"
    )


def test_a_run_goes_on_without_a_page_where_no_port_is_free(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def busy(_: object) -> None:
        raise RuntimeError("Meshcat failed to open a websocket port.")

    monkeypatch.setattr("drake_dress.report.web_page.Meshcat", busy)
    with pytest.raises(UserError, match="7000 to 7999"):
        open_page()
    assert run_module._open_meshcat(print) is None
    assert "goes on without" in capsys.readouterr().err
