"""The scenario with another seed, and what of it draws from that. Runs nothing."""

from __future__ import annotations

from cosim.run.described_components import describe_component
from cosim.run.run_seeds import SEED, component_seed
from cosim.simulation.scenario import Scenario
from plant_models.hybrid.noise import FROM_NAME


def drawn(scenario: Scenario) -> list[str]:
    """Names of what draws from the seed of the run: tables and components without a seed of their own.

    Args:
        scenario: the scenario.
    """
    table = scenario.table()
    found = [key for key in ("balises", "network") if getattr(getattr(table, key), SEED, None) == FROM_NAME]
    for name, component in table.components.items():
        if component.filter is not None:
            found += [name] if component.filter.seed == FROM_NAME else []
        elif component.recording is None:
            described = describe_component(name, component, scenario.folder, f"{scenario.where}: components.{name}")
            found += [name] if component_seed(described, component.parameters, table.seed) else []
    return found


def with_seed(scenario: Scenario, seed: int) -> Scenario:
    """The scenario with other random numbers: its seed moves by so much, so that 0 is the scenario as it is.

    Args:
        scenario: the scenario. seed: from 0.
    """
    return scenario.copy().set(SEED, scenario.table().seed + seed)
