"""A scenario as what is calibrated."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from cosim.calibration.job_runs import JobRuns
from cosim.calibration.recorded_signals import CalibrationError, RecordedSignals
from cosim.errors import nearest
from cosim.run.outcome import Outcome
from cosim.runs.executors import make_executor
from cosim.runs.journal import Journal
from cosim.runs.run import Run
from cosim.simulation.scenario import Scenario


@dataclass(frozen=True)
class _Sampled:
    """What is taken of an outcome: signals at instants, on lines between its rows.

    Args:
        names: of the signals. instants: [s].
    """

    names: Sequence[str]
    instants: Sequence[float]

    def __call__(self, outcome: Outcome) -> list[list[float]] | None:
        if outcome.failure is not None:
            return None
        time, rows = np.unique(outcome.result.time, return_index=True)
        return [np.interp(self.instants, time, outcome[name][rows]).tolist() for name in self.names]


class ScenarioRuns(JobRuns):
    """Runs of a scenario with other values of ``component.parameter``, those of a derivative at once.

    Args:
        scenario: what is run. names: values to fit, as `Scenario.set` takes them.
        guesses: first guesses by name; needed where the scenario does not set the value itself.
        workers, scheduler: where it is run, see `make_executor`.
        journal: that runs are written to and taken over from; None for none.

    Raises:
        CalibrationError: there is no first guess for a value. RunError: the cluster cannot be used.
    """

    def __init__(
        self,
        scenario: Scenario,
        names: Sequence[str],
        guesses: Mapping[str, float] | None = None,
        *,
        workers: int = 1,
        scheduler: str | None = None,
        journal: Journal | None = None,
    ) -> None:
        self.scenario = scenario
        table = scenario.table()
        self.start, self.bounds = {}, {}
        for name in names:
            component, _, key = name.partition(".")
            if component not in table.components:
                raise CalibrationError(
                    f"{scenario.where}: {name!r} names no component; write component.parameter, "
                    f"{nearest(component, table.components)}"
                )
            value = (guesses or {}).get(name, table.components[component].parameters.get(key))
            if not isinstance(value, int | float):
                raise CalibrationError(
                    f"{scenario.where}: no first guess of {name}: the scenario does not set it. Write {name}=VALUE."
                )
            self.start[name] = float(value)
        super().__init__(
            scenario.where, make_executor(workers, scheduler, apart=Run(scenario, self.start).apart), journal
        )
        first = self.row_of(Run(scenario, self.start)).result
        self.outputs = tuple(signal.name for signal in first.signals)
        self._units = {signal.name: signal.unit for signal in first.signals}

    def job(self, values: Mapping[str, float], recorded: RecordedSignals) -> Run:
        """A run of the scenario, see `JobRuns.job`."""
        take = _Sampled(tuple(recorded.measured), tuple(recorded.time.tolist()))
        return Run(self.scenario, values, take, repr((take.names, take.instants)))

    def unit(self, name: str) -> str:
        """Unit of a signal; nothing is said of that of a scenario's value.

        Args:
            name: of the signal or value.
        """
        return str(self._units.get(name, ""))
