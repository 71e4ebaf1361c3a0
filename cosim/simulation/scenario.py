"""A scenario: components, connections, balises and a report, from a file or built by a script, ready to run."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from copy import deepcopy
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

from cosim import ssp, studies
from cosim.errors import CosimError, ScenarioError
from cosim.run.outcome import Outcome
from cosim.run.results_manifest import read_manifest
from cosim.run.scenario_run import run_scenario
from cosim.run.scenario_structure import scenario_structure
from cosim.run.streaming import ending, where_to
from cosim.run.task import RunTask
from cosim.scenario.fmu_alone import FmuAlone, tables_of_fmu
from cosim.scenario.includes import Key, attribute, find_file, read_tables
from cosim.scenario.origin import Origin
from cosim.scenario.override import case_values, component_from_script, override, value_from_script
from cosim.scenario.package_names import is_package, stem
from cosim.scenario.saving import save_scenario, scenario_text
from cosim.scenario.schema import ScenarioTable, parse_scenario
from cosim.scenario.shipped import shipped_scenarios
from cosim.scenario.toml_values import plain
from cosim.structure.run_structure import Structure

if TYPE_CHECKING:
    from cosim.components.recording_data import Interpolation
    from cosim.studies.sampling_plans import Mode, Range
    from cosim.studies.sweep import Sweep

LOG = logging.getLogger("cosim")

__all__ = ["Scenario", "shipped_scenarios"]


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
        self._places: dict[Key, str] = {}  # in which file a value stands, where one file includes others
        self._warnings: list[str] = []
        self._name: str | None = None  # where it is not that of the file
        self._files: object = None  # what keeps unpacked files alive

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

    @classmethod
    def load(cls, name_or_path: str | Path, *, strict: bool = False) -> Scenario:
        """A shipped scenario by name, or one from a TOML file (paths in it are relative to the file) or from an SSP.

        A file is merged with those it names under ``include``; its ``[overrides]`` are applied last.

        Args:
            name_or_path: ``freight_profile_d``, ``my.toml``, ``system.ssp``, or ``system.ssp#Variant`` for a structure
                in it; or a results folder, for the scenario that it was made from.
            strict: whether an SSP whose form is not as the standard wants it is refused; else the run warns of it.

        Raises:
            ScenarioError: there is no such scenario, or it is not TOML, or not SSP.
            ProvenanceError: the results folder does not say what it was made from.
        """
        if is_package(name_or_path):
            return cls._from_package(str(name_or_path), strict)
        stored = None
        if Path(name_or_path).is_dir() and str(name_or_path) not in shipped_scenarios():
            stored = read_manifest(name_or_path)
        path = find_file(name_or_path) if stored is None else stored.scenario
        tables = read_tables(path)
        scenario = cls(folder=path.parent, where=str(path))
        scenario._name = None if stored is None else stored.name
        scenario._data = {"components": {}, "connections": [], **tables.data}
        scenario._places = tables.places
        return scenario

    @classmethod
    def _from_package(cls, name: str, strict: bool) -> Scenario:
        loaded = ssp.load_package(name, strict)
        scenario = cls(where=name, **loaded.tables)
        scenario._warnings, scenario._files = loaded.warnings, loaded.unpacked
        return scenario

    @classmethod
    def fmu(
        cls,
        path: str | Path,
        *,
        stop: float | None = None,
        step: float | None = None,
        start: float | None = None,
        inputs: Mapping[str, Any] | str | Path | None = None,
        parameters: Mapping[str, Any] | None = None,
        record: Sequence[str] = (),
        name: str = "fmu",
        interpolation: Interpolation | Mapping[str, Interpolation] | None = None,
    ) -> Scenario:
        """A scenario of one FMU alone: for a look at it, or for a regression test of its outputs.

        Args:
            path: of the FMU, relative to where the user stands.
            stop: end of the run [s]. start: its begin [s]. step: communication step [s]. Where not given, those of the
                FMU's default experiment; without a step there, a thousandth of the run.
            inputs: values by name, which are held; or a table (CSV, MAT, ...) or results folder whose columns are
                played back into the inputs of the same names: continuous inputs on lines between its rows, discrete
                ones held from row to row.
            parameters: start values by name.
            record: variables to record besides the outputs.
            name: of the component: its outputs are recorded as ``name.output``.
            interpolation: ``hold`` or ``linear`` for all columns of the table, or for some by name: a command that was
                logged is held.

        Raises:
            FmuLoadError: the FMU cannot be read.
            ScenarioError: no end is known, or an input does not exist; the nearest are suggested.
        """
        run = FmuAlone(start, stop, step, inputs, parameters, record, interpolation)
        tables, warnings = tables_of_fmu(Path(path), name, run)
        scenario = cls(where=Path(path).name, **tables)
        scenario._warnings = warnings
        return scenario

    def to_toml(self, folder: str | Path | None = None) -> str:
        """The text of a scenario file that runs identically; files it included and overrides are in it.

        Args:
            folder: where the file will stand, which paths are relative to; None for this scenario's.

        Raises:
            ScenarioError: something in the scenario cannot be; every fault is named.
        """
        return scenario_text(self.table(), self.folder, None if folder is None else Path(folder))

    def save(self, path: str | Path) -> Path:
        """Write a scenario file that runs identically. FMUs that came out of an SSP are copied to ``NAME_files`` beside
        it.

        Args:
            path: of the file, ending in ``.toml``; an existing one is replaced. Paths in it become relative to it.

        Returns:
            The path.

        Raises:
            ScenarioError: something in the scenario cannot be, or the path does not end in ``.toml``.
            OutputError: the file cannot be written.
        """
        return save_scenario(self.table(), self.folder, Path(path), getattr(self._files, "path", None))

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
        return Path(ssp.export_package(self.table(), self.name, self.folder, self.where, Path(path), version))

    @property
    def name(self) -> str:
        """Name of the file without its ending, or ``script``."""
        return self._name or stem(self.where)

    def add(self, name: str, **table: Any) -> Self:
        """Add a component.

        Args:
            name: of the component. table: its keys as in a file: `fmu`, `model` or `observer`, `parameters`, `preset`,
                `options`, ... `model` and `observer` take a name, ``file.py:Class``, a class, or an instance, of which
                each run has a copy; `fmu` and `recording` a path.

        Raises:
            ScenarioError: there is a component of this name already.
        """
        if name in self._data["components"]:
            raise ScenarioError(f"{self.where}: there is a component {name!r} already.")
        self._data["components"][name] = component_from_script(table)
        return self

    def connect(self, *lines: str) -> Self:
        """Add connections: ``"source.signal -> target.signal, target.signal"``.

        Args:
            lines: such as ``"train.speed -> observer.odometer"``.
        """
        self._data["connections"] = [*self._data["connections"], *lines]
        return self

    def balises(self, **table: Any) -> Self:
        """Set keys of the balise table."""
        self._data["balises"] = {**self._data.get("balises", {}), **table}
        return self

    def network(self, **table: Any) -> Self:
        """Set keys of the network table: ``nodes={"front": ["odometer.reading"]}, period=0.016, delay=0.05``."""
        self._data["network"] = {**self._data.get("network", {}), **plain(table)}
        return self

    def master(self, **table: Any) -> Self:
        """Set keys of the master table."""
        self._data["master"] = {**self._data.get("master", {}), **table}
        return self

    def report(self, **table: Any) -> Self:
        """Set keys of the report table."""
        self._data["report"] = {**self._data.get("report", {}), **table}
        return self

    def expect(self, check: str, **table: Any) -> Self:
        """Add an expectation that the run is held against, see `cosim.expectations`.

        Args:
            check: what is checked: ``speed_error``, ``signal``, ``on``, ``telegrams``, ...
            table: its keys as in a file; ``start`` and ``end`` may stand for ``from``, which Python keeps for itself,
                and ``to``.
        """
        self._data["expect"] = [*self._data.get("expect", []), {"check": check, **table}]
        return self

    def set(self, name: str, value: Any) -> Self:
        """Override one value.

        That is ``component.parameter``, ``balises.key``, ``network.key``, ``master.key``, ``report.key``, a top-level
        key such as ``stop``, or ``case``: all that a case of the scenario sets.

        Args:
            name: of the value. value: what it becomes; paths are relative to the working folder.

        Raises:
            ScenarioError: there is no such component or table.
        """
        try:
            override(self._data, name, value_from_script(name, value))
        except ScenarioError as error:
            raise ScenarioError(f"{self.where}: {error}") from error
        return self

    @property
    def cases(self) -> dict[str, dict[str, Any]]:
        """What each case sets, by the names of `set`; ``set("case", name)`` chooses one.

        Raises:
            ScenarioError: a case is no table.
        """
        return {name: case_values(self._data, name) for name in self._data.get("cases") or {}}

    def copy(self) -> Scenario:
        """An independent copy."""
        scenario = Scenario(folder=self.folder, where=self.where, **self._data)
        scenario._warnings, scenario._files, scenario._places = list(self._warnings), self._files, self._places
        scenario._name = self._name
        return scenario

    def __getstate__(self) -> dict[str, Any]:
        """For another process: files out of a package are kept by the original, and not removed with a copy."""
        return self.__dict__ | {"_files": None}

    def table(self) -> ScenarioTable:
        """The validated scenario.

        Raises:
            ScenarioError: something in it cannot be; every fault is named.
        """
        with self._places_named():
            return parse_scenario(self._data, self.where, self.folder)

    def vary(
        self,
        values: Mapping[str, Iterable[Any] | Range] | Sequence[Mapping[str, Any]],
        mode: Mode = "grid",
        *,
        count: int | None = None,
        seed: int = 0,
    ) -> Sweep:
        """A sweep: this scenario with some values changed, many times over.

        ::

            sweep = s.vary({"plant.mass": [70e3, 80e3], "balises.seed": range(5)})
            result = sweep.run(workers=2, measure={"distance": lambda outcome: outcome["plant.position"][-1]})
            result.write("results/masses")

        Args:
            values: names as for `set`, each with the values it takes; or a list of variations, each a mapping of names
                to values.
            mode: ``grid``: every combination, the last name changes quickest; ``zip``: first with first, second with
                second; ``latin`` (Latin hypercube) and ``random``: `count` points of
                `cosim.studies.sampling_plans.uniform` ranges and lists.
            count: number of points, for ``latin`` and ``random``. seed: of the points.

        Raises:
            ScenarioError: a name or a value cannot be; nothing has been run then.
            CosimError: a component that is varied cannot be described.
        """
        sweep: Sweep = studies.make_sweep(self, values, mode, count, seed)
        return sweep

    def run(
        self,
        progress: Callable[[float, float], None] | None = None,
        overrides: Mapping[str, Any] | None = None,
        warn: Callable[[str], None] | None = None,
        call_log: str | Path | None = None,
        building: Callable[[str], None] | None = None,
        stream: str | Path | None = None,
        finished: Callable[[Outcome], None] | None = None,
        fallback: str | Path | None = None,
    ) -> Outcome:
        """Run it.

        Args:
            progress: called with the time reached and the end [s].
            overrides: as for `set`, for this run only.
            warn: receives everything doubtful as soon as it is known, before the run where it can be; by default the
                log ``cosim``, which Python shows on the error stream. All warnings are in the outcome as well.
            call_log: a file to log every call of every component to, as `master.log_calls` asks for.
            building: receives the FMUs of shipped models that are built for the first time, some seconds each; by
                default the log ``cosim``, as information.
            stream: a results folder to which everything is written while the run goes on, so that it outlives the
                program; what an earlier run left there is removed before the first step. The table is written as
                ``table.npy``; `Outcome.write` adds formats that the scenario asks for.
            finished: called with the outcome before the components are closed, which is what is returned as well: what
                it writes is not lost where an FMU crashes while it is freed.
            fallback: a folder to which rows are written as for `stream`, only in case the process dies: whoever gives
                it removes it.

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
        for warning in self._warnings:
            (warn or LOG.warning)(warning)
        with self._places_named():
            task = RunTask(table, scenario.name, self.folder, self.where)
            origin = Origin.of(table, task.name, task.folder, task.where, self._files)
            folder, streaming = where_to(stream, fallback, origin)
            finish = ending(origin, folder, warn or LOG.warning, finished)
            return run_scenario(task, progress, warn, log, building, streaming, self._warnings, finish)

    def structure(self) -> Structure:
        """How the components hang together: order, groups, loops, what is held over a step. Nothing is run or built.

        Returns:
            The structure, with `text` and `draw`.

        Raises:
            CosimError: the scenario cannot be set up.
        """
        with self._places_named():
            return scenario_structure(RunTask(self.table(), self.name, self.folder, self.where))

    @contextmanager
    def _places_named(self) -> Iterator[None]:
        """Errors name the file in which the fault stands, also where that is an included one."""
        try:
            yield
        except CosimError as error:
            error.args = (attribute(str(error), self.where, self._places), *error.args[1:])
            raise
