"""Folders for what libraries keep between runs, where the usual ones cannot be written to.

An installation and a home may be read-only (images of Apptainer and Docker, Nix, shared clusters),
missing, or full. Then caches go to a folder of the user's own below the temporary one. All
libraries in use, Numba, Warp, Matplotlib and Mesa among them, look at the environment for it, and
processes that are started inherit it.
"""

from __future__ import annotations

import os
import stat
import tempfile
from collections.abc import MutableMapping
from functools import lru_cache
from pathlib import Path

# Written to find out whether there is room: about as much as one compiled kernel.
_PROBE = 1 << 16
# Variables of libraries that name a folder of their own, which must be of use where it is set.
_OWN_FOLDERS = ("NUMBA_CACHE_DIR", "WARP_CACHE_PATH")


def prepare_caches(environment: MutableMapping[str, str] = os.environ) -> None:
    """Points libraries to folders that can be written to. Changes nothing where they can be.

    Args:
        environment: of the process.
    """
    for name in _OWN_FOLDERS:
        if name in environment and not usable(Path(environment[name])):
            del environment[name]
    cache = _home_folder(environment, "XDG_CACHE_HOME", ".cache")
    if cache is None or not usable(cache):
        cache = temporary_cache()
        if cache is not None:
            environment["XDG_CACHE_HOME"] = str(cache)
    # Matplotlib keeps its settings in another folder, and complains where it cannot.
    own = environment.get("MPLCONFIGDIR")
    config = _home_folder(environment, "XDG_CONFIG_HOME", ".config")
    settings = Path(own) if own else None if config is None else config / "matplotlib"
    if cache is not None and (settings is None or not usable(settings)):
        environment["MPLCONFIGDIR"] = str(cache / "matplotlib")


def user_cache() -> Path | None:
    """Returns this program's own folder for what it keeps; None where nothing can be kept."""
    cache = _home_folder(os.environ, "XDG_CACHE_HOME", ".cache")
    if cache is not None and usable(cache / "drake_dress"):
        return cache / "drake_dress"
    return temporary_cache()


@lru_cache(maxsize=1)
def temporary_cache() -> Path | None:
    """Returns a folder below the temporary one that nobody else can write to.

    It has the user's name and stays, so that kernels are not compiled in each run. Where somebody
    else has made a folder of that name, or nothing can be written, there is none.
    """
    try:
        parent = Path(tempfile.gettempdir())
        # Python's last resort is the working directory, which is the user's.
        if parent == Path.cwd():
            return None
    except OSError:  # there is none, or the working directory is gone
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
    """Returns whether a folder is there, or can be made, and has room."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder) as file:
            file.write(bytes(_PROBE))
            file.flush()
    except (OSError, ValueError):
        return False
    return True


def _home_folder(environment: MutableMapping[str, str], name: str, usual: str) -> Path | None:
    """Returns the folder that a variable names, or the usual one in the user's home."""
    if environment.get(name):
        return Path(environment[name])
    try:
        return Path.home() / usual
    except RuntimeError:  # no HOME, and a user whom the system does not know
        return None
