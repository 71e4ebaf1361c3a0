"""A scenario in two halves: the plant side, to be recorded once, and observers beside the recording. Runs nothing.

Plant side is every component that is no observer, what observers listen to, and whatever acts on those: an observer in
the loop belongs to it too.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import fmu_observer
from cosim.coupling.connection import Link
from cosim.errors import ScenarioError
from cosim.run.balise_service import BALISE_EVENT
from cosim.run.component_models import make_declared
from cosim.run.connections import parse_connections, recorded_link
from cosim.run.described_components import describe_component
from cosim.run.signal_roles import ROLES, roles_of_balises
from cosim.scenario.scenario_tables import ComponentTable
from cosim.scenario.schema import ScenarioTable
from cosim.simulation.scenario import Scenario
from cosim.starter.inspected_fmu import inspect_fmu
from cosim.starter.starter_roles import plant_roles
from fmu_observer.observers.gated_observer import GatedObserver

_ESTIMATES, _EFFORT = ("position", "speed"), "effort"
_PLAYED_MASTER = ("algorithm", "inputs", "events", "stepper", "record_memory")
"""Keys of the master table that matter to an observer that only listens: when its inputs reach it, and how."""


@dataclass(frozen=True)
class Listener:
    """An observer beside a recording.

    Args:
        name: of it; not that of a component of the plant side it listens to. table: how it is made.
        sources: where its inputs come from.
    """

    name: str
    table: ComponentTable
    sources: Mapping[str, Link]


@dataclass(frozen=True)
class ScenarioParts:
    """What is what in a scenario.

    Args:
        table: the scenario.
        observers: names of those that estimate position or speed of the train. plant: names of the plant side.
        links: all connections. folder: start of relative paths.
        effort: where the effort comes from of a train that calls it otherwise; None for none.
    """

    table: ScenarioTable
    observers: tuple[str, ...]
    plant: tuple[str, ...]
    links: tuple[Link, ...]
    folder: Path
    effort: str | None = None

    @property
    def in_loop(self) -> tuple[str, ...]:
        """Observers that something on the plant side, or another observer, listens to."""
        return tuple(name for name in self.observers if name in self.plant)

    @property
    def acting(self) -> tuple[str, ...]:
        """Observers that act on the train; all that are listened to where nobody says which component the train is."""
        if not self.train:
            return self.in_loop
        before = _ancestors([self.train], self.links, self.table.components)
        return tuple(name for name in self.in_loop if name in before)

    @property
    def train(self) -> str:
        """The component that is the train, as far as balises or the report name it; else an empty text."""
        balises, report = self.table.balises, self.table.report
        position = (None if balises is None else balises.position) or report.true_position or report.true_speed or ""
        train = position.partition(".")[0]
        return train if train in self.table.components else ""

    @property
    def odometer(self) -> str | None:
        """The odometer that the scenario declares, as ``component.signal``; None where it declares none."""
        balises = self.table.balises
        return self.table.report.odometer or (None if balises is None else balises.odometer)

    def sources(self, name: str) -> dict[str, Link]:
        """Where the inputs of a component come from.

        Args:
            name: of the component.
        """
        return {target.partition(".")[2]: link for link in self.links if (target := link[1]).partition(".")[0] == name}

    @cached_property
    def template(self) -> Mapping[str, Link]:
        """Where an input of this name comes from: the odometer is the declared one, all else comes as for the observers
        of the scenario, else as for the plant side.
        """
        found: dict[str, Link] = {}
        if self.odometer is not None and self.odometer.partition(".")[0] in self.plant:
            wired = (link for link in self.links if link[0] == self.odometer and link[1].endswith(".odometer"))
            found["odometer"] = next(wired, (self.odometer, "odometer"))
        for name in (*self.observers, *self.plant):
            for signal, link in self.sources(name).items():
                if link[0].partition(".")[0] in self.plant:
                    found.setdefault(signal, link)
        if self.effort is not None:
            found.setdefault(_EFFORT, (self.effort, _EFFORT))
        return found


def find_parts(scenario: Scenario) -> ScenarioParts:
    """Separate the plant side of a scenario from its observers.

    Args:
        scenario: the scenario.

    Raises:
        CosimError: a component cannot be made, or a connection cannot be read.
    """
    table = scenario.table()
    links = tuple(parse_connections(table.connections, scenario.where))
    plant = None if table.balises is None else (table.balises.position or "").partition(".")[0]
    observers = tuple(name for name in table.components if name != plant and _is_observer(scenario, table, name))
    roots = [n for n, t in table.components.items() if n not in observers and t.observer is None]
    roots += [link[0].partition(".")[0] for link in links if link[1].partition(".")[0] in observers]
    parts = ScenarioParts(table, observers, _ancestors(roots, links, table.components), links, scenario.folder)
    return replace(parts, effort=_effort_of_fmu(scenario, parts))


def _effort_of_fmu(scenario: Scenario, parts: ScenarioParts) -> str | None:
    """What drives the train's FMU, or its output that reports the effort, as far as their names say so."""
    train = parts.table.components[parts.train] if parts.train else None
    if train is None or train.fmu is None:
        return None
    roles = plant_roles(inspect_fmu((scenario.folder / train.fmu).resolve(), train.units))
    if roles.effort is not None:
        link = parts.sources(parts.train).get(roles.effort.signal.name)
        return None if link is None else link[0]
    return None if roles.applied is None else f"{parts.train}.{roles.applied.signal.name}"


def _is_observer(scenario: Scenario, table: ScenarioTable, name: str) -> bool:
    """Named as one in the report, or an estimator of position or speed: shipped, or an FMU that receives balises."""
    component, where = table.components[name], f"{scenario.where}: components.{name}"
    if name in (table.report.observers or []):
        return True
    if component.observer is not None:
        return any(signal.name in _ESTIMATES for signal in make_declared(component, where).outputs)
    if component.fmu is None:
        return False
    described = describe_component(name, component, scenario.folder, where)
    return BALISE_EVENT in described.events and any(n in described.names("output") for n in _ESTIMATES)


def _ancestors(roots: Iterable[str], links: Iterable[Link], components: Iterable[str]) -> tuple[str, ...]:
    """These components and all that act on them, in the order of the scenario."""
    before: dict[str, set[str]] = {}
    for link in links:
        before.setdefault(link[1].partition(".")[0], set()).add(link[0].partition(".")[0])
    found, open_ = set(roots), list(roots)
    while open_:
        new = before.get(open_.pop(), set()) - found
        found |= new
        open_ += new
    return tuple(name for name in components if name in found)


# -- the two halves ---------------------------------------------------------------------------------------------------


def recording_scenario(scenario: Scenario, parts: ScenarioParts) -> Scenario:
    """The plant side alone, everything recorded that an observer listens to.

    Args:
        scenario: the scenario.
        parts: the plant side and the observers, from `find_parts`.
    """
    data = _table(parts.table)
    signals = _listened_to(parts)
    data["components"] = {name: _recorded(data["components"][name], signals.get(name, set())) for name in parts.plant}
    kept = [link for link in parts.links if {link[0].partition(".")[0], link[1].partition(".")[0]} <= set(parts.plant)]
    data["connections"] = [connection(link, link[1]) for link in kept]
    data["master"] = data.get("master", {}) | {"record_every": 1}
    data |= {"certificates": "ignore", "expect": []}
    if parts.table.balises is not None and parts.table.balises.receivers is not None:
        data["balises"]["receivers"] = [name for name in parts.table.balises.receivers if name in parts.plant]
    if parts.table.network is not None and parts.table.network.receivers is not None:
        data["network"]["receivers"] = [name for name in parts.table.network.receivers if name in parts.plant]
    data["report"] = _roles(parts.table, parts.in_loop)
    return _scenario(scenario, data)


def playback_scenario(
    scenario: Scenario,
    parts: ScenarioParts,
    folder: Path,
    listeners: Sequence[Listener],
    disturb: Callable[[dict[str, Any]], dict[str, Any]] = dict,
) -> Scenario:
    """Observers beside the recording.

    Args:
        scenario: that was recorded. parts: of it. folder: with the results of the plant side.
        listeners: the observers; none has the name of a component that another one needs, see `needed_components`.
        disturb: changes the tables of the scenario.

    Raises:
        ScenarioError: an observer listens to itself.
    """
    table, names = parts.table, [listener.name for listener in listeners]
    balises, network = table.balises, _network_of(parts, names)
    data: dict[str, Any] = {
        "title": ": ".join([table.title, *(one.table.label or one.name for one in listeners if len(names) == 1)]),
        **{key: getattr(table, key) for key in ("start", "stop", "step", "seed")},
        "certificates": "ignore",
        "components": _recordings(parts, folder, listeners) | {one.name: _table(one.table) for one in listeners},
        "connections": [
            connection(recorded_link(link, table, parts.folder), f"{one.name}.{signal}")
            for one in listeners
            for signal, link in one.sources.items()
        ],
        "master": _played_master(table),
        "report": _roles(table, names),
    }
    if balises is not None:
        watched = {key: value for key in _ESTIMATES if (value := getattr(balises, key)) is not None}
        data["balises"] = watched | {"timing": balises.timing, "layout": "recorded", "file": str(folder.resolve())}
        if balises.receivers is not None:
            data["balises"]["receivers"] = [
                one.name for one in listeners if _is_notified(one, table, balises.receivers)
            ]
    data |= {"network": network} if network else {}
    return _scenario(scenario, disturb(data))


def _is_notified(listener: Listener, table: ScenarioTable, receivers: Sequence[str]) -> bool:
    """Whether balises reach an observer where receivers are named: one of them, or one that is put beside them."""
    if listener.name in table.components:
        return listener.name in receivers
    system = make_declared(listener.table, listener.name)
    return BALISE_EVENT in [event.name for event in getattr(system, "triggered_events", ())]


def needed_components(parts: ScenarioParts, listener: Listener) -> list[str]:
    """Names of the recorded components that an observer needs beside it.

    Args:
        parts: of the scenario. listener: the observer.

    Raises:
        ScenarioError: it listens to itself.
    """
    table = parts.table
    used = [link[0] for link in listener.sources.values()]
    used += [value for value in _roles(table, [listener.name]).values() if isinstance(value, str)]
    used += [v for key in _ESTIMATES if table.balises is not None and (v := getattr(table.balises, key)) is not None]
    used += [name for names in _network_of(parts, [listener.name]).get("nodes", {}).values() for name in names]
    wanted = list(dict.fromkeys(signal.partition(".")[0] for signal in used))
    if listener.name in wanted and listener.name in parts.in_loop:
        raise ScenarioError(f"{listener.name}: listens to itself; a recording cannot take its place.")
    return [name for name in wanted if name != listener.name]


def is_over_network(parts: ScenarioParts, name: str) -> bool:
    """Whether measurements reach an observer over the network of the scenario.

    Args:
        parts: of the scenario. name: of the observer.
    """
    network = parts.table.network
    return network is not None and (network.receivers is None or name in network.receivers)


def _network_of(parts: ScenarioParts, names: Iterable[str]) -> dict[str, Any]:
    """The network table for these observers; empty where it reaches none of them."""
    reached = [name for name in names if is_over_network(parts, name)]
    return {**_table(parts.table.network), "receivers": reached} if reached else {}


def _recordings(parts: ScenarioParts, folder: Path, listeners: Iterable[Listener]) -> dict[str, Any]:
    """A recording in place of each component whose signals are used."""
    wanted = [name for listener in listeners for name in needed_components(parts, listener)]
    return {name: {"recording": str(folder.resolve()), "component": name} for name in wanted}


def _played_master(table: ScenarioTable) -> dict[str, Any]:
    master = {key: value for key, value in _table(table.master).items() if key in _PLAYED_MASTER}
    if master.get("algorithm") == "iterate":
        del master["algorithm"]  # there is no loop any more
    return master


def connection(link: Link, target: str) -> str | dict[str, Any]:
    """A connection as it stands in a scenario, to this target.

    Args:
        link: where the value comes from, and how it is converted.
        target: as ``component.signal``.
    """
    if len(link) == 2:
        return f"{link[0]} -> {target}"
    stated = link[2]
    return {
        "from": link[0],
        "to": target,
        "factor": stated.factor,
        "offset": stated.offset,
        "units": "convert" if stated.convert_units else "ignore",
        "values": [list(pair) for pair in stated.table],
    }


def _listened_to(parts: ScenarioParts) -> dict[str, set[str]]:
    """Signals that observers listen to, by component."""
    signals: dict[str, set[str]] = {}
    for link in parts.links:
        source, _, signal = link[0].partition(".")
        if link[1].partition(".")[0] in parts.observers:
            signals.setdefault(source, set()).add(signal)
    return signals


def _recorded(component: dict[str, Any], signals: set[str]) -> dict[str, Any]:
    record = component.get("record", [])
    return component | {"record": [*record, *sorted(signals - set(record))]}


def _roles(table: ScenarioTable, observers: Iterable[str]) -> dict[str, Any]:
    """The report table for these observers, without what it says of others."""
    kept = {*ROLES, "phases", "zones", "evaluate_after"}
    stated = {key: value for key, value in _table(table.report).items() if key in kept}
    stated = {key: value for key, value in stated.items() if key not in ROLES or value is not None}
    stated = roles_of_balises(table.balises) | stated
    return stated | {"observers": list(observers)}


def _scenario(scenario: Scenario, data: dict[str, Any]) -> Scenario:
    return Scenario(folder=scenario.folder, where=scenario.where, **data)


def _table(table: Any) -> dict[str, Any]:
    data: dict[str, Any] = table.model_dump(by_alias=True, exclude_unset=True)
    return data


# -- observers --------------------------------------------------------------------------------------------------------


def train_observers() -> dict[str, type[GatedObserver]]:
    """The shipped train observers by name: they receive balises and say position and speed."""
    return {
        n: kind
        for n, kind in fmu_observer.OBSERVERS.usable().items()
        if isinstance(kind, type)
        and issubclass(kind, GatedObserver)
        and {signal.name for signal in kind.outputs}.issuperset(_ESTIMATES)
    }
