"""What a live page shows, as values: a verdict, curves of one or several runs, marks, sections that fold. Its HTML is
made by `cosim.report.live.render`.

Every page of the package is made here: that of a run, of FMUs coupled without an observer, of runs laid over each
other, of a comparison, of a study, of a tuning. Another one is made likewise::

    from cosim.report.live.live_page import LivePage, Mark, PageCurve, PagePanel, PageRecording, PageVerdict
    from cosim.report.live.live_page import Rows, Section
    from cosim.report.live.render import live_page
    from cosim.report.page.page_files import write_page

    page = LivePage(
        title="Which observer for stopping_train",
        verdict=PageVerdict("Use quasi_lpv_uio: inside SUBSET-041 with all seeds.", "good"),
        cards=[("Largest position error", "4.2 m", "of 12 m allowed", "good")],    # name, value, remark, mood
        finding="odometer_reset fails first: the wheels skid at 80 s, and the next balise is 900 m away.",
        recordings=[PageRecording("nominal", time, [PageCurve("quasi_lpv_uio.speed", speed, "m/s")])],
        panels=[PagePanel("Speed error", ["quasi_lpv_uio.speed"])],                    # names of curves, as recorded
        marks=[Mark("balise", 12.5, "balise B7"), Mark("zone", 10.0, "wet rails", 20.0)],
        sections=[
            Section("Use", [Rows(table, links=["runs/a/report.html", None])], is_open=True),  # sorts, filters, plots
            Section("Not for these gaps", ["A sentence.", ["a bullet", "another"], table]),   # `Table` of fmus.tables
        ],
    )
    write_page(path, live_page(page))

What a page is given is escaped there, whatever it is. Imports NumPy only.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from cosim.results.shown_unit import ShownUnit
from fmus.tables.table import Table

Mood = Literal["good", "doubt", "bad", ""]
Card = tuple[str, str, str, str]
"""Name, value, remark and mood of a number that matters."""
Look = Literal["", "true", "measured", "wanted", "allowed"]
"""What a curve is beside others of its panel: an estimate or anything else, the truth, a measurement, a reference, the
edge of what is allowed. It decides colour and width alone."""


@dataclass(frozen=True, slots=True)
class PageVerdict:
    """The first sentence of a page, which must not mislead, and whether it is good."""

    text: str
    mood: Mood = ""


@dataclass(frozen=True)
class PageCurve:
    """A curve of a recording.

    Args:
        name: unique in its recording, ``component.signal``. values: shape (rows,); NaN is a gap. unit: of the values.
        shown: in which they are shown, where that is not `unit`; curves of several units that share an axis are shown
            in the one in which they are kept.
        held: whether a value holds until the next one; else lines join them.
        description: one line. look: see `Look`. label: text to show for it; its name where empty.
    """

    name: str
    values: np.ndarray
    unit: str = "1"
    held: bool = False
    description: str = ""
    look: Look = ""
    label: str = ""
    shown: ShownUnit | None = None


@dataclass(frozen=True)
class PageRecording:
    """Curves over one abscissa: a run, the other run, a tube, a search.

    Args:
        label: text to show for it. x: abscissa, not decreasing, shape (rows,). curves: over it.
        x_name, x_unit: of the abscissa; those of all recordings of a page are the same.
    """

    label: str
    x: np.ndarray
    curves: Sequence[PageCurve]
    x_name: str = "time"
    x_unit: str = "s"


@dataclass(frozen=True)
class PagePanel:
    """Curves drawn over each other.

    Args:
        title: above them. curves: names; of every recording that has one of them it is drawn.
        log: whether the axis is logarithmic at first. bands: pairs of names between which the area is filled.
        is_shown: at first; others are offered. is_whole: whether the axis holds every value at first, however far off.
    """

    title: str
    curves: Sequence[str]
    log: bool = False
    bands: Sequence[tuple[str, str]] = ()
    is_shown: bool = True
    is_whole: bool = False


@dataclass(frozen=True, slots=True)
class Mark:
    """A place on the abscissa that a reader can jump to.

    Args:
        kind: what it is: ``balise``, ``zone``, ``phase``, ``fault``, ``worst`` ... start: where. text: what is there.
        end: where it ends; None for an instant. panel: title of the panel that it is about; empty for all.
        value: height of the point in that panel, where there is one to be marked.
    """

    kind: str
    start: float
    text: str
    end: float | None = None
    panel: str = ""
    value: float | None = None


@dataclass(frozen=True)
class Rows:
    """A table to explore: sorted by a click, filtered, with distributions and parallel coordinates of its numbers.

    Args:
        table: the rows. links: a page for each row, relative to this one; None where there is none. folders: results
            for each row, likewise; of one without a page a click shows the command that makes it. plots: whether
            distributions and parallel coordinates are drawn.
    """

    table: Table
    links: Sequence[str | None] = ()
    folders: Sequence[str | None] = ()
    plots: bool = True


@dataclass(frozen=True)
class Folded:
    """What unfolds below a line of text."""

    summary: str
    parts: Sequence[Part]


Part = str | Table | Rows | Folded | list[str]
"""A paragraph, a table, a table to explore, what folds, bullets. Without content it leaves nothing behind."""


@dataclass(frozen=True)
class Section:
    """A part of a page that folds.

    Args:
        title: of it. parts: in their order. is_open: at first. mood: of its edge.
    """

    title: str
    parts: Sequence[Part]
    is_open: bool = False
    mood: Mood = ""


@dataclass(frozen=True)
class LivePage:
    """A page.

    Args:
        title: of it. verdict: the first sentence. cards: the few numbers that matter. finding: the largest one, with
            its cause. lead: what this is a page of, in a sentence. recordings, panels, marks: to explore.
        settled: where the start-up is over; axes follow the values from there on.
        sections: what folds, in their order; those of them that are open stand before the curves.
    """

    title: str
    verdict: PageVerdict
    cards: Sequence[Card] = ()
    finding: str = ""
    lead: str = ""
    recordings: Sequence[PageRecording] = ()
    panels: Sequence[PagePanel] = ()
    marks: Sequence[Mark] = ()
    settled: float | None = None
    sections: Sequence[Section] = ()
