"""One regression test: what was run, and the baseline it belongs to. Used by the pytest plugin and the command line."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from math import isfinite
from pathlib import Path
from typing import Any

from cosim.baselines.baseline_files import read_baseline
from cosim.baselines.regression import Regression, check, regression
from cosim.baselines.subject import Subject, after_its_delivery, make_subject
from cosim.baselines.update import Update, plan_update
from cosim.comparison.common_change import common_changes
from cosim.comparison.comparison import Comparison
from cosim.comparison.tolerance import Tolerance, Tolerances
from cosim.errors import BaselineError
from cosim.runs.run_apart import isolated_unless_stated
from cosim.scenario.scenario_tables import Isolate

WORST = 20
"""Lines shown of a difference."""


@dataclass(frozen=True)
class Call:
    """A run and its baseline.

    Args:
        subject: the run. path: of the baseline. tolerances: None for those in the baseline.
        signals, every: what the baseline is to keep.
    """

    subject: Subject
    path: Path
    tolerances: Tolerances | None
    signals: Sequence[str] | None
    every: float | None

    @classmethod
    def run(
        cls,
        what: Any,
        folder: Path,
        path: Path,
        *,
        signals: Iterable[str] | None = None,
        every: float | None = None,
        tolerance: Any = None,
        tolerances: Mapping[str, Any] | None = None,
        ignore: Iterable[str] = (),
        isolate: Isolate | None = None,
        **arguments: Any,
    ) -> Call:
        """Run what a test names.

        Args:
            what: scenario, FMU, outcome or result, see `make_subject`.
            folder: of the test, for relative paths.
            path: of the baseline.
            signals: names or patterns of what is kept; None for all.
            every: least spacing of the rows [s]; None for at most about 2000 rows.
            tolerance: what is allowed of signals that are not named otherwise.
            tolerances: what is allowed, by name or pattern.
            ignore: names or patterns of what is not compared.
            isolate: what runs in a process of its own where a scenario says nothing; None for the usual.
            arguments: further arguments of `make_subject`.

        Raises:
            CosimError: tolerances, names or the run itself are not as they should be.
        """
        ignored = tuple(ignore)
        stated = tolerance is not None or tolerances or ignored
        wanted = _tolerances_of(Tolerances(), tolerance, tolerances, ignored) if stated else None  # before a long run
        chosen = None if signals is None else tuple(signals)
        with after_its_delivery(path, what, folder), isolated_unless_stated(isolate):
            return cls(make_subject(what, folder, **arguments), path, wanted, chosen, every)

    @property
    def _stated(self) -> Any:
        return self.subject.outcome or self.subject.result

    def check(self) -> Regression:
        """Compare with the baseline.

        Raises:
            BaselineError: it is missing, unreadable or of another model. ComparisonError: nothing can be compared.
        """
        self._demand_either()
        return check(self._stated, read_baseline(self.path), self.tolerances)

    def update(self) -> Update:
        """What updating the baseline would do."""
        return plan_update(
            self._stated, self.path, self.tolerances, recipe=self.subject.recipe, signals=self.signals, every=self.every
        )

    def without_baseline(self) -> Regression:
        """The run alone, nothing compared.

        Raises:
            BaselineError: the run failed.
        """
        self._demand_either()
        return regression(Comparison(self.path.name, "result", ()), self.subject.outcome, self.subject.result, None)

    def _demand_either(self) -> None:
        """A run that failed without a baseline: a baseline is not what is missing."""
        failure = self.subject.result.failure
        if failure is not None and not self.path.exists():
            raise BaselineError(f"The run failed, and there is no baseline {self.path} yet: {failure}")

    @staticmethod
    def headlines(found: Comparison) -> dict[str, str]:
        """What was found in three lines: what was different in what was run, what is common, the worst signal.

        Args:
            found: what was found.

        Returns:
            Lines by ``changed``, ``common`` and ``worst``, as far as there is such a thing.
        """
        worst = found.failed[0] if found.failed else None
        share = "" if worst is None or not isfinite(worst.share_of_range) else f" {100.0 * worst.share_of_range:.3g} %"
        lines = {
            "changed": "; ".join(found.causes),
            "common": "; ".join(change.text for change in common_changes(found)),
            "worst": "" if worst is None else f"{worst.name}{share and share + ' of its range'}",
        }
        return {key: line for key, line in lines.items() if line}

    @staticmethod
    def worst(found: Comparison) -> list[str]:
        """What differs in lines: in what was run, in common, and in each signal, the worst first; then other notes.

        Args:
            found: what was found.
        """
        lines = [change.text for change in common_changes(found)]
        lines += [_line(signal) for signal in found.failed]
        lines += [difference.text for difference in found.event_differences]
        return [*found.causes, *lines[:WORST], *(note for note in found.notes if note not in found.causes)]


def _line(signal: Any) -> str:
    if signal.findings:
        return str(signal.findings[0].text)
    return f"{signal.name}: {signal.status}{signal.hint}"


def _tolerances_of(
    base: Tolerances, tolerance: Any = None, by_signal: Mapping[str, Any] | None = None, ignore: Iterable[str] = ()
) -> Tolerances:
    """Tolerances as a test gives them, on top of others."""
    default = Tolerances.of(tolerance).default if tolerance is not None else base.default
    stated = Tolerances.of(default, by_signal, ignore)
    merged: dict[str, Tolerance] = {
        **stated.by_signal,
        **{k: v for k, v in base.by_signal.items() if k not in stated.by_signal},
    }
    return Tolerances(default, merged, (*base.ignore, *(name for name in stated.ignore if name not in base.ignore)))
