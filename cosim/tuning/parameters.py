"""What is tuned: parameters by name with bounds, entries of matrices among them, and the settings of a candidate. Runs
nothing.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from math import isqrt, nan
from typing import Any

from cosim.components.described import DescribedComponent
from cosim.errors import CosimError, ScenarioError, nearest
from cosim.run.described_components import describe_component
from cosim.scenario.override import COMPONENT_KEYS, INNER, TABLES
from cosim.simulation.scenario import Scenario
from fmu_observer.design.optimisers.search_space import Bounded, SearchSpace

ENTRY = re.compile(r"(.+)\[(\d+)(?:,(\d+))?\]")
Bounds = tuple[float, float] | tuple[float, float, bool] | Bounded


@dataclass(frozen=True)
class _Entry:
    """An element of a vector: the whole by name, and its place from 0."""

    whole: str
    place: int


@dataclass(frozen=True)
class Tunable:
    """Parameters to be tuned, known to exist.

    Args:
        space: names and bounds. start: their present values by name; NaN where the scenario does not say.
        vectors: present values of the vectors of which elements are tuned, by name.
        entries: where a parameter is an element of a vector.
        notes: what was done to the vectors, in words.
    """

    space: SearchSpace
    start: Mapping[str, float]
    vectors: Mapping[str, Sequence[float]] = field(default_factory=dict)
    entries: Mapping[str, _Entry] = field(default_factory=dict)
    notes: Sequence[str] = ()

    def settings(self, values: Mapping[str, float]) -> dict[str, Any]:
        """What a candidate changes in the scenario, by the names of `Scenario.set`.

        Args:
            values: of the parameters, by name.
        """
        vectors = {name: list(stated) for name, stated in self.vectors.items()}
        settings: dict[str, Any] = {}
        for name, value in values.items():
            if name in self.entries:
                vectors[self.entries[name].whole][self.entries[name].place] = value
            else:
                settings[name] = value
        return settings | vectors


def tunable(scenario: Scenario, component: str | None, bounds: Mapping[str, Bounds]) -> Tunable:
    """Find the parameters in a scenario.

    Args:
        scenario: that has them. component: whose parameters those without a dot in their name are; None for none.
        bounds: by name (low, high), or (low, high, True) for a search in the logarithm. Of a square matrix, given row
            by row, entries of the diagonal are named ``process_covariance[1,1]``; of a vector ``gain[2]``.

    Raises:
        ScenarioError: no bounds, or bounds that cannot be; a parameter that does not exist, with the nearest names; an
            entry off the diagonal.
    """
    if not bounds:
        raise ScenarioError("Nothing is tuned: give parameters with bounds, such as {'observer.gain': (0.1, 10.0)}.")
    parameters, start, vectors, entries, diagonals = [], {}, {}, {}, []
    for stated, limits in bounds.items():
        name = stated if component is None or _head(stated) in _scenario_names(scenario) else f"{component}.{stated}"
        parameters.append(_bounded(name, limits))
        match = ENTRY.fullmatch(name)
        found = present_value(scenario, match[1] if match else name, stated)
        if match is None:
            if isinstance(found, list):
                raise ScenarioError(f"{stated}: this is a vector with {len(found)} elements; tune {stated}[1], ...")
            start[name] = found
            continue
        if not isinstance(found, list):
            raise ScenarioError(f"{stated}: {match[1]} is one number and has no elements.")
        place = _place(match, found, stated)
        entries[name] = _Entry(match[1], place)
        start[name], vectors[match[1]] = found[place], found
        if match[3] is not None:
            diagonals.append(match[1])
    notes = [_without_others(vectors, whole) for whole in dict.fromkeys(diagonals)]
    return Tunable(SearchSpace(parameters), start, vectors, entries, [note for note in notes if note])


def _scenario_names(scenario: Scenario) -> list[str]:
    """What the name of a setting may begin with: components and tables."""
    return [*scenario.table().components, *TABLES]


def _head(name: str) -> str:
    return name.partition(".")[0]


def _bounded(name: str, limits: Any) -> Bounded:
    try:
        if isinstance(limits, Bounded):
            return Bounded(name, limits.low, limits.high, limits.log)
        low, high, *log = limits
        return Bounded(name, float(low), float(high), bool(log and log[0]))
    except (TypeError, ValueError) as error:
        said = str(error) if name in str(error) else f"{name}: expected (low, high) or (low, high, True): {error}"
        raise ScenarioError(f"Bounds of {said}") from error


def _place(match: re.Match[str], whole: Sequence[float], stated: str) -> int:
    """Place of an element in its vector."""
    if match[3] is None:
        place = int(match[2]) - 1
    else:
        order = isqrt(len(whole))
        if order * order != len(whole):
            raise ScenarioError(
                f"{stated}: {match[1]} has {len(whole)} elements and is no square matrix; use [1] ... ."
            )
        if match[2] != match[3]:
            raise ScenarioError(
                f"{stated}: of a matrix the diagonal is tuned, such as {match[1]}[{match[2]},{match[2]}]."
            )
        place = (int(match[2]) - 1) * (order + 1) if int(match[2]) <= order else len(whole)
    if not 0 <= place < len(whole):
        raise ScenarioError(f"{stated}: there is no such element; {match[1]} has {len(whole)}, the first is 1.")
    return place


def _without_others(vectors: dict[str, Any], whole: str) -> str:
    """Make a matrix diagonal: with other entries left, a candidate might not be a covariance any more."""
    order = isqrt(len(vectors[whole]))
    others = [v for n, v in enumerate(vectors[whole]) if n % (order + 1) and v != 0.0]
    vectors[whole] = [0.0 if n % (order + 1) else v for n, v in enumerate(vectors[whole])]
    return f"{whole}: entries off the diagonal are zero in all candidates; they were not." if others else ""


def present_value(scenario: Scenario, name: str, stated: str) -> Any:
    """Present value of a setting: a number, or a list of a vector; NaN where the scenario does not say.

    Args:
        scenario: that has it. name: as for `Scenario.set`. stated: name for messages.

    Raises:
        ScenarioError: there is no such setting, or it is no number.
    """
    table = scenario.table()
    head, _, rest = name.partition(".")
    if head not in table.components:
        return _of_table(scenario, head, rest, stated)
    kind, dot, inner = rest.partition(".")
    if rest in COMPONENT_KEYS or (dot and kind in INNER and kind == "options"):
        return nan
    variable = inner if dot and kind in INNER else rest
    component = describe_component(
        head, table.components[head], scenario.folder, f"{scenario.where}: components.{head}"
    )
    set_value = table.components[head].parameters.get(variable)
    return _start_of(component, variable, set_value, stated)


def _of_table(scenario: Scenario, head: str, rest: str, stated: str) -> float:
    if head not in TABLES or not rest:
        raise ScenarioError(
            f"cannot tune {stated!r}: no component {head!r}; {nearest(head, _scenario_names(scenario))}"
        )
    value = getattr(getattr(scenario.table(), head, None), rest, None)
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise ScenarioError(f"cannot tune {stated!r}: the scenario has no number there.")
    return float(value)


def _start_of(component: DescribedComponent, variable: str, set_value: Any, stated: str) -> Any:
    elements = [n for n in component.variables if n.startswith(f"{variable}[")]
    if variable not in component.variables and not elements:
        settable = [v.name for v in component.variables.values() if v.causality in ("parameter", "input")]
        known = dict.fromkeys(n.partition("[")[0] for n in settable)
        raise ScenarioError(f"cannot tune {stated!r}: {component.name} has no {variable!r}; {nearest(variable, known)}")
    try:
        first = component.settable(elements[0] if elements else variable)
    except CosimError as error:
        raise ScenarioError(f"cannot tune {stated!r}: {error}") from error
    if isinstance(set_value, list):
        return [float(v) for v in set_value]
    if elements:
        starts = [_number(component.variables[n].start) for n in elements]
        singles = starts if set_value is None else [float(set_value)] * len(elements)
        return singles
    if first.shape or first.dimensions:
        return [float(v) for v in str(first.start).split()]
    return _number(first.start) if set_value is None else float(set_value)


def _number(start: Any) -> float:
    try:
        return float(start)
    except (TypeError, ValueError):
        return nan
