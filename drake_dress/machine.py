"""What this process may use of the machine it runs on."""

from __future__ import annotations

import contextlib
import gc
import os
from collections.abc import Iterator, MutableMapping
from pathlib import Path

_OWN_GROUPS = Path("/proc/self/cgroup")
_GROUPS = Path("/sys/fs/cgroup")
_THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")


def worker_count(groups: Path = _GROUPS, own: Path = _OWN_GROUPS) -> int:
    """Returns how many processes may run at once: of the cores, those that this job may use.

    A cluster or container allows fewer than there are, by an affinity or by a quota of time.

    Args:
        groups: where the kernel tells quotas of control groups (version 2, or 1 below `cpu`).
        own: tells which groups this process is in.
    """
    try:
        cores = len(os.sched_getaffinity(0))
    except (AttributeError, OSError):
        cores = os.cpu_count() or 1
    quota = _quota(groups, own)
    # A quota of 1.5 cores keeps two processes busy most of the time, but one is never held up.
    return max(1, cores if quota is None else min(cores, int(quota)))


def limit_threads(environment: MutableMapping[str, str] = os.environ) -> None:
    """Has linear algebra use no more threads than this job may use cores.

    Its libraries obey affinities by themselves, but no quota. What the user has set stays.

    Args:
        environment: of the process, before these libraries are imported.
    """
    count = worker_count()
    if count < len(os.sched_getaffinity(0)):
        for name in _THREADS:
            environment.setdefault(name, str(count))


@contextlib.contextmanager
def left_out_of_garbage() -> Iterator[None]:
    """Has Python look for garbage only among what is made meanwhile.

    Compilers, libraries and diagrams are a million objects that stay: to look at them again and
    again took 3 % of a run.
    """
    gc.collect()
    gc.freeze()
    try:
        yield
    finally:
        gc.unfreeze()


def _quota(groups: Path, own: Path) -> float | None:
    """Returns the least quota of this process's control groups, in cores; None if there is none."""
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
        # In a container, the path may be that of the host, and the root that of the container.
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
        return None  # "max" says that there is none
    return share if share > 0.0 else None
