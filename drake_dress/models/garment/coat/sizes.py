"""Sizes: body measures by size code, and a cut's measures for a body.

Letters stand for the intervals of bust or chest of EN 13402-3 (size designation of clothes),
children's codes for its statures. Numbers are not in the standard but in the trade: half the chest
(men), half the bust less 6 cm (women, to 46), both of which are the middles of its intervals. The
standard leaves the other body measures open. They follow here from straight lines over chest or
stature, as pattern makers grade them: across the shoulders, for instance, 1 cm for 4 cm of a man's
chest.

Sources, as the standard itself is not public: its intervals of the bust, 74 to 102 cm in steps of 4
and 107 to 131 cm in steps of 6, in the documentation of the R package Anthropometry
(`bustSizesStandard`); letters, also 4XL and 5XL, in Wikipedia, "Joint European standard for size
labelling of clothes". Children's chests are from memory, unchecked.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from drake_dress.errors import UserError
from drake_dress.models.garment.coat.parameters import CoatParameters

SIZE_TABLES = ("women", "men", "children")
_LETTERS = ("XS", "S", "M", "L", "XL", "XXL", "3XL", "4XL", "5XL")
_NUMBERS = tuple(range(34, 61, 2))
# Middles of the intervals of chest and bust, m.
_MEN_LETTERS = (0.82, 0.90, 0.98, 1.06, 1.14, 1.235, 1.35, 1.475, 1.60)
_WOMEN_LETTERS = (0.78, 0.86, 0.94, 1.025, 1.13, 1.25, 1.37, 1.49, 1.61)
# 34 is 80 cm; steps of 4 cm to 104 cm (46), then of 6 cm.
_WOMEN_NUMBERS = tuple(0.80 + 0.04 * k for k in range(7)) + tuple(
    1.04 + 0.06 * k for k in range(1, 8)
)
# Stature, cm, and chest, m, of children.
_CHILDREN = {
    **{92: 0.54, 98: 0.55, 104: 0.56, 110: 0.58, 116: 0.60, 122: 0.62, 128: 0.65, 134: 0.68},
    **{140: 0.71, 146: 0.74, 152: 0.77, 158: 0.80, 164: 0.84, 170: 0.88, 176: 0.92},
}


@dataclass(frozen=True)
class BodySize:
    """Measures of the body that a size is for, m.

    Attributes:
        stature: height of the body.
        chest: girth of chest or bust.
        shoulder: width across the shoulders, from tip to tip.
        arm: length from the shoulder tip to the wrist, the arm a little bent.
        armscye: girth around shoulder and armpit.
        elbow: girth of the bent elbow.
        hand: girth of the closed hand, which a cuff has to pass.
        neck: width of the neck at its base.
    """

    stature: float
    chest: float
    shoulder: float
    arm: float
    armscye: float
    elbow: float
    hand: float
    neck: float


def size_codes(table: str) -> tuple[str, ...]:
    """Returns the codes of one of `SIZE_TABLES`, as a scenario names them.

    Raises:
        UserError: the table is unknown.
    """
    _check_table(table, "size")
    return tuple(_bodies(table))


def body_of_size(table: str, code: str, source: str = "size") -> BodySize:
    """Returns the body that a size is for.

    Args:
        table: one of `SIZE_TABLES`.
        code: a letter such as `M`, an EU number such as `50`, or a child's stature such as `116`.
        source: file or name at the beginning of messages.

    Raises:
        UserError: the table or the size is unknown.
    """
    _check_table(table, source)
    bodies = _bodies(table)
    if code not in bodies:
        raise UserError(
            source,
            "size",
            f"is {code!r}, expected one of {', '.join(bodies)} for {table}",
        )
    return bodies[code]


def coat_of_size(cut: CoatParameters, body: BodySize) -> CoatParameters:
    """Returns a cut in the size of a body.

    A cut is drawn for a man of size 50, so its ease is what each of its girths and widths exceeds
    his by. The ease grows with the body's stature, as do the lengths of the cut.
    """
    base = body_of_size("men", "50")
    tall = body.stature / base.stature
    long = body.arm / base.arm

    def eased(value: float, own: float, his: float) -> float:
        return own + (value - his) * tall

    graded: dict[str, Callable[[float], float]] = {
        "chest": lambda v: eased(v, body.chest, base.chest),
        "hem_girth": lambda v: eased(v, body.chest, base.chest),
        "shoulder_width": lambda v: eased(v, body.shoulder, base.shoulder),
        "neck_width": lambda v: eased(v, body.neck, base.neck),
        "armhole_girth": lambda v: eased(v, body.armscye, base.armscye),
        "elbow_girth": lambda v: eased(v, body.elbow, base.elbow),
        "cuff_girth": lambda v: eased(v, body.hand, base.hand),
        "sleeve_length": lambda v: v * long,
        # the gap stays the same share of the chest
        "front_opening": lambda v: v * body.chest / base.chest,
        "hem_opening": lambda v: v * body.chest / base.chest,
    }
    lengths = cut.lengths
    return cut.with_lengths(
        {name: graded.get(name, lambda v: v * tall)(value) for name, value in lengths.items()}
    )


def _check_table(table: str, source: str) -> None:
    if table not in SIZE_TABLES:
        expected = ", ".join(SIZE_TABLES)
        raise UserError(source, "size_table", f"is {table!r}, expected one of {expected}")


def _bodies(table: str) -> dict[str, BodySize]:
    if table == "children":
        return {str(cm): _child(0.01 * cm, chest) for cm, chest in _CHILDREN.items()}
    body: Callable[[float], BodySize] = _man if table == "men" else _woman
    letters, numbers = _WOMEN_LETTERS, _WOMEN_NUMBERS
    if table == "men":
        letters, numbers = _MEN_LETTERS, tuple(0.02 * n for n in _NUMBERS)
    by_letter = {code: body(chest) for code, chest in zip(_LETTERS, letters, strict=True)}
    by_number = {str(n): body(chest) for n, chest in zip(_NUMBERS, numbers, strict=True)}
    return by_letter | by_number


def _man(chest: float) -> BodySize:
    more = chest - 1.0
    stature = float(np.clip(1.78 + 0.3 * more, 1.70, 1.84))
    return BodySize(
        stature=stature,
        chest=chest,
        shoulder=0.44 + 0.25 * more,
        arm=0.343 * stature,
        armscye=0.44 + 0.32 * more,
        elbow=0.29 + 0.18 * more,
        hand=0.23 + 0.08 * more,
        neck=0.155 + 0.08 * more,
    )


def _woman(bust: float) -> BodySize:
    more = bust - 0.92
    stature = float(np.clip(1.68 + 0.1 * more, 1.64, 1.72))
    return BodySize(
        stature=stature,
        chest=bust,
        shoulder=0.395 + 0.2 * more,
        arm=0.343 * stature,
        armscye=0.40 + 0.32 * more,
        elbow=0.26 + 0.18 * more,
        hand=0.20 + 0.08 * more,
        neck=0.14 + 0.05 * more,
    )


def _child(stature: float, chest: float) -> BodySize:
    return BodySize(
        stature=stature,
        chest=chest,
        shoulder=0.245 * stature,
        arm=0.335 * stature,
        armscye=0.44 * chest,
        elbow=0.05 + 0.12 * stature,
        hand=0.05 + 0.09 * stature,
        neck=0.05 + 0.05 * stature,
    )
