"""Made-up live pages for the tests, as files."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from cosim.report.live.live_page import LivePage, Mark, PageCurve, PagePanel, PageRecording, PageVerdict, Rows, Section
from cosim.report.live.render import live_page
from fmus.tables.table import Column, Table, name_column, text_column

TIME = np.linspace(0.0, 100.0, 20_001)
SPIKE = 12_345
"""Row of a value that no other is near."""


def curves(scale: float = 1.0) -> list[PageCurve]:
    """A wave with a spike, a ramp, a held signal with a gap, a small error."""
    wave = np.sin(TIME / 3.0)
    wave[SPIKE] = 7.0
    held = np.floor(TIME / 5.0)
    held[4000:6000] = np.nan
    return [
        PageCurve("train.speed", scale * wave, "m/s", description="How fast it is", look="true"),
        PageCurve("train.position", scale * TIME, "m"),
        PageCurve("driver.level", held, "1", held=True),
        PageCurve("observer.speed", scale * wave + 1e-3, "m/s"),
        PageCurve("observer.force", 1e3 * wave, "N"),
    ]


def explored_page(**more: object) -> LivePage:
    """A page with everything: one recording, panels, marks, a table to explore."""
    rows = [[f"run {i}", 1.0 * ((7 * i) % 12), 100.0 - i, f"{i} times what is allowed"] for i in range(12)]
    numbers = [Column("gain", "gain", "1"), Column("error", "error", "m/s")]
    table = Table("runs", [name_column("run", "Run"), *numbers, text_column("because", "because")], rows)
    values: dict[str, object] = {
        "title": "A page",
        "verdict": PageVerdict("It is good.", "good"),
        "recordings": [PageRecording("run", TIME, curves())],
        "panels": [
            PagePanel("Speed", ["train.speed", "observer.speed"]),
            PagePanel("Way", ["train.position"]),
            PagePanel("Force", ["observer.force"], is_shown=False),
        ],
        "marks": [
            Mark("worst", float(TIME[SPIKE]), "the spike", None, "Speed", 7.0),
            Mark("balise", 20.0, "balise B1"),
            Mark("balise", 40.0, "balise B2"),
            Mark("zone", 30.0, "wet rails", 50.0, "Force"),
        ],
        "sections": [Section("Runs", [Rows(table, ["other.html", *[None] * 11])])],
    }
    return LivePage(**(values | more))  # type: ignore[arg-type]  # by name


def overlaid_page() -> LivePage:
    """Two runs of which one is twice the other; a name has two units."""
    other = [*curves(2.0)[:-1], PageCurve("observer.force", TIME, "kN")]
    short = slice(0, 15_000, 2)
    cut = [PageCurve(c.name, c.values[short], c.unit, c.held, c.description, c.look) for c in other]
    recordings = [PageRecording("first", TIME, curves()), PageRecording("second", TIME[short], cut)]
    panels = [PagePanel("Way", ["train.position"]), PagePanel("Force", ["observer.force"])]
    return explored_page(recordings=recordings, marks=(), panels=panels)


def written(page: LivePage, path: Path) -> Path:
    """The page as a file."""
    path.write_text(live_page(page), encoding="utf-8")
    return path
