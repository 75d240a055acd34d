"""Tables and figures: what became of fitting and of too tight coats."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import Any

from benchmarks.cloth.table import Table
from benchmarks.figures import Figure, at_least
from benchmarks.fit.drawing import SIZES, Case
from benchmarks.fit.looks import CALLED, FITTING, TOO_TIGHT, Looks
from benchmarks.pairs import dressed, dressing_time
from benchmarks.statistics import wilson

# What is asked, %.
_ASKED, _ASKED_STAYING = 90.0, 95.0
# Lower ends of the classes of a ratio of garment to person.
_ARMHOLE = (1.3, 1.46, 1.6, 1.75, 1.9, 2.1, 2.4)
_BACK = (0.7, 0.8, 0.9, 1.0, 1.1)
_HEADER = [
    "runs",
    "dressed and staying on",
    "%",
    "90 % interval, %",
    "both sleeves on",
    "of those let go, staying on",
    "time to dress, s",
]
Result = dict[str, Any]
Key = Callable[[dict[str, Any]], Any]


def tables(results: Sequence[Result], looks: Looks) -> list[Table]:
    """Returns the success of fitting coats, in total and by group, that of others, and failures.

    Args:
        results: of the runs.
        looks: at all pairs, by the name of their cases.
    """
    done = _joined(results, looks)
    fitting = [(r, look) for r, look in done if look["called"] in FITTING]
    groups: dict[str, Key] = {
        "preset": lambda look: look["preset"],
        "size table": lambda look: look["size_table"],
        "sex": lambda look: look["sex"],
        "sizes above the person's own": _step,
        "tightest measure": lambda look: look["tightest"],
    }
    return [
        Table("What the look calls the pairs", ["", "pairs", *_HEADER], _by_verdict(done, looks)),
        *(
            Table(f"Fitting coats by {name}", ["", *_HEADER], _by(fitting, key))
            for name, key in groups.items()
        ),
        Table(
            "All runs by girth of armhole over that of upper arm",
            ["", *_HEADER],
            _by(done, lambda look: _class(look["ratios"]["armhole_girth"], _ARMHOLE)),
        ),
        Table(
            "All runs by width of back over that of shoulders",
            ["", *_HEADER],
            _by(done, lambda look: _class(look["ratios"]["back_width"], _BACK)),
        ),
        Table(
            "Runs that failed",
            ["", "called", "coat", "person", "armhole", "back", "reason"],
            [_failure(r, look) for r, look in done if not r["summary"]["success"]],
        ),
    ]


def figures(results: Sequence[Result], looks: Looks) -> list[Figure]:
    """Returns the shares that are asked for, of the runs that there are."""
    done = _joined(results, looks)
    fitting = [r for r, look in done if look["called"] in FITTING]
    tight = [r for r, look in done if look["called"] == TOO_TIGHT]
    let_go = [r for r in fitting if r["summary"]["stays_on"] is not None]
    found = []
    if fitting:
        name = f"fitting: dressed and staying on, of {len(fitting)}"
        found.append(at_least(name, _share(dressed(fitting), len(fitting)), "%", _ASKED))
    if tight:
        failed = len(tight) - dressed(tight)
        name = f"too tight: failed, of {len(tight)}"
        found.append(at_least(name, _share(failed, len(tight)), "%", _ASKED))
    if let_go:
        stay = sum(bool(r["summary"]["stays_on"]) for r in let_go)
        name = f"fitting: staying on, of {len(let_go)} that were let go"
        found.append(at_least(name, _share(stay, len(let_go)), "%", _ASKED_STAYING))
    return found


def told(looks: Looks) -> str:
    """Returns a sentence on how many pairs the look calls what."""
    counts = {word: _count(looks, word) for word in CALLED}
    each = ", ".join(f"{word} {count}" for word, count in counts.items() if count)
    return f"Verdicts of {len(looks)} pairs: {each}."


def _joined(results: Iterable[Result], looks: Looks) -> list[tuple[Result, dict[str, Any]]]:
    """Returns the finished runs with the look at each."""
    done = ((r, Case(**r["case"]).name) for r in results if "summary" in r)
    return [(r, looks[name]) for r, name in done if name in looks]


def _by_verdict(done: Sequence[tuple[Result, dict[str, Any]]], looks: Looks) -> list[list[Any]]:
    rows: list[list[Any]] = []
    for word in CALLED:
        if _count(looks, word):
            mine = [r for r, look in done if look["called"] == word]
            rows.append([word, _count(looks, word), *_cells(mine)])
    fitting = [r for r, look in done if look["called"] in FITTING]
    rows.append(["fits or tight", sum(_count(looks, w) for w in FITTING), *_cells(fitting)])
    return rows


def _by(done: Sequence[tuple[Result, dict[str, Any]]], key: Key) -> list[list[Any]]:
    values = sorted({key(look) for _, look in done})
    return [[str(v), *_cells([r for r, look in done if key(look) == v])] for v in values]


def _cells(results: Sequence[Result]) -> list[Any]:
    if not results:
        return [0, *[None] * (len(_HEADER) - 1)]
    count, on = len(results), dressed(results)
    low, high = wilson(on, count)
    let_go = [r["summary"]["stays_on"] for r in results if r["summary"]["stays_on"] is not None]
    return [
        count,
        on,
        f"{_share(on, count):.0f}",
        f"{100 * low:.0f} to {100 * high:.0f}",
        sum(r["summary"]["dressing_time_s"] is not None for r in results),
        f"{sum(let_go)} of {len(let_go)}",
        dressing_time(results),
    ]


def _failure(result: Result, look: dict[str, Any]) -> list[Any]:
    weight, height = look["weight"], look["height"]
    return [
        Case(**result["case"]).name,
        look["called"],
        f"{look['preset']} {look['size_table']} {look['size']} ({_step(look):+d})",
        f"{look['sex']} {look['age']:.0f} years {height:.2f} m {weight:.0f} kg",
        look["ratios"]["armhole_girth"],
        look["ratios"]["back_width"],
        result["summary"]["reason"],
    ]


def _step(look: dict[str, Any]) -> int:
    """Returns by how many sizes a coat is larger than the person's own."""
    return SIZES.index(look["size"]) - SIZES.index(look["own_size"])


def _class(ratio: float, ends: Sequence[float]) -> str:
    """Returns the name of a ratio's class; names are in the order of the ratios."""
    for low, high in zip((0.0, *ends), ends, strict=False):
        if ratio < high:
            return f"{low:.2f} to {high:.2f}"
    return f"{ends[-1]:.2f} and more"


def _count(looks: Looks, word: str) -> int:
    return sum(look["called"] == word for look in looks.values())


def _share(part: int, count: int) -> float:
    return 100.0 * part / count
