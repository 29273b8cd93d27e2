"""docs/architecture.md says what is in each package, in the words of the package itself."""

import pytest

from tests.package_table import PAGE, first_line, packages, written


def test_the_table_of_packages_is_that_of_their_docstrings():
    page = PAGE.read_text("utf-8")
    assert page == written(page), "run: python -m tests.package_table"


@pytest.mark.parametrize(("path", "line"), packages().items())
def test_each_package_says_what_it_is_in_one_sentence(path, line):
    assert line.endswith(".") and "|" not in line, f"{path}/__init__.py: {line!r}"


def test_only_the_first_line_of_a_docstring_counts():
    assert first_line('"""Maps.\n\nMore.\n"""\n') == "Maps."
    assert first_line("x = 1\n") == ""
