"""What a component is asked to log: checked against the categories that it declares. Knows descriptions and slaves."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from fmpy.model_description import ModelDescription

from cosim.diagnostics.messages import LogChoice
from cosim.errors import CouplingError, nearest

_STATUS_CATEGORIES = frozenset({"logStatusWarning", "logStatusDiscard", "logStatusError", "logStatusFatal"})
"""Standard names of the categories for what is wrong."""


@dataclass(frozen=True)
class LogSwitch:
    """Arguments of setDebugLogging.

    Args:
        on: whether to log. categories: which ones; none means all.
    """

    on: bool
    categories: tuple[str, ...] = ()


def log_switch(name: str, description: ModelDescription, choice: LogChoice | None) -> LogSwitch | None:
    """How to switch a component's log; None where it is left as it is.

    Args:
        name: of the component. description: its model description. choice: what the scenario asks for.

    Raises:
        CouplingError: a category that the component does not declare; its own are listed.
    """
    if choice is None or choice == "none":
        return None if choice is None else LogSwitch(False)
    declared = [category.name for category in description.logCategories]
    if choice == "all":
        return LogSwitch(True)
    if choice == "errors":
        wrong = tuple(c for c in declared if c in _STATUS_CATEGORIES)
        return LogSwitch(True, wrong) if wrong else None
    for category in choice:
        if category not in declared:
            known = nearest(category, declared) if declared else "it declares none; use log = 'all'."
            raise CouplingError(f"{name}: log: there is no log category {category!r}; {known}")
    return LogSwitch(True, tuple(choice)) if choice else LogSwitch(False)


def switch_log(slave: Any, fmi_version: int, switch: LogSwitch) -> str | None:
    """Call setDebugLogging; what the slave answers if it refuses, since a refused log is no reason not to run.

    Args:
        fmi_version: 1, 2 or 3. switch: of the slave's log.
    """
    try:
        if fmi_version == 1:
            slave.setDebugLogging(switch.on)  # FMI 1.0 knows no categories
        else:
            slave.setDebugLogging(switch.on, list(switch.categories))
    except Exception as error:
        return f"setDebugLogging({switch.on}, {list(switch.categories)}) was refused: {error}"
    return None
