"""Units of variables: from the FMU's own unit definitions. Knows descriptions only."""

from __future__ import annotations

from dataclasses import dataclass, replace

from fmpy.model_description import ModelDescription, ModelVariable
from fmpy.model_description import Unit as DeclaredUnit

from plant_models.hybrid.units import BASE_SYMBOLS, Unit, UnitError, conversion, parse_unit


@dataclass(frozen=True)
class NamedUnit:
    """A unit and what a file calls it.

    Args:
        name: as the file has it. unit: what it is; None where nothing says it.
    """

    name: str
    unit: Unit | None

    def to(self, other: NamedUnit) -> tuple[float, float]:
        """``(factor, offset)`` that bring a number in this unit to the other one; what nothing explains goes to what is
        called the same.

        Args:
            other: unit of the receiver.

        Raises:
            UnitError: numbers cannot be brought from one to the other; the message says why.
        """
        if self.unit is not None and other.unit is not None:
            return conversion(self.unit, other.unit)
        if self.name == other.name:
            return 1.0, 0.0
        raise UnitError(
            f"nothing defines the unit {(self if self.unit is None else other).name!r}, so numbers cannot be brought "
            f"from {self.name!r} to {other.name!r}; define it in the file that names it"
        )

    def fits(self, other: NamedUnit) -> bool:
        """Whether a number in this unit can be brought to the other one.

        Args:
            other: unit of the receiver.
        """
        try:
            self.to(other)
        except UnitError:
            return False
        return True


def named_unit(name: str) -> NamedUnit:
    """The unit that everybody understands by a name.

    Args:
        name: such as ``km/h``.
    """
    try:
        return NamedUnit(name, parse_unit(name))
    except UnitError:
        return NamedUnit(name, None)


class Units:
    """The units a model description defines.

    Args:
        description: of the FMU.
    """

    def __init__(self, description: ModelDescription) -> None:
        self._declared: dict[str, DeclaredUnit] = {u.name: u for u in description.unitDefinitions}

    @staticmethod
    def name(variable: ModelVariable) -> str | None:
        """Name of a variable's unit, its own or that of its declared type; None where there is none."""
        declared = variable.declaredType
        found: str | None = variable.unit or (declared.unit if declared is not None else None)
        return found

    def of(self, variable: ModelVariable) -> Unit | None:
        """The unit of a variable, or None where it declares none. A relative quantity has no offset.

        Raises:
            UnitError: a unit name without definition that cannot be understood.
        """
        name = self.name(variable)
        if name is None:
            return None
        unit = self.meaning(name)
        return replace(unit, offset=0.0) if _is_relative(variable) else unit

    def meaning(self, name: str) -> Unit:
        """What a unit name stands for, by the description's own definition or else as everybody understands it.

        Raises:
            UnitError: nothing defines it.
        """
        return self._defined(name) or parse_unit(name)

    def named(self, variable: ModelVariable) -> NamedUnit | None:
        """The unit of a variable with its name, or None where it declares none."""
        name = self.name(variable)
        try:
            return None if name is None else NamedUnit(name, self.of(variable))
        except UnitError:
            return NamedUnit(str(name), None)

    def displayed(self, variable: ModelVariable) -> NamedUnit | None:
        """The display unit of a variable with its name and what it is in SI; None where it declares none, or nothing
        says what it is. Where everybody understands the name, that is what it means.
        """
        declared, own = variable.declaredType, self.named(variable)
        name = variable.displayUnit or (declared.displayUnit if declared is not None else None)
        if name is None or own is None:
            return None
        found = NamedUnit(name, self._displayed(name, own))
        if found.unit is None or (own.unit is not None and not found.fits(own)):
            return None
        return replace(found, unit=replace(found.unit, offset=0.0)) if _is_relative(variable) else found

    def _displayed(self, name: str, own: NamedUnit) -> Unit | None:
        known, unit = named_unit(name).unit, own.unit or Unit((0,) * len(BASE_SYMBOLS))
        of_unit = self._declared.get(own.name)
        display = next((d for d in of_unit.displayUnits if d.name == name), None) if of_unit is not None else None
        if known is not None or display is None:
            return known or self._defined(name)
        factor = unit.factor / display.factor if display.factor else 0.0
        return replace(unit, factor=factor, offset=unit.offset - factor * display.offset)

    def _defined(self, name: str) -> Unit | None:
        defined = self._declared.get(name)
        if defined is None or defined.baseUnit is None:
            return None
        base = defined.baseUnit
        powers = tuple(int(getattr(base, symbol) or 0) for symbol in BASE_SYMBOLS)
        return Unit(powers, 1.0 if base.factor is None else float(base.factor), float(base.offset or 0.0))


def _is_relative(variable: ModelVariable) -> bool:
    declared, own = variable.declaredType, variable.relativeQuantity
    return bool(declared is not None and declared.relativeQuantity) if own is None else bool(own)
