"""Inputs that nothing is connected to: reported; refused where an observer, a sensor or a driver that ships has no
measured speed, since what it says then is about a train that stands.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from cosim.components.component import Component
from cosim.coupling.connection import Connection, unconnected_inputs
from cosim.errors import CouplingError
from cosim.run.loaded_components import names_with_starts
from cosim.scenario.scenario_tables import ComponentTable
from cosim.scenario.schema import ScenarioTable
from plant_models.hybrid.units import parse_unit
from plant_models.user_file import names_code

_SPEED = parse_unit("m/s")


def require_sources(
    table: ScenarioTable, components: Mapping[str, Component], connections: Sequence[Connection]
) -> list[str]:
    """Check that what measures is connected; a start value in the scenario says that a constant is meant.

    Args:
        table: the scenario. components: by name. connections: checked.

    Returns:
        What warns, of all other inputs.

    Raises:
        CouplingError: a speed that a shipped model reads has neither a source nor a value.
    """
    free = unconnected_inputs(connections, components.values(), names_with_starts(table))
    unwired = [name for name in free if _reads_speed(table.components, components, *name.split(".", 1))]
    if unwired:
        component, _, signal = unwired[0].partition(".")
        raise CouplingError(
            f"Nothing is connected to {', '.join(unwired)}; write a connection '... -> {unwired[0]}', or, where a "
            f"constant is meant, {signal.partition('[')[0]} = 0.0 in [components.{component}.parameters]."
        )
    return [f"Unconnected inputs keep their start values: {', '.join(free)}."] if free else []


def _reads_speed(
    tables: Mapping[str, ComponentTable], components: Mapping[str, Component], component: str, signal: str
) -> bool:
    """Whether an input is a speed of a model that ships, whose units are known to be right."""
    model = tables[component].observer or tables[component].model
    if model is None or model.stated is not None or names_code(model):
        return False
    unit = components[component].unit(signal)
    return unit is not None and unit.exponents == _SPEED.exponents
