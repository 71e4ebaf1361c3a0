"""The registry of expectations, by what stands in ``check``, and the kinds that ship."""

from __future__ import annotations

from cosim.expectations.expectation import Expectation
from plant_models.registry import Registry

EXPECTATIONS: Registry[type[Expectation]] = Registry(
    "expectation", ("cosim.expectations.kinds",), "cosim.expectations", "cosim.expectations.expectation:Expectation"
)


def shipped_expectations() -> dict[str, type[Expectation]]:
    """The kinds that ship, by name; those of other packages are not loaded."""
    return {name: EXPECTATIONS[name] for name in EXPECTATIONS.members if EXPECTATIONS.room(name)}
