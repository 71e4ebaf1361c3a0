"""Replay: one observer of a run again over its inputs, many members with parameters of their own at once.

The plant does not run: the recorded signals are the inputs. Tuning needs this, hundreds of candidates on one recording.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from cosim.components.loading import describe_system
from cosim.coupling.transformation import Transformation
from cosim.errors import CosimError, nearest
from cosim.run.component_models import make_system
from cosim.run.connections import parse_connections
from cosim.run.run_seeds import component_seed
from fmus.batch.members import Batch
from plant_models.hybrid.signal import scalar_names
from plant_models.hybrid.units import conversion, parse_unit

if TYPE_CHECKING:
    from cosim.run.outcome import Outcome
    from cosim.scenario.scenario_tables import ComponentTable
    from cosim.scenario.schema import ScenarioTable
    from plant_models.hybrid import HybridSystem


_BATCHES = 3
"""Of different sizes, kept at a time."""


class ReplayError(CosimError):
    """An observer cannot be replayed; the message says why and what to do."""


class Replay:
    """An observer of a run, ready to be run again with other parameters.

    Each input has at each communication point the value that the master gave it: of the end of the step where its
    signal is fresh, of the start where it is held (see `cosim show`). A member with the parameters of the run computes
    what the observer computed in it, bit for bit; that is checked first.

    Args:
        outcome: of a run of a scenario, every communication point recorded.
        observer: name of the component: a hybrid system that only listens, without triggered events.

    Raises:
        ReplayError: the run failed, or not every point was recorded; the component is no hybrid system, receives
            events, or has a rate of its own; a source of an input was not recorded; or the replay differs from the run.
    """

    def __init__(self, outcome: Outcome, observer: str) -> None:
        self.outcome, self.name = outcome, observer
        table = _table(outcome, observer)
        self._component = table.components[observer]
        self.system = _system(self._component, observer)
        self._stated = self._component.parameters | self._seed(table.seed)
        self.instants = _instants(outcome, table)
        self._first, self._inputs = _inputs(outcome, table, observer, self.system)
        self._batches: dict[int, Batch] = {}
        self._check()

    def run(
        self,
        results: Sequence[str],
        parameters: Mapping[str, ArrayLike] | None = None,
        members: int | None = None,
        progress: Callable[[int, int], None] | None = None,
        late: Mapping[str, int] | None = None,
        into: np.ndarray | None = None,
    ) -> np.ndarray:
        """Run members over the recording.

        Args:
            results: names of the outputs or other variables to be returned.
            parameters: by name what differs from the run: one value for all members, or one for each, shape (members,);
                of a vector with n elements shape (n,) or (members, n). Start values of states too.
            members: how many; None: as many as the longest of the parameters has rows.
            progress: called with the number of members done and of all.
            late: by name of a connected input the number of points that its values come later than in the run, or
                sooner where negative: what a wrong order of exchange would cost.
            into: where the values are written, as for `Batch.run`; a new array by default.

        Returns:
            Shape (members, points, len(results)); NaN from where a member failed.

        Raises:
            BatchError: a name is unknown or a shape does not fit.
            ReplayError: an input that is to be late is not connected.
        """
        stated = {name: np.asarray(values, dtype=float) for name, values in (parameters or {}).items()}
        count = members if members is not None else self._members(stated)
        batch = self._batch(count)
        for name, values in stated.items():
            batch.set(name, values)
        for name, value in self._first.items():
            batch.set(name, value)
        batch.start(float(self.instants[0]))
        return batch.run(self.instants[1:], results, self._moved(late or {}), progress, into)

    def inputs(self) -> np.ndarray:
        """Inputs as the observer had them at each communication point, in the order of its scalar inputs; those that
        nothing is connected to have their start values.

        Returns:
            Shape (points, inputs).
        """
        rows = np.tile(self.system.start_inputs(), (len(self.instants), 1))
        for column, name in enumerate(scalar_names(self.system.input_signals)):
            if name in self._first:
                rows[0, column], rows[1:, column] = self._first[name], self._inputs[name][:-1]
        return rows

    def parameters(self) -> dict[str, float]:
        """Values of all parameters in the run, by scalar name."""
        signals, known = self.system.parameter_signals, scalar_names(self.system.parameter_signals)
        values = dict(zip(known, map(float, self.system.start_parameters(self._component.preset)), strict=True))
        elements = {signal.name: signal.scalar_names for signal in signals} | {name: [name] for name in known}
        for name, stated in self._stated.items():
            if name in elements:
                values |= zip(
                    elements[name], np.broadcast_to(np.asarray(stated, float), len(elements[name])), strict=True
                )
        return values

    # -- internals --------------------------------------------------------------------------------------------------

    def _seed(self, run_seed: int) -> dict[str, Any]:
        described = describe_system(self.system, self.name, 3, self._component.preset)
        return component_seed(described, self._component.parameters, run_seed)

    def _moved(self, late: Mapping[str, int]) -> dict[str, np.ndarray]:
        """The inputs with some of them later; at an end the value there stays."""
        for name in late:
            if name not in self._inputs:
                raise ReplayError(f"{self.name!r} has no connected input {name!r}; {nearest(name, self._inputs)}")
        places = np.arange(len(self.instants))
        moved = {name: np.clip(places - points, 0, len(places) - 1) for name, points in late.items()}
        return {name: values[moved[name]] if name in moved else values for name, values in self._inputs.items()}

    def _members(self, stated: Mapping[str, np.ndarray]) -> int:
        """How many members the parameters are given for; 1 where each has one value for all."""
        vectors = {s.name for s in (*self.system.parameter_signals, *self.system.states) if s.size is not None}
        return max((len(v) for name, v in stated.items() if v.ndim > (1 if name in vectors else 0)), default=1)

    def _batch(self, members: int) -> Batch:
        """So many members with the parameters of the run, before time begins; the last few are kept for the next
        time.
        """
        if members not in self._batches:
            kept = list(self._batches.items())[1 - _BATCHES :]
            self._batches = dict(kept) | {members: Batch(self.system, members, self._component.preset)}
        batch = self._batches[members]
        batch.reset()
        for name, value in self._stated.items():
            batch.set(name, np.asarray(value, dtype=float))
        return batch

    def _check(self) -> None:
        recorded_names = {signal.name for signal in self.outcome.result.signals}
        outputs = [name for name in scalar_names(self.system.outputs) if f"{self.name}.{name}" in recorded_names]
        again = self.run(outputs, members=1)[0]
        for i, name in enumerate(outputs):
            recorded = self.outcome[f"{self.name}.{name}"]
            if not np.array_equal(again[:, i], recorded, equal_nan=True):
                first = int(np.flatnonzero(again[:, i] != recorded)[0])
                raise ReplayError(
                    f"The replay of {self.name!r} differs from the run: {name} is {again[first, i]!r} at "
                    f"{self.instants[first]:g} s, recorded {recorded[first]!r}. Something in the run that is neither a "
                    "parameter nor a connected input acts on it."
                )


def _table(outcome: Outcome, observer: str) -> ScenarioTable:
    """The scenario of a run in which this component can be replayed."""
    if outcome.failure is not None:
        raise ReplayError(f"The run failed, so it cannot be replayed: {outcome.failure}")
    if outcome.origin is None:
        raise ReplayError("Only the outcome of a scenario that was run in this program can be replayed.")
    table = outcome.origin.table
    if observer not in table.components:
        raise ReplayError(f"The run has no component {observer!r}; {nearest(observer, table.components)}")
    component = table.components[observer]
    if component.every != 1 or component.substeps != 1:
        raise ReplayError(f"{observer!r} has a rate of its own (every, substeps); only one step a point is replayed.")
    played = outcome.result.summary["master"]["algorithm"].get("played", {})
    links = parse_connections(table.connections, observer)
    sources = [source for source, target, *_ in links if target.partition(".")[0] == observer]
    if any(played.get(source) == "line" for source in sources):
        raise ReplayError(
            f"{observer!r} followed lines of a table; only held inputs are replayed. Record the run and play "
            "that back, or set 'interpolation' of the table to 'hold'."
        )
    if table.master.inputs != "hold":
        raise ReplayError(f"The inputs of {observer!r} followed lines (master.inputs); only held ones are replayed.")
    return table


def _system(component: ComponentTable, observer: str) -> HybridSystem:
    system = make_system(component, f"components.{observer}")
    if system is None:
        raise ReplayError(f"{observer!r} is no shipped model or hybrid system; only their equations make a batch.")
    if system.triggered_events:
        names = ", ".join(event.name for event in system.triggered_events)
        raise ReplayError(f"{observer!r} receives events ({names}); only observers without any are replayed.")
    return system


def _instants(outcome: Outcome, table: ScenarioTable) -> np.ndarray:
    """Communication points [s], shape (points,)."""
    times = np.asarray(outcome.result.time, dtype=float)
    if table.master.record_every != 1 or not (np.diff(times) > 0.0).all():
        raise ReplayError(
            "Each communication point must stand in the recording once: set master.record_every = 1, and record "
            "without events."
        )
    return times


def _inputs(
    outcome: Outcome, table: ScenarioTable, observer: str, system: HybridSystem
) -> tuple[dict[str, float], dict[str, np.ndarray]]:
    """Values of the connected inputs at the start, and from each point to the next, shape (points,)."""
    held = set(outcome.result.summary["master"]["algorithm"]["held"])
    units = dict(zip(scalar_names(system.inputs), _units(system), strict=True))
    recorded = {signal.name: signal.unit for signal in outcome.result.signals}
    first: dict[str, float] = {}
    later: dict[str, np.ndarray] = {}
    for source, target, *rest in parse_connections(table.connections, observer):
        component, _, name = target.partition(".")
        if component != observer:
            continue
        if source not in recorded or name not in units:
            raise ReplayError(
                f"{source} -> {target}: not among the recorded scalars; {nearest(source, recorded)} A local variable "
                "is recorded by components.NAME.record."
            )
        values = _transformed(outcome[source], rest[0] if rest else Transformation(), recorded[source], units[name])
        first[name] = float(values[0])
        fresh = f"{source} -> {target}" not in held
        later[name] = np.append(values[1:], values[-1]) if fresh else values
    return first, later


def _units(system: HybridSystem) -> list[str]:
    return [signal.unit for signal in system.inputs for _ in signal.scalar_names]


def _transformed(values: np.ndarray, stated: Transformation, source: str | None, target: str) -> np.ndarray:
    """What a connection makes of the recorded values, as the master computes it."""
    if stated.table:
        raise ReplayError("A connection with a table of values is not replayed.")
    factor, offset = 1.0, 0.0
    if stated.convert_units and source is not None:
        factor, offset = conversion(parse_unit(source), parse_unit(target))
    factor, offset = stated.after(factor, offset)
    return values if (factor, offset) == (1.0, 0.0) else factor * values + offset
