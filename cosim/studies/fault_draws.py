"""Ranges of faults: from where to where studies draw the parameters of the causes in a scenario. Runs nothing."""

from __future__ import annotations

from cosim.run.component_models import make_system
from cosim.runs.runnable import RunnableScenario
from cosim.studies.distributions import Range, uniform
from plant_models.faults.fault_system import FaultSystem
from plant_models.hybrid.signal import scalar_names


def fault_ranges(scenario: RunnableScenario) -> dict[str, Range]:
    """What to hand to `Scenario.vary` so that faults are drawn: ranges by name of the parameter, as the causes of all
    fault systems state them. Instants stay as the scenario has them.

    Args:
        scenario: with components such as `wheel_fault` and `signal_fault`.

    Raises:
        ScenarioError: a component cannot be made.
    """
    found: dict[str, Range] = {}
    for name, table in scenario.table().components.items():
        system = make_system(table, f"{scenario.where}: components.{name}") if table.model is not None else None
        if isinstance(system, FaultSystem):
            signals = {signal.name: signal for signal in system.parameters}
            for parameter, low, high in system.cause.ranges:
                found |= {f"{name}.{scalar}": uniform(low, high) for scalar in scalar_names([signals[parameter]])}
    return found
