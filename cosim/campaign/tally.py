"""What came of the runs so far: counts and the worst, for who watches."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from math import isfinite

from cosim.campaign.store import Row
from fmus.cli.progress import Report
from fmus.tables.numbers import number

_WATCHED = "_error_max"


class Tally:
    """Counts of runs, told with each chunk.

    Args:
        total: runs in all. of: measures whose worst is told; where none is named the first that is a largest error.
        report: called with runs done, runs in all, and a text; None for nobody.
    """

    def __init__(self, total: int, of: Sequence[str], report: Report | None) -> None:
        self._total, self._of, self._report = total, list(of[:1]), report
        self._done: dict[str, bool] = {}
        self._worst = 0.0

    def add(self, rows: Iterable[Row]) -> None:
        """More runs have ended.

        Args:
            rows: of them; those that were told before do not count twice.
        """
        for row in rows:
            self._done[row["key"]] = row["failure"] is not None
            if not self._of:
                self._of = [name for name in row if name.endswith(_WATCHED)][:1]
            value = next((row.get(name) for name in self._of), None)
            if value is not None and isfinite(value):
                self._worst = max(self._worst, abs(value))
        if self._report is not None and self._done:
            self._report(len(self._done), self._total, self._text())  # type: ignore[call-arg] # bars take a text

    def _text(self) -> str:
        failed = sum(self._done.values())
        worst = f", {self._of[0]} at most {number(self._worst)}" if self._of else ""
        return f"{failed} failed{worst}"
