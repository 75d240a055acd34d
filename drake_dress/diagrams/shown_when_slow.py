"""Progress on stderr for work that is usually quick."""

from __future__ import annotations

import threading
from types import TracebackType

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

_PATIENCE = 2.0  # s before anything is shown


class ShownWhenSlow:
    """Shows stages and their progress once the work has taken two seconds.

    A terminal shows a bar, which disappears when the work is done; other outputs show one line.

        with ShownWhenSlow("jacket.obj") as progress:
            progress("reading", 0.0)
    """

    def __init__(self, subject: str, patience: float = _PATIENCE) -> None:
        self._subject = subject
        self._stage = ""
        self._console = Console(stderr=True)
        self._bar = Progress(
            TextColumn("{task.description}"),
            BarColumn(),
            TimeElapsedColumn(),
            console=self._console,
            transient=True,
        )
        self._task = self._bar.add_task(subject, total=1.0)
        self._timer = threading.Timer(patience, self._show)
        self._timer.daemon = True
        self._lock = threading.Lock()
        self._done = False

    def __enter__(self) -> ShownWhenSlow:
        self._timer.start()
        return self

    def __call__(self, stage: str, share: float) -> None:
        """Sets the current stage, and the fraction of it that is done."""
        self._stage = stage
        self._bar.update(self._task, description=f"{self._subject}: {stage}", completed=share)

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        with self._lock:
            self._done = True
            self._timer.cancel()
            if self._bar.live.is_started:
                self._bar.stop()

    def _show(self) -> None:
        with self._lock:
            if self._done:
                return
            if self._console.is_terminal:
                self._bar.start()
            else:
                self._console.print(f"{self._subject}: {self._stage} …", markup=False)
