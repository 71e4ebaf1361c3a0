"""What a scenario states, call by call: components, connections, tables, single values; each call is checked."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from copy import copy, deepcopy
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self, Unpack

from cosim.errors import CosimError, ScenarioError
from cosim.expectations.registry import shipped_expectations
from cosim.scenario.includes import Key, attribute
from cosim.scenario.network_table import NetworkTable
from cosim.scenario.override import (
    CASE,
    case_values,
    component_from_script,
    connection_from_script,
    override,
    value_from_script,
)
from cosim.scenario.scenario_tables import BalisesTable, ComponentTable, ConnectionTable, MasterTable, ReportTable
from cosim.scenario.schema import ScenarioTable, parse_scenario
from cosim.scenario.toml_values import plain
from cosim.simulation.checked_call import CallCheck, keywords_of

if TYPE_CHECKING:
    from cosim.simulation import keywords


@keywords_of(ScenarioTable)
class StatedScenario:
    """A scenario as it is stated, ready to be checked as a whole.

    What a call says is checked at the call: keys, types, ranges, models, parameters, and signals of components that
    are there by then. What a later call may still bring is left to the run: a component that is named and not there
    yet, an input without a source. A call that is refused changes nothing.

    Args:
        folder: folder that relative paths start from.
        where: file name for messages.
        tables: the keys of a scenario file.

    Raises:
        ScenarioError: a key is unknown, or a value cannot be.
    """

    def __init__(
        self, *, folder: str | Path = ".", where: str = "script", **tables: Unpack[keywords.ScenarioKeywords]
    ) -> None:
        self.folder, self.where = Path(folder), where
        stated = plain(tables)
        CallCheck(stated, self.folder, self.where).keys()
        self._data: dict[str, Any] = {"components": {}, "connections": [], **stated}
        self._places: dict[Key, str] = {}  # in which file a value stands, where one file includes others
        self._warnings: list[str] = []
        self._name: str | None = None  # where it is not that of the file
        self._files: object = None  # what keeps unpacked files alive
        self._from_file = False  # whether it was read, and so may be somebody else's

    def __setattr__(self, name: str, value: object) -> None:
        """Refuse what would have no effect, such as ``scenario.step = 0.1``.

        Args:
            name: of the attribute. value: what it becomes.

        Raises:
            AttributeError: the scenario has no such attribute.
        """
        if not (name.startswith("_") or name in ("folder", "where")):
            raise AttributeError(f"A scenario has no attribute {name!r} to be set; use scenario.set({name!r}, ...).")
        super().__setattr__(name, value)

    @keywords_of(ComponentTable)
    def add(self, name: str, **table: Unpack[keywords.ComponentKeywords]) -> Self:
        """Add a component.

        Args:
            name: of the component. table: its keys as in a file: `fmu`, `model` or `observer`, `parameters`, `preset`,
                `options`, ... `model` and `observer` take a name, ``file.py:Class``, a class, or an instance, of which
                each run has a copy; `fmu` and `recording` a path. What a file calls ``as`` is `backend` here.

        Raises:
            CosimError: there is a component of this name already, or something in it cannot be.
        """
        if name in self._data["components"]:
            raise ScenarioError(f"{self.where}: there is a component {name!r} already.")
        components = {**self._data["components"], name: component_from_script(table)}
        return self._changed({"components": components}, lambda check: check.component(name))

    @keywords_of(ConnectionTable, left_out=("source", "target"))
    def connect(self, *lines: str | Mapping[str, Any], **transformation: Unpack[keywords.ConnectionKeywords]) -> Self:
        """Add connections: ``"source.signal -> target.signal, target.signal"``.

        Args:
            lines: such as ``"train.speed -> observer.odometer"``; or tables as in a file.
            transformation: what becomes of the number on its way, in each of the lines.

        Raises:
            CosimError: a line is none, or a signal of a component that is there does not exist or does not fit.
        """
        before = self._data["connections"]
        items = [*before, *(entry for line in lines for entry in connection_from_script(line, transformation))]
        return self._changed({"connections": items}, lambda check: check.connections(len(before)))

    @keywords_of(BalisesTable)
    def balises(self, **table: Unpack[keywords.BalisesKeywords]) -> Self:
        """Set keys of the balise table.

        Raises:
            CosimError: the table with these keys in it cannot be.
        """
        return self._with_table("balises", table)

    @keywords_of(NetworkTable)
    def network(self, **table: Unpack[keywords.NetworkKeywords]) -> Self:
        """Set keys of the network table: ``nodes={"front": ["odometer.reading"]}, period=0.016, delay=0.05``.

        Raises:
            CosimError: the table with these keys in it cannot be.
        """
        return self._with_table("network", table)

    @keywords_of(MasterTable)
    def master(self, **table: Unpack[keywords.MasterKeywords]) -> Self:
        """Set keys of the master table.

        Raises:
            ScenarioError: the table with these keys in it cannot be.
        """
        return self._with_table("master", table)

    @keywords_of(ReportTable)
    def report(self, **table: Unpack[keywords.ReportKeywords]) -> Self:
        """Set keys of the report table.

        Raises:
            CosimError: the table with these keys in it cannot be.
        """
        return self._with_table("report", table)

    @keywords_of(*shipped_expectations().values(), left_out=("check",))
    def expect(self, check: keywords.CheckName | str, **table: Unpack[keywords.ExpectationKeywords]) -> Self:
        """Add an expectation that the run is held against, see `cosim.expectations`.

        Args:
            check: what is checked: ``speed_error``, ``signal``, ``on``, ``telegrams``, ...
            table: its keys as in a file, each of some kinds; ``start`` and ``end`` may stand for ``from``, which Python
                keeps for itself, and ``to``.

        Raises:
            CosimError: there is no such check, or it has no such key or value; or a signal of a component that is there
                does not exist.
        """
        items = [*self._data.get("expect", []), {"check": check, **plain(table)}]
        return self._changed({"expect": items}, lambda check: check.expectation())

    def set(self, name: str, value: Any) -> Self:
        """Override one value.

        That is ``component.parameter``, ``balises.key``, ``network.key``, ``master.key``, ``report.key``, a top-level
        key such as ``stop``, or ``case``: all that a case of the scenario sets.

        Args:
            name: of the value. value: what it becomes; paths are relative to the working folder.

        Raises:
            CosimError: there is no such component, table, key or parameter, or it cannot have this value.
        """
        data = dict(self._data)
        with self._named():
            keys = override(data, name, value_from_script(name, value))
        return self._changed(data, lambda check: None if keys == (CASE,) else check.setting(keys))

    def with_settings(self, settings: Mapping[str, Any]) -> Self:
        """A copy with many values set, which are checked together, by its run or its `table`.

        Args:
            settings: values by the names of `set`.

        Raises:
            ScenarioError: there is no such component, table or case.
        """
        scenario = self.copy()
        with self._named():
            for name, value in settings.items():
                override(scenario._data, name, value_from_script(name, value))
        return scenario

    def _with_table(self, name: str, keywords: Mapping[str, Any]) -> Self:
        """The scenario with keys of one of its tables set."""
        table = {**self._data.get(name, {}), **plain(keywords)}
        return self._changed({name: table}, lambda check: check.table(name))

    def _changed(self, keys: Mapping[str, Any], check: Callable[[CallCheck], None]) -> Self:
        """The scenario with other keys, once they are checked; where they cannot be it stays as it was."""
        data = {**self._data, **keys}
        with self._places_named():
            check(CallCheck(data, self.folder, self.where))
        self._data = data
        return self

    @contextmanager
    def _named(self) -> Iterator[None]:
        """Errors begin with the place of the scenario."""
        try:
            yield
        except ScenarioError as error:
            raise ScenarioError(f"{self.where}: {error}") from error

    @property
    def cases(self) -> dict[str, dict[str, Any]]:
        """What each case sets, by the names of `set`; ``set("case", name)`` chooses one.

        Raises:
            ScenarioError: a case is no table.
        """
        return {name: case_values(self._data, name) for name in self._data.get("cases") or {}}

    def copy(self) -> Self:
        """An independent copy."""
        scenario = copy(self)
        scenario._data, scenario._warnings = deepcopy(self._data), list(self._warnings)
        scenario._files = self._files  # which is left out for another process
        return scenario

    def table(self) -> ScenarioTable:
        """The validated scenario.

        Raises:
            ScenarioError: something in it cannot be; every fault is named.
        """
        with self._places_named():
            return parse_scenario(self._data, self.where, self.folder)

    @contextmanager
    def _places_named(self) -> Iterator[None]:
        """Errors name the file in which the fault stands, also where that is an included one."""
        try:
            yield
        except CosimError as error:
            error.args = (attribute(str(error), self.where, self._places), *error.args[1:])
            raise
