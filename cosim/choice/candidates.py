"""Who takes part in a comparison of observers: those of the scenario, shipped ones, those of a script; and what each
knows of the train. Runs nothing.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import fmu_observer
from cosim.choice.playback import (
    SHARED_PARAMETERS,
    Listener,
    ScenarioParts,
    settable,
    train_observers,
)
from cosim.errors import ScenarioError, nearest
from cosim.run.balise_service import BALISE_EVENT
from cosim.run.component_models import make_declared
from cosim.scenario.model_name import ModelName, settings_of
from cosim.scenario.paths import absolute, move_file
from cosim.scenario.scenario_tables import ComponentTable
from cosim.simulation.scenario import Scenario
from plant_models.user_file import names_code

OPTIONAL = {"odometer_fault"}
"""Inputs that stay at their start value where nobody in a scenario knows them."""


@dataclass(frozen=True)
class BenchmarkCandidate(Listener):
    """An observer to be evaluated.

    Args:
        name: in the benchmark. table: how it is made. sources: where its inputs come from.
        origin: ``scenario`` or ``defaults``. settings: what was assumed, in words. misfit: why it cannot be coupled, or
            empty.
    """

    origin: str
    settings: tuple[str, ...] = ()
    misfit: str = ""

    @property
    def model(self) -> str:
        """Shipped observer or FMU."""
        return str(self.table.observer or self.table.model or self.table.fmu)


def find_candidates(
    scenario: Scenario, parts: ScenarioParts, names: Sequence[Any] | None
) -> tuple[list[BenchmarkCandidate], list[str]]:
    """The observers to be evaluated, and notes on what was assumed and left out.

    Args:
        scenario: for messages. parts: of it. names: those asked for; None for all that fit.

    Raises:
        ScenarioError: a name is neither an observer of the scenario nor a shipped one.
    """
    if names is not None:
        asked = {name if isinstance(name, str) else id(name): name for name in names}
        found = _distinct([_named(scenario, parts, name) for name in asked.values()])
        return found, [f"{c.name}: {text}" for c in found for text in c.settings]
    own = [_own(parts, name) for name in parts.observers]
    used = {parts.table.components[name].observer for name in parts.observers}
    others = [_shipped(parts, name) for name in train_observers() if name not in used]
    reasons = dict.fromkeys(c.misfit for c in others if c.misfit)
    left_out = [f"left out, as {why}: {', '.join(c.model for c in others if c.misfit == why)}" for why in reasons]
    found = [*own, *(c for c in others if not c.misfit)]
    return found, [*(f"{c.name}: {text}" for c in found for text in c.settings), *left_out]


def _distinct(candidates: Sequence[BenchmarkCandidate]) -> list[BenchmarkCandidate]:
    """Candidates of which no two have one name: two instances of a class, say."""
    names = [candidate.name for candidate in candidates]
    earlier = [names[:place].count(name) for place, name in enumerate(names)]
    return [replace(c, name=f"{c.name}_{n + 1}") if n else c for c, n in zip(candidates, earlier, strict=True)]


def _named(scenario: Scenario, parts: ScenarioParts, given: Any) -> BenchmarkCandidate:
    """An observer of the scenario, or one by the name of its model, or a class or an instance from a script."""
    if isinstance(given, str) and given in parts.observers:
        return _own(parts, given)
    try:
        name = ModelName.of(given)
    except ValueError as error:
        raise ScenarioError(f"{scenario.where}: {error}") from error
    if name.given is None and not names_code(name) and name not in fmu_observer.OBSERVERS:
        known = [*parts.observers, *(n for n in train_observers() if n not in parts.observers)]
        raise ScenarioError(f"{scenario.where}: unknown observer {name!r}; {nearest(name, known)}")
    if name.given is None:
        name = ModelName.of(move_file(name, lambda path: absolute(path, ".")))
    return _shipped(parts, name)


def _own(parts: ScenarioParts, name: str) -> BenchmarkCandidate:
    return BenchmarkCandidate(name, parts.table.components[name], parts.sources(name), "scenario")


def _shipped(parts: ScenarioParts, model: str) -> BenchmarkCandidate:
    """An observer with its own defaults and what the scenario says of the train."""
    own = settings_of(getattr(model, "given", None))  # what an instance says of the train stands
    table = ComponentTable.model_validate({"observer": model, **own})
    system = make_declared(table, model)
    name = model.rpartition(":")[2].replace(".", "_")
    parameters = {s.name for s in settable(system)}
    unset = parameters - table.parameters.keys()
    shared = {name: known for name, known in parts.shared_parameters.items() if name in unset}
    values = {name: value for name, (value, _) in shared.items()}
    table = table.model_copy(update={"parameters": {**table.parameters, **values}})
    sources = {s.name: parts.template[s.name] for s in system.inputs if s.name in parts.template}
    unique = name if name not in parts.table.components else f"{name}_with_defaults"
    settings = (_assumed(system, shared),) if parameters & set(SHARED_PARAMETERS) else ()
    return BenchmarkCandidate(unique, table, sources, "defaults", settings, _misfit(parts, system, sources))


def _assumed(system: Any, shared: Mapping[str, tuple[float, str]]) -> str:
    given = ", ".join(f"{name} = {value:g} ({why})" for name, (value, why) in shared.items())
    units = {s.name: (s.start, s.unit) for s in settable(system)}
    rest = ", ".join(
        f"{f} = {units[f][0]:g}" + (f" {units[f][1]}" if units[f][1] != "1" else "")
        for f in SHARED_PARAMETERS
        if f in units and f not in shared
    )
    return (
        f"not set in the scenario, gains at their defaults; from the scenario: {given or 'nothing of the train'}; "
        f"assumed: {rest or 'nothing'}."
    )


def _misfit(parts: ScenarioParts, system: Any, sources: Iterable[str]) -> str:
    """Why an observer cannot listen here, or an empty text."""
    triggered = getattr(system, "triggered_events", ())  # plain Python says with its `balise` what it takes
    payload = {s.name for event in triggered for s in event.payload}
    missing = [s.name for s in system.inputs if s.name not in sources and s.name not in payload | OPTIONAL]
    if missing:
        return f"nothing in this scenario gives its input{'s' if len(missing) > 1 else ''} {', '.join(missing)}"
    if BALISE_EVENT in [event.name for event in triggered] and parts.table.balises is None:
        return "it is corrected by balises, and this scenario has none"
    return ""
