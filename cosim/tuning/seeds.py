"""Seeds of a scenario: which settings of it draw, and the scenario with another seed. Runs nothing."""

from __future__ import annotations

from collections.abc import Sequence

from cosim.errors import ScenarioError, nearest
from cosim.scenario.structure import describe_component
from cosim.simulation.scenario import Scenario

SEED = "seed"


def seed_settings(scenario: Scenario, names: Sequence[str] | None = None) -> dict[str, int]:
    """The settings that a seed changes, with their present values.

    Args:
        scenario: the scenario.
        names: of the settings, such as ``wheel.seed``; None for all there are: of balises and network, and the
            parameter `seed` of every component.

    Raises:
        ScenarioError: a name is none of them.
    """
    table = scenario.table()
    found = {f"{key}.{SEED}": getattr(table, key).seed for key in ("balises", "network") if getattr(table, key)}
    for name, component in table.components.items():
        if component.recording is None:
            described = describe_component(name, component, scenario.folder, f"{scenario.where}: components.{name}")
            if SEED in described.variables:
                start = component.parameters.get(SEED, described.variables[SEED].start or 0)
                found[f"{name}.{SEED}"] = int(float(start))
    for name in names or ():
        if name not in found:
            raise ScenarioError(f"{scenario.where}: nothing draws from {name!r}; {nearest(name, found)}")
    return found if names is None else {name: found[name] for name in names}


def with_seed(scenario: Scenario, settings: dict[str, int], seed: int) -> Scenario:
    """The scenario with other random numbers: every setting moves by the seed, so that 0 is the scenario as it is.

    Args:
        scenario: the scenario. settings: from `seed_settings`. seed: from 0.
    """
    seeded = scenario.copy()
    for name, own in settings.items():
        seeded.set(name, own + seed)
    return seeded
