"""Units of what a sweep varies."""

from __future__ import annotations

from cosim.components.described import DescribedComponent
from cosim.errors import CosimError
from cosim.run.described_components import describe_component
from cosim.runs.runnable import RunnableScenario
from plant_models.hybrid.units import UnitError

_SETTING_UNITS = {
    "start": "s",
    "stop": "s",
    "step": "s",
    "balises.spacing": "m",
    "balises.first": "m",
    "balises.min_gap": "s",
    "balises.max_gap": "s",
    "balises.dropout_after": "s",
    "balises.expected_speed": "m/s",
    "balises.location_accuracy": "m",
    "balises.latency": "s",
    "balises.latency_jitter": "s",
    "balises.track_start": "m",
    "balises.track_end": "m",
    "report.evaluate_after": "s",
}


def setting_unit(scenario: RunnableScenario, name: str) -> str | None:
    """Unit of what is varied: of the parameter as its component declares it, or of a key; None where there is none.

    Args:
        scenario: that has it. name: of the setting.
    """
    component, _, variable = name.partition(".")
    table = scenario.table().components.get(component)
    if table is None:
        return _SETTING_UNITS.get(name)
    try:
        described: DescribedComponent = describe_component(component, table, scenario.folder, scenario.where)
        return described.unit_name(variable if variable in described.variables else f"{variable}[1]")
    except (CosimError, KeyError, UnitError):
        return None
