"""Output problems never end a command, and streams and signals are restored afterwards."""

from __future__ import annotations

import contextlib
import io
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from drake_dress.__main__ import main
from drake_dress.streams import forgiving_streams, keep_standard_descriptors

ROOT = Path(__file__).parents[1]


@pytest.mark.parametrize("encoding", ["ascii", "latin-1", "cp1252"])
def test_what_an_encoding_lacks_is_escaped(encoding: str, monkeypatch: pytest.MonkeyPatch) -> None:
    raw = io.BytesIO()
    monkeypatch.setattr(sys, "stdout", io.TextIOWrapper(raw, encoding=encoding))
    with forgiving_streams():
        print("5 µm … ± Ω \ud800")
        print("next")
    text = raw.getvalue().decode(encoding)
    assert "\\u03a9" in text
    assert text.endswith("next\n")


class Broken(io.RawIOBase):
    def __init__(self, number: int) -> None:
        self.number = number

    def writable(self) -> bool:
        return True

    def write(self, data: object) -> int:
        raise OSError(self.number, os.strerror(self.number))


@pytest.mark.parametrize("number", [32, 5, 28])
def test_a_stream_that_fails_ends_nothing(
    number: int, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(sys, "stdout", io.TextIOWrapper(io.BufferedWriter(Broken(number))))
    with forgiving_streams():
        for _ in range(3):
            print("a" * 10_000, flush=True)
    told = capsys.readouterr().err
    assert told == (
        "drake-dress: standard output: No space left on device\n" if number == 28 else ""
    )


def test_streams_and_signals_are_as_before_after_a_command(
    capsys: pytest.CaptureFixture[str],
) -> None:
    signals = [signal.SIGINT, signal.SIGTERM, signal.SIGHUP]
    before = (sys.stdout, sys.stderr, *(signal.getsignal(n) for n in signals))
    for words in (["run", "no.yaml"], ["bench", "--help"], ["run", "a\0b"], ["--version"], []):
        with contextlib.suppress(SystemExit):
            main(words)
        assert (sys.stdout, sys.stderr, *(signal.getsignal(n) for n in signals)) == before
    assert "Traceback" not in capsys.readouterr().err


@pytest.mark.parametrize("closed", ["stdout", "stderr", "both"])
def test_a_closed_stream_is_passed_over(closed: str, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("stdout", "stderr") if closed == "both" else (closed,):
        monkeypatch.setattr(sys, name, None)
    assert main(["bench", "--help"]) == 0
    assert main(["run", "no.yaml"]) == 2


def test_a_closed_pipe_is_no_error() -> None:
    """A flush at the exit of Python is no error either."""
    command = f"'{sys.executable}' -m drake_dress bench --help"
    done = subprocess.run(
        ["bash", "-c", f"{{ {command}; echo status $? >&2; }} | true"],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.stderr == "status 0\n"


def test_no_file_gets_the_number_of_a_closed_stream() -> None:
    code = (
        "import os\n"
        "from drake_dress.streams import keep_standard_descriptors\n"
        "os.close(0); os.close(1)\n"
        "keep_standard_descriptors()\n"
        "assert os.open('/dev/null', os.O_RDONLY) > 2\n"
    )
    subprocess.run([sys.executable, "-c", code], cwd=ROOT, check=True)
    number = os.open("/dev/null", os.O_RDONLY)
    keep_standard_descriptors()
    os.close(number)
    again = os.open("/dev/null", os.O_RDONLY)
    os.close(again)
    assert again == number
