"""Every module has its own test file, or the table names the one that covers it."""

import pytest

from tests.covered_by import ROOT, told, without_own_test


def test_the_table_lists_exactly_the_modules_without_a_test_file_of_their_own() -> None:
    assert sorted(told()) == without_own_test()


@pytest.mark.parametrize("module", without_own_test())
def test_the_test_file_that_covers_a_module_exists(module: str) -> None:
    test = told().get(module, "")
    assert test.startswith("tests/"), f"{module}: run `make coverage`"
    assert (ROOT / test).is_file()
