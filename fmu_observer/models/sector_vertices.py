"""Sector nonlinearity: from matrices that depend on premises to the vertices of an exact Takagi-Sugeno model. Plain
NumPy.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from fmu_observer.models.takagi_sugeno import Premise, TakagiSugenoModel

PremiseMatrix = Callable[[np.ndarray], Any]  # (premise values of shape (p,)) -> a matrix
_ROUNDING = 1e-9  # relative, of a matrix that is affine in a premise
_TRIALS = 12


def sector_nonlinearity(
    premises: tuple[Premise, ...], A: PremiseMatrix, B: PremiseMatrix, **model: Any
) -> TakagiSugenoModel:
    """The model ``dx = A(f) x + B(f) u`` with premises ``f_j(x, u)``, as blended vertices: Bouchama 2024, (2.1)-(2.3).

    The vertices are the matrices at the corners of the box of premises. Product memberships blend them exactly wherever
    A and B are affine in each premise for fixed others; that is tried at points inside the box.

    Args:
        premises: p premises with bounds.
        A: premise values, shape (p,), to shape (n, n). B: likewise to shape (n, m).
        model: everything else a `TakagiSugenoModel` asks for, by name.

    Returns:
        The model; inside the bounds ``sum h_i A_i = A(f)``, beyond them the matrices of the nearest point of the box.

    Raises:
        ValueError: there is no premise, or a matrix is not affine in a premise; the message names it and what to do.
    """
    if not premises:
        raise ValueError("Sector nonlinearity needs at least one premise; a linear model is an ObserverModel.")
    corners = [
        np.array([p.high if i >> j & 1 else p.low for j, p in enumerate(premises)]) for i in range(2 ** len(premises))
    ]
    for name, matrix in (("A", A), ("B", B)):
        _check_affine(name, matrix, premises)
    return TakagiSugenoModel(
        premises=premises,
        A=np.stack([np.asarray(A(corner), dtype=float) for corner in corners]),
        B=np.stack([np.asarray(B(corner), dtype=float) for corner in corners]),
        **model,
    )


def _check_affine(name: str, matrix: PremiseMatrix, premises: tuple[Premise, ...]) -> None:
    generator = np.random.default_rng(0)
    low, high = np.array([p.low for p in premises]), np.array([p.high for p in premises])
    for _ in range(_TRIALS):
        values, share = generator.uniform(low, high), generator.uniform(0.1, 0.9)
        for j, premise in enumerate(premises):
            at_low, at_high, between = values.copy(), values.copy(), values.copy()
            at_low[j], at_high[j], between[j] = low[j], high[j], (1.0 - share) * low[j] + share * high[j]
            ends = np.asarray(matrix(at_low), dtype=float), np.asarray(matrix(at_high), dtype=float)
            error = np.abs(np.asarray(matrix(between), dtype=float) - (1.0 - share) * ends[0] - share * ends[1])
            size = max(np.abs(ends[0]).max(initial=0.0), np.abs(ends[1]).max(initial=0.0), 1e-300)
            if error.max(initial=0.0) > _ROUNDING * size:
                raise ValueError(
                    f"Sector nonlinearity: {name} is not affine in premise {premise.name!r} (off by {error.max():.3g} "
                    f"inside its "
                    f"bounds). Make the nonlinear term itself a premise, so that {name} is affine in it."
                )
