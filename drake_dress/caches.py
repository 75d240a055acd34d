"""Cache folders for libraries, if the usual ones are not writable.

An installation or home folder may be read-only (images of Apptainer and Docker, Nix, shared
clusters), missing, or full. Caches then go to a private folder in the temporary directory. All
libraries in use, including Numba, Warp, Matplotlib and Mesa, read the folder from the environment,
which child processes inherit.
"""

from __future__ import annotations

import os
import stat
import tempfile
from collections.abc import MutableMapping
from functools import lru_cache
from pathlib import Path

# Bytes written to test for free space: about the size of one compiled kernel.
_PROBE = 1 << 16
# Environment variables for the cache folders of single libraries; if set, they must be usable.
_OWN_FOLDERS = ("NUMBA_CACHE_DIR", "WARP_CACHE_PATH")


def prepare_caches(environment: MutableMapping[str, str] = os.environ) -> None:
    """Points libraries to writable cache folders; leaves usable folders as they are.

    Args:
        environment: Environment of the process.
    """
    for name in _OWN_FOLDERS:
        if name in environment and not usable(Path(environment[name])):
            del environment[name]
    cache = _home_folder(environment, "XDG_CACHE_HOME", ".cache")
    if cache is None or not usable(cache):
        cache = temporary_cache()
        if cache is not None:
            environment["XDG_CACHE_HOME"] = str(cache)
    # Matplotlib keeps its settings in another folder, and warns if it is not writable.
    own = environment.get("MPLCONFIGDIR")
    config = _home_folder(environment, "XDG_CONFIG_HOME", ".config")
    settings = Path(own) if own else None if config is None else config / "matplotlib"
    if cache is not None and (settings is None or not usable(settings)):
        environment["MPLCONFIGDIR"] = str(cache / "matplotlib")


def user_cache() -> Path | None:
    """Returns this program's own cache folder; None if no folder is writable."""
    cache = _home_folder(os.environ, "XDG_CACHE_HOME", ".cache")
    if cache is not None and usable(cache / "drake_dress"):
        return cache / "drake_dress"
    return temporary_cache()


@lru_cache(maxsize=1)
def temporary_cache() -> Path | None:
    """Returns a folder in the temporary directory that only this user can write to.

    Its name contains the user ID and it persists, so that kernels are not compiled in each run.
    Returns None if another user owns a folder of that name, or if nothing can be written.
    """
    try:
        parent = Path(tempfile.gettempdir())
        # Python falls back to the working directory, which belongs to the user.
        if parent == Path.cwd():
            return None
    except OSError:  # no temporary directory, or the working directory was deleted
        return None
    folder = parent / f"drake-dress-{os.getuid()}"
    try:
        folder.mkdir(mode=0o700, exist_ok=True)
        found = folder.lstat()
    except OSError:
        return None
    owned = stat.S_ISDIR(found.st_mode) and found.st_uid == os.getuid()
    return folder if owned and not found.st_mode & 0o077 and usable(folder) else None


def usable(folder: Path) -> bool:
    """Returns whether a folder exists or can be created, and has free space."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder) as file:
            file.write(bytes(_PROBE))
            file.flush()
    except (OSError, ValueError):
        return False
    return True


def _home_folder(environment: MutableMapping[str, str], name: str, usual: str) -> Path | None:
    """Returns the folder named by a variable, or the usual one in the user's home."""
    if environment.get(name):
        return Path(environment[name])
    try:
        return Path.home() / usual
    except RuntimeError:  # HOME is not set, and the system does not know the user
        return None
