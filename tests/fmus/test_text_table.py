"""Text tables: names on the left, numbers on the right, a rule of the whole width, no blanks at the ends of lines."""

from __future__ import annotations

import pytest

from fmus.text_table import text_table

ROWS = [["name", "unit", "max [m/s]"], ["v", "m/s", "0.5"], ["odometer", "", "12.25"]]


def test_numbers_stand_on_the_right_and_names_on_the_left() -> None:
    assert text_table(ROWS, left=(0, 1), heading=True) == [
        "name      unit  max [m/s]",
        "-------------------------",
        "v         m/s         0.5",
        "odometer            12.25",
    ]


def test_no_line_ends_in_blanks_and_the_rule_has_the_width_of_the_table() -> None:
    head, rule, *lines = text_table([["a", "b"], ["1", "a long text"], ["2", ""]], left=(0, 1), heading=True)
    assert (head, rule, lines) == ("a  b", "-" * 14, ["1  a long text", "2"])


def test_without_rows_there_are_no_lines() -> None:
    assert text_table([], heading=True) == []


def test_rows_of_unequal_length_are_refused() -> None:
    with pytest.raises(ValueError, match="argument 2"):
        text_table([["a", "b"], ["c"]])
