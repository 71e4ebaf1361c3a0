"""From the table of a component to one that is described and can be asked, not stepped; nothing is built or loaded.

Where nothing of others is run, a class of a user's file is known as far as its text and the connections tell.
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

from cosim.components.component import Component
from cosim.components.loading import describe_fmu, describe_system
from cosim.components.recording import RecordingComponent
from cosim.components.start_values import start_values
from cosim.coupling.connection import Link
from cosim.errors import CosimError
from cosim.run.backends import intended
from cosim.run.code_not_run import code_component, is_code_not_run
from cosim.run.component_models import filter_component, make_system, open_recording, python_component
from cosim.scenario.scenario_tables import ComponentTable


def describe_component(
    name: str,
    table: ComponentTable,
    folder: Path,
    where: str,
    span: tuple[float, float] | None = None,
    links: Iterable[Link] = (),
) -> Component:
    """A component that can be asked and not stepped.

    Args:
        name: of the component. table: its table. folder: start of relative paths. where: place for messages.
        span: start and stop of the run [s], which a recording must cover; None where it does not matter.
        links: connections of the scenario, which name variables of code that is not run.

    Raises:
        ScenarioError, FmuLoadError: the component cannot be made. CouplingError: its parameters do not fit it.
    """
    try:
        return _described(name, table, folder, where, span)
    except CosimError as error:
        if not is_code_not_run(error):
            raise
        return code_component(name, table, links, where)


def _described(
    name: str, table: ComponentTable, folder: Path, where: str, span: tuple[float, float] | None
) -> Component:
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
