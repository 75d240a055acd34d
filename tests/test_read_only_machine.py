"""Kernels, processes and pictures work where installation, home and /dev/shm are read-only."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
WORK = """
import os
import numpy as np
from drake_dress.models.vector3 import dot
assert dot(np.ones(3), np.ones(3)) == 3.0
from drake_dress.drawing import as_svg, new_figure
assert len(as_svg(new_figure(1.0, 1.0))) > 100
from drake_dress.systems.shared_memory import SharedMemory
from drake_dress.worker_pool import WorkerPool
if __name__ == "__main__":
    with WorkerPool(1) as pool:
        assert pool.submit(abs, -3).result() == 3
    print(os.environ.get("XDG_CACHE_HOME"), len(SharedMemory(8).memory))
"""
READ_ONLY = """
set -e
mount --make-rprivate /
mount -t tmpfs -o ro tmpfs /dev/shm
for place in "$1" "$HOME"; do
    mount --bind "$place" "$place"
    mount -o remount,bind,ro "$place"
done
shift
exec "$@"
"""


@pytest.mark.parametrize("temporary", [True, False])
def test_nothing_but_time_is_lost(temporary: bool, tmp_path: Path) -> None:
    home, folder = tmp_path / "home", tmp_path / "tmp"
    home.mkdir()
    folder.mkdir()
    command = [sys.executable, "-c", WORK]
    settings = {"HOME": str(home), "TMPDIR": str(folder), "PYTHONPATH": str(ROOT)}
    if not temporary:
        # a folder that others can write to is not used, and there is no alternative
        (folder / f"drake-dress-{os.getuid()}").mkdir()
        (folder / f"drake-dress-{os.getuid()}").chmod(0o777)
    if os.geteuid() == 0:
        command = ["unshare", "-m", "sh", "-c", READ_ONLY, "sh", str(ROOT), *command]
    else:
        # without the right to mount, use a path below a file, which cannot be written to
        (home / "file").touch()
        nowhere = str(home / "file" / "x")
        settings |= {"HOME": nowhere, "NUMBA_CACHE_DIR": nowhere}
    kept = {k: v for k, v in os.environ.items() if not k.startswith(("XDG_", "MPL", "NUMBA_"))}
    done = subprocess.run(
        command, env=kept | settings, cwd="/", capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    assert done.stderr == "" or not temporary
    cache = str(folder / f"drake-dress-{os.getuid()}") if temporary else "None"
    assert done.stdout.split() == [cache, "8"]
