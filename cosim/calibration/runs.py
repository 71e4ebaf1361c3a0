"""What is calibrated: a sealed FMU, one loaded instance for all runs, or a scenario."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import ceil
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from cosim.calibration.least_squares import Fit, unseen_directions
from cosim.calibration.recorded_signals import CalibrationError, RecordedSignals
from cosim.coupling.instants import is_continuous
from cosim.errors import CosimError, nearest
from cosim.fmu_model.opening import Interface, open_model
from cosim.run.outcome import Outcome
from cosim.runs.engine import run_jobs
from cosim.runs.executors import make_executor
from cosim.runs.journal import Journal
from cosim.runs.run import Run
from cosim.simulation.scenario import Scenario

Array = NDArray[np.float64]
LIMIT = 0.5
"""Standard deviation along a direction, relative to the sizes of the parameters, beyond which it is not identified."""


class Hidden(NamedTuple):
    """What a recording does not show of the parameters.

    Attributes:
        names: parameters that are not identified. text: a sentence with the reason.
    """

    names: tuple[str, ...]
    text: str


class Runs(ABC):
    """What can be run with other parameters.

    Attributes:
        outputs: signals that it has. inputs: inputs that a recording may drive. discrete: those that are no continuous
            ones. start: first guesses by name.
        bounds: lowest and highest value by name; those without an entry have none.
    """

    outputs: tuple[str, ...]
    inputs: tuple[str, ...] = ()
    discrete: tuple[str, ...] = ()
    start: Mapping[str, float]
    bounds: Mapping[str, tuple[float, float]]

    @abstractmethod
    def run(self, values: Mapping[str, float], recorded: RecordedSignals) -> Array:
        """Simulate with parameters.

        Args:
            values: by name. recorded: instants, inputs and names of the signals.

        Returns:
            The signals at the instants, shape (q, n).
        """

    def run_all(self, points: Sequence[Mapping[str, float]], recorded: RecordedSignals) -> Array:
        """Simulate with several sets of parameters.

        Args:
            points: parameters of each run, by name. recorded: as for `run`.

        Returns:
            The signals, shape (m, q, n).
        """
        return np.stack([self.run(values, recorded) for values in points])

    @abstractmethod
    def unit(self, name: str) -> str:
        """Unit of a signal or of a value that is fitted, empty where it is not known.

        Args:
            name: of it.
        """

    def prepare(self, recorded: RecordedSignals) -> tuple[RecordedSignals, Mapping[str, float]]:
        """The part of a recording that is fitted, and first guesses by name, of what is fitted to it.

        Args:
            recorded: the whole.

        Raises:
            CalibrationError: nothing can be fitted to it.
        """
        return recorded, self.start

    def hidden(self, found: Fit, names: Sequence[str], recorded: RecordedSignals, level: float) -> list[Hidden]:
        """What the recording does not show: directions along which the parameters are uncertain by half their size.

        Args:
            found: the fit. names: of its parameters. recorded: what was fitted. level: of the intervals.
        """
        return [Hidden(tuple(d.shares), d.explain()) for d in unseen_directions(found, names, LIMIT)]

    def remarks(self, found: Fit, names: Sequence[str], recorded: RecordedSignals) -> list[str]:
        """What else there is to know of a fit.

        Args:
            found: the fit. names: of its parameters. recorded: what was fitted.
        """
        return []

    def parameter_lines(self, values: Mapping[str, float]) -> dict[str, float]:
        """What stands in a scenario, by name: values found, and those that belong to them.

        Args:
            values: by name.
        """
        return dict(values)

    def close(self) -> None:  # noqa: B027 - most have opened nothing
        """Free what was opened."""


class FmuRuns(Runs):
    """Runs of an FMU of either interface type: reset, parameters set, driven by the recorded inputs.

    Args:
        path: the ``.fmu`` file. names: parameters to fit, or start values of states.
        fixed: other start values by name. guesses: first guesses by name, where the FMU's own are not wanted.
        interface: ``co-simulation`` or ``model-exchange``; None for co-simulation where the FMU has it.
        step: longest communication step [s]; None for the sampling of the recording.

    Raises:
        CalibrationError: a parameter does not exist or cannot be set. FmuLoadError: the FMU cannot be opened.
    """

    def __init__(
        self,
        path: str | Path,
        names: Sequence[str],
        *,
        fixed: Mapping[str, float] | None = None,
        guesses: Mapping[str, float] | None = None,
        interface: Interface | None = None,
        step: float | None = None,
    ) -> None:
        self.path, self._step, self._fixed = str(path), step, dict(fixed or {})
        everything = dict.fromkeys(names, 0.0) | dict(guesses or {}) | self._fixed
        self._model = open_model(path, interface, states=(), parameters=everything)
        variables = self._model.instance.variables
        self.outputs, self.inputs = self._model.outputs, self._model.inputs
        self.discrete = tuple(name for name in self.inputs if not is_continuous(variables[name]))
        self.start, self.bounds = {}, {}
        for name in names:
            variable = variables[name]
            if (
                variable.causality in ("output", "independent", "calculatedParameter")
                or variable.variability == "constant"
            ):
                raise CalibrationError(
                    f"{path}: {name!r} cannot be set (causality {variable.causality}, variability "
                    f"{variable.variability}); expected a parameter or the start value of a state."
                )
            self.start[name] = float((guesses or {}).get(name, _number(variable.start, 0.0)))
            self.bounds[name] = _number(variable.min, -np.inf), _number(variable.max, np.inf)

    def unit(self, name: str) -> str:
        """Unit of a variable as the FMU names it.

        Args:
            name: of the variable.
        """
        return self._model.unit(name)

    def run(self, values: Mapping[str, float], recorded: RecordedSignals) -> Array:
        """Simulate with parameters; arguments and result as for `Runs`."""
        model, time = self._model, recorded.time
        places = [model.outputs.index(name) for name in recorded.measured]
        u = np.tile(model.start_inputs, (len(time), 1))
        for name, series in recorded.inputs.items():
            u[:, model.inputs.index(name)] = series
        first, last = u[:-1].copy(), u[:-1].copy()
        for name, (begins, ends) in recorded.ends.items():
            place = model.inputs.index(name)
            first[:, place], last[:, place] = begins, ends
        model.set_parameters(values)
        found = np.empty((len(time), len(places)))
        model.restart(float(time[0]), np.zeros(0), u[0])
        found[0] = model.read()[1][places]
        for k in range(len(time) - 1):
            begin, span = float(time[k]), float(time[k + 1] - time[k])
            parts = 1 if self._step is None else max(1, ceil(span / self._step - 1e-9))
            for i in range(parts):
                model.set_inputs(first[k] + (last[k] - first[k]) * ((i + 0.5) / parts))
                model.advance(begin + span * i / parts, span / parts)
            model.set_inputs(last[k])
            found[k + 1] = model.read()[1][places]
        return found.T

    def close(self) -> None:
        """Free the instance."""
        self._model.close()


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


class ScenarioRuns(Runs):
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
        self.scenario, self._journal = scenario, journal
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
        self._executor = make_executor(workers, scheduler, apart=Run(scenario, self.start).apart)
        first = self._rows([Run(scenario, self.start)])[0].result
        self.outputs = tuple(signal.name for signal in first.signals)
        self._units = {signal.name: signal.unit for signal in first.signals}

    def run(self, values: Mapping[str, float], recorded: RecordedSignals) -> Array:
        """The signals of one run, see `Runs.run`."""
        return np.asarray(self.run_all([values], recorded)[0])

    def run_all(self, points: Sequence[Mapping[str, float]], recorded: RecordedSignals) -> Array:
        """The signals of several runs, see `Runs.run_all`."""
        take = _Sampled(tuple(recorded.measured), tuple(recorded.time.tolist()))
        rests_on = repr((take.names, take.instants))
        return np.array(self._rows([Run(self.scenario, values, take, rests_on) for values in points], self._journal))

    def _rows(self, jobs: Sequence[Run], journal: Journal | None = None) -> list[Any]:
        """What is taken of each run.

        Raises:
            CosimError: a run failed.
        """
        found: dict[int, Any] = {}
        for done in run_jobs(jobs, self._executor, journal):
            if done.failure is not None:
                values = ", ".join(f"{name} = {value:.6g}" for name, value in done.job.settings.items())
                raise CosimError(
                    f"{self.scenario.where}: a run of the calibration failed, with {values}: {done.failure.reason}"
                )
            found[done.number] = done.row
        return [found[number] for number in range(len(jobs))]

    def unit(self, name: str) -> str:
        """Unit of a signal; nothing is said of that of a scenario's value.

        Args:
            name: of the signal or value.
        """
        return str(self._units.get(name, ""))

    def close(self) -> None:
        """Let the worker processes end."""
        self._executor.__exit__(None, None, None)


def _number(text: object, otherwise: float) -> float:
    try:
        return float(str(text))
    except ValueError:
        return otherwise
