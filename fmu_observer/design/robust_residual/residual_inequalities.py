"""The matrix inequalities (3.56)-(3.58): the same formulas for a solver's unknowns and for numbers, and how far numbers
keep them. Nothing is solved here.

Aguiar Cota 2019, section 3.3. All are to be negative.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from fmu_observer.design.cone_solver import Matrix, Rows, smallest_eigenvalue
from fmu_observer.design.robust_residual.problem import ResidualProblem


def robustness(
    problem: ResidualProblem, P: Matrix, L: Sequence[Matrix], lambda2: Matrix, alpha: Matrix, sized: bool = True
) -> dict[str, Rows]:
    """Decay and attenuation (3.56) with the term ``2 sigma P``, and the bound of the gains (3.58), at every vertex.

    ``[[P A_i - L_i C + (*) + 2 sigma P + M^2 C' C, P D], [D' P, -lambda^2 I]]`` and
    ``[[-alpha I, L_i'], [L_i, -P]]``.

    Args:
        problem: the question. P: shape (n, n). L: ``P K_i``, each of shape (n, q). lambda2: lambda squared, a number.
            alpha: a number. sized: with (3.58).

    Returns:
        Blocks by name.
    """
    C, D, weight = problem.C, problem.disturbance, problem.residual_gain**2
    found: dict[str, Rows] = {}
    for i, A in enumerate(problem.vertices):
        product = P @ A - L[i] @ C
        decrease = product + product.T + 2.0 * problem.decay * P + weight * C.T @ C
        found[f"attenuation (3.56), vertex {i + 1}"] = [
            [decrease, P @ D],
            [D.T @ P, -lambda2 * np.eye(D.shape[1])],
        ]
        if sized:
            found[f"size of the gain (3.58), vertex {i + 1}"] = [[-alpha * np.eye(len(C)), L[i].T], [L[i], -P]]
    return found


def sensitivity(problem: ResidualProblem, gains: np.ndarray, P: Matrix, gamma2: Matrix) -> dict[str, Rows]:
    """``||r|| > gamma ||f||`` at every vertex, (3.57) with its signs.

    ``[[P_f (A_i - K_i C) + (*) - M^2 C' C, P_f K_i F + M^2 C' F], [(*), gamma^2 I - M^2 F' F]]``; the print has it with
    -P_f and -f, and L_f for the gain of the first step.

    Args:
        problem: the question. gains: K_i, shape (N, n, q). P: P_f, symmetric, of any sign, shape (n, n). gamma2: gamma
            squared, a number.

    Returns:
        Blocks by name.
    """
    C, F, weight = problem.C, np.asarray(problem.fault), problem.residual_gain**2
    found: dict[str, Rows] = {}
    for i, (A, K) in enumerate(zip(problem.vertices, gains, strict=True)):
        product = P @ (A - K @ C)
        beside = P @ (K @ F) + weight * C.T @ F
        found[f"sensitivity (3.57), vertex {i + 1}"] = [
            [product + product.T - weight * C.T @ C, beside],
            [beside.T, gamma2 * np.eye(F.shape[1]) - weight * F.T @ F],
        ]
    return found


def margins(blocks: Mapping[str, Rows]) -> dict[str, float]:
    """How far each inequality is from failing: the smallest eigenvalue of its negative, less rounding.

    Args:
        blocks: numbers by name, each to be negative.

    Returns:
        Margins by name; all positive exactly when the numbers prove what was asked.
    """
    return {name: smallest_eigenvalue(-np.block(rows)) for name, rows in blocks.items()}
