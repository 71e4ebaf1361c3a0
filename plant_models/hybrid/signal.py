"""Signals: the names, units and attributes of everything that crosses a boundary.

A `Signal` uses FMI's own words, so that a model description is a transcription and not a translation.
This file imports NumPy, units, and the warning that an output may carry.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from keyword import iskeyword
from sys import float_info
from typing import Any, Literal

import numpy as np

from plant_models.hybrid.units import UnitError, parse_unit

ANNOTATION, ELEMENT = "fmu-observer.output-warning", "OutputWarning"
"""Names under which the description of an exported model carries it."""


@dataclass(frozen=True, slots=True)
class OutputWarning:
    """Warn where an output is not zero, or of a whole run in which it did not reach a number.

    Args:
        text: what that means and what to do, in words that follow the name of the component and begin with a verb or a
            noun, without a full stop.
        shows: outputs of the same system whose values are reported beside it.
        at_end: only the last row of a run counts; otherwise every row does.
        reaches: what the output comes to in a run that is long enough; where it is given, staying below it is what is
            warned of, and other numbers are none.

    Raises:
        ValueError: there is no text.
    """

    text: str
    shows: tuple[str, ...] = ()
    at_end: bool = False
    reaches: float | None = None

    def __post_init__(self) -> None:
        if not self.text.strip():
            raise ValueError("The warning of an output has no text; say what it means that it is not zero.")


Causality = Literal["input", "output", "parameter", "local"]
Variability = Literal["fixed", "tunable", "discrete", "continuous"]
Start = float | tuple[float, ...]


@dataclass(frozen=True, slots=True)
class Signal:
    """One variable of a hybrid system.

    Args:
        name: a legal identifier, unique within its system.
        unit: unit in SI symbols, e.g. ``m/s``, ``kg.m2``; ``1`` for a pure number.
        causality: FMI causality; states and memory are ``local``.
        variability: FMI variability; ``continuous`` states flow, ``discrete`` ones change only in jumps.
        start: start value [unit]; a tuple of `size` values for a vector.
        min: smallest legal value [unit], or None.
        max: largest legal value [unit], or None.
        description: one line for the user.
        size: None for a scalar, else the number of elements of a vector, named ``name[1]`` ... ``name[size]``.
        shape: of a state or parameter that is a matrix, (rows, columns); outside it is a vector of its entries, row by
            row.
        symmetric: whether that vector holds the upper triangle alone.
        display_unit: unit to show at the user's edge, e.g. ``km/h``.
        integer: a whole number to the outside; only a discrete output can be one.
        warning: what is reported after a run in which the value was not zero; of scalar outputs only.
        optional: an input that keeps its start value on purpose where nothing is connected to it: nobody is warned.
        can_be_missing: NaN stands for a value that is missing: an output that may have none, an input that leaves out
            what is missing.

    Raises:
        ValueError: the name is not an identifier or is a keyword, the unit has no meaning, the start is no number or
            does not fit the size, an integer is no
            discrete output, something else than a scalar output warns, something else than an input is optional, or
            what is no number from outside or to it, or an integer, can be missing.
    """

    name: str
    unit: str = "1"
    causality: Causality = "local"
    variability: Variability = "continuous"
    start: Start = 0.0
    min: float | None = None
    max: float | None = None
    description: str = ""
    size: int | None = None
    display_unit: str | None = None
    integer: bool = False
    warning: OutputWarning | None = None
    optional: bool = False
    can_be_missing: bool = False
    shape: tuple[int, int] | None = None
    symmetric: bool = False

    def __post_init__(self) -> None:
        if self.integer and (self.causality, self.variability) != ("output", "discrete"):
            raise ValueError(f"Signal {self.name!r} is an integer; only a discrete output can be one.")
        if self.warning is not None and (self.causality != "output" or self.size is not None):
            raise ValueError(f"Signal {self.name!r} has a warning; only a scalar output can have one.")
        if self.optional and self.causality != "input":
            raise ValueError(f"Signal {self.name!r} is optional; only an input can be.")
        if self.can_be_missing and (self.causality not in ("input", "output") or self.integer):
            raise ValueError(
                f"Signal {self.name!r} can be missing; only an input, or an output that is no integer, is."
            )
        if self.shape is not None and self.causality not in ("local", "parameter"):
            raise ValueError(f"Signal {self.name!r} has the shape {self.shape}; only a state or parameter is a matrix.")
        if not self.name.isidentifier():
            raise ValueError(f"Signal name {self.name!r} is not a legal identifier: use letters, digits and '_'.")
        if iskeyword(self.name) or self.name.startswith("_"):  # it becomes a field of the named tuples `u` and `p`
            raise ValueError(f"Signal name {self.name!r} is a Python keyword or begins with '_'; choose another one.")
        self._check_unit()
        start: object = self.start
        if isinstance(start, str) or start is None:
            raise ValueError(f"Signal {self.name!r} starts with {start!r}; expected a number.")
        if self.size is None:
            if isinstance(self.start, tuple):
                raise ValueError(f"Signal {self.name!r} is a scalar but its start is {self.start!r}.")
        elif not isinstance(self.start, tuple):
            object.__setattr__(self, "start", (float(self.start),) * self.size)
        elif len(self.start) != self.size:
            raise ValueError(f"Signal {self.name!r} has size {self.size} but {len(self.start)} start values.")

    def _check_unit(self) -> None:
        try:
            parse_unit(self.unit)
        except UnitError as error:
            raise ValueError(f"Signal {self.name!r}: {error}") from error

    @property
    def width(self) -> int:
        """Number of scalar variables this signal stands for."""
        return 1 if self.size is None else self.size

    @property
    def dimensions(self) -> tuple[int, ...]:
        """Shape of its value as equations see it, () for a scalar."""
        if self.shape is not None:
            return self.shape
        return () if self.size is None else (self.size,)

    @property
    def scalar_names(self) -> tuple[str, ...]:
        """FMI names of the scalar variables, ``name`` or ``name[1]`` ... ``name[size]``."""
        if self.size is None:
            return (self.name,)
        return tuple(f"{self.name}[{i + 1}]" for i in range(self.size))

    def entries(self, value: Any) -> list[Any]:
        """The numbers of a value, in the order of `scalar_names`.

        Args:
            value: of the shape `dimensions`; in a batch with the members as last dimension.
        """
        if self.size is None:
            return [value]
        if self.shape is None:
            return [value[i] for i in range(self.size)]
        rows, columns = self.shape
        return [value[i, j] for i in range(rows) for j in range(i if self.symmetric else 0, columns)]

    @property
    def bounds(self) -> str:
        """Which values are legal, in words."""
        unit = "" if self.unit == "1" else f" {self.unit}"
        named = (("at least", self.min), ("at most", self.max))
        limits = " and ".join(f"{word} {limit:g}{unit}" for word, limit in named if limit is not None)
        return f"a finite number, {limits}" if limits else "a finite number"

    @property
    def start_values(self) -> tuple[float, ...]:
        """Start values, one for each scalar variable [unit]."""
        return self.start if isinstance(self.start, tuple) else (float(self.start),)


def state(
    name: str,
    unit: str,
    start: Start | np.ndarray = 0.0,
    description: str = "",
    *,
    size: int | None = None,
    shape: tuple[int, int] | None = None,
    symmetric: bool = False,
) -> Signal:
    """A continuous state: flows between events, may jump at them.

    Args:
        name: of the signal. unit: SI, as FMI writes units (``m/s2``).
        start: initial value, one for all elements; a sequence for vectors; for a matrix an array of `shape`, a row for
            all rows, or the sequence of all entries as they stand outside.
        description: one line. size: number of elements of a vector, None for a scalar or a matrix.
        shape: of a matrix, (rows, columns). symmetric: whether only its upper triangle is a state.

    Raises:
        ValueError: see `Signal`; or a symmetric state is no square matrix, or its start is not symmetric.
    """
    first, count = _entries(name, start, size, shape, symmetric)
    kept: dict[str, Any] = {"description": description, "size": count, "shape": shape, "symmetric": symmetric}
    return Signal(name, unit, "local", "continuous", first, **kept)


def memory(name: str, unit: str, start: Start | np.ndarray = 0.0, description: str = "", **further: Any) -> Signal:
    """See `state`: a discrete one, constant between events, which changes only in jumps."""
    return replace(state(name, unit, start, description, **further), variability="discrete")


def input_signal(
    name: str,
    unit: str,
    start: Start = 0.0,
    description: str = "",
    *,
    size: int | None = None,
    variability: Variability = "continuous",
    display_unit: str | None = None,
    optional: bool = False,
    can_be_missing: bool = False,
) -> Signal:
    """An input; `start` is used while nothing is connected to it.

    Args:
        name: of the signal. unit: SI, as FMI writes units (``m/s2``).
        description: one line. size: number of elements of a vector, None for a scalar.
        variability: FMI's word, ``continuous`` or ``discrete``. display_unit: for the user's edge, such as ``km/h``.
        optional: not connected means `start` on purpose, and nobody is warned. For what is absent in most systems (a
            disturbance, a fault, the verdict of another component), not for what the equations live on.
        can_be_missing: NaN is a missing value, which the equations leave out (`hybrid.missing`).
    """
    kept = (None, None, description, size, display_unit)
    return Signal(name, unit, "input", variability, start, *kept, optional=optional, can_be_missing=can_be_missing)


def output_signal(
    name: str,
    unit: str,
    description: str = "",
    *,
    variability: Variability = "continuous",
    display_unit: str | None = None,
    size: int | None = None,
    integer: bool = False,
    warning: OutputWarning | None = None,
    can_be_missing: bool = False,
) -> Signal:
    """An output, computed from time, state, input and parameters.

    Args:
        name: of the signal. unit: SI, as FMI writes units (``m/s2``). description: one line.
        variability: FMI's word. display_unit: for the user's edge. size: number of elements, None for a scalar.
        integer: whether the FMU shows it as an integer variable.
        warning: what is reported after a run in which the value was not zero; None for nothing.
        can_be_missing: NaN is a missing value, where there is none.
    """
    kept = (None, None, description, size, display_unit, integer, warning)
    return Signal(name, unit, "output", variability, 0.0, *kept, can_be_missing=can_be_missing)


def discrete_output(name: str, unit: str, description: str = "", **further: Any) -> Signal:
    """An output that changes at events only.

    Args:
        name, unit, description: as of `output_signal`. further: its other arguments.
    """
    return output_signal(name, unit, description, variability="discrete", **further)


def warning_output(
    name: str,
    description: str,
    text: str,
    shows: tuple[str, ...] = (),
    *,
    at_end: bool = False,
    variability: Variability = "discrete",
) -> Signal:
    """An output without unit that is zero where all is well, and warns where it is not.

    Args:
        name, description, variability: as of `output_signal`. text, shows, at_end: as of `OutputWarning`.
    """
    return output_signal(name, "1", description, variability=variability, warning=OutputWarning(text, shows, at_end))


def standard_normal(name: str, description: str, size: int | None = None) -> Signal:
    """A noise of a periodic event: standard normal numbers, drawn afresh at every instant.

    Args:
        name, description, size: as of `input_signal`.
    """
    return input_signal(name, "1", 0.0, description, size=size, variability="discrete")


def parameter(
    name: str,
    unit: str,
    start: Start | np.ndarray,
    description: str = "",
    *,
    min: float | None = None,
    max: float | None = None,
    variability: Variability = "fixed",
    size: int | None = None,
    shape: tuple[int, int] | None = None,
    symmetric: bool = False,
    display_unit: str | None = None,
) -> Signal:
    """A parameter: fixed after initialisation, or tunable between steps.

    Args:
        name: of the signal. unit: SI, as FMI writes units. start: default. description: one line.
        min, max: bounds, refused beyond them; None for none. variability: ``fixed`` or ``tunable``.
        size: number of elements, None for a scalar or a matrix. shape, symmetric: see `state`.
        display_unit: for the user's edge.
    """
    first, count = _entries(name, start, size, shape, symmetric)
    kept = (first, min, max, description, count, display_unit)
    return Signal(name, unit, "parameter", variability, *kept, shape=shape, symmetric=symmetric)


def _entries(
    name: str, start: Start | np.ndarray, size: int | None, shape: tuple[int, int] | None, symmetric: bool
) -> tuple[Start, int | None]:
    """Start values as they stand outside, and how many; None for a scalar."""
    if shape is None:
        if symmetric:
            raise ValueError(f"Signal {name!r} is symmetric; give its shape (n, n).")
        return tuple(start.tolist()) if isinstance(start, np.ndarray) else start, size
    rows, columns = shape
    asymmetric = f"Signal {name!r} is symmetric; expected a square shape and start, got {shape}, {start}."
    if symmetric and rows != columns:
        raise ValueError(asymmetric)
    count = rows * (rows + 1) // 2 if symmetric else rows * columns
    if np.shape(start) == (count,):
        return tuple(np.asarray(start, dtype=float).tolist()), count
    matrix = np.array(np.broadcast_to(start, shape), dtype=float)
    if symmetric and not np.array_equal(matrix, matrix.T):
        raise ValueError(asymmetric)
    return tuple((matrix[np.triu_indices(rows)] if symmetric else matrix.ravel()).tolist()), count


def scalar_names(signals: Sequence[Signal]) -> tuple[str, ...]:
    """FMI names of all scalar variables of `signals`, in order."""
    return tuple(name for signal in signals for name in signal.scalar_names)


def width(signals: Sequence[Signal]) -> int:
    """Number of scalar variables of `signals`."""
    return sum(signal.width for signal in signals)


def within_bounds(signals: Sequence[Signal], p: Any) -> dict[str, Any]:
    """Requirements that parameters are finite and lie within their `min` and `max`.

    Args:
        signals: of the parameters.
        p: named tuple of all parameters, their values plain or traced.

    Returns:
        By text, with the name of the parameter and what is legal: 1 where it is fulfilled, else 0.
    """
    needed = {}
    for signal in signals:
        low = -float_info.max if signal.min is None else signal.min
        high = float_info.max if signal.max is None else signal.max
        for name, value in zip(signal.scalar_names, signal.entries(getattr(p, signal.name)), strict=True):
            needed[f"{name} must be {signal.bounds}"] = np.where(value >= low, np.where(value <= high, 1.0, 0.0), 0.0)
    return needed
