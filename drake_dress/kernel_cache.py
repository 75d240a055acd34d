"""Makes Numba's kernel cache fault-tolerant: without a usable cache it compiles in memory.

Numba fails at `@njit(cache=True)` if neither the installation nor the user's cache is writable, and
fails later if the disk is full or a cache file is damaged. A cache only saves time: none of this
may end a program. Numba has no setting for it, so the class that creates a dispatcher's cache is
replaced. Kernels of other packages in the process are cached as before.
"""

from __future__ import annotations

import multiprocessing
import os
import sys
import time
from collections.abc import Callable
from typing import Any, TextIO

from numba.core import caching, dispatcher

from drake_dress.caches import user_cache

# The attribute is not exported, so mypy does not know it.
_DISPATCHER: Any = dispatcher


# Time from the first missing kernel to the first message, and between messages, s.
_PATIENCE, _AGAIN = 2.0, 15.0


class Telling:
    """Reports that kernels are being compiled if it takes long, usually once on a machine.

    Args:
        out: Stream for the messages; stderr if None.
        clock: Returns a monotonic time, s.
    """

    def __init__(
        self, out: TextIO | None = None, clock: Callable[[], float] = time.monotonic
    ) -> None:
        self._out, self._clock = out, clock
        self._count = 0
        self._due: float | None = None

    def begin(self) -> None:
        """Records that the compilation of a kernel starts."""
        if self._due is None:
            self._due = self._clock() + _PATIENCE

    def end(self) -> None:
        """Records that a kernel was compiled, and prints a message if one is due."""
        self._count += 1
        now = self._clock()
        # worker processes compile at the same time and stay silent
        if self._due is None or now < self._due or multiprocessing.parent_process() is not None:
            return
        self._due = now + _AGAIN
        line = f"compiling kernels, once on this machine: {self._count} so far"
        print(line, file=self._out or sys.stderr, flush=True)


_TELLING = Telling()


class _Forgiving(caching.FunctionCache):
    """A cache that ignores failures to load or save."""

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        try:
            found = super().load_overload(sig, target_context)
        # A damaged file may raise any exception.
        except Exception:
            found = None
        if found is None:
            _TELLING.begin()
        return found

    def save_overload(self, sig: Any, data: Any) -> None:
        _TELLING.end()
        try:
            super().save_overload(sig, data)
        except Exception:
            try:
                # Start a new index, since the old one may be damaged.
                self.flush()
                super().save_overload(sig, data)
            except Exception:
                self.disable()


class _TemporaryLocator(caching.UserWideCacheLocator):
    """Keeps kernels in this program's own cache folder, which is tried last."""

    def __init__(self, py_func: Callable[..., Any], py_file: str) -> None:
        super().__init__(py_func, py_file)
        folder = user_cache()
        if folder is not None:
            place = self.get_suitable_cache_subpath(py_file)
            self._cache_path = os.path.join(folder, "kernels", place)


def _cache(function: Callable[..., Any]) -> Any:
    """Returns the cache of a function; a null cache if no folder is usable."""
    try:
        return _Forgiving(function)
    except RuntimeError:
        return caching.NullCache()


def install() -> None:
    """Makes Numba use these caches; may be called repeatedly."""
    locators = caching.CacheImpl._locator_classes
    if _TemporaryLocator not in locators:
        locators.append(_TemporaryLocator)
    _DISPATCHER.FunctionCache = _cache
