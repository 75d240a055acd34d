"""Compiled kernels return bitwise equal results in every process."""

import importlib
import pkgutil
from functools import cache
from typing import Any

from numba.core.dispatcher import Dispatcher

import drake_dress


def kernels() -> list[Any]:
    """Returns all kernels of the package."""
    names = [m.name for m in pkgutil.walk_packages(drake_dress.__path__, "drake_dress.")]
    modules = [importlib.import_module(n) for n in names if not n.endswith("__main__")]
    found = {id(v): v for m in modules for v in vars(m).values() if isinstance(v, Dispatcher)}
    return list(found.values())


def callees(kernel: Any) -> list[Any]:
    """Returns the kernels that a kernel calls by name."""
    function = kernel.py_func
    named = (function.__globals__.get(n) for n in function.__code__.co_names)
    return [v for v in named if isinstance(v, Dispatcher)]


@cache
def rounds_freely(kernel: Any) -> bool:
    """Returns whether the compiler may choose how a kernel's sums are rounded."""
    return bool(kernel.targetoptions.get("fastmath")) or any(map(rounds_freely, callees(kernel)))


def has_one_compilation(kernel: Any) -> bool:
    """Returns whether a second compilation can never take the place of the first."""
    options = kernel.targetoptions
    compiled_at_import = not kernel._can_compile
    return options.get("inline") == "always" or options.get("forceinline") or compiled_at_import


def test_a_kernel_that_others_call_has_one_compilation_where_rounding_is_free() -> None:
    # A kernel that is neither inlined nor compiled at import lies in its own library and, optimised
    # once more, in its caller's. The one that was loaded first is called, which depends on whether
    # the cache was warm. With free rounding their last bits differ.
    found = kernels()
    called = {id(g): g for k in found for g in callees(k)}
    assert len(found) > 200
    assert any(rounds_freely(k) for k in called.values())
    doubled = [
        f"{k.py_func.__module__}.{k.py_func.__name__}"
        for k in called.values()
        if rounds_freely(k) and not has_one_compilation(k)
    ]
    assert not doubled
