"""Layouts: from the balise table of a scenario to where, or when, the balises are."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from cosim.balises.layout import InstantLayout, TrackLayout, aperiodic, by_positions, by_spacing, from_csv
from cosim.balises.recorded import RecordedLayout, read_layout
from cosim.errors import ScenarioError, nearest
from cosim.scenario.scenario_tables import BalisesTable

Layout = TrackLayout | InstantLayout | RecordedLayout
_DELIVERED_AS_RECORDED = (
    "latency",
    "latency_jitter",
    "missed_fraction",
    "missed",
    "position_noise",
    "false_telegrams",
    "location_accuracy",
    "clock",
)

DRAWN_GAPS = ("min_gap", "max_gap", "dropout_after", "dropout_fraction", "dropout_stretch")
"""Keys of layout ``aperiodic``."""


def make_layout(table: BalisesTable, start: float, stop: float, folder: Path, where: str) -> Layout:
    """The balise layout of a scenario.

    Args:
        table: its balise table. start, stop: of the run [s]. folder: start of relative paths. where: place for
            messages.

    Raises:
        ScenarioError: with file and key.
    """
    for false in table.false_telegrams:
        if not start < false.time <= stop:
            raise ScenarioError(
                f"{where}: balises.false_telegrams: {false.time:g} s lies outside the run from {start:g} s to {stop:g} "
                f"s."
            )
    try:
        if table.layout == "aperiodic":
            return aperiodic(stop, table.seed, start=start, **{key: getattr(table, key) for key in DRAWN_GAPS})
        if table.layout == "instants":
            return InstantLayout(np.array(table.instants, dtype=float))
        if table.layout == "recorded":
            return _recorded(table, start, folder)
        return _checked(_track_layout(table, folder), table)
    except ScenarioError as error:
        raise ScenarioError(f"{where}: balises: {error}") from error


def _checked(layout: TrackLayout, table: BalisesTable) -> TrackLayout:
    """The layout, once the balises that are missed are known to be in it, and all of it on the track."""
    known = [b.identity for b in layout.balises]
    for identity in table.missed:
        if identity not in known:
            raise ScenarioError(f"missed: no balise {identity!r}; {nearest(identity, known)}")
    if table.track_end is not None:
        layout.check_within(table.track_start, table.track_end)
    return layout


def _recorded(table: BalisesTable, start: float, folder: Path) -> RecordedLayout:
    """The telegrams of an earlier run; what happens to telegrams has happened to them already."""
    stated = [key for key in _DELIVERED_AS_RECORDED if key in table.model_fields_set]
    stated += ["method"] if table.method != "auto" else []
    if stated:
        raise ScenarioError(f"layout 'recorded' delivers the telegrams as recorded; leave out {', '.join(stated)}.")
    return read_layout((folder / str(table.file)).resolve()).later(start)


def _track_layout(table: BalisesTable, folder: Path) -> TrackLayout:
    if table.layout == "csv":
        return from_csv(folder / str(table.file), table.location_accuracy)
    if table.layout == "positions":
        return by_positions(table.positions or [], table.location_accuracy)
    assert table.spacing is not None
    assert table.track_end is not None
    first = table.first if table.first is not None else table.track_start + table.spacing
    return by_spacing(table.spacing, first, table.track_end, table.location_accuracy)
