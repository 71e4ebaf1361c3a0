"""Requirements: what parameters and start values must fulfil before time runs, and what is said where they do not.

A system declares them by `HybridSystem.requirements`, and for start values by `start_requirements`, each as a text and
a condition. Mirrored by `runtime_unfulfilled` of the C runtime. Knows systems, and nothing of time.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np

from plant_models.hybrid.signal import scalar_names

if TYPE_CHECKING:
    from plant_models.hybrid.system import HybridSystem


MOST_NAMED = 4
"""Values that are named of one requirement, as in `runtime/model.h` of the C runtime."""


WORD = re.compile(r"\w+(?:\[[\d,]+\])?")
"""A name of a variable as it stands in a text."""


def named_values(system: HybridSystem, texts: Iterable[str]) -> list[list[int]]:
    """Positions of the parameters and states that texts name, in ascending order: those of parameters in `p`, those of
    states in `x`, counted on from the number of parameters.

    Args:
        system: whose parameters and states are meant. texts: of requirements.
    """
    places = {name: i for i, name in enumerate(_value_names(system))}
    return [sorted({places[word] for word in WORD.findall(text) if word in places}) for text in texts]


def _value_names(system: HybridSystem) -> list[str]:
    """Names of all that a requirement may be about: the parameters, then the states."""
    return list(scalar_names((*system.parameter_signals, *system.states)))


def unfulfilled(system: HybridSystem, p: np.ndarray, start: np.ndarray | None = None) -> str | None:
    """The first requirement that is not fulfilled, with the values of those it names; None where all are.

    Args:
        system: the hybrid system.
        p: its parameters, shape (k,).
        start: state with which time would begin, shape (n,); None where time has begun.
    """
    unpacked = system.unpack_parameters(p)
    needed = system.requirements(unpacked)
    if start is not None:
        needed = {**needed, **system.start_requirements(system.unpack_states(start), unpacked)}
    for text, fulfilled in needed.items():
        if not fulfilled:
            names, (places,) = _value_names(system), named_values(system, [text])
            known = [*p, *(() if start is None else start)]
            values = ", ".join(f"{names[i]} = {float(known[i])!r}" for i in places[:MOST_NAMED])
            return f"{text} ({values})" if values else text
    return None
