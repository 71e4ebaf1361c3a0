"""The outcome of a run: the result, the roles for the report, and how to write both."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from cosim.errors import UnmetError
from cosim.evaluation.spec import ReportSpec
from cosim.expectations.evaluated import Evaluated, evaluated_table
from cosim.results.result import Result
from cosim.results.results_folder import remove_report, write_results
from cosim.run.made_from import renewed

if TYPE_CHECKING:
    from cosim.scenario.origin import Origin

INTERRUPTED = "The run was interrupted; what was computed so far is kept."
"""The failure of a run that somebody stopped."""


@dataclass(frozen=True)
class Outcome:
    """What a run leaves.

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
        self, directory: str | Path, *, report: bool = True, figures: bool = False, files_up_to: float = 50e6
    ) -> dict[str, Path]:
        """Write result files, how they were made, and, where wanted, the report.

        Args:
            directory: the folder; results that an earlier run left there are replaced.
            report: whether to write the page as well. figures: whether to draw its figures as PNG files, too.
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
            from cosim.report.page.run_page import write_report  # noqa: PLC0415 - loaded only for a report

            paths["report"] = write_report(self.result, self.spec, directory, figures=figures)
        else:
            remove_report(directory)
        return paths
