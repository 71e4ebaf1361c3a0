"""The first step: gains with the least attenuation at a decay rate and a size, and what given gains prove.

Every inequality is recomputed in NumPy with the gains that are returned.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import inf

import numpy as np

from fmu_observer.certificates.bisection import bisected
from fmu_observer.design.cone_solver import RecomputedDesign, first_proven, smallest_eigenvalue
from fmu_observer.design.residual_analysis import minimum_gain
from fmu_observer.design.residual_channel import ResidualChannel
from fmu_observer.design.robust_residual.problem import ResidualProblem
from fmu_observer.design.robust_residual.residual_inequalities import margins, robustness
from fmu_observer.design.robust_residual.residual_solver import ResidualCandidate, candidates
from fmu_observer.models.checks import check_numbers
from fmu_observer.observability import MeasuredSystem, require_detectable

_BISECTIONS = 7
_SLOWEST = 1e-3  # of the decay asked for: below it nothing is sought
_ATTENUATION, _SIZE, _DECAY = "the attenuation (3.56)", "the size of the gains (3.58)", "the decay rate in (3.56)"


@dataclass(frozen=True, eq=False)
class RobustResidualDesign(RecomputedDesign):
    """Gains with their proof.

    Attributes:
        problem: what was asked. gains: K_i, shape (N, n, q) [1/s and the units of the states].
        attenuation: lambda, ``||r|| <= lambda ||eta||`` for every course of the premises.
        lyapunov_matrix: P, shape (n, n).
    """

    problem: ResidualProblem
    gains: np.ndarray
    attenuation: float
    lyapunov_matrix: np.ndarray

    @property
    def size(self) -> float:
        """Largest ``K_i' P K_i``, at most alpha."""
        P = self.lyapunov_matrix
        return max(float(np.linalg.eigvalsh(K.T @ P @ K)[-1]) for K in self.gains)

    @property
    def fault_channels(self) -> list[ResidualChannel]:
        """From the fault to the residual at each vertex."""
        return self.problem.fault_channels(self.gains)

    def sensitivity(self, low: float, high: float = inf) -> float:
        """Least gain from fault to residual over a band, at the vertices held still.

        Args:
            low, high: ends of the band [rad/s]. For a fault of a given length ask `pulse_ratio` of the
                `fault_channels`: most of its energy lies at low frequencies.
        """
        return min(minimum_gain(channel, low, high) for channel in self.fault_channels)

    def explain(self) -> str:
        """One sentence for the user, numbers included."""
        return (
            f"lambda = {self.attenuation:.4g} with M = {self.problem.residual_gain:g}, decay {self.problem.decay:g} "
            f"1/s and K' P K = {self.size:.4g}; {self.recomputed}"
        )


class InfeasibleResidualDesign(ValueError):  # noqa: N818 - what it is, not an "Error" of the program
    """There are no gains for what was asked.

    Args:
        message: what was tried and why it cannot be.

    Attributes:
        constraint: which of the demands cannot be met beside the others.
        nearest_attenuation: least lambda at this decay and size. nearest_decay: largest decay at this attenuation and
            size [1/s]. nearest_alpha: least size at this attenuation and decay. None where there is none, or where it
            is no demand.
    """

    def __init__(
        self,
        message: str,
        constraint: str,
        nearest_attenuation: float | None = None,
        nearest_decay: float | None = None,
        nearest_alpha: float | None = None,
    ) -> None:
        super().__init__(message)
        self.constraint, self.nearest_attenuation = constraint, nearest_attenuation
        self.nearest_decay, self.nearest_alpha = nearest_decay, nearest_alpha


def design_robust_residual(problem: ResidualProblem, attenuation: float | None = None) -> RobustResidualDesign:
    """Gains with the least attenuation lambda: step 1 of Algorithm 3-2, Aguiar Cota 2019, with a decay rate.

    As printed, without decay, the least lambda belongs to gains whose integrators stand still. M is fixed for the same
    reason: with M free the least lambda is that of M = 0. Step 2, the sensitivity of these gains, is
    `RobustResidualDesign.sensitivity` over a band of frequencies, and `proven_sensitivity` over all.

    Args:
        problem: vertices, channels, M, decay and alpha. attenuation: lambda that is demanded; None for the least one.

    Returns:
        The design; every inequality recomputed with its gains.

    Raises:
        InfeasibleResidualDesign: there are no such gains; the message says which demand stands in the way, and the
            nearest values that can be had.
        UnobservableError: a vertex has a mode that neither decays nor is measured; it is named.
        ValueError: the attenuation is not positive.
        ImportError: cvxpy (extra `lmi`) is not installed.
    """
    if attenuation is not None:
        check_numbers("Robust residual", {"attenuation": attenuation})
    for i, A in enumerate(problem.vertices):
        require_detectable(MeasuredSystem(A, problem.C, name=f"Robust residual, vertex {i + 1}"))
    found = _proven(problem)
    if found is None:
        raise _without_gains(problem)
    if attenuation is not None and found.attenuation > attenuation:
        raise _too_strong(problem, found, attenuation)
    return found


def proven_attenuation(problem: ResidualProblem, gains: np.ndarray) -> float:
    """Least lambda that one Lyapunov function proves for given gains, by (3.56); inf where it proves none.

    Args:
        problem: the question; its alpha does not count, its decay does. gains: K_i, shape (N, n, q).

    Raises:
        ValueError: the gains have another shape. ImportError: cvxpy (extra `lmi`) is not installed.
    """
    found = _proven(problem, gains=problem.gains(gains), sized=False)
    return inf if found is None else found.attenuation


def gain_size(problem: ResidualProblem, gains: np.ndarray, attenuation: float | None = None) -> float:
    """Least alpha for which (3.56) and (3.58) hold with given gains; inf where they hold with none.

    Args:
        problem: the question; its alpha does not count. gains: K_i, shape (N, n, q). attenuation: lambda to keep; None
            for any.

    Raises:
        ValueError: the gains have another shape. ImportError: cvxpy (extra `lmi`) is not installed.
    """
    return _least_alpha(problem, attenuation, problem.gains(gains))


# -- what is feasible -------------------------------------------------------------------------------------------------


def _proven(
    problem: ResidualProblem, gains: np.ndarray | None = None, sized: bool = True
) -> RobustResidualDesign | None:
    """A candidate whose inequalities all hold when recomputed, or None."""
    found = first_proven(
        candidates(problem, gains=gains, sized=sized), lambda one: _margins(problem, one, problem.alpha, sized)
    )
    if found is None:
        return None
    candidate, proof = found
    return RobustResidualDesign(proof, candidate.status, problem, candidate.gains, candidate.attenuation, candidate.P)


def _margins(
    problem: ResidualProblem, candidate: ResidualCandidate, alpha: float, sized: bool = True
) -> dict[str, float]:
    P = candidate.P
    L = [P @ K for K in candidate.gains]
    blocks = robustness(problem, P, L, candidate.attenuation**2, alpha, sized)
    return {"P > 0": smallest_eigenvalue(P), **margins(blocks)}


def _least_alpha(problem: ResidualProblem, attenuation: float | None, gains: np.ndarray | None = None) -> float:
    found = first_proven(
        candidates(problem, "alpha", gains, attenuation), lambda one: _margins(problem, one, one.alpha)
    )
    return inf if found is None else found[0].alpha


def _largest_decay(problem: ResidualProblem, attenuation: float | None) -> float | None:
    """Largest decay up to the one asked for at which the other demands are met, by bisection; None if none is."""

    def feasible(decay: float) -> bool:
        found = _proven(replace(problem, decay=decay))
        return found is not None and (attenuation is None or found.attenuation <= attenuation)

    low, high = 0.5 * problem.decay, problem.decay
    while low > _SLOWEST * problem.decay and not feasible(low):  # towards zero the numbers degenerate
        low, high = 0.5 * low, low
    if low <= _SLOWEST * problem.decay:
        return None
    return bisected(feasible, low, high, _BISECTIONS)[0]


def _without_gains(problem: ResidualProblem) -> InfeasibleResidualDesign:
    alpha, decay = _least_alpha(problem, None), _largest_decay(problem, None)
    none = f"no decay down to {_SLOWEST * problem.decay:.3g} 1/s"
    tried = f"decay {problem.decay:g} 1/s and K' P K <= alpha = {problem.alpha:g}, M = {problem.residual_gain:g}"
    slower = f"{none} with this alpha" if decay is None else f"decay {decay:.3g} 1/s with this alpha"
    if alpha < inf:
        advice = f"Nearest found feasible: alpha = {alpha:.4g} with this decay, or {slower}."
        message = f"Robust residual: no gains for {tried}: {_SIZE} stands against the decay. {advice}"
        return InfeasibleResidualDesign(message, _SIZE, nearest_decay=decay, nearest_alpha=alpha)
    message = f"Robust residual: no gains for {tried}, nor with any alpha: {_DECAY} has no common P at the vertices."
    return InfeasibleResidualDesign(f"{message} Nearest found feasible: {slower}.", _DECAY, nearest_decay=decay)


def _too_strong(problem: ResidualProblem, found: RobustResidualDesign, attenuation: float) -> InfeasibleResidualDesign:
    alpha, decay = _least_alpha(problem, attenuation), _largest_decay(problem, attenuation)
    tried = f"lambda = {attenuation:g}, decay {problem.decay:g} 1/s, alpha = {problem.alpha:g}"
    near = [f"lambda = {found.attenuation:.4g} at this decay and alpha"]
    near.append(
        f"no decay down to {_SLOWEST * problem.decay:.3g} 1/s at this lambda and alpha"
        if decay is None
        else f"decay {decay:.3g} 1/s at this lambda and alpha"
    )
    near.append(
        "no alpha at this lambda and decay" if alpha == inf else f"alpha = {alpha:.4g} at this lambda and decay"
    )
    message = f"Robust residual: no gains for {tried}: {_ATTENUATION} is too strong."
    message = f"{message} Nearest found feasible: {'; '.join(near)}."
    size = None if alpha == inf else alpha
    return InfeasibleResidualDesign(message, _ATTENUATION, found.attenuation, decay, size)
