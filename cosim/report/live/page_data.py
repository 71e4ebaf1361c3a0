"""The curves, panels and marks of a live page as plain data and packed columns. Imports NumPy only.

A page holds every row as long as all columns have room. The curves of its panels come first; what finds no room is
reduced to its extremes, and the page says so.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import isfinite
from typing import Any

import numpy as np

from cosim.report.live.live_page import LivePage, Mark, PageCurve, PagePanel, PageRecording
from cosim.report.live.packed_column import INSTANTS, PackedColumn, pack
from fmus.tables.line_picture import extreme_rows
from fmus.tables.plain_data import jsonable

ROOM = 2_200_000
"""Characters that all columns of a page may take at least."""
ROOM_A_ROW = 20
MOST_ROOM = 30_000_000
REDUCED_SHARE = 0.25  # of the room is for curves that are reduced
A_PIECE = 12  # characters that a piece of such a curve takes
FEWEST_PIECES, MOST_PIECES = 50, 1000
"""Pieces of a curve that is reduced; of each its ends and extremes are kept."""
LONG = 200_000
"""Rows from which a curve has an overview as well, which is drawn first."""


@dataclass(frozen=True)
class _PageData:
    """What the script of a page reads.

    Args:
        data: plain data. blocks: texts of packed columns by number. reduced: names of curves without all their rows.
    """

    data: Mapping[str, Any]
    blocks: Sequence[str]
    reduced: Sequence[str]


def page_data(page: LivePage) -> _PageData:
    """The curves of a page, packed.

    Args:
        page: what it shows.
    """
    packer = _Packer(page)
    recordings = [packer.recording(recording) for recording in page.recordings]
    data = {
        "recordings": recordings,
        "panels": [_panel(panel) for panel in page.panels],
        "settled": page.settled,
        "marks": [_mark(mark) for mark in page.marks if isfinite(mark.start)],
    }
    return _PageData(jsonable(data), packer.blocks, packer.reduced)


class _Packer:
    """Packs the columns of a page, those first that its panels show."""

    def __init__(self, page: LivePage) -> None:
        rows = max((len(r.x) for r in page.recordings), default=0)
        room = min(max(ROOM, ROOM_A_ROW * rows), MOST_ROOM)
        count = max(sum(len(r.curves) for r in page.recordings), 1)
        pieces = int(REDUCED_SHARE * room / count / A_PIECE)
        self.pieces = min(max(pieces, FEWEST_PIECES), MOST_PIECES)
        self.room = float(room)
        self.blocks: list[str] = []
        self.reduced: list[str] = []
        self.packed: dict[tuple[int, str], dict[str, Any]] = {}
        self.abscissas = {id(r): self._column(pack(r.x, INSTANTS)) for r in page.recordings}
        first = {name for panel in page.panels for name in (*panel.curves, *(n for pair in panel.bands for n in pair))}
        curves = [(recording, curve) for recording in page.recordings for curve in recording.curves]
        ordered = sorted(curves, key=lambda pair: pair[1].name not in first)
        packed = [pack(curve.values) for _, curve in ordered]
        self.room = room if sum(p.size for p in packed) <= room else (1.0 - REDUCED_SHARE) * room
        for (recording, curve), column in zip(ordered, packed, strict=True):
            self.packed[id(recording), curve.name] = self._curve(curve, column)

    def recording(self, recording: PageRecording) -> dict[str, Any]:
        """A recording as plain data."""
        return {
            "label": recording.label,
            "x": {"name": recording.x_name, "unit": recording.x_unit, **self.abscissas[id(recording)]},
            "curves": [self.packed[id(recording), curve.name] for curve in recording.curves],
        }

    def _curve(self, curve: PageCurve, packed: PackedColumn) -> dict[str, Any]:
        entry = {name: getattr(curve, name) for name in ("name", "unit", "held", "description", "look", "label")}
        entry |= {"ascends": _ascends(curve.values)}
        if (shown := curve.shown) is not None and shown.name != curve.unit:
            entry["shown"] = {"unit": shown.name, "factor": shown.factor, "offset": shown.offset}
        if packed.size > self.room:
            self.reduced.append(curve.name)
            return entry | self._extremes(curve.values)
        overview = {"overview": self._extremes(curve.values)} if len(curve.values) >= LONG else {}
        return entry | self._column(packed) | overview

    def _extremes(self, values: np.ndarray) -> dict[str, Any]:
        """A curve by its extremes, and the rows where they are."""
        rows = extreme_rows(values, self.pieces)
        return self._column(pack(values[rows])) | {"rows": self._column(pack(rows.astype(float), INSTANTS))}

    def _column(self, packed: PackedColumn) -> dict[str, Any]:
        self.room -= packed.size
        self.blocks += [packed.text, packed.odd]
        return packed.data() | {"block": len(self.blocks) - 2}


def _ascends(values: np.ndarray) -> bool:
    """Whether a curve can be an abscissa itself: it rises, never falls, and has no gap."""
    return len(values) > 1 and bool(np.all(values[1:] >= values[:-1])) and -np.inf < values[0] < values[-1] < np.inf


def _panel(panel: PagePanel) -> dict[str, Any]:
    return {
        "title": panel.title,
        "curves": list(panel.curves),
        "log": panel.log,
        "bands": [list(pair) for pair in panel.bands],
        "shown": panel.is_shown,
        "whole": panel.is_whole,
    }


def _mark(mark: Mark) -> dict[str, Any]:
    names = ("kind", "start", "end", "text", "panel", "value")
    return {name: getattr(mark, name) for name in names}
