"""Seeds of a run: what nobody gives a seed of its own draws from that of the run and its name. Runs nothing."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from cosim.components.component import Component
from cosim.errors import CouplingError
from cosim.scenario.schema import ScenarioTable
from fmus.fmi.standard import OWN_TOOL
from plant_models.hybrid.noise import FROM_NAME, OWN_SEED_EXPECTED, is_seed, seed_of

SEED = "seed"
"""Key of the tables, and name of the parameter of a component that draws."""


def with_seeds(table: ScenarioTable) -> ScenarioTable:
    """The scenario with numbers for the seeds of balises, network and filters that follow from that of the run.

    Args:
        table: of the scenario.
    """
    found: dict[str, Any] = {}
    for name, part in (("balises", table.balises), ("network", table.network)):
        if part is not None:
            found[name] = part.model_copy(update={SEED: _number(table.seed, name, part.seed)})
    components = dict(table.components)
    for name, component in table.components.items():
        if component.filter is not None:
            drawing = component.filter.model_copy(update={SEED: _number(table.seed, name, component.filter.seed)})
            components[name] = component.model_copy(update={"filter": drawing})
    return table.model_copy(update={**found, "components": components})


def component_seed(component: Component, parameters: Mapping[str, Any], run_seed: int) -> dict[str, int]:
    """The parameter `seed` of a component that draws and is given none of its own; nothing for all others.

    Args:
        component: described. parameters: that the scenario gives it. run_seed: of the run.

    Raises:
        CouplingError: the seed that it is given is no whole number.
    """
    variable = component.variables.get(SEED)
    if variable is None or component.description.generationTool != OWN_TOOL:
        return {}  # what a parameter of that name means is for its maker to say
    seed = parameters.get(SEED, float(variable.start or FROM_NAME))
    if isinstance(seed, bool) or not isinstance(seed, int | float) or not (is_seed(seed) or seed == FROM_NAME):
        raise CouplingError(f"{component.name}.{SEED} = {seed!r}: expected {OWN_SEED_EXPECTED}.")
    return {SEED: seed_of(run_seed, component.name)} if seed == FROM_NAME else {}


def _number(run_seed: int, name: str, own: int) -> int:
    return seed_of(run_seed, name) if own == FROM_NAME else own
