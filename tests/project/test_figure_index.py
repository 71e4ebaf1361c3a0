"""The index of the theses says of each sheet what its lines say: agrees, differs, because, or nothing published."""

from __future__ import annotations

import json
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pages import ROOT, generator

INDEX = generator().figure_index


def line(published: float | str | None, measured: float | str, why: str = "", **more: float) -> dict[str, Any]:
    return {"published": published, "measured": measured, "why": why, **more}


@pytest.mark.parametrize(
    ("lines", "said"),
    [
        ([line(2.0, 2.01), line(None, 7.0)], "agrees (1 within 1%)"),
        (
            [line(2.0, 2.03, "noise is not printed; ours is white")],
            "**differs** in 1 of 1, because noise is not printed",
        ),
        ([line("stops", "stops"), line("slides", "stops", "rail: ours")], "**differs** in 1 of 2, because rail: ours"),
        ([line(None, 1.0, "not printed")], "nothing published"),
        (
            [line(None, 1.0, independent=1.0), line(None, 1.0, independent=1.1)],
            "nothing published; 1 of 2 agree with an independent implementation",
        ),
    ],
)
def test_what_a_sheet_is_said_to_be(lines: list[dict[str, Any]], said: str) -> None:
    assert INDEX.agreement(lines) == said


@given(st.lists(st.tuples(st.floats(0.1, 10.0), st.floats(0.1, 10.0)), min_size=1))
def test_agrees_only_where_every_published_number_is_met(pairs: list[tuple[float, float]]) -> None:
    """Recomputed here from the numbers alone."""
    met = all(abs(measured - published) <= 0.01 * published for published, measured in pairs)
    said = INDEX.agreement([line(published, measured, "a reason") for published, measured in pairs])
    assert said.startswith("agrees") == met
    assert ("because a reason" in said) == (not met)


def test_every_sheet_has_one_row() -> None:
    sheets = sorted((ROOT / "docs" / "gallery").glob("*/numbers/*.json"))
    rows = [row for row in INDEX.figures().splitlines() if "](gallery_" in row]
    assert len(rows) == len(sheets)
    assert all(json.loads(s.read_text())["source"].split("|")[0] in r for s, r in zip(sheets, rows, strict=True))
