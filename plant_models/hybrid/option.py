"""Options of hybrid systems that are numbers, checked where equations are built from them."""

from __future__ import annotations

import numpy as np


def is_number(value: object) -> bool:
    """Whether an option is a real number, infinite ones included; truth values and not-a-number are none.

    Args:
        value: of the option.
    """
    real = isinstance(value, int | float | np.integer | np.floating) and not isinstance(value, bool)
    return real and value == value  # noqa: PLR0124 # not-a-number is not itself


def require_whole(where: str, low: int = 1, high: int | None = None, **options: object) -> None:
    """Refuse an option that is not a whole number, or not within bounds.

    Args:
        where: what asks, for the message. low, high: bounds, both legal; None for no upper one. options: values by
            name.

    Raises:
        ValueError: one is not; the message says which, and what is expected.
    """
    for name, value in options.items():
        whole = isinstance(value, int | np.integer) and not isinstance(value, bool)
        if not whole:
            raise ValueError(f"{where}: {name} must be a whole number, got {value!r}.")
        number = int(value)  # type: ignore[call-overload] # it is whole
        if number < low or (high is not None and number > high):
            legal = f"at least {low}" if high is None else f"{low} to {high}"
            raise ValueError(f"{where}: {name} must be {legal}, got {number}.")
