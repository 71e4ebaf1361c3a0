"""A scenario: components, connections, balises and a report, from a file or built by a script, ready to run."""

from __future__ import annotations

import logging
import tomllib
from collections.abc import Callable, Mapping
from copy import deepcopy
from importlib.resources import files
from pathlib import Path
from typing import Any, Self

from cosim.diagnostics.structure import Structure
from cosim.errors import ScenarioError, nearest
from cosim.scenario.outcome import Outcome
from cosim.scenario.run import run_scenario
from cosim.scenario.schema import ComponentTable, ScenarioTable, parse_scenario
from cosim.ssp.names import is_package, stem

LOG = logging.getLogger("cosim")
SHIPPED = files("cosim") / "scenarios"
TABLES = ("balises", "master", "report")
COMPONENT_KEYS = {field.alias or name for name, field in ComponentTable.model_fields.items()}


class Scenario:
    """A coupled system to be run, with the balises it passes and the roles of its signals.

    Built from a file, ``Scenario.load("freight_profile_d")`` or ``Scenario.load("my.toml")``, or step by step::

        s = Scenario(stop=60.0, step=0.01)
        s.add("plant", fmu="vendor.fmu", parameters={"mass": 80e3})
        s.add("observer", observer="takagi_sugeno_cdo")
        s.connect("plant.speed -> observer.odometer")
        s.balises(position="plant.position", speed="plant.speed", layout="spacing", spacing=500.0, track_end=3000.0)
        outcome = s.run()

    Args:
        folder: folder that relative paths start from.
        where: file name for messages.
        tables: the keys of a scenario file.
    """

    def __init__(self, *, folder: str | Path = ".", where: str = "script", **tables: Any) -> None:
        self.folder, self.where = Path(folder), where
        self._data: dict[str, Any] = {"components": {}, "connections": [], **deepcopy(tables)}
        self._doubts: list[str] = []
        self._files: object = None  # what keeps unpacked files alive

    @classmethod
    def load(cls, name_or_path: str | Path) -> Scenario:
        """A shipped scenario by name, or one from a TOML file (paths in it are relative to the file) or from an SSP.

        Args:
            name_or_path: ``freight_profile_d``, ``my.toml``, ``system.ssp``, or ``system.ssp#Variant`` for a structure in it.

        Raises:
            ScenarioError: there is no such scenario, or it is not TOML, or not SSP.
        """
        if is_package(name_or_path):
            return cls._from_package(str(name_or_path))
        path = Path(name_or_path)
        if path.suffix != ".toml" and not path.is_file():
            shipped = Path(str(SHIPPED)) / f"{name_or_path}.toml"
            if not shipped.is_file():
                raise ScenarioError(f"No scenario {str(name_or_path)!r}; {nearest(str(name_or_path), shipped_scenarios())}")
            path = shipped
        if not path.is_file():
            raise ScenarioError(f"Scenario file {path} does not exist.")
        try:
            data = tomllib.loads(path.read_text(encoding="utf-8"))
        except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
            raise ScenarioError(f"{path}: not readable as TOML: {error}") from error
        scenario = cls(folder=path.parent, where=str(path))
        scenario._data = {"components": {}, "connections": [], **data}
        return scenario

    @classmethod
    def _from_package(cls, name: str) -> Scenario:
        from cosim.ssp.load import load_package  # noqa: PLC0415 - lxml only for those who read such files

        loaded = load_package(name)
        scenario = cls(where=name, **loaded.tables)
        scenario._doubts, scenario._files = loaded.doubts, loaded.unpacked
        return scenario

    def export_ssp(self, path: str | Path, version: str = "2.0") -> Path:
        """Write the scenario as a system structure package: FMUs, connections and parameters, as other tools read them.

        Args:
            path: of the file, ending in ``.ssp``. version: of SSP, ``1.0`` or ``2.0``.

        Returns:
            The path.

        Raises:
            CosimError: the scenario cannot be set up, or has something that this version cannot say.
            OutputError: the file cannot be written.
        """
        from cosim.ssp.export import export_package  # noqa: PLC0415 - lxml only for those who write such files

        return export_package(self.table(), self.name, self.folder, self.where, Path(path), version)

    @property
    def name(self) -> str:
        """Name of the file without its ending, or ``script``."""
        return stem(self.where)

    def add(self, name: str, **table: Any) -> Self:
        """Add a component; keys as in a file: `fmu`, `model` or `observer`, `parameters`, `preset`, `options`, ..."""
        if name in self._data["components"]:
            raise ScenarioError(f"{self.where}: there is a component {name!r} already.")
        self._data["components"][name] = table
        return self

    def connect(self, *lines: str) -> Self:
        """Add connections: ``"source.signal -> target.signal, target.signal"``."""
        self._data["connections"] = [*self._data["connections"], *lines]
        return self

    def balises(self, **table: Any) -> Self:
        """Set keys of the balise table."""
        self._data["balises"] = {**self._data.get("balises", {}), **table}
        return self

    def master(self, **table: Any) -> Self:
        """Set keys of the master table."""
        self._data["master"] = {**self._data.get("master", {}), **table}
        return self

    def report(self, **table: Any) -> Self:
        """Set keys of the report table."""
        self._data["report"] = {**self._data.get("report", {}), **table}
        return self

    def set(self, name: str, value: Any) -> Self:
        """Override one value.

        That is ``component.parameter``, ``balises.key``, ``master.key``, ``report.key`` or a top-level key such as ``stop``.

        Raises:
            ScenarioError: there is no such component or table.
        """
        head, dot, rest = name.partition(".")
        components = self._data["components"]
        if not dot:
            self._data[name] = value
        elif head in components:
            table = components[head]
            if rest == "fmu":
                table[rest] = str(Path(str(value)).resolve())  # given here, so relative to where the user stands
            elif rest in COMPONENT_KEYS:
                table[rest] = value
            elif rest.startswith("options."):
                table.setdefault("options", {})[rest.removeprefix("options.")] = value
            else:
                table.setdefault("parameters", {})[rest] = value
        elif head in TABLES:
            self._data.setdefault(head, {})[rest] = value
        else:
            known = [*components, *TABLES]
            raise ScenarioError(f"{self.where}: cannot set {name!r}: no component {head!r}; {nearest(head, known)}")
        return self

    def copy(self) -> Scenario:
        """An independent copy."""
        scenario = Scenario(folder=self.folder, where=self.where, **self._data)
        scenario._doubts, scenario._files = list(self._doubts), self._files
        return scenario

    def table(self) -> ScenarioTable:
        """The validated scenario.

        Raises:
            ScenarioError: something in it cannot be; every fault is named.
        """
        return parse_scenario(self._data, self.where)

    def run(
        self, progress: Callable[[float, float], None] | None = None, overrides: Mapping[str, Any] | None = None,
        warn: Callable[[str], None] | None = None, call_log: str | Path | None = None,
        building: Callable[[str], None] | None = None,
    ) -> Outcome:  # fmt: skip
        """Run it.

        Args:
            progress: called with the time reached and the end [s].
            overrides: as for `set`, for this run only.
            warn: told of everything doubtful as soon as it is known, before the run where it can be; by default the log
                ``cosim``, which Python shows on the error stream. All warnings are in the outcome as well.
            call_log: a file to log every call of every component to, as `master.log_calls` asks for.
            building: told of the FMUs of shipped models that are built for the first time, some seconds each; by default the
                log ``cosim``, as information.

        Returns:
            The outcome: result, report roles, warnings; also for a run that failed on the way (see `Outcome.failure`).

        Raises:
            CosimError: the scenario cannot be set up.
        """
        scenario = self.copy()
        for name, value in (overrides or {}).items():
            scenario.set(name, value)
        if call_log is not None:
            scenario.master(log_calls=True)
        table = scenario.table()
        log = None if call_log is None else Path(call_log)
        for doubt in self._doubts:
            (warn or LOG.warning)(doubt)
        outcome = run_scenario(table, scenario.name, self.folder, self.where, progress, warn, log, building)
        return outcome.with_summary(warnings=[*self._doubts, *outcome.warnings]) if self._doubts else outcome

    def structure(self) -> Structure:
        """How the components hang together: order, groups, loops, what is held over a step. Nothing is run or built.

        Returns:
            The structure, with `text` and `draw`.

        Raises:
            CosimError: the scenario cannot be set up.
        """
        from cosim.scenario.structure import scenario_structure  # noqa: PLC0415 - scipy's graphs only for those who ask

        return scenario_structure(self.table(), self.name, self.folder, self.where)


def shipped_scenarios() -> list[str]:
    """Names of the scenarios that come with the package."""
    return sorted(Path(str(entry)).stem for entry in SHIPPED.iterdir() if str(entry).endswith(".toml"))
