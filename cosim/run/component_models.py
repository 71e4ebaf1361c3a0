"""Models: from the tables of a scenario to components."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any, Literal

import fmu_observer
import fmus
import plant_models
from cosim import fmu_filter
from cosim.components.component import Component
from cosim.components.kept_libraries import load_shipped
from cosim.components.loading import load_block, load_fmu
from cosim.components.python import PythonComponent
from cosim.components.python_model import PythonModel
from cosim.components.recording import RecordingComponent, load_recording
from cosim.components.recording_data import Recording
from cosim.errors import ScenarioError, nearest
from cosim.run.backends import FAULTS, Notify, Realised, Request, cannot_build, realise
from cosim.scenario.model_name import ModelName
from cosim.scenario.paths import absolute, move_option_files
from cosim.scenario.scenario_tables import Backend, ComponentTable, Isolate
from fmu_observer.event_protocol import EventProtocol
from fmu_observer.observers.parameter_values import parameter_values
from fmus.isolation.crashes import noted_crash
from fmus.isolation.limits import OwnProcess
from fmus.isolation.programs import IsolationUnavailable, isolation_programs
from plant_models.disk_cache.files import file_digest
from plant_models.hybrid import HybridSystem
from plant_models.hybrid.option import MemberNames
from plant_models.local_files import files_digest
from plant_models.registry import descends_from
from plant_models.user_file import UserFileError, make

OWN_PACKAGES = ("plant_models", "fmu_observer")
LATE_PARAMETERS = frozenset({"late_policy", "replay_horizon"})

_AFTER_CRASH = "{0} gets a process of its own, since its file ended one before: {1}. isolate = 'no' prevents that."
_LASTING = 100
"""Systems that are kept; a sweep over options makes ever new ones."""

_systems: dict[tuple[type[HybridSystem], str], HybridSystem] = {}


def _model_of(table: ComponentTable, where: str) -> Any:
    """The class or instance that a table names as ``model`` or ``observer``; None where it names neither."""
    rooms = {"model": plant_models.PLANTS, "observer": fmu_observer.OBSERVERS}
    for kind, other in (("model", "observer"), ("observer", "model")):
        name = getattr(table, kind)
        if name is not None:
            if name.stated is None and str(name) not in rooms[kind] and str(name) in rooms[other]:
                raise ScenarioError(f"{where}: {str(name)!r} is no {kind}; write {other} = {str(name)!r}.")
            return name.load(rooms[kind], kind, where)
    return None


def make_system(table: ComponentTable, where: str) -> HybridSystem | None:
    """The hybrid system of a component, or None for an FMU by path, for a recording and for plain Python.

    Args:
        table: of the component. where: place for messages.

    Args:
        table: of the scenario. where: name of the scenario, for messages.

    Raises:
        ScenarioError: unknown model, option or preset.
    """
    model = _model_of(table, where)
    if not descends_from(model, plant_models.SYSTEM):
        return None
    name = table.model or table.observer
    if isinstance(model, type):
        chosen = move_option_files(table.options, lambda path: absolute(path, name.folder if name else "."))
        options = _for_its_period(model, _chosen_options(model, chosen, where), table)
        system: HybridSystem = _made(model, options, where)
    elif table.options != dict(model.options):
        raise ScenarioError(f"{where}: {name} is an instance, which has its options already; give the class instead.")
    else:
        system = model
    if table.preset is not None and table.preset not in system.presets:
        raise ScenarioError(f"{where}: {name} has no preset {table.preset!r}; {nearest(table.preset, system.presets)}")
    return system


def make_declared(table: ComponentTable, where: str) -> Any:
    """What a component's model declares: a hybrid system or a model of plain Python, both with `inputs`, `outputs` and
    `parameter_signals`; None for an FMU by path and for a recording.

    Args:
        table: of the component. where: place for messages.

    Raises:
        ScenarioError: the model cannot be had, or its declarations cannot be.
    """
    system = make_system(table, where)
    if system is not None or (table.model or table.observer) is None:
        return system
    return PythonModel(_model_of(table, where), table.options, where)


def component_factories(
    tables: Mapping[str, ComponentTable],
    folder: Path,
    where: str,
    notify: Notify,
    span: tuple[float, float],
    tolerance: float | str | None = None,
    isolate: Isolate | None = None,
) -> tuple[dict[str, Callable[[], Component]], list[str]]:
    """For each component a function that makes a fresh one, called once for the run and perhaps once for the probe; and
    notes.

    Args:
        tables: of the components. folder: paths are relative to it. where: place for messages.
        notify: called for each FMU that is built. span: start and stop of the run [s], which recordings must cover.
        tolerance: of the FMUs whose table says nothing else; see
            `cosim.components.described.Described.choose_tolerance`.
        isolate: what of the FMUs whose table says nothing else runs in a process of its own.

    Raises:
        ScenarioError, FmuLoadError: a component cannot be made.
    """
    places = {name: f"{where}: components.{name}" for name in tables}
    systems = {name: system for name in tables if (system := make_system(tables[name], places[name])) is not None}
    made = realise({n: Request(tables[n], _lasting(tables[n], s), places[n]) for n, s in systems.items()}, notify)
    factories: dict[str, Callable[[], Component]] = {}
    for name, table in tables.items():
        if table.recording is not None:
            recording = open_recording(name, table, folder, places[name], span)
            factories[name] = partial(RecordingComponent, name, recording)
            made.notes += _left_out_note(name, recording)
        elif name in systems:
            factories[name] = _of_system(name, table, systems[name], made)
        else:
            chosen, notes = _isolate(name, table, folder, isolate)
            factories[name] = _of_file(name, table, folder, places[name], tolerance, chosen)
            made.notes += notes
        if table.can_be_missing:
            factories[name] = partial(_declared, factories[name], table.can_be_missing, places[name])
    return factories, made.notes


def _of_system(name: str, table: ComponentTable, system: HybridSystem, made: Realised) -> Callable[[], Component]:
    """Makes a shipped model: its FMU where there is one, else a block."""
    if name in made.files:
        return partial(load_shipped, made.files[name], name)
    return partial(load_block, system, name, _version(made.kinds[name]), **_block_arguments(table))


def _of_file(
    name: str,
    table: ComponentTable,
    folder: Path,
    where: str,
    tolerance: float | str | None,
    isolate: Isolate | None,
) -> Callable[[], Component]:
    """Makes a component of an FMU by path, of a filter over one, or of plain Python."""
    if table.filter is not None:
        return partial(filter_component, name, table, folder, where)
    if table.fmu is None:
        return partial(python_component, name, table, where)
    chosen = tolerance if table.tolerance is None else table.tolerance
    path = (folder / table.fmu).resolve()
    apart = _own_process(table) if isolate == "component" else None
    return partial(load_fmu, path, name, chosen, table.units, table.interface, table.method, apart)


def _own_process(table: ComponentTable) -> OwnProcess:
    """The process that an FMU gets."""
    return OwnProcess(**table.limits.model_dump()) if table.limits is not None else OwnProcess()


def _isolate(
    name: str, table: ComponentTable, folder: Path, isolate: Isolate | None
) -> tuple[Isolate | None, list[str]]:
    """What of an FMU runs in a process of its own, and a note where nobody has said so."""
    stated = table.isolate or isolate
    crash = _crash(table, folder) if stated is None else ""
    return ("component", [_AFTER_CRASH.format(name, crash)]) if crash else (stated, [])


def _crash(table: ComponentTable, folder: Path) -> str:
    """How this very FMU ended a process before, where it can be given one of its own; else empty."""
    if table.fmu is None or table.filter is not None:
        return ""
    try:
        said = noted_crash(file_digest((folder / table.fmu).resolve()))
        return said if said and isolation_programs() else ""
    except (OSError, IsolationUnavailable):  # the run says what is the matter
        return ""


def _declared(factory: Callable[[], Component], missing: Sequence[str], where: str) -> Component:
    """A component some signals of which can be missing."""
    component = factory()
    component.declare_missing(missing, where)
    return component


def python_component(name: str, table: ComponentTable, where: str) -> PythonComponent:
    """A component of plain Python.

    Args:
        name: of the component. table: its table. where: place for messages.

    Raises:
        ScenarioError: the class cannot be loaded, or its declarations cannot be.
    """
    if table.preset is not None or table.backend is not None:
        raise ScenarioError(
            f"{where}: 'preset' and 'as' belong to hybrid systems; plain Python takes 'parameters' and 'options'."
        )
    return PythonComponent(name, make_declared(table, where), str(table.model or table.observer))


def filter_component(name: str, table: ComponentTable, folder: Path, where: str) -> PythonComponent:
    """A component that is a filter over its FMU.

    Args:
        name: of the component. table: its table, with `filter`. folder: start of relative paths.
        where: place for messages.

    Raises:
        FmuLoadError: the FMU cannot be opened. CosimError: it cannot serve this filter.
    """
    assert table.filter is not None
    path = (folder / str(table.fmu)).resolve()
    model = PythonModel(fmu_filter.FmuFilterModel(path, table.filter, table.parameters, table.units), {}, where)
    return PythonComponent(name, model, f"{table.filter.kind} over {table.fmu}")


def open_recording(
    name: str, table: ComponentTable, folder: Path, where: str, span: tuple[float, float] | None = None
) -> Recording:
    """What a component plays back.

    Args:
        name: of the component. table: its table. folder: start of relative paths. where: place for messages.
        span: start and stop of the run [s], which the recording must cover; None where nothing is run.

    Raises:
        ScenarioError: the recording cannot be read or played back.
    """
    path = (folder / str(table.recording)).resolve()
    return load_recording(path, name, table.component, table.interpolation, span, where, table.can_be_missing)


def _left_out_note(name: str, recording: Recording) -> list[str]:
    """Which columns of a recording are not there, if any."""
    columns = "; ".join(f"{column}: {why}" for column, why in recording.left_out.items())
    return [f"{name}: columns that cannot be played back are left out. {columns}."] if columns else []


def _version(kind: Backend) -> Literal[2, 3]:
    return 2 if kind.endswith("2") else 3


def _block_arguments(table: ComponentTable) -> dict[str, Any]:
    policy = table.late_policy if "late_policy" in table.model_fields_set else None
    return {"preset": table.preset, "late_policy": policy, "replay_horizon": table.replay_horizon}


def _made(model: type[HybridSystem], options: Mapping[str, Any], where: str) -> HybridSystem:
    """The system with these options."""
    if model.__module__.partition(".")[0] in OWN_PACKAGES:
        try:
            return model(**options)
        except ValueError as error:  # options that no list of choices can check, such as the model of a filter
            said = str(error).removeprefix(f"{model.name}: ")  # systems begin with their name, formulas do not
            raise ScenarioError(f"{where}: {model.name}: {said}") from error
    try:
        made: HybridSystem = make(model, options)
    except UserFileError as error:
        raise ScenarioError(f"{where}: {error}") from error
    return made


def _lasting(table: ComponentTable, system: HybridSystem) -> HybridSystem:
    """The first system of the same class and options in this process: what has been traced need not be traced for each
    run. An instance that a script gave may differ from others of its class, and lasts itself.
    """
    name = table.model or table.observer or ModelName()
    lasts_itself = name.stated is system
    if lasts_itself:
        return system
    options = _for_its_period(type(system), table.options, table)
    options = move_option_files(options, lambda path: f"{path} {files_digest(name.folder / path)}")
    lasting = _systems.setdefault((type(system), repr(sorted(options.items()))), system)
    while len(_systems) > _LASTING:
        _systems.pop(next(iter(_systems)))
    return lasting


def native_fmu(
    system: HybridSystem, version: Any, preset: str | None, where: str, protocol: EventProtocol | None = None
) -> Path:
    """The FMU of a shipped system, built where it was not yet.

    Args:
        system: the system. version: of FMI. preset: of its parameters. where: place for messages.
        protocol: how it is notified of events; None for what is usual in the version of FMI.

    Raises:
        FmuLoadError: it cannot be built.
    """
    try:
        return fmus.cached_fmu(system, fmi_version=version, preset=preset, protocol=protocol)
    except FAULTS as error:
        raise cannot_build(where, system, error) from error


def _chosen_options(factory: type[HybridSystem], options: Mapping[str, Any], where: str) -> dict[str, Any]:
    """The options as the system names them: a whole number may be written 2.0, but truth values and numbers are not the
    same.
    """
    chosen: dict[str, Any] = {}
    for key, value in options.items():
        if key not in factory.option_choices:
            raise ScenarioError(
                f"{where}: {factory.name} has no option {key!r}; {nearest(key, factory.option_choices)}"
            )
        choices = factory.option_choices[key]
        equal = [
            choice for choice in choices if choice == value and isinstance(choice, bool) == isinstance(value, bool)
        ]
        if choices and not equal and not (isinstance(value, str) and value in choices):
            raise ScenarioError(f"{where}: option {key} = {value!r} of {factory.name}; choose {_legal(choices)}.")
        chosen[key] = equal[0] if equal else value
    return chosen


def _for_its_period(factory: type[HybridSystem], options: dict[str, Any], table: ComponentTable) -> dict[str, Any]:
    """The options, with the period that the parameters set: a filter of a plant takes as many steps as that needs."""
    period = table.parameters.get("sample_period")
    if isinstance(period, bool) or not isinstance(period, int | float) or not period > 0.0:
        return options
    built = "period" in factory.option_choices and not {"period", "substeps"} & set(options)
    return {**options, "period": float(period)} if built else options


def _legal(choices: Sequence[Any]) -> str:
    if isinstance(choices, range):
        return f"{choices[0]} to {choices[-1]}"
    own = ", or write file.py:Class" if isinstance(choices, MemberNames) else ""
    return f"from {', '.join(map(repr, choices))}{own}"


def stated_parameters(table: ComponentTable, system: HybridSystem) -> dict[str, Any]:
    """What the table of a component says of the parameters of its system, by name.

    Args:
        table: of the component. system: the hybrid system that it names.
    """
    known = {n for s in system.parameter_signals for n in (s.name, *s.scalar_names)}
    return {name: value for name, value in table.parameters.items() if name in known}


def values_in_use(table: ComponentTable, system: Any) -> Any:
    """Values of all parameters of a system, as its flow takes them.

    Args:
        table: of the component. system: the hybrid system that it names.
    """
    return system.unpack_parameters(parameter_values(system, stated_parameters(table, system), table.preset))
