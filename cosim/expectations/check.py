"""Expectations before the run: what they name exists, their windows lie within the run, thresholds are known."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from math import ceil, floor, isfinite
from typing import TYPE_CHECKING, Any

from cosim.components.component import Component
from cosim.coupling.connection import split_name
from cosim.errors import CosimError, ScenarioError, nearest
from cosim.expectations.indicators import BETWEEN_0_AND_1, shipped_threshold
from cosim.expectations.values import ERRORS
from plant_models.hybrid.units import UnitError, conversion

if TYPE_CHECKING:
    from cosim.scenario.schema import ScenarioTable

SIGNAL_KEYS = ("signal", "reference")
SLACK = 1e-9
NEVER_CERTIFIED = 'certificates = "ignore" leaves nothing to judge; remove that line'


def check_expectations(
    table: ScenarioTable, components: Mapping[str, Component], receivers: Sequence[str], where: str
) -> ScenarioTable:
    """Check the expectations of a scenario against its components.

    Args:
        table: the scenario. components: by name. receivers: of balise telegrams. where: place for messages.

    Returns:
        The scenario, with the thresholds of indicators that were left to us.

    Raises:
        ScenarioError: a signal, observer or receiver does not exist, a window lies outside the run, or an expectation
        can never
            be judged; one line for each expectation at fault.
    """
    faults, items = [], []
    check = _Check(table, components, receivers)
    for place, item in enumerate(table.expect, start=1):
        title = f" ({item.name})" if item.name else ""
        try:
            items.append(check.one(item))
        except CosimError as error:
            faults.append(f"{where}: expect, number {place}{title}, {item.check!r}: {error}")
    if faults:
        raise ScenarioError("\n".join(faults))
    return table.model_copy(update={"expect": items})


class _Check:
    """The checks, by kind of expectation."""

    def __init__(self, table: ScenarioTable, components: Mapping[str, Component], receivers: Sequence[str]) -> None:
        self.table, self.components, self.receivers = table, components, receivers

    def one(self, item: Any) -> Any:
        """The expectation, with its threshold where it has one; raises a `CosimError` where something is wrong."""
        self._window(item)
        units = [self._unit(getattr(item, key)) for key in SIGNAL_KEYS if hasattr(item, key)]
        if item.check in ERRORS:
            self._estimates(item)
        elif item.check == "difference":
            _same_dimension(units)
        elif item.check in ("on", "off"):
            return (
                item
                if item.threshold is not None
                else item.model_copy(update={"threshold": self._threshold(item.signal)})
            )
        elif item.check == "telegrams":
            self._telegrams(item)
        elif item.check == "certificate":
            self._certificates(item)
        return item

    def _window(self, item: Any) -> None:
        """The window lies within the run, and holds at least one point that is recorded."""
        first, last = self.table.start, self.table.stop
        for key, value in (
            ("from", getattr(item, "start", None)),
            ("to", getattr(item, "end", None)),
            ("before", getattr(item, "before", None)),
        ):
            if value is not None and not first - SLACK <= value <= last + SLACK:
                raise ScenarioError(
                    f"{key!r} ({value:g} s) lies outside the run, which lasts from {first:g} to {last:g} s"
                )
        if not hasattr(item, "end"):
            return
        begin = item.start if item.start is not None else first
        if item.start is None and item.check in ERRORS:
            begin = max(first, self.table.report.evaluate_after)
        end = item.end if item.end is not None else last
        if begin > end:
            raise ScenarioError(
                f"'to' ({end:g} s) lies before the evaluation begins (report.evaluate_after, {begin:g} s); give 'from'"
            )
        period = self.table.step * self.table.master.record_every
        if floor((end - first) / period + SLACK) < ceil((begin - first) / period - SLACK) and end < last - SLACK:
            raise ScenarioError(f"no row is recorded between {begin:g} and {end:g} s; one is every {period:g} s")

    def _unit(self, name: str) -> Any:
        """Unit of a signal that exists, None where it has none."""
        component, signal = split_name(name, self.components, "signal")
        with _as_scenario_error():
            variable = self.components[component].variable(signal, "output", "local")
        if getattr(variable, "shape", None):
            raise ScenarioError(f"{name} is an array; name one element, {name}[1] for instance")
        try:
            return self.components[component].unit(signal)
        except UnitError as error:
            raise ScenarioError(str(error)) from error

    def _estimates(self, item: Any) -> None:
        role, output, _ = ERRORS[item.check]
        if getattr(self.table.report, role) is None:
            raise ScenarioError(
                f'the true value is not known; say which signal it is with report.{role} = "component.signal"'
            )
        observers = self._named(item.of, self._observers(), "observer")
        if not observers:
            raise ScenarioError("there is no observer; name the component that estimates with 'of'")
        for observer in observers:
            with _as_scenario_error():
                self.components[observer].variable(output, "output")

    def _observers(self) -> list[str]:
        given = self.table.report.observers
        return (
            list(given)
            if given is not None
            else [n for n, t in self.table.components.items() if t.observer is not None]
        )

    def _named(self, of: str | Sequence[str] | None, otherwise: Sequence[str], what: str) -> list[str]:
        names = list(otherwise) if of is None else [of] if isinstance(of, str) else list(of)
        for name in names:
            if name not in self.components:
                raise ScenarioError(f"no {what} {name!r}; {nearest(name, otherwise or self.components)}")
        return names

    def _telegrams(self, item: Any) -> None:
        if self.table.balises is None:
            raise ScenarioError("this scenario has no balises; give it a table [balises]")
        if item.of is not None and item.of not in self.receivers:
            raise ScenarioError(f"{item.of!r} is told of no telegrams; {nearest(item.of, self.receivers)}")

    def _certificates(self, item: Any) -> None:
        if self.table.balises is None:
            raise ScenarioError("this scenario has no balises, so there are no gaps to be certified for")
        if self.table.certificates == "ignore":
            raise ScenarioError(NEVER_CERTIFIED)
        for name in self._named(item.of, self.receivers, "observer"):
            if name not in self.receivers:
                raise ScenarioError(f"{name!r} is told of no telegrams; {nearest(name, self.receivers)}")

    def _threshold(self, name: str) -> float:
        """Halfway between the values an indicator may take."""
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
        """Whether an indicator's name tells its levels: of shipped models, and the slip indicator of what plays an
        observer.
        """
        return self.table.components[component].fmu is None or (
            signal == "slip_indicator" and component in self._observers()
        )


def _same_dimension(units: Sequence[Any]) -> None:
    if None in units:
        return
    try:
        conversion(*units)
    except UnitError as error:
        raise ScenarioError(f"the two signals cannot be compared: {error}") from error


@contextmanager
def _as_scenario_error() -> Iterator[None]:
    try:
        yield
    except CosimError as error:
        raise ScenarioError(str(error)) from error
