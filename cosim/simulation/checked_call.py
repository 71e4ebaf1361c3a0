"""What a call of a script says, checked at the call: by the declarations of the tables of scenario files, and against
the components that the scenario has by then. Reads descriptions; nothing is built, loaded or run.

What another call may still bring is left to the run: components that are not there yet, inputs without a source.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TypeVar

from cosim.components.component import Component
from cosim.components.loading import describe_fmu
from cosim.coupling.clocks import connect_clocks
from cosim.coupling.connection import Link, connect
from cosim.errors import CosimError, FmuLoadError, ScenarioError
from cosim.run.connections import parse_connections
from cosim.run.described_components import describe_component
from cosim.run.signal_roles import ODOMETER, ROLES, check_signal, roles_of_balises
from cosim.scenario.paths import COMPONENT_PATHS, MODEL_KEYS
from cosim.scenario.scenario_tables import ComponentTable
from cosim.scenario.schema import parse_part, step_count
from cosim.toml_table import TomlTable
from fmus.near_files import near_files

F = TypeVar("F", bound=Callable[..., Any])
COMPONENTS, CONNECTIONS, NETWORK, EXPECT = "components", "connections", "network", "expect"
_NAMING = ("signal", "reference", "bound")
"""Keys of expectations that name a signal."""
_ORIGINS = (*COMPONENT_PATHS, *MODEL_KEYS)


def keywords_of(*tables: type[TomlTable], left_out: Sequence[str] = ()) -> Callable[[F], F]:
    """Give a method with ``**keywords``, or a class whose constructor has them, the signature that names them, for
    completion and help.

    Args:
        tables: whose keys the keywords are. left_out: keys that the method takes in another way.
    """

    def named(method: F) -> F:
        if isinstance(method, type):
            method.__doc__ = f"{method.__doc__}\n\n{named(method.__init__).__doc__}"  # type: ignore[misc]
            return method
        signature = inspect.signature(method)
        own = [p for p in signature.parameters.values() if p.kind is not p.VAR_KEYWORD]
        keys = {name: p for table in tables for name, p in _keys(table) if name not in left_out}
        if len(tables) > 1:  # which keys are needed depends on the table that is meant
            keys = {name: p.replace(default=None if p.default is p.empty else p.default) for name, p in keys.items()}
        method.__signature__ = signature.replace(parameters=[*own, *keys.values()])  # type: ignore[attr-defined]
        listed = ", ".join(f"``{name}``" for name in keys)
        method.__doc__ = f"{inspect.cleandoc(method.__doc__ or '')}\n\nKeywords: {listed}."
        return method

    return named


def _keys(table: type[TomlTable]) -> Iterator[tuple[str, inspect.Parameter]]:
    """The keys of a table by the names that a script gives them: what a file calls ``from`` is another word there."""
    shown = table.__signature__.parameters
    for name, field in table.model_fields.items():
        yield name, (shown.get(name) or shown[str(field.alias)]).replace(name=name)


class CallCheck:
    """A scenario as far as it is stated, against which calls are checked.

    Args:
        data: the keys of the scenario, with what the call says in them. folder: start of relative paths.
        where: place for messages.
    """

    def __init__(self, data: Mapping[str, Any], folder: Path, where: str) -> None:
        self.data, self.folder, self.where = data, folder, where

    def keys(self) -> None:
        """All keys by themselves, and the times where all are there.

        Raises:
            ScenarioError: an unknown key, a wrong type, a value out of range, or a step that does not fit.
        """
        part = self._parsed(tuple(self.data), ())
        if {"stop", "step"} <= set(self.data):
            try:
                step_count(getattr(part, "start", 0.0), part.stop, part.step)
            except ValueError as error:
                raise ScenarioError(f"{self.where}: {error}") from error

    def component(self, name: str) -> None:
        """A component: its keys, its file or model, preset, options and parameters.

        Args:
            name: of the component.

        Raises:
            CosimError: something in it cannot be.
        """
        self._describe(name, self._component_table(name, self.data[COMPONENTS][name]))

    def connections(self, before: int) -> None:
        """Connections, as far as the components at both their ends are there.

        Args:
            before: how many items stood before the call.

        Raises:
            CosimError: no line ``source.signal -> target.signal``, an unknown signal, units that do not fit, or two
            sources for one input.
        """
        items = self._parsed((CONNECTIONS,), ()).connections
        links = parse_connections(items, self.where)
        earlier = len(parse_connections(items[:before], self.where))
        known = self._known(name.partition(".")[0] for link in links[earlier:] for name in link[:2])
        for number, link in enumerate(links[earlier:], start=earlier):
            shared = [other for other in links[:number] if other[1] == link[1]]
            self._link(link, shared, known)

    def table(self, name: str, at: tuple[str, ...] = ()) -> None:
        """One of the tables of the scenario, and the signals that it names.

        Args:
            name: of the table, such as ``balises``. at: path of keys, where only that is checked.

        Raises:
            CosimError: something in it cannot be.
        """
        try:
            part = self._parsed((name,), at)
        except ScenarioError as error:
            if at or not _is_of_a_part(str(error), f"{self.where}: {name}"):
                raise
            together = f"the first call of {name}() states all that belongs together, later ones add to it"
            raise ScenarioError(f"{error}; {together}") from error
        named = [] if part is None else list(_named_signals(part))
        for place, signal, unit in named:
            if place.split(".")[: len(at)] == list(at):
                self._signal(signal, unit, place)

    def expectation(self) -> None:
        """The last of the expectations, and the signals that it names.

        Raises:
            CosimError: something in it cannot be.
        """
        number = len(self.data[EXPECT])
        expected = self._parsed((EXPECT,), (EXPECT, number - 1)).expect[-1]
        named = [(key, name) for key in _NAMING if isinstance(name := getattr(expected, key, None), str)]
        for key, name in named:
            self._signal(name, None, f"expect, number {number}, {expected.check!r}, {key}")

    def setting(self, keys: tuple[str, ...]) -> None:
        """One value that was set; what does not fit it elsewhere may still be set too.

        Args:
            keys: path to the value.

        Raises:
            CosimError: it cannot be, whatever else is set.
        """
        if keys[0] != COMPONENTS or len(keys) < 3:
            self.table(keys[0], keys)
            return
        name, key = keys[1:3]
        part = self._parsed((COMPONENTS,), keys)
        if key in _ORIGINS:  # preset and parameters may still be those of the model before
            self._describe(name, self._component_table(name, {key: self.data[COMPONENTS][name][key]}))
        elif key == "parameters" and part is not None:
            self._describe(name, part.components[name])

    def _signal(self, name: str, unit: str | None, place: str) -> None:
        """A signal that a table names: it is there, and of the unit, where its component is there by now."""
        if "." not in name:
            raise ScenarioError(f"{self.where}: {place}: expected 'component.signal' (got {name!r}).")
        known = self._known(iter([name.partition(".")[0]]))
        if known:
            with self._named(place):
                check_signal(name, unit, known, place)

    def _parsed(self, names: Sequence[str], at: tuple[str | int, ...]) -> Any:
        return parse_part({name: self.data[name] for name in names}, self.where, self.folder, at)

    def _component_table(self, name: str, table: Mapping[str, Any]) -> ComponentTable:
        parsed = parse_part({COMPONENTS: {name: table}}, self.where, self.folder)
        found: ComponentTable = parsed.components[name]
        return found

    def _describe(self, name: str, table: ComponentTable) -> Component | None:
        """The component; None where what it is only shows in a run."""
        place = f"{COMPONENTS}.{name}"
        with self._named(place):
            path = (self.folder / (table.fmu or table.recording or ".")).resolve()
            if not path.exists():
                error, endings = (FmuLoadError, (".fmu",)) if table.fmu is not None else (ScenarioError, ())
                raise error(f"there is no {path}; {near_files(path, *endings)}")
            if table.recording is not None:
                return None
            if table.filter is not None:
                describe_fmu(path, name)
                return None
            return describe_component(name, table, self.folder, f"{self.where}: {place}")

    def _known(self, names: Iterator[str]) -> dict[str, Component]:
        """Those of the components that are there and can be described."""
        tables = self.data.get(COMPONENTS, {})
        stated = [name for name in dict.fromkeys(names) if name in tables]
        found = {name: self._describe(name, self._component_table(name, tables[name])) for name in stated}
        return {name: component for name, component in found.items() if component is not None}

    def _link(self, link: Link, shared: Sequence[Link], known: Mapping[str, Component]) -> None:
        """A connection; that to the payload of an event is whole with the event's count, perhaps by a later call."""
        ends = [name.partition(".")[::2] for name in link[:2]]
        with self._named(f"{link[0]} -> {link[1]}"):
            found = [known[name].elements(signal)[0].variable for name, signal in ends if name in known]
            if len(found) < len(ends) or NETWORK in self.data:
                return
            if found[1].valueReference not in known[ends[1][0]].event_references():
                within = [other for other in shared if other[0].partition(".")[0] in known]
                connect(connect_clocks([*within, link], known)[1], known)

    @contextmanager
    def _named(self, place: str) -> Iterator[None]:
        """Errors begin with the place in the scenario."""
        try:
            yield
        except CosimError as error:
            text = str(error)
            if not text.startswith(self.where):
                text = f"{self.where}: {text}" if place in text else f"{self.where}: {place}: {text}"
            raise type(error)(text) from error


def _is_of_a_part(text: str, place: str) -> bool:
    """Whether what is wrong is that a table is not whole: in one line, a key of it is missing, or it is refused as a
    whole.
    """
    return "\n" not in text and (text.startswith(f"{place}: ") or text.endswith(": is missing"))


def _named_signals(part: Any) -> Iterator[tuple[str, str, str | None]]:
    """Place, name and unit of the signals that tables name; None for any unit."""
    balises, report, network = (getattr(part, name, None) for name in ("balises", "report", NETWORK))
    for role, name in roles_of_balises(balises).items():
        yield f"balises.{role.removeprefix('true_')}", name, ROLES[role] if role != ODOMETER else None
    for role, unit in ROLES.items() if report is not None else ():
        if getattr(report, role) is not None:
            yield f"report.{role}", getattr(report, role), unit
    for node, signals in network.nodes.items() if network is not None else ():
        for name in signals:
            yield f"network.nodes.{node}", name, None
