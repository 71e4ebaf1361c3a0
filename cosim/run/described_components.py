"""From the table of a component to one that is described and can be asked, not stepped; nothing is built or loaded."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from cosim.components.component import Component
from cosim.components.loading import describe_fmu, describe_system
from cosim.components.recording import RecordingComponent
from cosim.components.start_values import start_values
from cosim.run.backends import intended
from cosim.run.component_models import filter_component, make_system, open_recording, python_component
from cosim.scenario.scenario_tables import ComponentTable


def describe_component(
    name: str, table: ComponentTable, folder: Path, where: str, span: tuple[float, float] | None = None
) -> Component:
    """A component that can be asked and not stepped.

    Args:
        name: of the component. table: its table. folder: start of relative paths. where: place for messages.
        span: start and stop of the run [s], which a recording must cover; None where it does not matter.

    Raises:
        ScenarioError, FmuLoadError: the component cannot be made. CouplingError: its parameters do not fit it.
    """
    system = make_system(table, where)
    component: Component
    if table.recording is not None:
        component = RecordingComponent(name, open_recording(name, table, folder, where, span))
    elif table.filter is not None:
        component = filter_component(name, table, folder, where)
    elif system is None and table.fmu is None:
        component = python_component(name, table, where)
    elif system is None:
        component = describe_fmu((folder / str(table.fmu)).resolve(), name, table.units, table.interface)
    else:
        backend = intended(table, system)
        version: Any = int(backend[-1])
        # the exported FMU carries the same description
        component = describe_system(system, name, version, table.preset)
        component.kind = "block" if backend.startswith("block") else "FMU"
    if table.filter is None:
        start_values(component, table.parameters)
    component.declare_missing(table.can_be_missing, where)
    return component
