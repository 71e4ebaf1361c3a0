"""Systems that ship, with their usual options: one object of each in a process, built and traced once for all tests."""

from __future__ import annotations

from functools import cache

from fmus import RECIPES
from plant_models.hybrid import HybridSystem


@cache
def shipped(name: str) -> HybridSystem:
    """The system of a name in the registries."""
    return RECIPES[name]()
