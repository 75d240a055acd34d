"""Rows of four or eight numbers as tuples, for kernels on vector registers.

A tuple in place of an array lets LLVM keep a row in registers. Its length is part of its type and
selects the width when a kernel is compiled. `like` is any tuple of the wanted width.
"""

from __future__ import annotations

from typing import Any

from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

FOUR = (0.0,) * 4
EIGHT = (0.0,) * 8
_FUSED = ("contract",)


@intrinsic
def load(typing_context: Any, work: Any, i: Any, like: Any) -> Any:
    """Returns the first numbers of row `i` of a C-contiguous array."""

    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        places = _places(context, builder, signature, args, len(like))
        return context.make_tuple(builder, like, [builder.load(p) for p in places])

    return like(work, i, like), generate


@intrinsic
def store(typing_context: Any, work: Any, i: Any, a: Any) -> Any:
    """Writes the tuple `a` to the first numbers of row `i`."""

    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        places = _places(context, builder, signature, args, len(a))
        for place, value in zip(places, cgutils.unpack_tuple(builder, args[2]), strict=True):
            builder.store(value, place)
        return context.get_dummy_value()

    return types.void(work, i, a), generate


@intrinsic
def times(typing_context: Any, s: Any, a: Any) -> Any:
    """Returns s a."""

    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        values = cgutils.unpack_tuple(builder, args[1])
        return context.make_tuple(builder, a, [builder.fmul(args[0], v) for v in values])

    return a(s, a), generate


@intrinsic
def less(typing_context: Any, a: Any, s: Any, b: Any) -> Any:
    """Returns a − s b."""
    return a(a, s, b), _fused("fsub")


@intrinsic
def more(typing_context: Any, a: Any, s: Any, b: Any) -> Any:
    """Returns a + s b."""
    return a(a, s, b), _fused("fadd")


def _fused(operation: str) -> Any:
    """Returns the generator of `a` fsub or fadd `s b`, with one rounding."""

    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        pairs = zip(
            cgutils.unpack_tuple(builder, args[0]),
            cgutils.unpack_tuple(builder, args[2]),
            strict=True,
        )
        combined = getattr(builder, operation)
        values = [
            combined(p, builder.fmul(args[1], q, flags=_FUSED), flags=_FUSED) for p, q in pairs
        ]
        return context.make_tuple(builder, signature.args[0], values)

    return generate


def _places(context: Any, builder: Any, signature: Any, args: Any, count: int) -> list[Any]:
    """Returns pointers to the first numbers of a row: args[0] is the array, args[1] the row."""
    kind, index = signature.args[:2]
    array = context.make_array(kind)(context, builder, args[0])
    row = context.cast(builder, args[1], index, types.intp)
    columns = [context.get_constant(types.intp, c) for c in range(count)]
    return [
        cgutils.get_item_pointer(context, builder, kind, array, (row, c), wraparound=False)
        for c in columns
    ]
