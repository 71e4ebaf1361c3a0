"""What a component is, as its model description says: capabilities, variables, units, events. Calls no slave."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass

from fmpy.model_description import ModelDescription, ModelVariable

from cosim.errors import CouplingError, nearest
from fmus.fmi.capabilities import read_capabilities
from fmus.fmi.description import declared_tolerance
from fmus.fmi.elements import Element, Variables, described, elements_of
from fmus.fmi.standard import OWN_TOOL
from fmus.fmi.types import NUMERIC_TYPES
from fmus.fmi.units import Units
from plant_models.hybrid.units import Unit, UnitError


@dataclass(frozen=True)
class EventPort:
    """A triggered event a component declares.

    Args:
        name: the event.
        trigger: value reference of the clock (FMI 3) or of the count (FMI 2).
        stamp: value reference of ``<name>_time``, or None where the component has none.
        payload: field of the event (``position``, ...) -> value reference.
    """

    name: str
    trigger: int
    stamp: int | None
    payload: Mapping[str, int]


class Described(ABC):
    """A component before anything of it runs. Variables go by name; elements of arrays are named ``x[1]``, ``m[2,3]``.

    Args:
        name: name in the scenario. description: its model description.
        source: where it comes from, for people. kind: ``FMU`` or ``block``.
    """

    fmi_version: int
    real_type: str
    event_needs_step: bool
    """Whether an event that was told happens in the next step only (FMI 2), or at once (FMI 3)."""

    def __init__(self, name: str, description: ModelDescription, source: str, kind: str) -> None:
        self.name, self.description, self.source, self.kind = name, description, source, kind
        self.capabilities = read_capabilities(description)
        self.tolerance: float | None = declared_tolerance(description) if self.fmi_version > 1 else None
        """Relative tolerance that it is told at set-up; FMI 1.0 co-simulation has no call for it."""
        self.variables = Variables({v.name: v for v in description.modelVariables})
        self.events: dict[str, EventPort] = self._find_events()
        self._units = Units(description)

    def choose_tolerance(self, tolerance: float | str | None) -> None:
        """Another relative tolerance than the declared one, or ``none``; None changes nothing. FMI 1.0 knows of
        none.
        """
        if tolerance is not None and self.fmi_version > 1:
            self.tolerance = None if isinstance(tolerance, str) else tolerance

    def tolerance_argument(self) -> tuple[dict[str, float], str]:
        """The tolerance as an argument of the call that takes it, and what to say of that call where it fails."""
        if self.tolerance is None:
            return {}, ""
        hint = "where it is the tolerance that it refuses, set another one with the key 'tolerance', or 'none'"
        return {"tolerance": self.tolerance}, f" with the tolerance {self.tolerance:g} ({hint})"

    @property
    def can_save(self) -> bool:
        """Whether the component says that its state can be saved and restored."""
        return self.capabilities.canGetAndSetFMUState

    @property
    def can_vary_step(self) -> bool:
        """Whether the component says that the communication step may vary."""
        return self.capabilities.canHandleVariableCommunicationStepSize

    @property
    def restores_exactly(self) -> bool:
        """Whether its states are known to be exact without a probe: those of blocks and of the FMUs this package
        exports.
        """
        return self.can_save and (self.kind == "block" or self.description.generationTool == OWN_TOOL)

    def names(self, causality: str) -> list[str]:
        """Names of the numeric scalars and elements of one causality, without the triggers, stamps and payloads of
        events.
        """
        hidden = self.event_references() if causality == "input" else set()
        variables = self.description.modelVariables
        found = [
            v
            for v in variables
            if v.causality == causality and v.type in NUMERIC_TYPES and v.valueReference not in hidden
        ]
        return [name for v in found for name in ([e.name for e in elements_of(v)] if v.shape else [v.name])]

    def elements(self, name: str) -> list[Element]:
        """The elements of a variable, row by row; a scalar or a single element is alone.

        Raises:
            CouplingError: there is no such variable or element.
        """
        self.variable(name)
        return self.variables.expanded(name)

    def variable(self, name: str, *causalities: str) -> ModelVariable:
        """The variable of this name, or the array that holds the element of this name.

        Raises:
            CouplingError: there is none, or it has another causality; the nearest names are suggested.
        """
        try:
            found = self.variables[name]
        except KeyError as error:
            array = self.variables.get(name.partition("[")[0])
            if array is not None and array.shape:
                raise CouplingError(
                    f"{self.name}: no element {name!r} in a {described(array)}; the first is 1."
                ) from error
            candidates = [v.name for v in self.variables.values() if not causalities or v.causality in causalities]
            raise CouplingError(f"{self.name}: no variable {name!r}; {nearest(name, candidates)}") from error
        if causalities and found.causality not in causalities:
            raise CouplingError(
                f"{self.name}.{name} has causality '{found.causality}', expected {' or '.join(causalities)}; "
                f"such variables: {', '.join(self.names(causalities[0])) or 'none'}."
            )
        return found

    def unit_name(self, name: str) -> str | None:
        """Name of a variable's unit, its own or that of its declared type; None where there is none."""
        return self._units.name(self.variables[name])

    def unit(self, name: str) -> Unit | None:
        """The unit of a variable from the FMU's own unit definitions, or None where it declares none.

        A relative quantity (a temperature difference) has no offset.

        Raises:
            UnitError: a unit name without definition that cannot be understood.
        """
        try:
            return self._units.of(self.variables[name])
        except UnitError as error:
            raise UnitError(f"{self.name}.{name}: {error}") from error

    def settable(self, name: str) -> ModelVariable:
        """The variable of this name, or the array that holds the element of this name, if a start value can be set.

        Raises:
            CouplingError: there is none, or it cannot be set.
        """
        variable = self.variable(name)
        if variable.causality in ("output", "independent", "calculatedParameter") or variable.variability == "constant":
            what = "is constant" if variable.variability == "constant" else f"has causality '{variable.causality}'"
            raise CouplingError(f"{self.name}.{name} cannot be set: it {what}.")
        if variable.type == "Clock":
            raise CouplingError(f"{self.name}.{name} cannot be set: it is a Clock, which ticks by itself or at events.")
        return variable

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
        prefix = f"{event}_"
        reserved = {f"{event}_time", f"{event}_count"}
        real = {
            n: r
            for n, r in references.items()
            if self.variables[n].type == self.real_type and not self.variables[n].shape
        }
        return {n.removeprefix(prefix): r for n, r in real.items() if n.startswith(prefix) and n not in reserved}
