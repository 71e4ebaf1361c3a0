"""From the tables of a scenario to its components: loaded, and later instantiated with their start values.

Whoever hands in `resources` frees what was loaded, also where a later component cannot be.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

from fmpy.model_description import ModelDescription

from cosim.components.component import Component
from cosim.components.description import read_description
from cosim.components.loading import describe_fmu
from cosim.components.start_values import StartValue, start_values
from cosim.errors import CouplingError, ScenarioError
from cosim.fmu_filter.stated_deviations import taken_as
from cosim.run.component_models import LATE_PARAMETERS, component_factories
from cosim.run.remarks import Remarks
from cosim.run.run_seeds import component_seed
from cosim.run.task import RunTask
from cosim.scenario.scenario_tables import ComponentTable
from cosim.scenario.schema import ScenarioTable
from fmus.exchange.description import as_stepped
from fmus.fmi.capabilities import read_capabilities, tool_warning
from fmus.fmi.sense import doubled_names


def names_with_starts(table: ScenarioTable) -> dict[str, list[str]]:
    """Names of the variables that have a start value in the scenario, by component.

    Args:
        table: of the scenario.
    """
    return {name: list(component.parameters) for name, component in table.components.items()}


def _component_starts(table: ComponentTable, component: Component, run_seed: int) -> dict[str, StartValue]:
    """Start values of a component in a run, by name; its arrays get their shapes."""
    if table.filter is not None:
        return {}  # they are those of its FMU, which has taken them
    late = _protocol_parameters(table, component, f"components.{component.name}")
    return start_values(component, late | table.parameters | component_seed(component, table.parameters, run_seed))


def _check_instances(files: Mapping[str, Path], where: str) -> None:
    """Refuse a second component of an FMU that allows one instance in a process (canBeInstantiatedOnlyOncePerProcess).

    Two files are the same FMU where model identifier and GUID (instantiation token) agree.
    """
    if len(files) < 2:
        return
    first: dict[tuple[str, str], str] = {}
    descriptions: dict[Path, ModelDescription] = {}
    for name, path in files.items():
        if path not in descriptions:
            descriptions[path] = read_description(path, name)
        description = descriptions[path]
        if not read_capabilities(as_stepped(description)).canBeInstantiatedOnlyOncePerProcess:
            continue
        identity = (as_stepped(description).coSimulation.modelIdentifier, str(description.guid))
        if identity in first:
            raise CouplingError(
                f"{where}: components {first[identity]!r} and {name!r} are the same FMU ({path.name}), which can be "
                f"instantiated "
                "only once per process (canBeInstantiatedOnlyOncePerProcess). Ask its vendor for one without this "
                "limit."
            )
        first[identity] = name


@dataclass(frozen=True)
class LoadedComponents:
    """The components of a run.

    Args:
        components: by name. starts: their start values, by component and name.
        factories: make a fresh one each, to be probed.
    """

    components: Mapping[str, Component]
    starts: Mapping[str, Mapping[str, StartValue]]
    factories: Mapping[str, Callable[[], Component]]


def load_components(
    task: RunTask, building: Callable[[str], None], remarks: Remarks, resources: ExitStack
) -> LoadedComponents:
    """Load the components, with warnings of what their descriptions say.

    Args:
        task: of the run. building: called for each FMU that is built. remarks: of the run.
        resources: closed when the run ends, which frees the components.

    Raises:
        CosimError: a component cannot be had, or its table sets what it cannot take.
    """
    table, folder = task.table, task.folder
    span = table.start, table.stop
    factories, notes = component_factories(
        table.components, folder, task.where, building, span, table.tolerance, table.master.isolate
    )
    remarks.note(*notes, *_deviations_of_filters(table, folder))
    files = {name: (folder / t.fmu).resolve() for name, t in table.components.items() if t.fmu is not None}
    _check_instances(files, task.where)
    components: dict[str, Component] = {}
    starts: dict[str, dict[str, StartValue]] = {}
    resources.callback(_free, components)
    for name, factory in factories.items():
        components[name] = factory()
        starts[name] = _component_starts(table.components[name], components[name], table.seed)
        _remark(components[name], remarks)
    return LoadedComponents(components, starts, factories)


def _deviations_of_filters(table: ScenarioTable, folder: Path) -> list[str]:
    """What the deviations of filters were taken as, where their FMUs have other units than SI."""
    filters = {name: (part.filter, part) for name, part in table.components.items() if part.filter is not None}
    return [
        note
        for name, (own, part) in filters.items()
        for note in taken_as(own, describe_fmu((folder / str(part.fmu)).resolve(), name, part.units))
    ]


def _remark(component: Component, remarks: Remarks) -> None:
    """Warn of the tool that made an FMU, and of names that stand in it twice, once for all that share them."""
    warning = tool_warning(component.name, component.description)
    if warning is not None:
        remarks.warn(warning)
    doubled = doubled_names(component.description)
    if doubled is not None and not any(doubled in reported for reported in remarks.warnings):
        remarks.warn(f"{component.name}: {doubled}")


def _free(components: Mapping[str, Component]) -> None:
    for component in components.values():
        component.terminate()
        component.free()


def _protocol_parameters(table: ComponentTable, component: Component, where: str) -> dict[str, float | str]:
    """What the table says about late events, as parameters of an FMU; a block was made with them."""
    stated: dict[str, float | str] = {
        name: getattr(table, name) for name in sorted(table.model_fields_set & LATE_PARAMETERS)
    }
    for name in stated:
        if name not in component.variables:
            why = "what it does with late events is its own choice" if component.events else "it receives no events"
            raise ScenarioError(f"{where}: this {component.kind} has no parameter {name}; {why}.")
    return stated if component.kind == "FMU" else {}
