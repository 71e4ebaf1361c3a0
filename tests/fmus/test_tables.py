"""Tables: one value, shown in a terminal of any width without a loss, and as data."""

from __future__ import annotations

import re
from dataclasses import replace
from math import inf, nan

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fmus.tables.notebook import paragraph_html
from fmus.tables.numbers import DASH, instant
from fmus.tables.table import Column, Table, error_column, name_column, pairs_table, text_column
from fmus.tables.terminal import paragraph

WORDS = st.text("abcdefgh._-[] ", max_size=40)


@st.composite
def tables(draw: st.DrawFn) -> Table:
    """Tables of one to three names, texts and numbers."""
    names = draw(st.integers(0, 2))
    others = draw(st.lists(st.sampled_from(["text", "number"]), min_size=1, max_size=7))
    kinds = ["name"] * names + others
    columns = [
        Column(f"k{i}", draw(WORDS), draw(st.sampled_from(["", "m/s"])), kind=kind) for i, kind in enumerate(kinds)
    ]
    numbers = st.none() | st.floats() | st.integers()
    values = [WORDS if kind != "number" else numbers for kind in kinds]
    return Table("table", columns, draw(st.lists(st.tuples(*values), max_size=5)))


def characters(text: str) -> dict[str, int]:
    """How often each character but blanks and rules stands in a text."""
    kept = re.sub(r"[\s-]", "", text)
    return {character: kept.count(character) for character in set(kept)}


@given(tables(), st.integers(24, 140))
def test_no_line_is_wider_than_the_terminal(table: Table, width: int) -> None:
    assert all(len(line) <= width and line == line.rstrip() for line in table.text(width).split("\n"))


@given(tables(), st.integers(24, 140))
def test_nothing_is_left_out_in_a_narrow_terminal(table: Table, width: int) -> None:
    whole, narrow = characters(table.text()), characters(table.text(width))
    assert all(narrow.get(character, 0) >= count for character, count in whole.items())


@given(tables())
def test_without_a_width_a_row_is_a_line(table: Table) -> None:
    lines = table.text().split("\n") if table.rows else []
    rule = any(column.title() for column in table.columns)
    assert len(lines) == len(table.rows) + 2 * rule * bool(table.rows)
    assert all(len(line) <= len(table.text(10_000)) for line in lines)


@given(tables(), st.integers(30, 140))
def test_in_a_pipe_a_row_is_a_line_and_numbers_without_room_are_named(table: Table, most: int) -> None:
    piped = table.within(most, "see --json")
    lines = replace(piped, notes=()).text().split("\n") if table else []
    kept = [column.key for column in piped.columns]
    left_out = [column for column in table.columns if column.key not in kept]
    assert [column.key for column in table.columns if column not in left_out] == kept
    assert all(column.kind == "number" and column.heading in piped.notes[0] for column in left_out)
    assert [row.split() for row in lines[-len(table.rows) :]] == [" ".join(row).split() for row in piped.cells]
    if piped.names and all(column.kind == "number" for column in piped.columns[piped.names :]):
        names = replace(piped, columns=piped.columns[: piped.names], rows=[row[: piped.names] for row in piped.rows])
        assert max(map(len, lines), default=0) <= max(most, *map(len, names.text().split("\n")))


def test_of_the_numbers_the_first_ones_find_room() -> None:
    columns = [name_column("run"), *(Column(f"e{i}", f"observer.error_{i}", "m") for i in range(9)), text_column("why")]
    text = Table("t", columns, [["a", *range(9), "because " * 9]]).within(60, "see --json").text()
    assert text.split("\n")[4:] == [
        "a          0          1          2          3          4  " + ("because " * 9).rstrip(),
        "4 more columns, see --json: " + ", ".join(f"observer.error_{i}" for i in range(5, 9)) + ".",
    ]


def test_a_line_is_as_long_as_is_allowed_and_no_longer() -> None:
    table = Table("t", [name_column("run"), Column("abcdef", "abcdef"), Column("ghijkl", "ghijkl")], [["a", 1, 2]])
    rows = [table.within(most, "").text().split("\n") for most in (17, 16)]
    assert [len(lines[0]) for lines in rows] == [17, 9]


@given(tables())
def test_what_is_the_same_in_all_rows_stands_above_them(table: Table) -> None:
    stated = replace(table, rows_are="runs")
    shown, cells = stated.shown(), list(zip(*table.cells, strict=True)) if table else []
    assert stated.data() == table.data() or "nan" in repr(table.data())
    if len(table.rows) < 2 or not table.names:
        assert shown is stated
        return
    for column, values in zip(table.columns, cells, strict=True):
        is_kept = any(kept.key == column.key for kept in shown.columns)
        assert is_kept == (column.kind == "name" or len(set(values)) > 1)
        assert is_kept or (
            column.heading.strip() in shown.lead and (values[0] == DASH or values[0].strip() in shown.lead)
        )
    assert shown.lead in stated.text()
    assert paragraph_html(shown.lead) in stated.html()


@given(tables())
def test_data_are_the_values_by_their_keys(table: Table) -> None:
    keys = [column.key for column in table.columns]
    assert repr([list(row) for row in table.rows]) == repr([[entry[key] for key in keys] for entry in table.data()])


def test_numbers_stand_on_the_right_names_on_the_left_and_no_line_ends_in_blanks() -> None:
    columns = [name_column("name", "name"), text_column("unit", "unit"), Column("max", "max", "m/s")]
    table = Table("t", columns, [["v", "m/s", 0.5], ["odometer", "", 12.25]], title="Sizes", notes=["of all"])
    assert table.text().split("\n") == [
        "Sizes",
        "name      unit  max [m/s]",
        "-------------------------",
        "v         m/s       0.500",
        "odometer             12.2",
        "of all",
    ]


def test_what_does_not_fit_follows_below_the_names_again() -> None:
    columns = [name_column("o", "observer"), *(error_column(f"e{i}", f"error {i}", "m/s") for i in range(5))]
    text = Table("t", columns, [["takagi_sugeno_cdo", 1.0, 2.0, 3.0, 4.0, inf]]).text(40)
    assert text.count("takagi_sugeno_cdo") == text.count("observer") == 2
    assert all(f"{number}.00" in text for number in range(1, 5))
    assert "diverged" in text


def test_long_names_are_broken_behind_what_parts_them_and_can_be_distinguished() -> None:
    rows = [[f"locomotive.bogie_with_a_long_name.axle[{i}].wheel.speed_of_rotation", i] for i in (1, 2)]
    lines = Table("t", [name_column("signal"), Column("n")], rows).text(40).split("\n")
    assert [line for line in lines if "axle[1]" in line] != [line for line in lines if "axle[2]" in line]
    assert "".join(line.strip().split("  ")[0] for line in lines[:2]) == rows[0][0]


def test_a_column_multiplies_for_reading_only() -> None:
    share = Column("share", "Share", "%", factor=100.0)
    table = Table("t", [name_column("n"), share], [["a", 0.25], ["b", (0.1, 0.5)], ["c", None]])
    assert [row[1] for row in table.cells] == ["25.0", "10.0 to 50.0", "–"]
    assert [row["share"] for row in table.data()] == [0.25, (0.1, 0.5), None]


def test_columns_that_hold_nothing_can_be_left_out() -> None:
    columns = [name_column("n"), Column("a"), Column("b"), Column("c")]
    table = Table("t", columns, [["x", None, 1.0, None], ["y", None, nan, None]]).filled(always=("c",))
    assert [column.key for column in table.columns] == ["n", "b", "c"]


def test_pairs_have_no_heading() -> None:
    assert pairs_table("t", {"a": 1, "bc": [2, 3]}).text() == "a   1\nbc  2, 3"


def test_a_row_of_another_length_is_refused() -> None:
    with pytest.raises(ValueError, match="table t: a row of 1 values, expected 2"):
        Table("t", [name_column("a"), Column("b")], [["c"]])


def test_of_a_paragraph_only_a_word_that_is_longer_than_a_line_stands_out() -> None:
    path = "/" + "a" * 90
    lines = paragraph(f"- written to {path} just now, as was asked for by whoever typed the command", 40)
    assert [line.strip() for line in lines if len(line) > 40] == [path]
    assert paragraph("a\nb", None) == ["a", "b"]


@given(st.floats(-1e7, 1e7) | st.floats(-1e-3, 1e-3))
def test_an_instant_is_written_to_the_millisecond_however_long_the_run(time: float) -> None:
    text = instant(time)
    assert abs(float(text) - time) <= (5.1e-3 * abs(time) if 1e-9 <= abs(time) < 1e-3 else 5.1e-4)
    assert "e" not in text
    assert not text.startswith("-0") or float(text) != 0.0
    assert "." not in text or text[-1] not in "0."


def test_an_instant_that_is_none_is_a_dash() -> None:
    assert [instant(value) for value in (None, float("nan"), 1003.0, 3605.25, 0.0)] == [
        "–",
        "–",
        "1003",
        "3605.25",
        "0",
    ]
