"""Compiles kernels in which four similar statements in a row become one vector instruction.

Numba turns LLVM's superword-level vectorisation off for a whole process by default. So these
kernels are compiled with their signatures when they are defined, and the setting is restored.
Without it they are correct, and about half as fast.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numba as nb
from numba.core import config

# Numba sets its options by name when it is imported.
_CONFIG: Any = config


def vectorised(signature: Any) -> Callable[[Callable[..., Any]], Any]:
    """Returns a decorator that compiles a function at once, with fused multiply-adds.

    Args:
        signature: Numba signature of the function.
    """

    def compile_now(function: Callable[..., Any]) -> Any:
        before = _CONFIG.SLP_VECTORIZE
        _CONFIG.SLP_VECTORIZE = 1
        try:
            return nb.njit(signature, cache=True, nogil=True, fastmath={"contract"})(function)
        finally:
            _CONFIG.SLP_VECTORIZE = before

    return compile_now
