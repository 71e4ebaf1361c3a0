"""Units of variables: from the FMU's own unit definitions. Knows descriptions only."""

from __future__ import annotations

from dataclasses import replace

from fmpy.model_description import ModelDescription, ModelVariable
from fmpy.model_description import Unit as DeclaredUnit

from plant_models.hybrid.units import BASE_SYMBOLS, Unit, parse_unit


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
        unit = self._defined(name) or parse_unit(name)
        return replace(unit, offset=0.0) if _is_relative(variable) else unit

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
