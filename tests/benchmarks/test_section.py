from pathlib import Path

import pytest

from benchmarks.section import END, begin, write_between
from drake_dress.errors import UserError


def test_tables_go_between_their_marks_and_nothing_else_changes(tmp_path: Path) -> None:
    path = tmp_path / "doc.md"
    one, two = begin("one"), begin("two")
    path.write_text(f"before\n{one}\nold\n{END}\nmiddle\n{two}\nkept\n{END}\nafter\n")
    write_between(path, "one", "new")
    write_between(path, "one", "newer")
    assert path.read_text() == (
        f"before\n{one}\n\nnewer\n\n{END}\nmiddle\n{two}\nkept\n{END}\nafter\n"
    )


@pytest.mark.parametrize(
    "text", ["", f"{END}\n{begin('one')}", f"{begin('one')}\n", 2 * f"{begin('one')}\n{END}\n"]
)
def test_a_file_without_its_marks_is_left_as_it_is(text: str, tmp_path: Path) -> None:
    path = tmp_path / "doc.md"
    path.write_text(text)
    with pytest.raises(UserError, match="expected one <!-- bench one -->"):
        write_between(path, "one", "new")
    assert path.read_text() == text


def test_a_file_that_is_not_there_is_told(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="cannot be read"):
        write_between(tmp_path / "none.md", "one", "new")
