"""Certificates of continuous-discrete observers: every mixture of gaps up to a limit, by one Lyapunov function.

It uses the exact transitions of `gap_error` and the candidates of `quadratic`, and believes only what it recomputes.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache, reduce
from math import inf

import numpy as np

from fmu_observer.certificates.bisection import bisected
from fmu_observer.certificates.finding import Finding, remark
from fmu_observer.certificates.gap_error import GapError, first_unstable_gap, rows_of
from fmu_observer.certificates.gap_findings import gap_finding
from fmu_observer.certificates.quadratic import (
    MARGIN,
    Decrease,
    QuadraticCondition,
    best_decrease,
    flow_condition,
    inequalities,
    largest_between,
    transition_condition,
)
from fmu_observer.certificates.switching_error import SwitchingError

_SHORTEST_HORIZON = 20.0  # [s]
_COARSE, _FINE = 12, 2400  # gaps a vertex for finding the Lyapunov matrix, and for checking it
_CUTS = 4
_SMALLEST_LIMIT = 1e-4  # of the constant limit: below it no aperiodic limit was found
_LARGEST_GROWTH = 1e60  # over a gap: more is beyond what a quadratic form in floating point can judge
_LIMIT_TOLERANCE = 2e-4  # relative width of the last bisection interval


def certify_sampled_error(
    vertices: tuple[GapError, ...], max_gap: float, error_model: str, *, switching: bool = False
) -> Finding:
    """Certificate of an observer whose error is that of one of the vertices over each gap, or always between them.

    Args:
        vertices: error equations, one for each corner of what is uncertain, all of one size. max_gap: longest gap asked
            for [s]. error_model: the error equations in words, and what they leave out.
        switching: the error equations may change at any time within a gap, to any of the vertices' hull; what is
            certified holds for that. Otherwise they change from gap to gap only.

    Returns:
        What is found about the gaps.

    Raises:
        ValueError: the vertices are errors of different components, or switch and do not share one linear reset.
    """
    _require_comparable(vertices)
    horizon = _longest_searched(max_gap)
    constant_limit = first_unstable_gap(vertices, horizon)
    found = _common_decrease(vertices, max_gap, switching)
    holds = found.holds
    limit = aperiodic_limit(vertices, horizon, switching)
    return gap_finding(
        max_gap,
        horizon,
        constant_limit=constant_limit,
        mixed_limit=max(limit, max_gap) if holds else limit,  # the bisection stops a little below the limit
        growth=max(vertex.spectral_radius(max_gap) for vertex in vertices),
        decrease=found.margin,
        holds=holds,
        error_model=error_model,
        remarks=_left_out(vertices[0], max_gap),
        matrix=rows_of(found.P),
    )


def _longest_searched(gap: float) -> float:
    return max(_SHORTEST_HORIZON, 4.0 * gap)


def _require_comparable(vertices: tuple[GapError, ...]) -> None:
    if not all(vertices[0].comparable(vertex) for vertex in vertices):
        raise ValueError(
            "Certificate: the vertices must be errors of the same components, reset in the same way; they are not."
        )


def _left_out(vertex: GapError, max_gap: float) -> tuple[str, ...]:
    """A note where the error does not fall in a gap of zero, and no derivative there covers short ones."""
    if vertex.continuous_limit is not None or vertex.spectral_radius(0.0) < 1.0 - MARGIN:
        return ()
    return (f"gaps below {max_gap / (_FINE + 1):.2g} s are left out",)


def with_switching_noted(found: Finding, vertices: tuple[GapError, ...], what: str) -> Finding:
    """The finding of errors constant over each gap, with a remark whether it holds where they change within gaps too.

    Args:
        found: of `vertices`. what: changes, in the plural, for the words.
    """
    assert found.demand is not None, "a finding about a gap"
    covered = "covered too"
    if _left_out(vertices[0], found.demand):
        covered = "not evaluated"
    elif not _common_decrease(vertices, found.demand, True).holds:
        limit = aperiodic_limit(vertices, _longest_searched(found.demand), switching=True)
        covered = f"covered up to {limit:.4g} s only" if limit > 0.0 else "covered for no gap that was tried"
    return found.also(remark(f"{what} that change within a gap are {covered}"))


@lru_cache(maxsize=256)
def aperiodic_limit(vertices: tuple[GapError, ...], horizon: float, switching: bool = False) -> float:
    """Longest gap [s] up to which one quadratic Lyapunov function covers all gaps; inf if it covers the horizon.

    By bisection: a function that covers a set of gaps covers every smaller one. With `switching` see
    `certify_sampled_error`.

    Args:
        vertices: error equations of the vertices.
    """
    bound = min(first_unstable_gap(vertices, horizon), horizon)
    if bound == horizon and _common_decrease(vertices, horizon, switching).holds:
        return inf

    def covered(longest: float) -> bool:
        return _common_decrease(vertices, longest, switching).holds

    return bisected(covered, 0.0, bound, width=_LIMIT_TOLERANCE, least=_SMALLEST_LIMIT * bound)[0]


@lru_cache(maxsize=256)
def _common_decrease(vertices: tuple[GapError, ...], longest: float, switching: bool) -> Decrease:
    """Seek one P for all vertices and all gaps in (0, longest] on a coarse grid, and recompute on a fine one.

    Where the fine grid finds a gap that the candidate does not cover, that gap joins the coarse grid. What is switching
    is evaluated at the centre of the vertices, with the most that changes within a gap may add to it.
    """
    scale = _scaling(vertices)
    with np.errstate(over="ignore", invalid="ignore"):
        fine = [_conditions(vertex, longest, _FINE, scale) for vertex in vertices]
    if not all(np.abs(condition.N).max() < _LARGEST_GROWTH for condition in fine):  # NaN included
        return Decrease(-inf, None)
    sought = _pick(fine, range(0, _FINE + 1, _FINE // _COARSE))
    inclusion = SwitchingError.between(vertices) if switching else None
    evaluated = fine if inclusion is None else [_conditions(inclusion.centre, longest, _FINE, scale)]

    def recomputed(P: np.ndarray) -> tuple[float, list[int]]:
        values = [inequalities(condition, P) for condition in evaluated]
        if inclusion is not None:
            values[0] += _growth(inclusion, P / np.outer(scale, scale), longest)[:, None, None] * P
        worst = {int(np.linalg.eigvalsh(v)[:, -1].argmax()) for v in values}
        return -max(largest_between(v) for v in values), sorted(worst)

    found = best_decrease(sought, recomputed, lambda known, worst: known.joined(_pick(fine, worst)), _CUTS)
    return found.unscaled(scale)


def _growth(inclusion: SwitchingError, P: np.ndarray, longest: float) -> np.ndarray:
    """What changes within a gap add to the inequalities of the centre, in units of P, shape (FINE + 1,)."""
    if inclusion.centre.continuous_limit is None:  # not divided by the gap: see `_conditions`
        gaps = longest / (_FINE + 1) * np.arange(1, _FINE + 2)
        return np.asarray(inclusion.growth(P, longest, gaps) * gaps)
    return np.asarray(inclusion.growth(P, longest, np.linspace(0.0, longest, _FINE + 1)) / inclusion.centre.rate)


def _conditions(vertex: GapError, longest: float, count: int, scale: np.ndarray) -> QuadraticCondition:
    """``(Phi' P Phi - P) / (rate gap) < 0`` at gaps from 0 to `longest`, in scaled coordinates.

    At gap 0 the quotient is the derivative: the condition of the flow for infinitely frequent samples.
    """
    scaling = scale[None, :] / scale[:, None]
    limit = vertex.continuous_limit
    # the resets alone contract: nothing to divide by the gap, and no gap shorter than the first of the grid
    if limit is None:
        return transition_condition(vertex.transitions(longest, count + 1)[1] * scaling)
    gaps, matrices = vertex.transitions(longest, count)
    start = flow_condition(limit * scaling / vertex.rate)
    return start.joined(transition_condition(matrices * scaling, vertex.rate * gaps))


def _pick(conditions: list[QuadraticCondition], indices: Sequence[int]) -> QuadraticCondition:
    parts = [condition.picked(indices) for condition in conditions]
    return reduce(QuadraticCondition.joined, parts)


def _scaling(vertices: tuple[GapError, ...]) -> np.ndarray:
    """Size of the error components relative to the first, at the fastest rate of the vertices."""
    return vertices[0].units(max(vertex.rate for vertex in vertices))
