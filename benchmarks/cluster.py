"""Runs cases on a Ray cluster: an existing one, or one that is started on this machine.

The checkout is sent to the nodes, so that all of them run the same code; what it needs has to be
installed there. A node that is lost costs the runs that it was at: they are begun again elsewhere.
"""

from __future__ import annotations

import logging
import os
import signal
import socket
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, TypeVar

from drake_dress.errors import UserError
from drake_dress.interrupt import Interrupt

C = TypeVar("C")
R = TypeVar("R")

_ROOT = Path(__file__).parents[1]
# What nodes need not have of a checkout.
_LEFT = [".git", ".venv", "out", "docs", "**/__pycache__", ".hypothesis", ".mypy_cache"]
# Nodes that a run may be lost with before it counts as one that cannot be done.
_MOST_LOST = 10
# Between looks for the signal that ends a study, s.
_LOOK = 1.0
HERE = "local"
# For an answer of a cluster's address, s.
_PATIENCE = 5.0


def completed_on(
    address: str,
    run: Callable[[C, Path], R],
    cases: Sequence[C],
    stop: Interrupt,
    bring: Callable[[C, Mapping[str, bytes]], None] | None = None,
) -> Iterator[tuple[C, R]]:
    """Yields each case once with what it came to, as soon as it is done anywhere.

    Args:
        address: of the cluster; `auto` for the one that this machine belongs to, `local` to start
            one here.
        run: a case, with a folder for its files.
        cases: that are run, a core each.
        stop: after it is set nothing more is yielded.
        bring: is called with the files that a case left in its folder, by their paths there; None
            if nobody wants them.

    Raises:
        UserError: Ray is not installed, or there is no cluster.
    """
    ray = connected(address)
    # a node that is lost does not count as a failure of the run
    task = ray.remote(_run).options(num_cpus=1, max_retries=_MOST_LOST)
    try:
        pending = {task.remote(run, case, bring is not None): case for case in cases}
        while pending and not stop.is_set():
            done, _ = ray.wait(list(pending), num_returns=1, timeout=_LOOK)
            for reference in done:
                case = pending.pop(reference)
                result, files = ray.get(reference)
                if bring is not None:
                    bring(case, files)
                yield case, result
    finally:
        # what runs is not waited for
        ray.shutdown()


def connected(address: str) -> Any:
    """Returns Ray, connected to a cluster.

    Raises:
        UserError: Ray is not installed, or there is no cluster at the address.
    """
    # no report of use to anybody, and no word on what is not asked for
    os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")
    try:
        import ray
    except ImportError:
        raise UserError(
            "bench", "--ray", "Ray is not installed; pip install 'drake_dress[ray]'"
        ) from None
    _prove(address)
    environment = {"working_dir": str(_ROOT), "excludes": _LEFT}
    where: dict[str, Any] = {"address": address}
    if address == HERE:
        where = {"include_dashboard": False, "_node_ip_address": "127.0.0.1"}
    # Ray would end this process at once, with nothing said and nothing kept
    handler = signal.getsignal(signal.SIGTERM)
    try:
        ray.init(**where, runtime_env=environment, log_to_driver=False, logging_level=logging.ERROR)
    except (ConnectionError, ValueError, RuntimeError) as error:
        first = str(error).strip().splitlines()[0] if str(error).strip() else type(error).__name__
        raise UserError("bench", "--ray", f"no cluster at {address}: {first}") from None
    finally:
        signal.signal(signal.SIGTERM, handler)
    return ray


def _prove(address: str) -> None:
    """Raises UserError where nobody listens; Ray would try again for minutes."""
    if address in ("auto", HERE):
        return
    host, _, port = address.removeprefix("ray://").rpartition(":")
    if not host or not port.isdecimal() or not 0 < int(port) < 2**16:
        raise UserError("bench", "--ray", f"{address!r} is no address, expected auto or HOST:PORT")
    try:
        socket.create_connection((host, int(port)), _PATIENCE).close()
    except OSError as error:
        why = error.strerror or str(error)
        raise UserError("bench", "--ray", f"no cluster at {address}: {why}") from None


def _run(run: Callable[[C, Path], R], case: C, wanted: bool) -> tuple[R, dict[str, bytes]]:
    """Runs a case on a node; returns its files, too, if they are wanted."""
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        result = run(case, folder)
        files = {}
        if wanted:
            for path in sorted(folder.rglob("*")):
                if path.is_file():
                    files[str(path.relative_to(folder))] = path.read_bytes()
        return result, files
