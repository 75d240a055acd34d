"""The verdict: which measures of a garment are too small or too large for a person.

The limits are ratios of the garment's measure to the person's. They come from dressings of the
dummy with coats of which one measure was changed at a time, and, for coats that are held at the
edges of their opening, of drawn bodies in drawn coats; docs/garments.md has both.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from drake_dress.models.garment.fit.girths import PersonGirths
from drake_dress.models.garment.fit.sizes import GarmentSizes
from drake_dress.models.sides import SIDES

# cannot: the garment cannot go on. fails: dressings with such a measure fail. tight: they take much
# longer. unknown: it cannot be judged. note: worth knowing, with no effect on a dressing.
Level = Literal["cannot", "fails", "unknown", "tight", "note"]
_ORDER: tuple[Level, ...] = ("cannot", "fails", "unknown", "tight", "note")


@dataclass(frozen=True)
class Limits:
    """Ratios of a garment's measure to the person's.

    Attributes:
        least: below it, the garment cannot go on.
        fails: below it, dressings fail.
        tight: below it, they take much longer, and some may fail.
    """

    least: float = 0.0
    fails: float = 0.0
    tight: float = 0.0

    @property
    def wanted(self) -> float:
        """Returns the ratio from which on a measure suits."""
        return max(self.least, self.fails, self.tight)


# Cloth hardly stretches, so a narrower opening than the limb lets nothing through.
CUFF = Limits(least=1.0)
ARMHOLE = Limits(least=1.0, fails=1.6, tight=1.75)
# Of a coat that is held at the edges: it lies open before the arm.
ARMHOLE_AT_EDGES = Limits(least=1.0, fails=1.46, tight=1.6)
BACK = Limits(tight=0.8)
_FREE = Limits()
# A shorter sleeve is none: what is left is the edge of an armhole, m.
SHORTEST_SLEEVE = 0.05
# Shares of the arm, from the shoulder to the middle of the hand, below which a sleeve is called
# short, and of the arm to the tip of the hand, above which the hand stays in it.
_SHORT, _COVERED = 0.85, 1.0
# Differences between left and right above which they are told, as shares of the larger.
_UNEQUAL = 0.05


@dataclass(frozen=True)
class Comparison:
    """A measure of the garment beside the person's.

    Attributes:
        name: of the measure, such as `left cuff`.
        measure: what a change of size would change: a coat parameter such as `cuff_girth`, or
            `back_width`, which depends on several.
        garment: m; None if the garment has no such measure.
        part: what of the person it is compared with, such as `hand`.
        person: m.
        limits: of the ratio of both.
    """

    name: str
    measure: str
    garment: float | None
    part: str
    person: float
    limits: Limits = _FREE

    @property
    def ratio(self) -> float | None:
        """Returns the garment's measure over the person's."""
        return None if self.garment is None else self.garment / self.person

    @property
    def state(self) -> str:
        """Returns `fits`, `tight`, `too tight` or `too narrow`; empty if nothing is asked of it."""
        ratio, limits = self.ratio, self.limits
        if ratio is None or limits == _FREE:
            return ""
        if ratio < limits.least:
            return "too narrow"
        if ratio < limits.fails:
            return "too tight"
        return "tight" if ratio < limits.tight else "fits"


@dataclass(frozen=True)
class Finding:
    """What was found: how bad it is, the measure that it is about, if any, and a sentence."""

    level: Level
    measure: str
    text: str


@dataclass(frozen=True)
class Fit:
    """A verdict.

    Attributes:
        comparisons: of garment and person.
        findings: worst first.
    """

    comparisons: tuple[Comparison, ...]
    findings: tuple[Finding, ...]

    @property
    def fits(self) -> bool | None:
        """Returns whether the garment goes on; None if that cannot be judged.

        What is tight goes on, with difficulty.
        """
        levels = {finding.level for finding in self.findings}
        if levels & {"cannot", "fails"}:
            return False
        return None if "unknown" in levels else True

    @property
    def impossible(self) -> tuple[Finding, ...]:
        """Returns why the garment cannot go on at all."""
        return self._at("cannot")

    @property
    def reasons(self) -> tuple[Finding, ...]:
        """Returns why it does not fit, cannot be judged, or is tight."""
        return self._at("cannot", "fails", "unknown", "tight")

    @property
    def notes(self) -> tuple[Finding, ...]:
        """Returns what else is worth knowing."""
        return self._at("note")

    def _at(self, *levels: Level) -> tuple[Finding, ...]:
        return tuple(finding for finding in self.findings if finding.level in levels)


def judge(sizes: GarmentSizes, person: PersonGirths, at_edges: bool = False) -> Fit:
    """Returns whether a garment goes on a person, and why not.

    Args:
        sizes: of the garment at rest.
        person: girths of the person.
        at_edges: whether it is held at the edges of its opening.
    """
    comparisons = _comparisons(sizes, person, ARMHOLE_AT_EDGES if at_edges else ARMHOLE)
    found = [*_opening(sizes), *_sleeves(sizes, person), *_narrow(comparisons)]
    found += [*_front(sizes, person), *_sides(sizes)]
    return Fit(comparisons, tuple(sorted(found, key=lambda f: _ORDER.index(f.level))))


def _comparisons(
    sizes: GarmentSizes, person: PersonGirths, armhole: Limits
) -> tuple[Comparison, ...]:
    p, rows = person, []
    for side in SIDES:
        girth = sizes.girth(f"{side}_cuff")
        rows.append(Comparison(f"{side} cuff", "cuff_girth", girth, "hand", p.hand, CUFF))
    for side in SIDES:
        girth = sizes.girth(f"{side}_armhole")
        rows.append(
            Comparison(f"{side} armhole", "armhole_girth", girth, "upper arm", p.upper_arm, armhole)
        )
    for side in SIDES:
        length = sizes.sleeve_length[side]
        rows.append(Comparison(f"{side} sleeve", "sleeve_length", length, "arm", p.arm_length))
    back, shoulders = sizes.back_width, sizes.shoulder_width
    rows += [
        Comparison("shoulder width", "shoulder_width", shoulders, "shoulders", p.shoulder_width),
        Comparison("back width", "back_width", back, "shoulders", p.shoulder_width, BACK),
        Comparison("chest, cloth around", "chest", sizes.chest, "chest", p.chest),
        Comparison("hem, cloth around", "chest", sizes.hem, "hips", p.hips),
    ]
    if sizes.opening == "closed":
        neck = next((loop.girth for loop in sizes.loops if loop.name == "neck"), None)
        rows.append(Comparison("neck", "neck_width", neck, "head", p.head))
    else:
        width = p.neck / math.pi
        rows.append(Comparison("neck width", "neck_width", sizes.neck_width, "neck", width))
    return tuple(rows)


def _opening(sizes: GarmentSizes) -> list[Finding]:
    if sizes.opening == "closed":
        text = (
            "closed front: no opening runs from the collar to the hem, so it is pulled over the "
            "head and cannot be put on like a coat"
        )
        return [Finding("cannot", "", text)]
    if sizes.opening == "back":
        text = (
            "it opens at the back: it is put on from the front, and only coats that open in front "
            "are judged"
        )
        return [Finding("unknown", "", text)]
    return []


def _sleeves(sizes: GarmentSizes, person: PersonGirths) -> list[Finding]:
    found = []
    for side in SIDES:
        length = sizes.sleeve_length[side]
        if length < SHORTEST_SLEEVE:
            text = f"no sleeves: the {side} one is {_cm(length)} long"
            found.append(Finding("cannot", "sleeve_length", text))
    length = min(sizes.sleeve_length.values())
    if SHORTEST_SLEEVE <= length < _SHORT * person.arm_length:
        text = f"the sleeves end {_cm(person.arm_length - length)} before the middle of the hand"
        found.append(Finding("note", "sleeve_length", text))
    longest = max(sizes.sleeve_length.values())
    if longest > _COVERED * person.reach:
        text = (
            f"the sleeves reach {_cm(longest - person.reach)} beyond the tip of the hand, which "
            "stays in them"
        )
        found.append(Finding("note", "sleeve_length", text))
    return found


def _narrow(comparisons: Sequence[Comparison]) -> list[Finding]:
    """Returns each kind of measure that is too small once, for the smaller of left and right."""
    levels: dict[str, Level] = {"too narrow": "cannot", "too tight": "fails", "tight": "tight"}
    worst: dict[str, Comparison] = {}
    for row in comparisons:
        other = worst.get(row.measure)
        if row.state in levels and (other is None or _ratio(row) < _ratio(other)):
            worst[row.measure] = row
    found = []
    for row in worst.values():
        alike = [other for other in comparisons if (other.measure, other.state) == _kind(row)]
        name = f"{row.name} is" if len(alike) == 1 else f"{row.name.split()[-1]}s are"
        what = "narrower than" if row.state == "too narrow" else f"{row.state} for"
        length = 0.0 if row.garment is None else row.garment
        text = f"the {name} {what} the {row.part}: {_cm(length)} and {_cm(row.person)}"
        found.append(Finding(levels[row.state], row.measure, text))
    return found


def _kind(row: Comparison) -> tuple[str, str]:
    return row.measure, row.state


def _ratio(row: Comparison) -> float:
    return math.inf if row.ratio is None else row.ratio


def _front(sizes: GarmentSizes, person: PersonGirths) -> list[Finding]:
    missing = person.chest - sizes.chest
    if sizes.opening == "closed" or missing <= 0.0:
        return []
    return [Finding("note", "chest", f"the front stays open by {_cm(missing)} at the chest")]


def _sides(sizes: GarmentSizes) -> list[Finding]:
    found = []
    pairs = {
        "cuffs": [sizes.girth(f"{side}_cuff") for side in SIDES],
        "armholes": [sizes.girth(f"{side}_armhole") for side in SIDES],
        "sleeves": [sizes.sleeve_length[side] for side in SIDES],
    }
    for name, (left, right) in pairs.items():
        if abs(left - right) > _UNEQUAL * max(left, right):
            text = f"left and right {name} differ: {_cm(left)} and {_cm(right)}"
            found.append(Finding("note", "", text))
    return found


def _cm(length: float) -> str:
    return f"{100.0 * length:.1f} cm"
