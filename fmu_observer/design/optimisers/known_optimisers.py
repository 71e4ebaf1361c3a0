"""The registry of optimisers. Loads none before it is looked up."""

from __future__ import annotations

from difflib import get_close_matches

from fmu_observer.design.optimisers.optimiser import Optimiser
from plant_models.registry import Registry

OPTIMISERS: Registry[type[Optimiser]] = Registry(
    "optimiser",
    ("fmu_observer.design.optimisers.methods",),
    "fmu_observer.optimisers",
    "fmu_observer.design.optimisers.optimiser:Optimiser",
)
"""Optimisers by name."""

SHORT_NAMES = {
    "pso": "particle_swarm",
    "ga": "genetic",
    "bbo": "biogeography",
    "cma": "cma_es",
    "gradient": "likelihood_gradient",
    "hand": "trial_and_error",
}
"""What the literature calls them, beside their names here."""


def find_optimiser(name: str) -> type[Optimiser]:
    """The class of an optimiser.

    Args:
        name: in the registry, or a short one: ``pso``, ``ga``, ``bbo``, ``cma``, ``gradient``, ``hand``.

    Raises:
        ValueError: there is none of this name; the nearest are named.
    """
    chosen = SHORT_NAMES.get(name, name)
    if chosen in OPTIMISERS:
        return OPTIMISERS[chosen]
    known = [*OPTIMISERS, *SHORT_NAMES]
    near = get_close_matches(name, known, 3, 0.5)
    hint = f"did you mean {', '.join(near)}?" if near else f"known: {', '.join(known)}."
    raise ValueError(f"There is no optimiser {name!r}; {hint}")
