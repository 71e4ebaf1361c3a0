"""The catalogue: all checks that run an FMU, in order, by interface type."""

from __future__ import annotations

from contextlib import suppress

from fmus.check.check import Check
from plant_models.registry import Registry, RegistryError

CHECKS: Registry[type[Check]] = Registry("check", ("fmus.check.checks",), "fmus.checks", "fmus.check.check:Check")


def checks_of(interface: str) -> list[type[Check]]:
    """The checks of an interface type, in order; one of an installed package that cannot be loaded is left out.

    Args:
        interface: its name in a model description.
    """
    found = []
    for name in CHECKS:
        with suppress(RegistryError):
            found.append(CHECKS[name])
    return sorted((check for check in found if check.interface == interface), key=lambda check: check.place)


def check_of(interface: str, name: str) -> type[Check]:
    """A check by its name.

    Args:
        interface: that it is about. name: of the check.
    """
    return next(check for check in checks_of(interface) if check.name == name)
