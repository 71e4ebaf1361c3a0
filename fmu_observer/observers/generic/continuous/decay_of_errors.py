"""What both unknown-input observers of a model share: numbers that a model may be made of, and whether errors decay."""

from __future__ import annotations

from collections.abc import Sequence
from inspect import signature
from typing import NamedTuple

import numpy as np

from fmu_observer.certificates.polytope import polytope_stability
from fmu_observer.models.known_models import MODELS

NUMBERS: dict[str, tuple[()]] = {name: () for make in MODELS.values() for name in signature(make).parameters}
"""Numbers that models by name are made of, as options of an observer: any value is legal that the model takes."""


class Decay(NamedTuple):
    """Whether errors decay.

    Attributes:
        holds: they do. values: ``abscissa`` [1/s], and for several vertices the `decay` proven [1/s]. statement: in
            words.
    """

    holds: bool
    values: dict[str, float]
    statement: str


def errors_decay(vertices: Sequence[np.ndarray], scaling: Sequence[float] | None = None) -> Decay:
    """Decay of ``de = A_i e``: exact for one matrix, for several by one Lyapunov function, however it moves between.

    Args:
        vertices: shape (n, n) each [1/s]. scaling: n numbers, times which the errors are of one size; None for ones.
    """
    abscissa = max(float(np.linalg.eigvals(A).real.max()) for A in vertices)
    if len(vertices) == 1:
        return Decay(abscissa < 0.0, {"abscissa": abscissa}, "is Hurwitz (abscissa < 0)")
    found = polytope_stability(vertices, scaling)
    return Decay(
        found.holds,
        {"abscissa": abscissa, "decay": found.decay},
        "has one Lyapunov function over all slopes of phi (decay > 0)",
    )
