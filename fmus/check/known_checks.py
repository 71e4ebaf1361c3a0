"""The catalogue: all checks that run an FMU, in order, by interface type."""

from __future__ import annotations

from fmus.check.check import Check
from plant_models.registry import Registry
from plant_models.user_file import Expected

CHECKS: Registry[type[Check]] = Registry("check", ("fmus.check.checks",), "fmus.checks", "fmus.check.check:Check")
EXPECTED = Expected("subclass of Check", lambda found: isinstance(found, type) and issubclass(found, Check))
