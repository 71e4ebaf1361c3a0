"""From the table of a component to its start values: parameters, what is done with late events, and seeds."""

from __future__ import annotations

from cosim.components.component import Component
from cosim.components.start_values import StartValue, start_values
from cosim.run.component_models import protocol_parameters
from cosim.run.run_seeds import component_seed
from cosim.scenario.scenario_tables import ComponentTable
from cosim.scenario.schema import ScenarioTable


def names_with_starts(table: ScenarioTable) -> dict[str, list[str]]:
    """Names of the variables that have a start value in the scenario, by component.

    Args:
        table: of the scenario.
    """
    return {name: list(component.parameters) for name, component in table.components.items()}


def component_starts(table: ComponentTable, component: Component, run_seed: int) -> dict[str, StartValue]:
    """Start values of a component in a run, by name; its arrays get their shapes.

    Args:
        table: of the component. component: loaded. run_seed: of the run.

    Raises:
        ScenarioError, CouplingError: as for `start_values`; a component without a parameter that its table sets.
    """
    if table.filter is not None:
        return {}  # they are those of its FMU, which has taken them
    late = protocol_parameters(table, component, f"components.{component.name}")
    return start_values(component, late | table.parameters | component_seed(component, table.parameters, run_seed))
