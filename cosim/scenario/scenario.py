"""A scenario: components, connections, balises and a report, from a file or built by a script, ready to run."""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Mapping
from copy import deepcopy
from importlib.resources import files
from pathlib import Path
from typing import Any, Self

from cosim.errors import ScenarioError, nearest
from cosim.scenario.outcome import Outcome
from cosim.scenario.run import run_scenario
from cosim.scenario.schema import ComponentTable, ScenarioTable, parse_scenario

SHIPPED = files("cosim") / "scenarios"
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

    @classmethod
    def load(cls, name_or_path: str | Path) -> Scenario:
        """A shipped scenario by name, or one from a TOML file; paths in it are relative to the file.

        Raises:
            ScenarioError: there is no such scenario, or it is not TOML.
        """
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

    @property
    def name(self) -> str:
        """Name of the file without its ending, or ``script``."""
        return Path(self.where).stem

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

    def report(self, **table: Any) -> Self:
        """Set keys of the report table."""
        self._data["report"] = {**self._data.get("report", {}), **table}
        return self

    def set(self, name: str, value: Any) -> Self:
        """Override one value: ``component.parameter``, ``balises.key``, ``report.key`` or a top-level key such as ``stop``.

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
        elif head in ("balises", "report"):
            self._data.setdefault(head, {})[rest] = value
        else:
            known = [*components, "balises", "report"]
            raise ScenarioError(f"{self.where}: cannot set {name!r}: no component {head!r}; {nearest(head, known)}")
        return self

    def copy(self) -> Scenario:
        """An independent copy."""
        return Scenario(folder=self.folder, where=self.where, **self._data)

    def table(self) -> ScenarioTable:
        """The validated scenario.

        Raises:
            ScenarioError: something in it cannot be; every fault is named.
        """
        return parse_scenario(self._data, self.where)

    def run(
        self, progress: Callable[[float, float], None] | None = None, overrides: Mapping[str, Any] | None = None,
        warn: Callable[[str], None] | None = None,
    ) -> Outcome:  # fmt: skip
        """Run it.

        Args:
            progress: called with the time reached and the end [s].
            overrides: as for `set`, for this run only.
            warn: told of everything doubtful as soon as it is known, before the run where it can be; by default the log
                ``cosim``, which Python shows on the error stream. All warnings are in the outcome as well.

        Returns:
            The outcome: result, report roles, warnings; also for a run that failed on the way (see `Outcome.failure`).

        Raises:
            CosimError: the scenario cannot be set up.
        """
        scenario = self.copy()
        for name, value in (overrides or {}).items():
            scenario.set(name, value)
        return run_scenario(scenario.table(), scenario.name, self.folder, self.where, progress, warn)


def shipped_scenarios() -> list[str]:
    """Names of the scenarios that come with the package."""
    return sorted(Path(str(entry)).stem for entry in SHIPPED.iterdir() if str(entry).endswith(".toml"))
