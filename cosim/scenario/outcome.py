"""The outcome of a run: the result, the roles for the report, and how to write both."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from cosim.report.spec import ReportSpec
from cosim.results.result import Result


@dataclass(frozen=True)
class Outcome:
    """What a run leaves.

    Args:
        result: table, events, summary.
        spec: roles of the signals for metrics and report.
        tables: formats in which `write` writes the table, any of ``csv``, ``mat`` and ``npy``.
    """

    result: Result
    spec: ReportSpec
    tables: tuple[str, ...] = ("csv", "mat")

    def __getitem__(self, name: str) -> np.ndarray:
        """Values of a recorded signal, shape (rows,)."""
        return self.result[name]

    @property
    def failure(self) -> str | None:
        """Why the run ended early, or None."""
        return self.result.failure

    @property
    def warnings(self) -> list[str]:
        """What the user should know."""
        return list(self.result.summary.get("warnings", []))

    def with_summary(self, **entries: Any) -> Outcome:
        """The same outcome with more entries in its summary."""
        return replace(self, result=replace(self.result, summary={**self.result.summary, **entries}))

    def write(self, directory: str | Path, *, report: bool = True) -> dict[str, Path]:
        """Write result files and, where wanted, the report.

        Returns:
            Paths by kind.

        Raises:
            OutputError: the folder cannot be written.
        """
        from cosim.report.html import write_report  # noqa: PLC0415 - matplotlib is loaded only for a report
        from cosim.results.folder import write_results  # noqa: PLC0415 - and scipy only for MAT files

        paths = dict(write_results(self.result, directory, self.tables))
        if report:
            paths["report"] = write_report(self.result, self.spec, directory)
        else:
            (Path(directory) / "report.html").unlink(missing_ok=True)  # of an earlier run: it would not speak of these results
        return paths
