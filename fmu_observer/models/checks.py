"""What every model must be before an observer is built on it: names, signals and matrices. Raises in words where it is
not so.

It knows signals and arrays, and no model.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import isfinite

import numpy as np

from plant_models.hybrid import Signal
from plant_models.repeated_names import repeated_names

_CAUSALITIES = {
    "states": ("local", "state"),
    "inputs": ("input", "input_signal"),
    "measurements": ("input", "input_signal"),
    "unknown_inputs": ("input", "input_signal"),
}


def check_identifiers(where: str, **names: object) -> None:
    """Name and event of a model are identifiers.

    Args:
        where: what is checked, for the message. names: by what they are.

    Raises:
        ValueError: one is not; the message says which.
    """
    for what, name in names.items():
        if not isinstance(name, str) or not name.isidentifier():
            raise ValueError(f"{where}: {what} {name!r} is not a legal identifier: use letters, digits and '_'.")


def check_signals(where: str, **groups: Sequence[Signal]) -> None:
    """States, inputs, measurements and unknown inputs are scalar signals of the right kind, no name where it collides.

    A measurement may have the name of the state it measures; states, inputs and unknown inputs may not share one, for
    the observer's outputs are called like the states and the unknown inputs.

    Args:
        where: for the message. groups: `states`, `inputs`, `measurements`, and `unknown_inputs` where a model has them.

    Raises:
        ValueError: one is not so; the message says which.
    """
    for kind, signals in groups.items():
        causality, maker = _CAUSALITIES[kind]
        for signal in signals:
            if not isinstance(signal, Signal):
                raise ValueError(
                    f"{where}: {kind} holds {signal!r}, expected signals made by {maker}(name, unit, ...)."
                )
            if signal.size is not None or signal.causality != causality:
                raise ValueError(
                    f"{where}: {signal.name!r} in {kind} must be a scalar made by {maker}(name, unit, ...)."
                )
        _check_once(where, kind, [s.name for s in signals])
    unknown = groups.get("unknown_inputs", ())
    kinds = "states, inputs and unknown inputs" if unknown else "states and inputs"
    _check_once(where, kinds, [s.name for signals in (groups["states"], groups["inputs"], unknown) for s in signals])
    for kind in ("states", "measurements"):
        if not groups[kind]:
            raise ValueError(f"{where}: it has no {kind}, expected at least one.")


def checked_matrix(where: str, name: str, value: object, shape: tuple[int, ...], reason: str) -> np.ndarray:
    """The matrix as an array of floats.

    Args:
        where: for the message. name: of the matrix. value: what was given. shape: what is expected. reason: why that
            shape.

    Raises:
        ValueError: it holds something else than finite numbers, or has another shape.
    """
    try:
        array = np.asarray(value, dtype=float)
    except (TypeError, ValueError):
        raise ValueError(f"{where}: {name} is not a matrix of numbers, expected shape {shape} for {reason}.") from None
    if array.shape != shape:
        raise ValueError(f"{where}: {name} has shape {array.shape}, expected {shape} for {reason}.")
    if not np.isfinite(array).all():
        raise ValueError(f"{where}: {name} must hold finite numbers, got {array.tolist()}.")
    return array


def check_numbers(where: str, positive: Mapping[str, float], not_negative: Mapping[str, float] | None = None) -> None:
    """Periods and bounds are numbers that make sense.

    Args:
        where: what is checked, for the message. positive: numbers by name. not_negative: numbers by name.

    Raises:
        ValueError: one is not finite, or too small; the message says which.
    """
    for least, numbers in (("positive", positive), ("not negative", not_negative or {})):
        for name, value in numbers.items():
            number = isinstance(value, int | float | np.number) and isfinite(value)
            if not number or value < 0.0 or (value == 0.0 and least == "positive"):
                raise ValueError(f"{where}: {name} must be finite and {least}, got {value!r}.")


def _check_once(where: str, kind: str, names: Sequence[str]) -> None:
    if twice := repeated_names(names):
        raise ValueError(f"{where}: used more than once among its {kind}: {', '.join(twice)}.")
