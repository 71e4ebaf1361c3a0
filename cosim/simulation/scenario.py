"""A scenario: components, connections, balises and a report, from a file or built by a script, ready to run."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Unpack

from cosim import campaign as campaigns
from cosim import ssp, studies
from cosim.errors import CosimError
from cosim.process.last_call import LAST_CALL
from cosim.run.outcome import Outcome
from cosim.run.results_manifest import read_manifest
from cosim.run.scenario_run import run_scenario
from cosim.run.scenario_structure import scenario_structure
from cosim.run.streaming import ending, where_to
from cosim.run.task import RunTask
from cosim.runs.run_apart import run_apart, where_it_runs
from cosim.scenario.campaign_table import CampaignTable
from cosim.scenario.fmu_alone import FmuAlone, tables_of_fmu
from cosim.scenario.includes import find_file, read_tables
from cosim.scenario.origin import Origin
from cosim.scenario.package_names import is_package, stem
from cosim.scenario.saving import save_scenario, scenario_text
from cosim.scenario.scenario_tables import Isolate
from cosim.scenario.shipped import shipped_scenarios
from cosim.simulation.checked_call import keywords_of
from cosim.simulation.results_of_others import demand_trust, is_of_results
from cosim.simulation.scenario_screen import scenario_screen
from cosim.simulation.stated_scenario import StatedScenario
from cosim.structure.run_structure import Structure
from fmus.cli.progress import SIMULATED_TIME, Progress, reported
from fmus.tables.table import FirstScreen, Parts
from plant_models.code_trust import is_looking, looking

if TYPE_CHECKING:
    from cosim.campaign.campaign import Campaign
    from cosim.components.recording_data import Interpolation
    from cosim.simulation import keywords
    from cosim.studies.distributions import Distribution
    from cosim.studies.sampling_plans import Mode
    from cosim.studies.sweep import Sweep

LOG = logging.getLogger("cosim")

__all__ = ["Scenario", "shipped_scenarios"]


class Scenario(StatedScenario, FirstScreen):
    """A coupled system to be run, with the balises it passes and the roles of its signals.

    Built from a file, ``Scenario.load("freight_profile_d")`` or ``Scenario.load("my.toml")``, or step by step::

        s = Scenario(stop=60.0, step=0.01)
        s.add("plant", fmu="vendor.fmu", parameters={"mass": 80e3})
        s.add("observer", observer="takagi_sugeno_cdo")
        s.connect("plant.speed -> observer.odometer")
        s.balises(position="plant.position", speed="plant.speed", layout="spacing", spacing=500.0, track_end=3000.0)
        outcome = s.run()

    What a call says is checked at the call, see `StatedScenario`, which says what the arguments are too.
    """

    @classmethod
    def load(cls, name_or_path: str | Path, *, strict: bool = False, trust: bool = False) -> Scenario:
        """A shipped scenario by name, or one from a TOML file (paths in it are relative to the file) or from an SSP.

        A file is merged with those it names under ``include``; its ``[overrides]`` are applied last.

        Args:
            name_or_path: ``freight_profile_d``, ``my.toml``, ``system.ssp``, or ``system.ssp#Variant`` for a structure
                in it; or a results folder, for the scenario that it was made from.
            strict: whether an SSP whose form is not as the standard wants it is refused; else the run warns of it.
            trust: whether code that a results folder names may be run although it never was here.

        Raises:
            ScenarioError: there is no such scenario, or it is not TOML, or not SSP.
            UntrustedError: a results folder names such code; where nothing is run, it does not matter.
            ProvenanceError: the results folder does not say what it was made from.
        """
        if is_package(name_or_path):
            return cls._from_package(str(name_or_path), strict)
        stored = None
        if Path(name_or_path).is_dir() and str(name_or_path) not in shipped_scenarios():
            stored = read_manifest(name_or_path)
        path = find_file(name_or_path) if stored is None else stored.scenario
        tables = read_tables(path)
        if is_of_results(path) and not is_looking():
            demand_trust(path, tables.data, trust)
        scenario = cls(folder=path.parent, where=str(path))
        scenario._name, scenario._from_file = None if stored is None else stored.name, True
        scenario._data |= tables.data
        scenario._places = tables.places
        return scenario

    @classmethod
    def _from_package(cls, name: str, strict: bool) -> Scenario:
        loaded = ssp.load_package(name, strict)
        scenario = cls(where=name)
        scenario._data |= loaded.tables
        scenario._from_file = True
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
        isolate: Isolate | None = None,
        units: Mapping[str, Any] | None = None,
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
            isolate: ``component`` for a process of the FMU's own, ``run`` for one of the run.
            units: what its owner knows and its description does not say, by name of the variable: ``"km/h"``, or
                ``{"unit": "kN", "sign": -1}``, as in the table ``units`` of a scenario file.

        Raises:
            FmuLoadError: the FMU cannot be read.
            ScenarioError: no end is known, or an input does not exist; the nearest are suggested.
        """
        run = FmuAlone(start, stop, step, inputs, parameters, record, interpolation, units)
        tables, warnings = tables_of_fmu(Path(path), name, run)
        scenario = cls(where=Path(path).name, **tables)
        if isolate is not None:
            scenario.master(isolate=isolate)
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

    def __getstate__(self) -> dict[str, Any]:
        """For another process: files out of a package are kept by the original, and not removed with a copy."""
        return self.__dict__ | {"_files": None}

    def first_screen(self) -> Parts:
        """What the scenario is, its components and connections; where it cannot be run yet, why."""
        try:
            self.table()
            fault = ""
        except CosimError as error:
            fault = str(error).split("\n", 1)[0]
        return scenario_screen(self.name, self._data, fault)

    def vary(
        self,
        values: Mapping[str, Iterable[Any] | Distribution] | Sequence[Mapping[str, Any]],
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
                second; ``latin`` (Latin hypercube), ``sobol`` and ``random``: `count` points of
                `cosim.studies.distributions.uniform` ranges and lists.
            count: number of points, for ``latin``, ``sobol`` and ``random``. seed: of the points.

        Raises:
            ScenarioError: a name or a value cannot be; nothing has been run then.
            CosimError: a component that is varied cannot be described.
        """
        sweep: Sweep = studies.make_sweep(self, values, mode, count, seed)
        return sweep

    @keywords_of(CampaignTable)
    def campaign(self, **table: Unpack[keywords.CampaignKeywords]) -> Campaign:
        """The many runs that the table ``[campaign]`` asks for, ready to run.

        ::

            campaign = s.campaign(runs=1000, vary={"seed": {"whole": [0, 99999]}, "train.mass": {"normal": [8e4, 4e3]}})
            result = campaign.run("results/night", workers=4)

        Raises:
            CosimError: there is no campaign, or something in it cannot be.
        """
        scenario = self.with_settings({f"campaign.{key}": value for key, value in table.items()})
        made: Campaign = campaigns.make_campaign(scenario)
        return made

    def run(
        self,
        progress: Progress = None,
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
            progress: called with the time reached and the end [s]; by default a bar, where the run lasts and somebody
                can see it; False for none.
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
        scenario = self.with_settings(overrides or {})
        if call_log is not None:
            scenario.master(log_calls=True)
        table = scenario.table()
        log = None if call_log is None else Path(call_log)
        isolate, why_here = where_it_runs(scenario)
        if isolate == "run" and not LAST_CALL.watched:
            where = None if stream is None else Path(stream)
            with self._places_named(), reported(progress, shape=SIMULATED_TIME) as report:
                outcome = run_apart(scenario, warn or LOG.warning, where, log, report)
            if finished is not None:
                finished(outcome)
            return outcome
        if isolate != table.master.isolate:
            scenario.master(isolate=isolate)
            table = scenario.table()
        for warning in self._warnings:
            (warn or LOG.warning)(warning)
        with self._places_named():
            task = RunTask(table, scenario.name, self.folder, self.where)
            origin = Origin.of(table, task.name, task.folder, task.where, self._files)
            folder, streaming = where_to(stream, fallback, origin)
            finish = ending(origin, folder, warn or LOG.warning, finished, why_here)
            with reported(progress, shape=SIMULATED_TIME) as report:
                return run_scenario(task, report, warn, log, building, streaming, self._warnings, finish)

    def structure(self, *, trust: bool = False) -> Structure:
        """How the components hang together: order, groups, loops, what is held over a step. Nothing is run or built.

        Args:
            trust: whether classes that a file names as ``file.py:Class`` are looked into, which runs their files. Else
                their texts and the connections say what they have; what a script gave or named itself is known anyway.

        Returns:
            The structure, with `text` and `draw`.

        Raises:
            CosimError: the scenario cannot be set up.
        """
        with self._places_named(), looking(is_looking() or (self._from_file and not trust)):
            return scenario_structure(RunTask(self.table(), self.name, self.folder, self.where))
