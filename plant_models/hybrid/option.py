"""Options of hybrid systems: numbers, checked where equations are built from them, and names of members."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from plant_models.registry import Registry
from plant_models.user_file import names_code


class MemberNames(Sequence[str]):
    """The choices of an option that names a member of a registry. ``file.py:Class`` and ``package.module:Class`` are
    legal too, though not listed.

    Args:
        registry: read at each look-up.
    """

    def __init__(self, registry: Registry[Any]) -> None:
        self.registry = registry

    def __getitem__(self, index: Any) -> Any:
        return list(self.registry)[index]

    def __iter__(self) -> Iterator[str]:
        return iter(self.registry)

    def __len__(self) -> int:
        return len(self.registry)

    def __contains__(self, value: object) -> bool:
        return isinstance(value, str) and (value in self.registry or names_code(value))


def is_number(value: object) -> bool:
    """Whether an option is a real number, infinite ones included; truth values and not-a-number are none.

    Args:
        value: of the option.
    """
    real = isinstance(value, int | float | np.integer | np.floating) and not isinstance(value, bool)
    return real and value == value  # noqa: PLR0124 # not-a-number is not itself


def require_chosen(where: str, choices: Mapping[str, Sequence[Any]], **options: object) -> None:
    """Refuse an option that is none of its choices.

    Args:
        where: what asks, for the message. choices: by name of the option, `option_choices` of a system say.
        options: values by name.

    Raises:
        ValueError: one is not; the message says which, and names the choices.
    """
    for name, value in options.items():
        if value not in choices[name]:
            known = ", ".join(map(str, choices[name]))
            raise ValueError(f"{where}: unknown {name} {value!r}; choose one of: {known}.")


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
