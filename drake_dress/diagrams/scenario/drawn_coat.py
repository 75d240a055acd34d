"""Draws a coat: cut, size and measures, for studies over many coats."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from drake_dress.diagrams.scenario.coat import COAT_MEASURES, coat_parameters
from drake_dress.diagrams.scenario.schema import Coat
from drake_dress.errors import UserError
from drake_dress.models.garment.coat import COATS, body_of_size, make_coat, size_codes

# Relative width of a measure's own variation: makers differ by this in coats of one size.
MEASURE_WIDTH = 0.03
_SPACING = 0.06  # m, of the mesh that shows whether drawn measures make a coat
_ATTEMPTS = 50  # to draw measures that fit each other


def draw_coat(
    rng: np.random.Generator,
    cuts: Sequence[str] | None = None,
    tables: Sequence[str] = ("women", "men"),
    width: float = MEASURE_WIDTH,
    opens: str = "front",
) -> Coat:
    """Returns the keys `garment.coat` of a drawn coat, which the generator's state decides.

    Cut, table and size are equally likely each. Then every measure that the coat has is multiplied
    by a factor of its own between 1 − width and 1 + width, and stands in the keys.

    Args:
        rng: generator; it is advanced.
        cuts: presets to draw from. None for all that open on the side `opens`.
        tables: size tables to draw from.
        width: relative width of each measure's variation.
        opens: see `cuts`.

    Raises:
        UserError: a cut or a table is unknown, or no drawn measures make a coat.
    """
    if cuts is None:
        cuts = [name for name, cut in COATS.items() if cut.opens == opens]
    unknown = [name for name in cuts if name not in COATS]
    if unknown:
        known = ", ".join(COATS)
        raise UserError("coat", "preset", f"is {unknown[0]!r}, expected one of {known}")
    for _ in range(_ATTEMPTS):
        coat = Coat(preset=_one_of(rng, cuts), size_table=_one_of(rng, tables))
        coat.size = _one_of(rng, size_codes(coat.size_table))
        whole = coat_parameters(coat)
        for name in COAT_MEASURES:
            value = getattr(whole, name)
            factor = 1.0 + width * rng.uniform(-1.0, 1.0)
            if value is not None:
                setattr(coat, name, float(value * factor))
        try:
            make_coat(coat_parameters(coat), _SPACING)
        except UserError as error:
            why = str(error)
        else:
            return coat
    raise UserError("coat", "width", f"is {width}, at which no drawn measures make a coat: {why}")


def in_size(coat: Coat, size: str) -> Coat:
    """Returns a coat in another size of its table.

    Each measure that is given keeps its ratio to that of the cut in the coat's size, so a drawn
    coat stays the work of the same maker.

    Raises:
        UserError: the table has no such size.
    """
    cut = Coat(preset=coat.preset, size=coat.size, size_table=coat.size_table)
    before, after = coat_parameters(cut), coat_parameters(replace(cut, size=size))
    found = replace(coat, size=size)
    for name in COAT_MEASURES:
        given, own, other = (getattr(each, name) for each in (coat, before, after))
        if given is not None and own and other is not None:
            setattr(found, name, float(given * other / own))
    return found


def own_size(table: str, chest: float, codes: Sequence[str] | None = None) -> str:
    """Returns the size of a table whose body has the chest girth nearest to `chest`, m.

    Args:
        table: of sizes.
        chest: girth, as a tape measures it, m.
        codes: sizes to choose from; None for all of the table.

    Raises:
        UserError: there is no such table.
    """
    codes = size_codes(table) if codes is None else codes
    return min(codes, key=lambda code: abs(body_of_size(table, code).chest - chest))


def _one_of(rng: np.random.Generator, words: Sequence[str]) -> str:
    return words[int(rng.integers(len(words)))]
