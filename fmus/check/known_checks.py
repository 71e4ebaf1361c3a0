"""The catalogue: all checks that run an FMU, in order, by interface type."""

from __future__ import annotations

from collections.abc import Callable, Iterable

from fmus.check.check import Check
from plant_models.registry import Registry, log_left_out
from plant_models.user_file import Expected, UserFileError, name_of

CHECKS: Registry[type[Check]] = Registry("check", ("fmus.check.checks",), "fmus.checks", "fmus.check.check:Check")
EXPECTED = Expected("subclass of Check", lambda found: isinstance(found, type) and issubclass(found, Check))


def checks_of(interface: str, left_out: Callable[[str, str], None] = log_left_out) -> dict[str, type[Check]]:
    """The checks of an interface type by name, in order.

    Args:
        interface: its name in a model description.
        left_out: is called with name and reason for each check that cannot be loaded.
    """
    found = {name: check for name, check in CHECKS.usable(left_out).items() if check.interface == interface}
    return dict(sorted(found.items(), key=lambda item: item[1].place))


def registered_places(names: Iterable[str]) -> dict[str, str]:
    """Where a process of their own finds the checks that this program has registered: ``file.py:Class`` by name.

    Args:
        names: of checks.

    Raises:
        ValueError: one stands where no other process finds it.
    """
    places = {}
    for name in names:
        check = CHECKS.own(name)
        if check is None:
            continue
        if check.__module__ == "__main__":
            raise UserFileError(f"the check {name!r} stands in the program itself; put it into a file and import that.")
        places[name] = name_of(check)
    return places
