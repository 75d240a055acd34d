"""Resource limits of this process: cores, threads and garbage collection."""

from __future__ import annotations

import contextlib
import gc
import os
from collections.abc import Iterator, MutableMapping
from functools import cache
from pathlib import Path

from threadpoolctl import ThreadpoolController

_OWN_GROUPS = Path("/proc/self/cgroup")
_GROUPS = Path("/sys/fs/cgroup")
_THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")


def worker_count(groups: Path = _GROUPS, own: Path = _OWN_GROUPS) -> int:
    """Returns the number of cores that this job may use, for as many parallel processes.

    A cluster or container may restrict the cores by CPU affinity or by a time quota.

    Args:
        groups: Folder with the quotas of control groups (version 2, or version 1 below `cpu`).
        own: File that lists the control groups of this process.
    """
    try:
        cores = len(os.sched_getaffinity(0))
    except (AttributeError, OSError):
        cores = os.cpu_count() or 1
    quota = _quota(groups, own)
    # Round down: with a quota of 1.5 cores, two processes would be throttled; one never is.
    return max(1, cores if quota is None else min(cores, int(quota)))


def limit_threads(environment: MutableMapping[str, str] = os.environ) -> None:
    """Limits the threads of linear algebra to the number of cores that this job may use.

    The libraries respect affinities by themselves, but not quotas. Variables set by the user are
    kept.

    Args:
        environment: Environment of the process, before these libraries are imported.
    """
    count = worker_count()
    if count < len(os.sched_getaffinity(0)):
        for name in _THREADS:
            environment.setdefault(name, str(count))


@cache
def _libraries() -> ThreadpoolController:
    return ThreadpoolController()


def one_thread() -> contextlib.AbstractContextManager[object]:
    """Returns a context in which linear algebra uses one thread.

    For small matrices a second thread gains nothing, and where other processes use the cores, each
    product waits for it: a forecast of 6 ms took 160 ms.
    """
    context: contextlib.AbstractContextManager[object] = _libraries().limit(limits=1)
    return context


@contextlib.contextmanager
def left_out_of_garbage() -> Iterator[None]:
    """Restricts Python's garbage collection to objects created inside the context.

    Compilers, libraries and diagrams have a million permanent objects: scanning them repeatedly
    took 3 % of a run.
    """
    gc.collect()
    gc.freeze()
    try:
        yield
    finally:
        gc.unfreeze()


def _quota(groups: Path, own: Path) -> float | None:
    """Returns the smallest quota of this process's control groups, in cores; None without one."""
    try:
        lines = own.read_text(encoding="utf-8").splitlines()
    except (OSError, ValueError):
        return None
    found = []
    for line in lines:
        _, _, rest = line.partition(":")
        controllers, _, path = rest.partition(":")
        if controllers == "":
            root = groups
        elif "cpu" in controllers.split(","):
            root = groups / "cpu"
        else:
            continue
        # In a container, the path may be the host's while the root is the container's.
        folder = root / path.strip("/")
        found += [
            share for f in (root, folder, *folder.parents) if (share := _share(f)) is not None
        ]
    return min(found, default=None)


def _share(folder: Path) -> float | None:
    """Returns the cores that one control group may use; None if it has no quota."""
    try:
        if (folder / "cpu.max").exists():
            quota, _, period = (folder / "cpu.max").read_text(encoding="ascii").partition(" ")
        else:
            quota = (folder / "cpu.cfs_quota_us").read_text(encoding="ascii")
            period = (folder / "cpu.cfs_period_us").read_text(encoding="ascii")
        share = float(quota) / float(period)
    except (OSError, ValueError, ZeroDivisionError):
        return None  # "max" means no quota
    return share if share > 0.0 else None
