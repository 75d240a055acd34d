"""Random damage to the bytes of a file."""

from __future__ import annotations

import numpy as np

# Kinds of damage that any file may have.
KINDS = ("flip", "drop", "insert", "cut", "zero", "nothing", "noise")


def damage(
    rng: np.random.Generator, data: bytearray, how: str, most: int, zeroed: int
) -> bytearray:
    """Returns the damaged bytes; `data` may be changed.

    Args:
        rng: Generator of the damage.
        data: Sound bytes.
        how: Kind of damage, from `KINDS`; any other kind returns the bytes as they are.
        most: One more than the largest number of flips, drops, insertions or zeroed pieces.
        zeroed: Length of a zeroed piece.
    """
    for _ in range(int(rng.integers(1, most))):
        k = int(rng.integers(len(data)))
        if how == "flip":
            data[k] ^= 1 << int(rng.integers(8))
        elif how == "drop":
            del data[k : k + int(rng.integers(1, 60))]
        elif how == "insert":
            data[k:k] = rng.bytes(int(rng.integers(1, 5)))
        elif how == "zero":
            data[k : k + zeroed] = bytes(len(data[k : k + zeroed]))
    if how == "cut":
        del data[int(rng.integers(1, len(data))) :]
    elif how == "nothing":
        data.clear()
    elif how == "noise":
        return bytearray(rng.bytes(int(rng.integers(1, 5000))))
    return data
