"""What expectations are checked against before the run: the scenario, its components, and who receives balises."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from math import ceil, floor, isfinite
from typing import TYPE_CHECKING, Any

from cosim.components.component import Component
from cosim.coupling.connection import split_name
from cosim.errors import CosimError, ScenarioError, nearest
from cosim.expectations.indicator_levels import BETWEEN_0_AND_1, shipped_threshold
from plant_models.hybrid.units import UnitError, conversion

if TYPE_CHECKING:
    from cosim.scenario.scenario_tables import ComponentTable, ReportTable

_SLACK = 1e-9


@dataclass(frozen=True)
class Before:
    """What is known before the run.

    Args:
        start, stop: of the run [s]. period: from one recorded row to the next [s].
        report: roles of signals. tables: of the components, by name. components: by name.
        receivers: of balise telegrams; None where the scenario has no balises.
        certificates: what is done about them: ``warn``, ``require`` or ``ignore``.
    """

    start: float
    stop: float
    period: float
    report: ReportTable
    tables: Mapping[str, ComponentTable]
    components: Mapping[str, Component]
    receivers: Sequence[str] | None
    certificates: str

    @property
    def observers(self) -> list[str]:
        """Those of the report, or else all components that are named as observers."""
        stated = self.report.observers
        if stated is not None:
            return list(stated)
        return [n for n, t in self.tables.items() if t.observer is not None or t.filter is not None]

    def demand_within(self, key: str, value: float | None) -> None:
        """An instant lies within the run.

        Args:
            key: of the instant. value: the instant [s], or None.
        """
        first, last = self.start, self.stop
        if value is not None and not first - _SLACK <= value <= last + _SLACK:
            raise ScenarioError(
                f"{key!r} ({value:g} s) lies outside the run, which lasts from {first:g} to {last:g} s; for a shorter "
                "run leave expectations out: --set expect=[]"
            )

    def demand_window(self, start: float | None, end: float | None, otherwise: float) -> None:
        """A window lies within the run, and holds at least one point that is recorded.

        Args:
            start, end: of the window [s], or None. otherwise: where it begins without `start` [s].
        """
        self.demand_within("from", start)
        self.demand_within("to", end)
        first, last = self.start, self.stop
        begin = otherwise if start is None else start
        until = last if end is None else end
        if begin > until:
            raise ScenarioError(
                f"'to' ({until:g} s) lies before the evaluation begins (report.evaluate_after, {begin:g} s); "
                "give 'from'"
            )
        recorded = floor((until - first) / self.period + _SLACK) >= ceil((begin - first) / self.period - _SLACK)
        if not recorded and until < last - _SLACK:
            raise ScenarioError(f"no row is recorded between {begin:g} and {until:g} s; one is every {self.period:g} s")

    def demand_output(self, component: str, output: str) -> None:
        """A component has an output.

        Args:
            component: its name. output: of it.
        """
        with _as_scenario_error():
            self.components[component].variable(output, "output")

    def demand_equal_dimension(self, *signals: str) -> None:
        """Signals exist, and can be compared.

        Args:
            signals: ``component.signal``.
        """
        units = [self.unit(signal) for signal in signals]
        if None in units:
            return
        try:
            conversion(*units)
        except UnitError as error:
            raise ScenarioError(f"the two signals cannot be compared: {error}") from error

    def unit(self, name: str) -> Any:
        """Unit of a signal that exists, None where it has none.

        Args:
            name: ``component.signal``.
        """
        component, signal = split_name(name, self.components, "signal")
        with _as_scenario_error():
            variable = self.components[component].variable(signal, "output", "local")
        if getattr(variable, "shape", None):
            raise ScenarioError(f"{name} is an array; name one element, {name}[1] for instance")
        try:
            return self.components[component].unit(signal)
        except UnitError as error:
            raise ScenarioError(str(error)) from error

    def named(self, of: str | Sequence[str] | None, otherwise: Sequence[str], what: str) -> list[str]:
        """The components that an expectation names, or others where it names none.

        Args:
            of: as named. otherwise: where nothing is. what: they are, for messages.
        """
        names = list(otherwise) if of is None else [of] if isinstance(of, str) else list(of)
        for name in names:
            if name not in self.components:
                raise ScenarioError(f"no {what} {name!r}; {nearest(name, otherwise or self.components)}")
        return names

    def threshold(self, name: str) -> float:
        """Halfway between the values an indicator may take.

        Args:
            name: ``component.signal``.
        """
        component, _, signal = name.partition(".")
        variable = self.components[component].variable(signal)
        if variable.type == "Boolean":
            return BETWEEN_0_AND_1
        try:
            low, high = float(variable.min), float(variable.max)
        except (TypeError, ValueError):
            low = high = float("nan")
        if isfinite(low) and isfinite(high) and low < high:
            return 0.5 * (low + high)
        known = shipped_threshold(name) if self._follows_our_levels(component, signal) else None
        if known is None:
            raise ScenarioError(f"{name} does not say which values it takes; give 'threshold', above which it is on")
        return known

    def _follows_our_levels(self, component: str, signal: str) -> bool:
        """Whether an indicator's name states its levels: of shipped models, and the slip indicator of what plays an
        observer.
        """
        own = self.tables.get(component)
        return (own is not None and own.fmu is None) or (signal == "slip_indicator" and component in self.observers)


@contextmanager
def _as_scenario_error() -> Iterator[None]:
    try:
        yield
    except CosimError as error:
        raise ScenarioError(str(error)) from error
