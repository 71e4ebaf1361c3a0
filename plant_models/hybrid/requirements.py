"""Requirements: what parameters must fulfil before time runs, and what is said where they do not.

A system declares them by `HybridSystem.requirements`, each as a text and a condition. Mirrored by `runtime_unfulfilled`
of the C runtime. Knows systems, and nothing of time.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from sys import float_info
from typing import TYPE_CHECKING, Any

import numpy as np

from plant_models.hybrid.signal import Signal, scalar_names

if TYPE_CHECKING:
    from plant_models.hybrid.system import HybridSystem


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
        values = getattr(p, signal.name)
        for i, name in enumerate(signal.scalar_names):
            value = values if signal.size is None else values[i]
            needed[f"{name} must be {signal.bounds}"] = np.where(value >= low, np.where(value <= high, 1.0, 0.0), 0.0)
    return needed


def named_parameters(system: HybridSystem, text: str) -> list[int]:
    """Positions in `p` of the parameters that a text names, in the order of the parameters.

    Args:
        system: whose parameters are meant.
    """
    return [
        i
        for i, name in enumerate(scalar_names(system.parameter_signals))
        if re.search(rf"(?<!\w){re.escape(name)}(?![\w\[])", text)
    ]


def unfulfilled(system: HybridSystem, p: np.ndarray) -> str | None:
    """The first requirement that parameters do not fulfil, with the values of those it names; None where they fulfil
    all.

    Args:
        system: the hybrid system.
        p: its parameters, shape (k,).
    """
    for text, fulfilled in system.requirements(system.unpack_parameters(p)).items():
        if not fulfilled:
            names = scalar_names(system.parameter_signals)
            values = ", ".join(f"{names[i]} = {float(p[i])!r}" for i in named_parameters(system, text))
            return f"{text} ({values})" if values else text
    return None
