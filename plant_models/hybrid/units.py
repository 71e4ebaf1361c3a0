"""Units: what a unit name such as ``kg.m2/s3`` or ``km/h`` stands for in SI base units.

Used by the model descriptions (BaseUnit) and by the master (conversion at connections). Standard library only.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass

BASE_SYMBOLS = ("kg", "m", "s", "A", "K", "mol", "cd", "rad")


class UnitError(ValueError):
    """A unit name that cannot be understood, or two units that cannot be converted into each other."""


@dataclass(frozen=True, slots=True)
class Unit:
    """``value_in_SI = factor * value + offset`` with the exponents of the SI base units.

    Args:
        exponents: powers of kg, m, s, A, K, mol, cd, rad.
        factor: scale to SI.
        offset: shift to SI, for temperatures.
    """

    exponents: tuple[int, ...]
    factor: float = 1.0
    offset: float = 0.0


def _unit(factor: float, offset: float = 0.0, **powers: int) -> Unit:
    return Unit(tuple(powers.get(symbol, 0) for symbol in BASE_SYMBOLS), factor, offset)


_SYMBOLS: dict[str, Unit] = {
    **{symbol: _unit(1.0, **{symbol: 1}) for symbol in BASE_SYMBOLS},
    "1": _unit(1.0),
    "-": _unit(1.0),
    "%": _unit(1e-2),
    "permille": _unit(1e-3),
    "g": _unit(1e-3, kg=1),
    "t": _unit(1e3, kg=1),
    "L": _unit(1e-3, m=3),
    "km": _unit(1e3, m=1),
    "cm": _unit(1e-2, m=1),
    "mm": _unit(1e-3, m=1),
    "ms": _unit(1e-3, s=1),
    "min": _unit(60.0, s=1),
    "h": _unit(3600.0, s=1),
    "Hz": _unit(1.0, s=-1),
    "N": _unit(1.0, kg=1, m=1, s=-2),
    "kN": _unit(1e3, kg=1, m=1, s=-2),
    "J": _unit(1.0, kg=1, m=2, s=-2),
    "W": _unit(1.0, kg=1, m=2, s=-3),
    "kW": _unit(1e3, kg=1, m=2, s=-3),
    "MW": _unit(1e6, kg=1, m=2, s=-3),
    "Pa": _unit(1.0, kg=1, m=-1, s=-2),
    "kPa": _unit(1e3, kg=1, m=-1, s=-2),
    "bar": _unit(1e5, kg=1, m=-1, s=-2),
    "V": _unit(1.0, kg=1, m=2, s=-3, A=-1),
    "Ohm": _unit(1.0, kg=1, m=2, s=-3, A=-2),
    "H": _unit(1.0, kg=1, m=2, s=-2, A=-2),
    "Wb": _unit(1.0, kg=1, m=2, s=-2, A=-1),
    "deg": _unit(math.pi / 180.0, rad=1),
    "rpm": _unit(math.pi / 30.0, rad=1, s=-1),
    "degC": _unit(1.0, 273.15, K=1),
    "mph": _unit(0.44704, m=1, s=-1),
}
_SYMBOL_AND_POWER = re.compile(r"([A-Za-z]+)\^?(-?\d+)")
_GROUP = r"(?:[^()/]+|\([^()/]+\))"
_NAME = re.compile(rf"{_GROUP}(?:/{_GROUP})*")


def parse_unit(name: str) -> Unit:
    """The meaning of a unit name: products with ``.`` or ``*``, quotients with ``/``, integer powers behind a symbol.

    Args:
        name: e.g. ``m/s``, ``kg.m2``, ``N.s2/m2``, ``J/(kg.K)``, ``s-1``, ``km/h``, ``1``; empty for a pure number.
            After a ``/`` everything up to the next ``/`` is divided by, with or without parentheses; no ``/`` within
            them.

    Raises:
        UnitError: a symbol is unknown, or the name is not such an expression.
    """
    plain = name.replace(" ", "") or "1"
    if _NAME.fullmatch(plain) is None:
        raise UnitError(
            f"cannot read unit {name!r}: expected products and quotients of symbols, like 'kg.m2/s' or 'J/(kg.K)'"
        )
    if plain in _SYMBOLS:
        return _SYMBOLS[plain]
    exponents = [0] * len(BASE_SYMBOLS)
    factor = 1.0
    numerator, *denominators = (group.strip("()") for group in plain.split("/"))
    for sign, group in [(1, numerator), *((-1, d) for d in denominators)]:
        for token in re.split(r"[.*]", group):
            symbol, power = _symbol_and_power(token, name)
            power *= sign
            exponents = [e + power * s for e, s in zip(exponents, symbol.exponents, strict=True)]
            factor *= symbol.factor**power
    # a shifted unit within a product or quotient is a difference, without the shift
    return Unit(tuple(exponents), factor)


def conversion(source: Unit, target: Unit) -> tuple[float, float]:
    """``(factor, offset)`` with ``value_in_target = factor * value_in_source + offset``.

    Angles in rad are treated as pure numbers, as SI does.

    Args:
        source, target: units with their factors, offsets and exponents of the SI base units.

    Raises:
        UnitError: the units measure different things, or one of them nothing: its factor is zero or not finite.
    """
    if source.exponents[:-1] != target.exponents[:-1]:
        raise UnitError(f"different dimensions: {_dimension(source)} and {_dimension(target)}")
    if source.factor == 0.0 or target.factor == 0.0 or not all(map(math.isfinite, (*_scale(source), *_scale(target)))):
        raise UnitError(f"a unit with the factor and offset {_scale(source)} or {_scale(target)} measures nothing")
    return source.factor / target.factor, (source.offset - target.offset) / target.factor


def _scale(unit: Unit) -> tuple[float, float]:
    return unit.factor, unit.offset


def _symbol_and_power(token: str, name: str) -> tuple[Unit, int]:
    if token in _SYMBOLS:
        return _SYMBOLS[token], 1
    match = _SYMBOL_AND_POWER.fullmatch(token)
    if match is None or match[1] not in _SYMBOLS:
        raise UnitError(f"unknown unit symbol {token!r} in {name!r}; known: {', '.join(sorted(_SYMBOLS))}")
    return _SYMBOLS[match[1]], int(match[2])


def _dimension(unit: Unit) -> str:
    powers = [f"{s}{'' if e == 1 else e}" for s, e in zip(BASE_SYMBOLS, unit.exponents, strict=True) if e]
    return ".".join(powers) or "1"
