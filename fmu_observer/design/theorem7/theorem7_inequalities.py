"""The matrix inequalities of Theorem 7: the same formulas for a solver's unknowns and for numbers, and how far numbers
keep them. Nothing is solved here.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypedDict, Unpack

import numpy as np

from fmu_observer.design.cone_solver import Matrix, Rows, smallest_eigenvalue
from fmu_observer.models.checks import check_numbers
from fmu_observer.models.takagi_sugeno import TakagiSugenoModel


class Theorem7Options(TypedDict, total=False):
    """What Theorem 7 may be asked beside gap and decay.

    Attributes:
        mu: bound of the premise mismatch [1/s], 0 without it; the thesis prints none.
        disturbance: with the channel of G and w, as without it. Without it the least gamma is met by ignoring the
            continuous output.
        scaling: n positive numbers T; errors are measured, and the problem solved, in ``T x``; None for the model's
            own. Needed where states differ by decades.
        two_vertex: the sharper variant that asks at the beginning and the end of a gap separately.
    """

    mu: float
    disturbance: bool
    scaling: Sequence[float] | None
    two_vertex: bool


@dataclass(frozen=True, eq=False)
class Theorem7Problem:
    """What Theorem 7 is asked: a model in the coordinates ``z = T x``, a longest gap and a decay.

    Attributes:
        A: shape (N, n, n). C1: shape (q1, n). C2: shape (q2, n). D: shape (q2, nv).
        channel: largest eigenvalue of G'G, the strength of the disturbance channel; 0 leaves the channel out.
        gap: tau_M [s]. eta: decay rate of the sampled gain, and the rate at which the error is to fall [1/s].
        mu: bound of the premise mismatch, ``|sum (h_i(x) - h_i(xh)) (A_i x + B_i u)| <= mu |e|`` [1/s]; 0 for exact
        premises.
        two_vertex: impose the beginning and the end of a gap separately, which is sharper and costs twice.
        T: shape (n,), the scaling of the coordinates.
    """

    A: np.ndarray
    C1: np.ndarray
    C2: np.ndarray
    D: np.ndarray
    channel: float
    gap: float
    eta: float
    mu: float
    two_vertex: bool
    T: np.ndarray

    @classmethod
    def of(
        cls, model: TakagiSugenoModel, gap: float, eta: float, **options: Unpack[Theorem7Options]
    ) -> Theorem7Problem:
        """The question for a model.

        Args:
            model: with a sampled measurement. gap: longest [s]. eta: decay [1/s]. options: see `Theorem7Options`.

        Raises:
            ValueError: gap, eta or mu is not a legal number, or the scaling is not n positive numbers.
        """
        mu, scaling = options.get("mu", 0.0), options.get("scaling")
        check_numbers("Theorem 7", {"gap": gap}, {"eta": eta, "mu": mu})
        T = np.asarray(model.scaling if scaling is None else scaling, dtype=float)
        if T.shape != (model.order,) or not np.all(T > 0.0):
            raise ValueError(f"Theorem 7: scaling needs {model.order} positive numbers, one a state, got {scaling!r}.")
        assert model.D is not None  # set by the model itself
        assert model.G is not None
        scaled_G = T[:, None] * model.G
        with_channel = options.get("disturbance", True) and scaled_G.size
        return cls(
            model.A * T[:, None] / T,
            model.C_sampled / T,
            model.C_continuous / T,
            model.D,
            channel=float(np.linalg.norm(scaled_G, 2)) ** 2 if with_channel else 0.0,
            gap=gap,
            eta=eta,
            mu=mu,
            two_vertex=options.get("two_vertex", False),
            T=T,
        )

    @property
    def order(self) -> int:
        """Number of states, n."""
        return len(self.T)

    @property
    def noises(self) -> int:
        """Number of noises in the continuous measurements, nv."""
        return int(self.D.shape[1])


@dataclass(frozen=True)
class Unknowns:
    """Values or unknowns of Theorem 7; the lists have one entry a vertex.

    Attributes:
        P, Q: symmetric, shape (n, n). M: shape (n, n).
        N: blocks N_i1 .. N_i3 of shape (n, n) and, where there is noise, N_i4 of shape (nv, n).
        w1, w2: ``M' K_i1`` of shape (n, q1) and ``M' K_i2`` of shape (n, q2).
        gamma2: gamma squared. inverse_sigma: 1 / sigma_1.
    """

    P: Matrix
    Q: Matrix
    M: Matrix
    N: Sequence[Sequence[Matrix]]
    w1: Sequence[Matrix]
    w2: Sequence[Matrix]
    gamma2: Matrix
    inverse_sigma: Matrix


def inequalities(problem: Theorem7Problem, unknowns: Unknowns, performance: bool) -> dict[str, Rows]:
    """Block rows of every matrix that must be negative definite, by name: Bouchama 2024, (2.13)-(2.14).

    Read as the derivation (2.12), (2.15)-(2.28) has it: ``- w_i2 C2`` in phi21, ``-(1/tau_M) Q``, ``+ N_i4`` in block
    (4, 3), and ``gamma^2 / lmax(G'G)`` in the last block, scaled coordinates included.

    Args:
        performance: with the attenuation of noise and disturbance; without it only the decay of the error is asked for.
        problem: sizes, vertices and gaps. unknowns: matrices in the form of the solver or of NumPy.
    """
    phases = {"start": ", start of the gap", "end": ", end of the gap"} if problem.two_vertex else {"whole": ""}
    return {
        f"vertex {i + 1}{words}": _vertex(problem, unknowns, i, phase, performance)
        for i in range(len(problem.A))
        for phase, words in phases.items()
    }


def margins(problem: Theorem7Problem, unknowns: Unknowns, performance: bool) -> dict[str, float]:
    """How far every inequality is from failing, by name: the smallest eigenvalue of what must be positive, less
    rounding.

    Args:
        problem: the question. unknowns: numbers. performance: as in `inequalities`.

    Returns:
        Margins; all positive exactly when the numbers prove what was asked.
    """
    found = {"P": smallest_eigenvalue(unknowns.P), "Q": smallest_eigenvalue(unknowns.Q)}
    if problem.mu > 0.0:
        found["sigma_1"] = float(unknowns.inverse_sigma)
    if performance:
        found["gamma squared"] = float(unknowns.gamma2)
    blocks = inequalities(problem, unknowns, performance)
    return found | {name: smallest_eigenvalue(-np.block(rows)) for name, rows in blocks.items()}


def _vertex(problem: Theorem7Problem, unknowns: Unknowns, i: int, phase: str, performance: bool) -> Rows:
    rows = _phi(problem, unknowns, i, phase, performance)
    if phase != "start":
        transposed = [block.T for block in unknowns.N[i][: len(rows)]]
        rows = _bordered(rows, transposed, -(1.0 / problem.gap) * unknowns.Q)
    M, unit = unknowns.M, np.eye(problem.order)
    if problem.mu > 0.0:
        rows = _bordered(rows, [M, M, M], -unknowns.inverse_sigma * unit)
    if performance and problem.channel > 0.0:
        through = problem.channel**0.5 * M  # the last block of Sigma^-1, gamma^2 / lmax(G'G), scaled to gamma^2
        rows = _bordered(rows, [through, through, through], -unknowns.gamma2 * unit)
    return rows


def _phi(problem: Theorem7Problem, unknowns: Unknowns, i: int, phase: str, performance: bool) -> Rows:
    """Phi_i, block rows over (scaled error at the sample, its derivative, its change since, noise)."""
    P, Q, M = unknowns.P, unknowns.Q, unknowns.M
    w1, w2 = unknowns.w1[i], unknowns.w2[i]
    N1, N2, N3 = unknowns.N[i][:3]
    unit = np.eye(problem.order)
    continuous = M.T @ (problem.eta * unit + problem.A[i])
    if len(problem.C2):
        continuous = continuous - w2 @ problem.C2
    sampled = w1 @ problem.C1
    weight = (problem.mu**2 * unknowns.inverse_sigma + (1.0 if performance else 0.0)) * unit
    pull = (0.0 if phase == "end" else problem.gap) * Q
    phi11 = _symmetric(continuous - sampled) + weight
    phi21 = P - M + continuous - sampled
    phi22 = pull - _symmetric(M)
    phi31 = _symmetric(continuous) - sampled + N1.T + weight
    phi32 = P - M.T + continuous.T + N2.T
    phi33 = _symmetric(continuous + N3.T) + weight
    rows = [[phi11, phi21.T, phi31.T], [phi21, phi22, phi32.T], [phi31, phi32, phi33]]
    if not (performance and problem.noises):
        return rows
    noise = (w2 @ problem.D).T
    return _bordered(rows, [noise, noise, noise + unknowns.N[i][3]], -unknowns.gamma2 * np.eye(problem.noises))


def _symmetric(matrix: Matrix) -> Matrix:
    return matrix + matrix.T


def _bordered(rows: Rows, left: list[Matrix], corner: Matrix) -> Rows:
    """Block rows with one more row and column; `left` may be shorter, the rest of it is zero."""
    missing = [np.zeros((corner.shape[0], row[k].shape[1])) for k, row in enumerate(rows) if k >= len(left)]
    border = [*left, *missing]
    return [[*row, block.T] for row, block in zip(rows, border, strict=True)] + [[*border, corner]]
