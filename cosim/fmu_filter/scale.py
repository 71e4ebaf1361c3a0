"""In which unit a filter over an FMU counts a signal: that of the FMU where everybody understands its name, else SI.
Values only.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

from fmpy.model_description import ModelDescription, ModelVariable

from cosim.results.si import NAMED
from fmus.fmi.units import Units, named_unit
from plant_models.hybrid.units import BASE_SYMBOLS, Unit


@dataclass(frozen=True)
class Scale:
    """``shown = factor * value of the FMU + offset``.

    Attributes:
        unit: of what is shown, a name that everybody understands. factor, offset: see above.
    """

    unit: str = "1"
    factor: float = 1.0
    offset: float = 0.0

    @property
    def is_plain(self) -> bool:
        """Whether nothing is converted."""
        return self.factor == 1.0 and self.offset == 0.0

    def shown(self, value: float) -> float:
        """A value of the FMU as it is shown."""
        return self.factor * value + self.offset

    def own(self, value: float) -> float:
        """A value that is shown as the FMU has it."""
        return (value - self.offset) / self.factor

    @property
    def of_deviations(self) -> Scale:
        """That of standard deviations: without an offset, which two values have in common, and without a sign."""
        meaning, unit = named_unit(self.unit).unit, self.unit
        if meaning is not None and meaning.offset != 0.0:
            unit = _in_si(meaning) if meaning.factor == 1.0 else f"{unit}/1"  # within a quotient a unit has no offset
        return replace(self, unit=unit, factor=abs(self.factor), offset=0.0)


def scale_of(description: ModelDescription, variable: ModelVariable) -> Scale:
    """The scale of a variable. What has no unit, or one that nothing explains, is shown as it is.

    Args:
        description: of the FMU. variable: of it.
    """
    named = Units(description).named(variable)
    if named is None or named.unit is None:
        return Scale()
    if named_unit(named.name).unit == named.unit:
        return Scale(named.name)
    return Scale(_in_si(named.unit), named.unit.factor, named.unit.offset)


def shown(scales: Mapping[str, Scale], values: dict[str, float]) -> dict[str, float]:
    """Values of the FMU as they are shown.

    Args:
        scales: of those that are converted, by name. values: by name; they are changed.
    """
    for name, scale in scales.items():
        if name in values:
            values[name] = scale.shown(values[name])
    return values


def _in_si(unit: Unit) -> str:
    powers = [f"{symbol}{power}" for symbol, power in zip(BASE_SYMBOLS, unit.exponents, strict=True) if power]
    return NAMED.get(unit.exponents) or ".".join(powers) or "1"
