"""Who takes part in a comparison of observers: those of the scenario, shipped ones, those of a script; and what each is
told of the train. Runs nothing.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import fmu_observer
from cosim.coupling.connection import Link
from cosim.errors import ScenarioError, nearest
from cosim.observer_benchmark.playback import FACTS, Sides, known_facts, told_to, train_observers
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
class BenchmarkCandidate:
    """An observer to be judged.

    Args:
        name: in the benchmark. table: how it is made. sources: where its inputs come from.
        origin: ``scenario`` or ``defaults``. settings: what was assumed, in words. misfit: why it cannot be coupled, or
            empty.
    """

    name: str
    table: ComponentTable
    sources: Mapping[str, Link]
    origin: str
    settings: tuple[str, ...] = ()
    misfit: str = ""

    @property
    def model(self) -> str:
        """Shipped observer or FMU."""
        return str(self.table.observer or self.table.model or self.table.fmu)


def find_candidates(
    scenario: Scenario, sides: Sides, names: Sequence[Any] | None
) -> tuple[list[BenchmarkCandidate], list[str]]:
    """The observers to be judged, and notes on what was assumed and left out.

    Args:
        scenario: for messages. sides: of it. names: those asked for; None for all that fit.

    Raises:
        ScenarioError: a name is neither an observer of the scenario nor a shipped one.
    """
    if names is not None:
        asked = {name if isinstance(name, str) else id(name): name for name in names}
        found = _told_apart([_named(scenario, sides, name) for name in asked.values()])
        return found, [f"{c.name}: {text}" for c in found for text in c.settings]
    own = [_own(sides, name) for name in sides.observers]
    used = {sides.table.components[name].observer for name in sides.observers}
    others = [_shipped(sides, name) for name in train_observers() if name not in used]
    reasons = dict.fromkeys(c.misfit for c in others if c.misfit)
    left_out = [f"left out, as {why}: {', '.join(c.model for c in others if c.misfit == why)}" for why in reasons]
    found = [*own, *(c for c in others if not c.misfit)]
    return found, [*(f"{c.name}: {text}" for c in found for text in c.settings), *left_out]


def _told_apart(candidates: Sequence[BenchmarkCandidate]) -> list[BenchmarkCandidate]:
    """Candidates of which no two have one name: two instances of a class, say."""
    names = [candidate.name for candidate in candidates]
    earlier = [names[:place].count(name) for place, name in enumerate(names)]
    return [replace(c, name=f"{c.name}_{n + 1}") if n else c for c, n in zip(candidates, earlier, strict=True)]


def _named(scenario: Scenario, sides: Sides, given: Any) -> BenchmarkCandidate:
    """An observer of the scenario, or one by the name of its model, or a class or an instance from a script."""
    if isinstance(given, str) and given in sides.observers:
        return _own(sides, given)
    try:
        name = ModelName.of(given)
    except ValueError as error:
        raise ScenarioError(f"{scenario.where}: {error}") from error
    if name.given is None and not names_code(name) and name not in fmu_observer.OBSERVERS:
        known = [*sides.observers, *(n for n in train_observers() if n not in sides.observers)]
        raise ScenarioError(f"{scenario.where}: unknown observer {name!r}; {nearest(name, known)}")
    if name.given is None:
        name = ModelName.of(move_file(name, lambda path: absolute(path, ".")))
    return _shipped(sides, name)


def _own(sides: Sides, name: str) -> BenchmarkCandidate:
    return BenchmarkCandidate(name, sides.table.components[name], sides.sources(name), "scenario")


def _shipped(sides: Sides, model: str) -> BenchmarkCandidate:
    """An observer with its own defaults and what the scenario says of the train."""
    said = settings_of(getattr(model, "given", None))  # what an instance says of the train stands
    table = ComponentTable.model_validate({"observer": model, **said})
    system = make_declared(table, model)
    name = model.rpartition(":")[2].replace(".", "_")
    parameters = {s.name for s in told_to(system)}
    untold = parameters - table.parameters.keys()
    facts = {fact: known for fact, known in known_facts(sides).items() if fact in untold}
    told = {fact: value for fact, (value, _) in facts.items()}
    table = table.model_copy(update={"parameters": {**table.parameters, **told}})
    template = sides.template()
    sources = {s.name: template[s.name] for s in system.inputs if s.name in template}
    unique = name if name not in sides.table.components else f"{name}_with_defaults"
    settings = (_assumed(system, facts),) if parameters & set(FACTS) else ()
    return BenchmarkCandidate(unique, table, sources, "defaults", settings, _misfit(sides, system, sources))


def _assumed(system: Any, facts: Mapping[str, tuple[float, str]]) -> str:
    given = ", ".join(f"{fact} = {value:g} ({why})" for fact, (value, why) in facts.items())
    units = {s.name: (s.start, s.unit) for s in told_to(system)}
    rest = ", ".join(
        f"{f} = {units[f][0]:g}" + (f" {units[f][1]}" if units[f][1] != "1" else "")
        for f in FACTS
        if f in units and f not in facts
    )
    return (
        f"not set in the scenario, gains at their defaults; told {given or 'nothing of the train'}; assumed "
        f"{rest or 'nothing'}."
    )


def _misfit(sides: Sides, system: Any, sources: Iterable[str]) -> str:
    """Why an observer cannot listen here, or an empty text."""
    triggered = getattr(system, "triggered_events", ())  # plain Python says with its `balise` what it takes
    payload = {s.name for event in triggered for s in event.payload}
    missing = [s.name for s in system.inputs if s.name not in sources and s.name not in payload | OPTIONAL]
    if missing:
        return f"nothing in this scenario gives its input{'s' if len(missing) > 1 else ''} {', '.join(missing)}"
    if BALISE_EVENT in [event.name for event in triggered] and sides.table.balises is None:
        return "it is corrected by balises, and this scenario has none"
    return ""
