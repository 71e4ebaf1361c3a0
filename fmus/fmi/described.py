"""What an instance is, as its model description says: capabilities, variables, events. Calls nothing."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from fmpy.model_description import ModelDescription

from fmus.fmi.capabilities import read_capabilities
from fmus.fmi.elements import Variables, elements_of
from fmus.fmi.standard import CO_SIMULATION
from fmus.fmi.types import NUMERIC_TYPES, REAL_TYPE


@dataclass(frozen=True)
class EventPort:
    """A triggered event that an instance declares.

    Args:
        name: the event.
        trigger: value reference of the clock (FMI 3) or of the count (FMI 2).
        stamp: value reference of ``<name>_time``, or None where there is none.
        payload: field of the event (``position``, ...) -> value reference.
    """

    name: str
    trigger: int
    stamp: int | None
    payload: Mapping[str, int]

    def fields(self, stamp: float, payload: Mapping[str, float]) -> dict[int, float]:
        """What to set by value reference; fields that are not declared are dropped.

        Args:
            stamp: when the event happened [s].
            payload: values by field.

        Returns:
            Values by value reference, the stamp last.
        """
        found = dict[int, float]()
        for name, reference in self.payload.items():
            if name in payload:
                found[reference] = float(payload[name])
        if self.stamp is not None:
            found[self.stamp] = stamp
        return found


class Described(ABC):
    """An instance before anything of it runs. Variables go by name; elements of arrays are named ``x[1]``, ``m[2,3]``.

    `negated` are variables whose slave holds the value with the other sign (FMI 1.0).

    Args:
        name: of the instance.
        slave: object with fmpy's call surface, which holds the values.
        description: its model description.
    """

    fmi_version: int
    interface = CO_SIMULATION
    event_needs_step: bool
    """Whether an event that was notified happens in the next step only (FMI 2), or at once (FMI 3)."""

    def __init__(self, name: str, slave: Any, description: ModelDescription) -> None:
        self.name, self.slave, self.description = name, slave, description
        self.negated: frozenset[str] = frozenset()
        self.capabilities = read_capabilities(description, self.interface)
        self.tolerance: float | None = _declared_tolerance(description) if self.fmi_version > 1 else None
        """Relative tolerance that it is given at set-up; FMI 1.0 co-simulation has no call for it."""
        self.variables = Variables({v.name: v for v in description.modelVariables})
        self.events: dict[str, EventPort] = self._find_events()

    def tolerance_argument(self) -> tuple[dict[str, float], str]:
        """The tolerance as an argument of the call that takes it, and what to say of that call where it fails."""
        if self.tolerance is None:
            return {}, ""
        hint = "where it is the tolerance that it refuses, set another one with the key 'tolerance', or 'none'"
        return {"tolerance": self.tolerance}, f" with the tolerance {self.tolerance:g} ({hint})"

    @property
    def can_save(self) -> bool:
        """Whether it says that its state can be saved and restored."""
        return self.capabilities.canGetAndSetFMUState

    @property
    def can_vary_step(self) -> bool:
        """Whether it says that the communication step may vary."""
        return self.capabilities.canHandleVariableCommunicationStepSize

    @property
    def has_event_mode(self) -> bool:
        """Whether it declares event mode (FMI 3)."""
        return self.capabilities.hasEventMode

    def names(self, causality: str) -> list[str]:
        """Names of the numeric scalars and elements of one causality, without the triggers, stamps and payloads of
        events.

        Args:
            causality: in the words of FMI.
        """
        hidden = self.event_references() if causality == "input" else set()
        found = [
            v
            for v in self.description.modelVariables
            if v.causality == causality and v.type in NUMERIC_TYPES and v.valueReference not in hidden
        ]
        return [element.name for v in found for element in elements_of(v)]

    def event_references(self) -> set[int]:
        """Value references of the triggers, stamps and payloads of all events: the master sets them, no connection
        may.
        """
        hidden: set[int] = set()
        for event in self.events.values():
            hidden |= {event.trigger, *event.payload.values()} | ({event.stamp} if event.stamp is not None else set())
        return hidden

    @abstractmethod
    def _find_events(self) -> dict[str, EventPort]: ...

    def _payload_of(self, event: str, references: Mapping[str, int]) -> dict[str, int]:
        prefix, real = f"{event}_", REAL_TYPE[self.fmi_version]
        reserved = {f"{event}_time", f"{event}_count"}
        return {
            name.removeprefix(prefix): reference
            for name, reference in references.items()
            if name.startswith(prefix)
            and name not in reserved
            and self.variables[name].type == real
            and not self.variables[name].shape
        }


def _declared_tolerance(description: ModelDescription) -> float | None:
    """Relative tolerance of the default experiment; None where none is declared, or no positive number."""
    experiment = description.defaultExperiment
    try:
        tolerance = math.nan if experiment is None or experiment.tolerance is None else float(experiment.tolerance)
    except ValueError:
        return None
    return tolerance if 0.0 < tolerance < math.inf else None
