"""Errors in the user's input are reported in one readable line, whatever the input."""

from hypothesis import given
from hypothesis import strategies as st

from drake_dress.errors import UserError

ANY_TEXT = st.text(max_size=1000)


@given(ANY_TEXT, ANY_TEXT, ANY_TEXT)
def test_any_error_is_one_printable_line(source: str, key: str, message: str) -> None:
    line = str(UserError(source, key, message))
    assert len(line.splitlines()) <= 1
    assert line.isprintable()
    assert len(line) <= 1420


def test_short_texts_are_told_as_they_are() -> None:
    error = UserError("a.yaml", "plant.spacing", "is 3,\n expected 0.01 to 0.06")
    assert str(error) == "a.yaml: plant.spacing: is 3, expected 0.01 to 0.06"


def test_both_ends_of_a_long_text_are_told() -> None:
    line = str(UserError("a.yaml", "", "is " + "x" * 10_000 + ", expected a number"))
    assert line.startswith("a.yaml: is xxx")
    assert line.endswith("x, expected a number")
