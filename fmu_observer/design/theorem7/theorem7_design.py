"""Theorem 7 as a design tool: gains for a model, a gap and a decay, or the attenuation of given gains, checked in
NumPy.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from math import inf, sqrt
from typing import Any, Unpack

import numpy as np

from fmu_observer.design.cone_solver import (
    Attempt,
    RecomputedDesign,
    attempts,
    first_proven,
    largest_feasible,
    load_cvxpy,
    symmetric_value,
)
from fmu_observer.design.theorem7.theorem7_inequalities import (
    Theorem7Options,
    Theorem7Problem,
    Unknowns,
    inequalities,
    margins,
)
from fmu_observer.models.checks import checked_matrix
from fmu_observer.models.known_models import find_takagi_sugeno_model
from fmu_observer.models.takagi_sugeno import TakagiSugenoModel
from fmu_observer.observability import require_detectable_vertices

_Gains = tuple[np.ndarray, np.ndarray]
# strictness asked of every inequality where gamma is minimised, and the solver's tolerances
_ATTEMPTS: tuple[Attempt, ...] = (
    (1e-6, {"tol_gap_abs": 1e-6, "tol_gap_rel": 1e-6, "tol_feas": 1e-7, "tol_ktratio": 1e-6}),
    (1e-6, {}),
    (1e-6, {"static_regularization_constant": 1e-6}),  # for states that differ by decades
    (1e-4, {"static_regularization_constant": 1e-6}),
)


@dataclass(frozen=True, eq=False)
class _Theorem7Candidate:
    """What the solver returned, in scaled coordinates.

    Attributes:
        unknowns: numbers. sampled_gain, continuous_gain: shape (N, n, q). status: the solver's word for it.
    """

    unknowns: Unknowns
    sampled_gain: np.ndarray
    continuous_gain: np.ndarray
    status: str


_DEFAULTS = {"disturbance": True, "scaling": None, "two_vertex": False}
_BISECTIONS = 7
_SMALLEST = 1e-3  # of what was asked: below it nothing is called feasible


@dataclass(frozen=True, eq=False)
class Theorem7Design(RecomputedDesign):
    """Gains with their proof.

    Attributes:
        model: name of the model. gap: tau_M [s]. eta: decay of the sampled gain [1/s]. mu: premise mismatch [1/s].
        gamma: attenuation from noise and disturbance to the error, in the exponentially weighted variables; inf where
            only the decay was asked for.
        sampled_gain: K_i1, shape (N, n, q1). continuous_gain: K_i2, shape (N, n, q2).
        options: the further arguments.
        lyapunov_matrix: P in the coordinates ``T x``, shape (n, n).
    """

    model: str
    gap: float
    eta: float
    mu: float
    gamma: float
    sampled_gain: np.ndarray
    continuous_gain: np.ndarray
    options: Mapping[str, Any]
    lyapunov_matrix: np.ndarray

    def parameters(self) -> dict[str, Any]:
        """Parameters of `GeneralTakagiSugenoCdo` with these gains, by name."""
        return {
            "innovation_decay": self.eta,
            "sampled_gain": tuple(map(float, self.sampled_gain.ravel())),
            "continuous_gain": tuple(map(float, self.continuous_gain.ravel())),
        }

    def explain(self) -> str:
        """One sentence for the user, numbers included."""
        attenuation = "decay only" if self.gamma == inf else f"gamma = {self.gamma:.4g}"
        return (
            f"Theorem 7 holds for {self.model} with gaps up to {self.gap:g} s and eta = {self.eta:g} 1/s: "
            f"{attenuation}; {self.recomputed}"
        )


class InfeasibleDesign(ValueError):  # noqa: N818 - what it is, not an "Error" of the program
    """Theorem 7 has no solution for what was asked.

    Args:
        message: what was tried and why it cannot be.

    Attributes:
        nearest_eta: largest decay found feasible at the gap asked for [1/s]; None when none is, down to a thousandth.
        nearest_gap: longest gap found feasible at the decay asked for [s]; None likewise.
    """

    def __init__(self, message: str, nearest_eta: float | None, nearest_gap: float | None) -> None:
        super().__init__(message)
        self.nearest_eta, self.nearest_gap = nearest_eta, nearest_gap


def design_theorem7(
    model: str | TakagiSugenoModel,
    gap: float,
    eta: float,
    *,
    gains: _Gains | None = None,
    performance: bool = True,
    **options: Unpack[Theorem7Options],
) -> Theorem7Design:
    """Gains of the observer (2.6) with the least gamma, or the least gamma of given gains: Bouchama 2024, Theorem 7.

    Args:
        model: a Takagi-Sugeno model or the name of one.
        gap: longest gap between samples tau_M [s].
        eta: decay rate of the sampled gain; the error is proven to fall as ``exp(-eta t)`` without noise [1/s].
        gains: K_i1 of shape (N, n, q1) and K_i2 of shape (N, n, q2) to analyse; None to seek them.
        performance: seek the least gamma; False asks for the decay only and seeks the largest margin.
        options: mu, disturbance, scaling and two_vertex of `Theorem7Options`.

    Returns:
        The design; every inequality recomputed with the returned gains.

    Raises:
        InfeasibleDesign: there is no solution; the message says what was tried and the nearest feasible eta and gap.
        UnobservableError: a vertex has a mode that does not decay and is not measured; it is named.
        ValueError: an argument is not legal, or the gains have another shape.
        ImportError: cvxpy (extra `lmi`) is not installed.
    """
    chosen = find_takagi_sugeno_model(model)
    problem = Theorem7Problem.of(chosen, gap, eta, **options)
    kept = {name: options.get(name, value) for name, value in _DEFAULTS.items()} | {"performance": performance}
    return _designed(chosen, problem, None if gains is None else _scaled(chosen, problem, gains), kept)


def _designed(
    model: TakagiSugenoModel, problem: Theorem7Problem, gains: _Gains | None, options: Mapping[str, Any]
) -> Theorem7Design:
    """The design in the model's own states, of gains in scaled coordinates or free ones."""
    performance = bool(options["performance"])
    if performance and not (problem.noises or problem.channel):
        raise ValueError(
            f"Theorem 7: {model.name} has neither noise nor disturbance to attenuate; ask with performance=False."
        )
    found = _proven(problem, performance, gains)
    if found is None:
        raise _infeasible(model, problem, performance, gains)
    candidate, proof = found
    T = problem.T[None, :, None]
    return Theorem7Design(
        margins=proof,
        status=candidate.status,
        model=model.name,
        gap=problem.gap,
        eta=problem.eta,
        mu=problem.mu,
        gamma=sqrt(candidate.unknowns.gamma2) if performance else inf,
        sampled_gain=candidate.sampled_gain / T,
        continuous_gain=candidate.continuous_gain / T,
        options=options,
        lyapunov_matrix=candidate.unknowns.P,
    )


def _proven(
    problem: Theorem7Problem, performance: bool, gains: _Gains | None
) -> tuple[_Theorem7Candidate, dict[str, float]] | None:
    """A candidate whose inequalities all hold when recomputed, or None."""
    found = _candidates(problem, performance, gains)
    return first_proven(found, lambda candidate: margins(problem, candidate.unknowns, performance))


def _scaled(model: TakagiSugenoModel, problem: Theorem7Problem, gains: _Gains) -> _Gains:
    wanted = [(model.vertices, model.order, len(C)) for C in (model.C_sampled, model.C_continuous)]
    if len(gains) != len(wanted):
        raise ValueError(
            f"Theorem 7: gains must be a pair, of the sampled and of the continuous outputs; got {len(gains)}."
        )
    arrays = [
        checked_matrix("Theorem 7", f"the {name} gain", K, shape, "vertices, states, measurements")
        for name, K, shape in zip(("sampled", "continuous"), gains, wanted, strict=True)
    ]
    return arrays[0] * problem.T[None, :, None], arrays[1] * problem.T[None, :, None]


# -- what is feasible -------------------------------------------------------------------------------------------------


def largest_eta(model: str | TakagiSugenoModel, gap: float, most: float, **options: Any) -> float | None:
    """Largest decay eta up to `most` [1/s] for which the error can be proven to fall at this gap, by bisection; None if
    none is, down to a thousandth of it.

    Args:
        model: a model or the name of one. gap: longest gap [s]. options: gains, mu, disturbance, scaling, two_vertex of
            `design_theorem7`.
    """
    chosen, gains = find_takagi_sugeno_model(model), options.pop("gains", None)
    problem = Theorem7Problem.of(chosen, gap, most, **options)
    return _largest(problem, "eta", most, None if gains is None else _scaled(chosen, problem, gains))


def largest_gap(model: str | TakagiSugenoModel, eta: float, most: float, **options: Any) -> float | None:
    """Longest gap up to `most` [s] for which the error can be proven to fall with this eta, by bisection; None if none
    is, down to a thousandth of it.

    Args:
        model: a model or the name of one. eta: decay [1/s]. options: as of `largest_eta`.
    """
    chosen, gains = find_takagi_sugeno_model(model), options.pop("gains", None)
    problem = Theorem7Problem.of(chosen, most, eta, **options)
    return _largest(problem, "gap", most, None if gains is None else _scaled(chosen, problem, gains))


def search_eta(
    model: str | TakagiSugenoModel, gap: float, etas: Sequence[float], **options: Any
) -> dict[float, Theorem7Design | None]:
    """A design for each of several decays, the grid search of Remark 8; None where there is none.

    Args:
        model: a model or the name of one. gap: longest gap [s]. etas: decays [1/s]. options: as of `design_theorem7`.
    """
    designs: dict[float, Theorem7Design | None] = {}
    for eta in etas:
        try:
            designs[float(eta)] = design_theorem7(model, gap, eta, **options)
        except InfeasibleDesign:
            designs[float(eta)] = None
    return designs


def _largest(problem: Theorem7Problem, name: str, most: float, gains: _Gains | None) -> float | None:
    """Largest value of a field of the problem at which the decay is feasible, between a thousandth of `most` and
    `most`.
    """

    def feasible(value: float) -> bool:
        return _proven(replace(problem, **{name: value}), False, gains) is not None  # type: ignore[arg-type]

    return largest_feasible(feasible, most, _SMALLEST * most, _BISECTIONS)


def _infeasible(
    model: TakagiSugenoModel, problem: Theorem7Problem, performance: bool, gains: _Gains | None
) -> InfeasibleDesign:
    require_detectable_vertices(model, "Theorem 7")
    eta, gap = _largest(problem, "eta", problem.eta, gains), _largest(problem, "gap", problem.gap, gains)
    tried = [f"gaps up to {problem.gap:g} s", f"eta = {problem.eta:g} 1/s", f"mu = {problem.mu:g}"]
    tried.append("free gains" if gains is None else "the gains given")
    tried.append("decay and attenuation" if performance else "decay only")
    if problem.two_vertex:
        tried.append("both ends of a gap separately")
    if eta == problem.eta:
        advice = "The decay alone is feasible: give other coordinates by `scaling`, or ask with performance=False."
    else:
        near_eta = f"no eta down to {_SMALLEST * problem.eta:.3g} 1/s" if eta is None else f"eta = {eta:.3g} 1/s"
        near_gap = f"no gap down to {_SMALLEST * problem.gap:.3g} s" if gap is None else f"gaps up to {gap:.3g} s"
        advice = f"Nearest found feasible: {near_eta} at this gap; {near_gap} at this eta."
    return InfeasibleDesign(f"Theorem 7 has no solution for {model.name} with {', '.join(tried)}. {advice}", eta, gap)


def _candidates(
    problem: Theorem7Problem, performance: bool, gains: _Gains | None = None
) -> Iterator[_Theorem7Candidate]:
    """Seek values for the unknowns, once with every setting in `_ATTEMPTS`; take the first that proves what is asked.

    Yields:
        What the solver returned, where it is usable.
    """
    cp = load_cvxpy("Design by Theorem 7")
    unknowns = _unknowns(cp, problem, gains)
    margin, strict = cp.Variable(), cp.Parameter()
    matrices = [cp.bmat(rows) for rows in inequalities(problem, unknowns, performance).values()]
    unit = np.eye(problem.order)
    constraints = [matrix << -margin * np.eye(matrix.shape[0]) for matrix in matrices]
    constraints += [unknowns.P >> margin * unit, unknowns.Q >> margin * unit]
    if performance:
        question = cp.Problem(cp.Minimize(unknowns.gamma2), [*constraints, margin == strict])
    else:
        question = cp.Problem(cp.Maximize(margin), [*constraints, cp.trace(unknowns.P) == problem.order])
    for status in attempts(cp, question, strict, _ATTEMPTS if performance else _ATTEMPTS[:1]):
        candidate = _candidate(unknowns, gains, status)
        if candidate is not None:
            yield candidate


def _unknowns(cp: Any, problem: Theorem7Problem, gains: _Gains | None) -> Unknowns:
    n, vertices = problem.order, range(len(problem.A))
    M = cp.Variable((n, n))
    if gains is None:
        w1 = [cp.Variable((n, len(problem.C1))) for _ in vertices]
        w2 = [cp.Variable((n, len(problem.C2))) if len(problem.C2) else None for _ in vertices]
    else:
        w1, w2 = [M.T @ K for K in gains[0]], [M.T @ K if K.size else None for K in gains[1]]
    shapes = ((n, n), (n, n), (n, n), *(((problem.noises, n),) if problem.noises else ()))
    N = [[cp.Variable(shape) for shape in shapes] for _ in vertices]
    symmetric = {"symmetric": True}
    return Unknowns(
        cp.Variable((n, n), **symmetric), cp.Variable((n, n), **symmetric), M, N, w1, w2, cp.Variable(), cp.Variable()
    )


def _candidate(unknowns: Unknowns, gains: _Gains | None, status: str) -> _Theorem7Candidate | None:
    M = np.asarray(unknowns.M.value)
    if not np.all(np.isfinite(M)) or np.linalg.cond(M) > 1e14:
        return None
    if gains is None:
        K1 = np.stack([np.linalg.solve(M.T, w.value) for w in unknowns.w1])
        K2 = np.stack([np.zeros((len(M), 0)) if w is None else np.linalg.solve(M.T, w.value) for w in unknowns.w2])
    else:
        K1, K2 = gains
    numbers = Unknowns(
        P=symmetric_value(unknowns.P),
        Q=symmetric_value(unknowns.Q),
        M=M,
        N=[[_value(block) for block in blocks] for blocks in unknowns.N],
        w1=[M.T @ K for K in K1],
        w2=[M.T @ K for K in K2],
        gamma2=float(_value(unknowns.gamma2)),
        inverse_sigma=float(_value(unknowns.inverse_sigma)),
    )
    return _Theorem7Candidate(numbers, K1, K2, status)


def _value(variable: Any) -> np.ndarray:
    """Its number, zero for an unknown that appears nowhere."""
    return np.zeros(variable.shape) if variable.value is None else np.asarray(variable.value)
