"""The registry of expectations, by what stands in ``check``."""

from __future__ import annotations

from cosim.expectations.expectation import Expectation
from plant_models.registry import Registry

EXPECTATIONS: Registry[type[Expectation]] = Registry(
    "expectation", ("cosim.expectations.kinds",), "cosim.expectations", "cosim.expectations.expectation:Expectation"
)
