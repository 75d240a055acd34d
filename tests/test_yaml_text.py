"""Ambiguous YAML is refused, with its line and both readings."""

from __future__ import annotations

import math
from typing import Any

import pytest
import yaml
from hypothesis import example, given, settings
from hypothesis import strategies as st

from drake_dress.errors import UserError
from drake_dress.yaml_text import MAX_DEPTH, MAX_VALUES, read_yaml, write_yaml


def refused(text: str) -> str:
    with pytest.raises(UserError) as caught:
        read_yaml("a.yaml", text)
    line = str(caught.value)
    assert line.startswith("a.yaml: ")
    assert "\n" not in line
    return line


# text, and part of the message
TWICE = {
    "far apart": ("plant: {a: 1}\nseed: 1\n\nplant: {b: 2}", "plant: stands twice, lines 1 and 4"),
    "flow": ("plant: {a: 1, a: 2}", "plant.a: stands twice in line 1"),
    "in a list": ("a:\n- b:\n    c: 1\n    c: 3", "a[0].b.c: stands twice, lines 3 and 4"),
    "quoted": ("a: 1\n'a': 2", "a: stands twice, lines 1 and 2"),
    "equal values": ("a: 1\na: 1", "a: stands twice, lines 1 and 2"),
    "merged": ("a: &x {b: 1}\nc:\n  <<: *x\n  b: 2", "c.b: stands twice, lines 3 and 4"),
    "merged later": ("a: &x {b: 1}\nc:\n  b: 2\n  <<: *x", "c.b: stands twice, lines 3 and 4"),
    "merges": ("a: &x {b: 1}\nc:\n  <<: [*x, *x]", "c.b: stands twice in line 3"),
    "two merges": ("a: &x {b: 1}\nc:\n  <<: *x\n  <<: *x", "c.<<: stands twice, lines 3 and 4"),
}  # fmt: skip
# word, and parts of the message
TWO_READINGS = {
    "010": ["8", "10"],
    "-010": ["-8", "-10"],
    "08": ["8"],
    "007": ["7"],
    "1:30": ["90", "'1:30'"],
    "1:00:00.5": ["3600.5"],
    "no": ["false", "'no'"],
    "Yes": ["true", "'Yes'"],
    "ON": ["true"],
    "off": ["false"],
    "1_000": ["1000"],
    "1_0.5": ["10.5"],
    "0x1F": ["31"],
    "0b11": ["3"],
    "0o17": ["15"],
    "2024-01-01": ["date", "'2024-01-01'"],
    "2024-01-01T10:00:00": ["date"],
    "1e400": ["out of range"],
    str(2**70): ["out of range", "64 bits"],
    "9" * 5000: ["out of range"],
}
ONE_READING: dict[str, Any] = {
    "": None, "~": None, "null": None, "true": True, "False": False, "3": 3, "-3": -3, "+3": 3,
    "0": 0, "1e3": 1000.0, "1E-3": 1e-3, ".5": 0.5, "1.": 1.0,
    "-.inf": -math.inf, "+.Inf": math.inf, "٣": "٣",
    "'010'": "010", '"no"': "no", "!!str 010": "010", "1.2.3": "1.2.3", "y": "y", "1:2:x": "1:2:x",
    "udpm://239.255.76.67:7667?ttl=0": "udpm://239.255.76.67:7667?ttl=0", "inf": "inf",
}  # fmt: skip
UNUSABLE = {
    "a number as key": ("1: 2", "the key is 1, expected a name"),
    "an empty key": ("null: 2", "the key is empty"),
    "a bool as key": ("true: 2", "the key is True"),
    "a word of two readings as key": ("on: 2", "the key on is true or text"),
    "a list as key": ("? [a]\n: 2", "is no key"),
    "a decimal comma": ("a: {b: 0,05}", "05"),
    "a tag that runs code": ("a: !!python/object/apply:os.system [x]", "!!python/object/apply"),
    "a tag": ("a: !!int 3", "!!int"),
    "two documents": ("a: 1\n---\na: 2", "line 2: a second document"),
    "a tab": ("a:\n\tb: 1", "line 2: a tab"),
    "no such anchor": ("a: *b", "*b"),
    "a group inside itself": ("a: &x {b: *x}", "*x"),
    "a merge of a value": ("a: {<<: 3}", "<<"),
    "open brackets": ("a: [1", "line"),
    "control characters": ("a: \x01", "#x0001"),
    "too deep": ("[" * (MAX_DEPTH + 1), "deeper"),
    "much too deep": ("[" * 100_000, "deeper"),
}


@pytest.mark.parametrize("name", TWICE)
def test_a_key_that_stands_twice_is_told_with_both_lines(name: str) -> None:
    text, words = TWICE[name]
    assert words in refused(text)


@pytest.mark.parametrize("word", TWO_READINGS, ids=lambda word: word[:20])
def test_a_word_with_two_readings_is_told_with_line_and_remedy(word: str) -> None:
    for text in (f"a: 1\nb: {word}", f"a: 1\nb: [1, {word}]"):
        line = refused(text)
        assert "line 2" in line
        for offered in TWO_READINGS[word]:
            assert offered in line


@pytest.mark.parametrize("word", ONE_READING)
def test_a_word_with_one_reading_has_it(word: str) -> None:
    value = read_yaml("a.yaml", f"a: {word}")["a"]
    assert value == ONE_READING[word]
    assert type(value) is type(ONE_READING[word])


@pytest.mark.parametrize("name", UNUSABLE)
def test_what_no_scenario_says_is_told_in_one_line(name: str) -> None:
    text, words = UNUSABLE[name]
    assert words in refused(text)


def test_aliases_repeat_a_value_but_not_without_bound() -> None:
    assert read_yaml("a.yaml", "a: &x {b: [1]}\nc: *x") == {"a": {"b": [1]}, "c": {"b": [1]}}
    assert read_yaml("a.yaml", "a: &x {b: 1}\nc: {<<: *x, d: 2}")["c"] == {"b": 1, "d": 2}
    lines = ["a0: &a0 [0]"]
    lines += [f"a{k}: &a{k} [{', '.join(10 * [f'*a{k - 1}'])}]" for k in range(1, 12)]
    assert str(MAX_VALUES) in refused("\n".join(lines))


VALUES = st.recursive(
    st.none() | st.booleans() | st.integers(-(2**63), 2**63 - 1)
    | st.floats(allow_nan=False) | st.text(st.characters(codec="utf-8"), max_size=8)
    | st.sampled_from([*TWO_READINGS, *ONE_READING]),
    lambda inner: st.lists(inner, max_size=3)
    | st.dictionaries(st.text("abn0:", min_size=1), inner),
    max_leaves=8,
)  # fmt: skip


@settings(max_examples=150)
@given(VALUES)
def test_what_is_written_is_read_back(value: Any) -> None:
    assert read_yaml("a.yaml", write_yaml({"a": value})) == {"a": value}


# Words of digits and of the letters and signs that occur in numbers.
WORDS = st.text("0123456789+-._:eExob", min_size=1, max_size=8).filter(lambda w: w[0] not in "-:")


@settings(max_examples=300)
@given(WORDS)
@example(".0_")
@example("1__0.")
@example("0b_")
def test_what_is_read_is_what_a_reader_of_yaml_1_1_has(word: str) -> None:
    """Otherwise it is refused; exponents are an exception: text in 1.1, numbers in 1.2."""
    text = f"a: {word}"
    try:
        read = read_yaml("a.yaml", text)["a"]
    except UserError as error:
        assert "line 1" in str(error)
        return
    other = yaml.safe_load(text)["a"]
    assert read == other or (isinstance(other, str) and read == float(other))
