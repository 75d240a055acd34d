"""Compiles kernels whose statements, four alike in a row, are to become one vector instruction.

Numba leaves LLVM's superword-level vectorisation off for a whole process unless told otherwise, so
these kernels are compiled when they are defined, with their signatures, and the setting is given
back. Without it they are right, and about half as fast.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numba as nb
from numba.core import config

# Numba sets its options by name when it is imported.
_CONFIG: Any = config


def vectorised(signature: Any) -> Callable[[Callable[..., Any]], Any]:
    """Returns a decorator that compiles a function at once, products fused with sums.

    Args:
        signature: of Numba.
    """

    def compile_now(function: Callable[..., Any]) -> Any:
        before = _CONFIG.SLP_VECTORIZE
        _CONFIG.SLP_VECTORIZE = 1
        try:
            return nb.njit(signature, cache=True, nogil=True, fastmath={"contract"})(function)
        finally:
            _CONFIG.SLP_VECTORIZE = before

    return compile_now
