"""Seeds drawn for a purpose.

Seeds 0 to 99 are for development, 100 to 999 for choosing between variants, 1000 and above for
reporting. Reported figures must come from seeds that nobody has looked at. Therefore, they are
drawn; the same root of the draw gives the same seeds.
"""

from __future__ import annotations

import numpy as np

PURPOSES = {"develop": range(100), "choose": range(100, 1000), "report": range(1000, 2**31)}


def drawn_seeds(purpose: str, count: int, root: int) -> list[int]:
    """Returns distinct seeds in the order in which they are drawn.

    A larger draw with the same root begins with the smaller one.

    Args:
        purpose: One of `PURPOSES`; it must have at least `count` seeds.
        count: Number of seeds.
        root: Seed of the draw, 0 or more.
    """
    among = PURPOSES[purpose]
    rng = np.random.default_rng([root, among.start])
    drawn: dict[int, None] = {}
    while len(drawn) < count:
        drawn[int(rng.integers(among.start, among.stop))] = None
    return list(drawn)
