"""What a sweep leaves: its runs with settings, measures and outcomes, as a table, a comparison and a picture."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from cosim.comparison.compare import compare
from cosim.errors import ComparisonError
from cosim.report.live.still_panels import still_panels
from cosim.report.page.picture_files import Pictures
from cosim.studies.live_sweep import measured_curves
from cosim.studies.sweep_files import write_figures, write_sweep
from cosim.studies.sweep_runs import SweepRuns

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from cosim.comparison.comparison import Comparison


class SweepResult(SweepRuns):
    """The runs of a sweep, in order of its variations; arguments as for `SweepRuns`."""

    def _picture_html(self) -> str:
        """The first measures over what was varied, as on the page."""
        return still_panels(*measured_curves(self))

    def compare(self, reference: int = 0, tolerance: Any = None, **options: Any) -> dict[int, Comparison]:
        """Compare every other run with one of them.

        Args:
            reference: number of the run to compare with.
            tolerance: and further options, as for `cosim.compare`.
            options: further options of `cosim.compare`.

        Returns:
            A comparison for each other run that has results, by its number.

        Raises:
            ComparisonError: the reference has no results.
        """
        results = {run.number: result for run in self.runs if (result := run.result) is not None}
        if reference not in results:
            known = ", ".join(map(str, results)) or "none"
            raise ComparisonError(f"Run {reference} has no results to compare with; these have: {known}.")
        base = results[reference]
        return {n: compare(base, other, tolerance, **options) for n, other in results.items() if n != reference}

    def plot(self, measure: str | None = None, against: str | None = None, ax: Axes | None = None) -> Axes:
        """Draw a measure over a varied value, a line for each combination of the others.

        Args:
            measure: its name; the first where not given. against: what was varied; the first that takes several values.
            ax: axes to draw on; None for a figure of its own.

        Returns:
            The axes.

        Raises:
            OutputError: there is no such measure, or this was not varied.
        """
        from cosim.studies.sweep_drawing import sweep_figure  # noqa: PLC0415 - matplotlib only for those who draw

        return sweep_figure(self, measure, against, ax)

    def write(self, directory: str | Path, *, figures: Pictures = False) -> dict[str, Path]:
        """Write a results folder for each run (``run_000``, ...), the table as ``index.csv`` and ``index.json``, and
        the page ``index.html`` to explore it.

        Args:
            directory: the folder; created where it does not exist.
            figures: whether a picture of each measure is drawn as well: True or ``"png"``, or ``"svg"``.

        Returns:
            Paths by kind.

        Raises:
            OutputError: the folder cannot be written.
        """
        paths = write_sweep(self, Path(directory))
        return paths | write_figures(self, Path(directory), figures)
