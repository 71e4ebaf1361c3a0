"""The outcome of a run: the result, the roles for the report, and how to write both."""

from __future__ import annotations

import webbrowser
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from tempfile import mkdtemp
from textwrap import shorten
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from cosim.errors import UnmetError
from cosim.evaluation.error_table import error_table
from cosim.evaluation.metrics import phase_metrics
from cosim.evaluation.spec import ReportSpec
from cosim.expectations.evaluated import Evaluated, evaluated_table
from cosim.report.live.live_page import PageVerdict
from cosim.report.live.still_panels import still_panels
from cosim.report.page.picture_files import Pictures
from cosim.report.page.run_curves import run_panels, run_recording
from cosim.report.page.run_verdict import observer_statuses, run_verdict
from cosim.results.result import Result
from cosim.results.results_folder import REPORT, remove_report, write_results
from cosim.results.selection import selected
from cosim.run.made_from import renewed
from fmus.tables.table import FirstScreen, Parts, Table

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from cosim.scenario.origin import Origin

_WARNINGS, _LONGEST = 3, 180
"""Warnings on the first screen, and letters of each."""
INTERRUPTED = "The run was interrupted; what was computed so far is kept."
"""The failure of a run that somebody stopped."""


@dataclass(frozen=True)
class Outcome(FirstScreen, Mapping[str, np.ndarray]):
    """What a run leaves; a mapping from the names of the recorded signals, ``time`` first, to their values.

    Args:
        result: table, events, summary.
        spec: roles of the signals for metrics and report.
        tables: formats in which `write` writes the table, any of ``csv``, ``mat`` and ``npy``.
        origin: the scenario and the files it uses, for `write`; None where the outcome is not of a scenario.
    """

    result: Result
    spec: ReportSpec
    tables: tuple[str, ...] = ("csv",)
    origin: Origin | None = field(default=None, repr=False, compare=False)

    def __getitem__(self, name: str) -> np.ndarray:
        """Values of a recorded signal, shape (rows,)."""
        return self.result[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self.result)

    def __len__(self) -> int:
        return len(self.result)

    @property
    def time(self) -> np.ndarray:
        """Time of the rows [s], shape (rows,)."""
        return self.result.time

    def errors(self) -> Table:
        """Errors of speed and position of every observer in every phase; without rows where there is none."""
        return self._errors(self.spec)

    def _errors(self, spec: ReportSpec) -> Table:
        metrics = phase_metrics(self.result, spec) if len(self.time) else []
        return error_table([m for m in metrics if m.speed or m.position], spec)

    def to_pandas(self, signals: Iterable[str] | None = None) -> Any:
        """A `pandas.DataFrame`; see `cosim.results.to_frames.to_pandas`.

        Args:
            signals: names of those wanted; all by default.
        """
        return self.result.to_pandas(signals)

    def plot(self, *signals: str) -> Figure:
        """Draw signals over time, those of one unit in one panel; without names the main picture of the run.

        Args:
            signals: names, or patterns such as ``*.speed``.

        Returns:
            The figure. A notebook shows it; ``.savefig(path)`` writes it.

        Raises:
            OutputError: a name or pattern fits no recorded signal; the nearest are suggested.
        """
        from cosim.report.figures import main_picture, signal_figure  # noqa: PLC0415 - matplotlib only for those who draw

        if signals:
            return signal_figure.signal_figure(self.result, selected(self.result, signals).signals)
        return main_picture.main_picture(self.result, self.spec)

    def open(self, directory: str | Path | None = None) -> Path:
        """Write the page of the run and show it in the browser.

        Args:
            directory: the folder for it; a new temporary one by default.

        Returns:
            Path of the page, also where no browser can be started.

        Raises:
            OutputError: the folder cannot be written.
        """
        folder = Path(mkdtemp(prefix="cosim_")) if directory is None else Path(directory)
        page: Path = _run_pages().write_report_page(self.result, self.spec, folder.absolute() / REPORT)
        webbrowser.open(page.as_uri())
        return page

    def first_screen(self) -> Parts:
        """How the run ended and what matters of it in a sentence; warnings; errors of the observers over the whole run,
        or the signals.
        """
        warnings = [f"warning: {shorten(text, _LONGEST)}" for text in self.warnings]
        more = [f"... and {len(warnings) - _WARNINGS} more warnings"] if len(warnings) > _WARNINGS else []
        return [
            f"{self.spec.title}. {self.verdict.text}",
            "\n".join([*warnings[:_WARNINGS], *more]),
            self._errors(replace(self.spec, phases=[])) or self.result.signals_table(),
        ]

    def _picture_html(self) -> str:
        """Speed and its errors, as on the page; of a plain coupling the signals that change."""
        if not len(self.time):
            return ""
        recordings = [run_recording(self.result, self.spec)]
        return still_panels(recordings, run_panels(self.result, self.spec), self.spec.evaluate_after)

    @property
    def verdict(self) -> PageVerdict:
        """What the run comes to, as ``text`` in a sentence or two, and as ``mood`` whether that is good."""
        statuses = observer_statuses(self.result, self.spec) if len(self.time) else []
        return run_verdict(self.result, self.spec, self.expectations, statuses)

    @property
    def failure(self) -> str | None:
        """Why the run ended early, or None."""
        return self.result.failure

    @property
    def warnings(self) -> list[str]:
        """What the user should know."""
        return list(self.result.summary.get("warnings", []))

    @property
    def expectations(self) -> list[Evaluated]:
        """What became of the expectations of the scenario, in order."""
        return [Evaluated.from_data(data) for data in self.result.summary.get("expectations", [])]

    @property
    def unmet(self) -> list[Evaluated]:
        """Expectations that are not met."""
        return [evaluated for evaluated in self.expectations if not evaluated.passed]

    def expectations_text(self) -> str:
        """A list of all expectations for people, what is not met first; empty where the scenario has none."""
        return evaluated_table(self.expectations).text()

    def check(self) -> Self:
        """The outcome itself, where the run reached its end and all its expectations are met: the last line of a test.

        Raises:
            UnmetError: the run ended early, or something is not met; the message lists it. It is an `AssertionError`
            too.
        """
        faults = [f"The run ended early: {self.failure}"] if self.failure is not None else []
        faults += [self.expectations_text()] if self.unmet else []
        if faults:
            raise UnmetError("\n".join(faults))
        return self

    def with_summary(self, **entries: Any) -> Outcome:
        """The same outcome with more entries in its summary."""
        return replace(self, result=replace(self.result, summary={**self.result.summary, **entries}))

    def asked_by(self, command: str) -> Outcome:
        """The same outcome, to say that this command line asked for it and no script."""
        return self if self.origin is None else replace(self, origin=replace(self.origin, command=command))

    def write(
        self, directory: str | Path, *, report: bool = True, figures: Pictures = False, files_up_to: float = 50e6
    ) -> dict[str, Path]:
        """Write result files, how they were made, and, where wanted, the report.

        Args:
            directory: the folder; results that an earlier run left there are replaced.
            report: whether to write the page as well. figures: whether to draw its figures as files, too:
                True or ``"png"``, or ``"svg"``.
            files_up_to: FMUs, recordings and other files of the scenario up to this size are copied to
                ``made_from/files``; of larger ones path and hash are noted [bytes].

        Returns:
            Paths by kind.

        Raises:
            OutputError: the folder cannot be written.
        """
        with renewed(directory, self.origin, files_up_to) as seal:
            paths = dict(write_results(self.result, directory, self.tables))
            seal(paths, self.result.summary)
        if self.origin is not None:
            paths["made_from"] = Path(directory) / "made_from" / "manifest.json"
        if report:
            paths["report"] = _run_pages().write_report(self.result, self.spec, directory, figures=figures)
        else:
            remove_report(directory)
        return paths


def _run_pages() -> Any:
    """The module that writes pages of runs, which is loaded only where one is wanted."""
    from cosim.report.page import run_page  # noqa: PLC0415 - matplotlib is loaded only for a report

    return run_page
