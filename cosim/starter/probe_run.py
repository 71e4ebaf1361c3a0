"""Short runs of an FMU alone, in a process of their own: how its outputs respond to a step of an input."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from time import monotonic

import numpy as np

from cosim.components.stated_units import StatedUnit
from cosim.errors import RunError
from cosim.run.outcome import Outcome
from cosim.runs.executors import Executor
from cosim.runs.run import Run
from cosim.simulation.scenario import Scenario
from cosim.starter.step_response import StepResponse

NAME = "plant"
SPAN = 4.0  # [s]
SIZES = (1.0, 30.0, 1e3, 3e4, 1e6)
"""Of a step, in a unit that nobody knows: kN, a share of the whole, N."""
MORE = 1.5
_MOVES = 0.05
"""Change of a speed from which on a train moves, in km/h or m/s."""
CALL_TIMEOUT = 10.0  # [s]
LONGEST = 30.0  # [s]


@dataclass(frozen=True)
class ProbeRun:
    """Runs of an FMU.

    Args:
        path: of the FMU. units: what is stated of its variables. step: communication step [s].
        outputs: those that are read, among them local variables. executor: where the runs are done.
    """

    path: Path
    units: Mapping[str, StatedUnit]
    step: float
    outputs: Sequence[str]
    executor: Executor
    deadline: float = field(default_factory=lambda: monotonic() + LONGEST)
    """When no further run begins: of a slow FMU, or one with many inputs, not all is tried."""

    def respond(self, name: str, parameters: Mapping[str, float], size: float | None = None) -> StepResponse | None:
        """How outputs respond to an input that moves the train; None where none of the sizes does.

        Args:
            name: of the input. parameters: other start values. size: of the step; None for the smallest that moves it.

        Raises:
            RunError: the FMU fails at the first size already; a larger one may be more than it can take.
        """
        sizes = [sign * s for s in SIZES for sign in (1.0, -1.0)] if size is None else [size]
        for tried in sizes:
            try:
                less, more = (self._run({**parameters, name: value}) for value in (tried, MORE * tried))
            except RunError:
                if tried == sizes[0] and size is None:
                    raise
                return None
            if monotonic() > self.deadline:
                return None
            less, more = _at_common_instants(less, more)
            columns = {n: more[n] - less[n] for n in less if n != "time"}
            response = StepResponse(less["time"], (MORE - 1.0) * tried, columns)
            if size is not None or any(np.ptp(less[n]) > _MOVES for n in response.speeds()):
                return response
        return None

    def _run(self, values: Mapping[str, float]) -> Mapping[str, np.ndarray]:
        """The columns of a run by name, ``time`` among them."""
        steps = max(round(SPAN / self.step / 4.0), 1) * 4
        scenario = Scenario(stop=steps * self.step, step=self.step, master={"call_timeout": CALL_TIMEOUT})
        stated = {name: fact.model_dump(exclude_unset=True) for name, fact in self.units.items()}
        scenario.add(NAME, fmu=str(self.path), units=stated, parameters=dict(values), record=list(self.outputs))
        (_, ended), *_ = self.executor.each([Run(scenario, take=columns_of)])
        if ended.failure is not None:
            raise RunError(ended.failure.reason)
        columns: Mapping[str, np.ndarray] = ended.row
        return columns


def _at_common_instants(
    one: Mapping[str, np.ndarray], other: Mapping[str, np.ndarray]
) -> Iterator[Mapping[str, np.ndarray]]:
    """Columns of two runs at the instants that both have: events of the FMU may lie elsewhere in each."""
    _, *places = np.intersect1d(one["time"], other["time"], return_indices=True)
    for run, place in zip((one, other), places, strict=True):
        yield {name: column[place] for name, column in run.items()}


def columns_of(outcome: Outcome) -> Mapping[str, np.ndarray]:
    """The columns of a run of the FMU alone, by their names in it; of an event the row after it.

    Args:
        outcome: of the run.
    """
    last = np.append(np.diff(outcome.result.time) > 0.0, True)
    return {name.removeprefix(f"{NAME}."): np.asarray(outcome[name])[last] for name in outcome}
