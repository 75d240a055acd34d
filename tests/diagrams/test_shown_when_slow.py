import time

import pytest

from drake_dress.diagrams.shown_when_slow import ShownWhenSlow


def test_quick_work_says_nothing(capfd: pytest.CaptureFixture[str]) -> None:
    with ShownWhenSlow("coat.obj") as progress:
        progress("reading", 0.5)
    assert capfd.readouterr() == ("", "")


def test_slow_work_says_once_on_stderr_what_it_does(capfd: pytest.CaptureFixture[str]) -> None:
    with ShownWhenSlow("coat.obj", patience=0.05) as progress:
        progress("reading [the] garment", 0.5)
        time.sleep(0.5)
        progress("checking", 0.7)
    out, err = capfd.readouterr()
    assert out == ""
    assert err.split() == ["coat.obj:", "reading", "[the]", "garment", "…"]
