"""Reports in one line which system library or Python package is missing."""

from __future__ import annotations

import ctypes
import importlib
import re

from drake_dress.errors import UserError

# System libraries that Drake and OpenCV load, and their Debian packages; `.ci/run` and the README
# list the same.
SYSTEM_LIBRARIES = {
    "libX11.so.6": "libx11-6",
    "libGLX.so.0": "libglx0",
    "libOpenGL.so.0": "libopengl0",
    "libEGL.so.1": "libegl1",
}
# Modules required by every command.
_NEEDED = ("numpy", "scipy", "yaml", "rich", "h5py", "trimesh", "rtree", "pydrake.common")
# Modules provided by an extra.
EXTRAS = {
    "torch": "torch",
    "cv2": "vision",
    "gymnasium": "gym",
    "moviepy": "gym",
    "mujoco": "mujoco",
    "ray": "ray",
    "pyarrow": "ray",
    "anny": "bodies",
}
_SHARED_OBJECT = re.compile(r"(lib[\w.+-]+\.so[\d.]*)")
_INSTALL = "expected all packages of drake_dress: pip install them again"


def check_libraries() -> None:
    """Imports the modules required by every command.

    Raises:
        UserError: A module cannot be imported.
    """
    for name in _NEEDED:
        try:
            importlib.import_module(name)
        # Modules built against incompatible versions may raise any exception.
        except Exception as error:
            raise import_problem(error, name) from error


def import_problem(error: Exception, module: str = "") -> UserError:
    """Returns the error message for a module that cannot be imported.

    Args:
        error: Exception raised by the import.
        module: Module that was imported, if known.
    """
    text = " ".join(str(error).split()) or type(error).__name__
    missing = _SHARED_OBJECT.search(text)
    if missing and "cannot open shared object file" in text:
        names = [missing.group(1), *(n for n in SYSTEM_LIBRARIES if not _loads(n))]
        names = list(dict.fromkeys(names))
        packages = " ".join(SYSTEM_LIBRARIES[n] for n in names if n in SYSTEM_LIBRARIES)
        install = f"apt-get install {packages}" if packages else "the system package that has it"
        verb = "is" if len(names) == 1 else "are"
        message = f"cannot be loaded: {', '.join(names)} {verb} missing, expected {install}"
        return UserError(module or "library", "", message)
    if isinstance(error, ModuleNotFoundError) and error.name:
        asked = module.partition(".")[0]
        other = asked and asked != error.name.partition(".")[0]
        needs = f", which {asked} uses" if other else ""
        extra = EXTRAS.get(error.name.partition(".")[0])
        install = f"expected pip install 'drake_dress[{extra}]'" if extra else _INSTALL
        return UserError(error.name, "", f"is not installed{needs}, {install}")
    name = module or getattr(error, "name", None) or "library"
    return UserError(name, "", f"cannot be imported: {text}, {_INSTALL}")


def _loads(name: str) -> bool:
    try:
        ctypes.CDLL(name)
    except OSError:
        return False
    return True
