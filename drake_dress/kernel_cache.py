"""Numba keeps compiled kernels where it can, and compiles in memory where it cannot.

Numba fails at `@njit(cache=True)` if neither the installation nor the user's cache can be written
to, and fails later if the disk is full or a file of the cache is damaged. A cache only saves time:
none of this may end a program. Numba has no setting for it, so what makes a dispatcher's cache is
replaced; kernels of other packages in the process are kept as before.
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

# Mypy knows only what a module exports.
_DISPATCHER: Any = dispatcher


# Time after the first kernel that is not there, s, from which it is told, and between lines.
_PATIENCE, _AGAIN = 2.0, 15.0


class Telling:
    """Tells that kernels are compiled, where that takes long: once on a machine, mostly.

    Args:
        out: where lines are written; stderr if None.
        clock: s that go on.
    """

    def __init__(
        self, out: TextIO | None = None, clock: Callable[[], float] = time.monotonic
    ) -> None:
        self._out, self._clock = out, clock
        self._count = 0
        self._due: float | None = None

    def begin(self) -> None:
        """Notes that a kernel is to be compiled."""
        if self._due is None:
            self._due = self._clock() + _PATIENCE

    def end(self) -> None:
        """Notes that one was, and tells so where it is time."""
        self._count += 1
        now = self._clock()
        # processes beside this one compile at the same time, and are silent
        if self._due is None or now < self._due or multiprocessing.parent_process() is not None:
            return
        self._due = now + _AGAIN
        line = f"compiling kernels, once on this machine: {self._count} so far"
        print(line, file=self._out or sys.stderr, flush=True)


_TELLING = Telling()


class _Forgiving(caching.FunctionCache):
    """Passes over what cannot be loaded or saved."""

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        try:
            found = super().load_overload(sig, target_context)
        # A damaged file raises whatever its bytes happen to mean.
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
                # An index that is damaged is begun anew.
                self.flush()
                super().save_overload(sig, data)
            except Exception:
                self.disable()


class _TemporaryLocator(caching.UserWideCacheLocator):
    """Keeps kernels in this program's own cache, the last place that is tried."""

    def __init__(self, py_func: Callable[..., Any], py_file: str) -> None:
        super().__init__(py_func, py_file)
        folder = user_cache()
        if folder is not None:
            place = self.get_suitable_cache_subpath(py_file)
            self._cache_path = os.path.join(folder, "kernels", place)


def _cache(function: Callable[..., Any]) -> Any:
    """Returns the cache of a function; one that keeps nothing where nothing can be kept."""
    try:
        return _Forgiving(function)
    except RuntimeError:
        return caching.NullCache()


def install() -> None:
    """Has Numba use these caches; may be called again."""
    locators = caching.CacheImpl._locator_classes
    if _TemporaryLocator not in locators:
        locators.append(_TemporaryLocator)
    _DISPATCHER.FunctionCache = _cache
