"""Runs cases on a Ray cluster: an existing one, or one that is started on this machine.

A checkout is sent to the nodes, so that all run the same code; its dependencies must be installed
there. Without a checkout, the package itself must be installed on the nodes, too. If a node is
lost, its unfinished runs are restarted on other nodes.
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

_PACKAGE = Path(__file__).parent
# Parts of a checkout that nodes do not need; logs and data may be large.
_LEFT = [".git", ".venv", "out", "build", "docs", "*.h5", "**/__pycache__", ".hypothesis"]
_LEFT += [".mypy_cache", ".ruff_cache"]
# Number of lost nodes after which a run counts as impossible.
_MOST_LOST = 10
# Period of checking for a signal that ends the study, s.
_LOOK = 1.0
HERE = "local"
# Timeout for connecting to a cluster, s.
_PATIENCE = 5.0


def completed_on(
    address: str,
    run: Callable[[C, Path], R],
    cases: Sequence[C],
    stop: Interrupt,
    bring: Callable[[C, Mapping[str, bytes]], None] | None = None,
    command: str = "bench",
) -> Iterator[tuple[C, R]]:
    """Yields each case with its result as soon as it is done on any node.

    Args:
        address: Address of the cluster; `auto` for the one that this machine belongs to, `local` to
            start one here.
        run: Runs a case, given a folder for its files.
        cases: Cases to run, each on one core.
        stop: Once it is set, no more results are yielded.
        bring: Called with a case's files, by their paths in its folder; None if the files are not
            needed.
        command: Command with the option `--ray`, for messages.

    Raises:
        UserError: Ray is not installed, or there is no cluster.
    """
    ray = connected(address, command)
    # losing a node does not count as a failure of the run
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
        # does not wait for unfinished runs
        ray.shutdown()


def connected(address: str, command: str = "bench") -> Any:
    """Returns Ray, connected to a cluster.

    Args:
        address: Address as in `completed_on`.
        command: Command with the option `--ray`, for messages.

    Raises:
        UserError: Ray is not installed, or there is no cluster at the address.
    """
    # disables usage reports and the notice about them
    os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")
    try:
        import ray
    except ImportError:
        raise UserError(
            command, "--ray", "Ray is not installed; pip install 'drake_dress[ray]'"
        ) from None
    _prove(address, command)
    where: dict[str, Any] = {"address": address}
    if address == HERE:
        where = {"include_dashboard": False, "_node_ip_address": "127.0.0.1"}
    # Ray's own handler would end this process without a message and without keeping results
    handler = signal.getsignal(signal.SIGTERM)
    try:
        ray.init(**where, runtime_env=sent_code(), log_to_driver=False, logging_level=logging.ERROR)
    except (ConnectionError, ValueError, RuntimeError) as error:
        first = str(error).strip().splitlines()[0] if str(error).strip() else type(error).__name__
        raise UserError(command, "--ray", f"no cluster at {address}: {first}") from None
    finally:
        signal.signal(signal.SIGTERM, handler)
    return ray


def sent_code(package: Path = _PACKAGE) -> dict[str, Any]:
    """Returns Ray's runtime environment: the checkout that holds `package`, or nothing.

    An installed package lies in a folder with all others, which must not be sent.
    """
    root = package.parent
    if not (root / "pyproject.toml").is_file():
        return {}
    return {"working_dir": str(root), "excludes": _LEFT}


def _prove(address: str, command: str) -> None:
    """Raises UserError if nothing listens at the address; Ray would retry for minutes."""
    if address in ("auto", HERE):
        return
    host, _, port = address.removeprefix("ray://").rpartition(":")
    if not host or not port.isdecimal() or not 0 < int(port) < 2**16:
        raise UserError(command, "--ray", f"{address!r} is no address, expected auto or HOST:PORT")
    try:
        socket.create_connection((host, int(port)), _PATIENCE).close()
    except OSError as error:
        why = error.strerror or str(error)
        raise UserError(command, "--ray", f"no cluster at {address}: {why}") from None


def _run(run: Callable[[C, Path], R], case: C, wanted: bool) -> tuple[R, dict[str, bytes]]:
    """Runs a case on a node; also returns its files if `wanted`."""
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        result = run(case, folder)
        files = {}
        if wanted:
            for path in sorted(folder.rglob("*")):
                if path.is_file():
                    files[str(path.relative_to(folder))] = path.read_bytes()
        return result, files
