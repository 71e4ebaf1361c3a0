"""The quadratic programme of one Gauss-Newton step over a window, handed to PIQP as it comes with CasADi.

Unknowns are the changes of the states and the noises of all rows. It knows matrices and no model.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np

from fmu_observer.formulas.moving_horizon.window_stages import BufferedCall
from plant_models.hybrid.casadi_package import ca


class _FreeSweep:
    """Minimum of ``sum (dx' A dx + w' w) / 2 + b' dx`` with ``dx = F dx_before + G w + c`` (Bellman's recursion).

    Args:
        count: N, rows of the window. order: n, states.
    """

    def __init__(self, count: int, order: int) -> None:
        self.count, self.order = count, order
        self._backwards = BufferedCall(_backwards(order).mapaccum(count))
        self._forwards = BufferedCall(_forwards(order).mapaccum(count))

    def solve(
        self, A: np.ndarray, b: np.ndarray, F: np.ndarray, G: np.ndarray, c: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Solve one.

        Args:
            A: cost of the changes, shape (N, n, n), symmetric. b: likewise, shape (N, n).
            F: transitions into each row, zero into the first, shape (N, n, n). G: of the noises, shape (N, n, n).
            c: what is missing, shape (N, n).

        Returns:
            Changes, noises, and multipliers of the transitions, shape (N, n) each.
        """
        N, n = self.count, self.order
        columns_F, columns_G = (np.ascontiguousarray(part.transpose(0, 2, 1)) for part in (F, G))
        reversed_ = (part[::-1] for part in (A, b, columns_F, columns_G, c))
        _, gains, values = self._backwards(np.zeros(n * (n + 1)), *reversed_)
        gains, values = (part.reshape(N, n + 1, n)[::-1] for part in (gains, values))
        changes, noises = (
            part.reshape(N, n).copy() for part in self._forwards(np.zeros(n), columns_F, columns_G, c, gains)
        )
        prices = np.einsum("kij,ki->kj", values[:, :n], changes) + values[:, n]
        return changes, noises, prices


_SOLVER, _OPTIONS = "piqp", {"eps_abs": 1e-9, "eps_rel": 1e-10, "max_iter": 100}
_SOLVED = "SOLVER_RET_SUCCESS"
_FREE = 1e6  # standard deviations, so many that they are no bound of a disturbance


class Step(NamedTuple):
    """Where the quadratic programme leads.

    Attributes:
        change: of the states, shape (N, n). noises: of the transitions, in standard deviations, shape (N, n).
        prices: multipliers of the transitions, shape (N, n). status: of the solver.
    """

    change: np.ndarray
    noises: np.ndarray
    prices: np.ndarray
    status: str

    @property
    def solved(self) -> bool:
        """Whether the solver says that it is solved."""
        return self.status == _SOLVED


class Programme(NamedTuple):
    """``min z' H z / 2 + g' z`` with ``A z`` between two limits, and bounds of z.

    Attributes:
        h: nonzeros of H as in `WindowProgram.cost`. g: shape (2 N n,). a: nonzeros of A as in its `transitions`.
        limits: of the transitions, equal, then of the noises with bounds, shape (N n + N d,).
        lower, upper: bounds of z, shape (2 N n,).
    """

    h: np.ndarray
    g: np.ndarray
    a: np.ndarray
    limits: tuple[np.ndarray, np.ndarray]
    lower: np.ndarray
    upper: np.ndarray


class WindowProgram:
    """Quadratic programmes of one size: ``min sum (dx' A dx + w' w) / 2 + b' dx`` with ``dx = F dx_before + G w + c``.

    Args:
        count: N, rows of the window. order: n, states.
        solver: name of a solver of quadratic programmes that CasADi knows. options: of it.
        disturbed: rows of ``G w`` that have bounds, d of them.
    """

    def __init__(
        self,
        count: int,
        order: int,
        solver: str = _SOLVER,
        options: Mapping[str, Any] = MappingProxyType(_OPTIONS),
        disturbed: tuple[int, ...] = (),
    ) -> None:
        self.count, self.order, self.disturbed = count, order, list(disturbed)
        size, within = count * order, np.arange(order)
        rows = np.repeat(np.arange(count) * order, order * order) + np.tile(within, size)
        self.cost = _sparsity([np.full(size, order), np.ones(size)], [rows, size + np.arange(size)])
        columns = np.full((count, order), order + 1)
        columns[-1] = 1
        place = np.full((count, order, order + 1), -1)
        first = np.arange(count)[:, None] * order
        place[:, :, 0] = first + within
        place[:-1, :, 1:] = (first[1:] + within)[:, None, :]
        self._kept = (place >= 0).ravel()
        bounds = np.arange(len(disturbed))
        of_noise = np.hstack([first + within, size + np.arange(count)[:, None] * len(disturbed) + bounds])
        self.transitions = _sparsity(
            [columns.ravel(), np.full(size, of_noise.shape[1])],
            [place.ravel()[self._kept], np.repeat(of_noise, order, axis=0).ravel()],
            size + count * len(disturbed),
        )
        settings: dict[str, Any] = {"print_time": False, "error_on_fail": False, solver: dict(options)}
        self._solver = ca.conic("window", solver, {"h": self.cost, "a": self.transitions}, settings)
        self._call = BufferedCall(self._solver)
        self._rest = [np.zeros(self._solver.nnz_in(i)) for i in range(10, self._solver.n_in())]

    def solve(
        self,
        A: np.ndarray,
        b: np.ndarray,
        F: np.ndarray,
        G: np.ndarray,
        c: np.ndarray,
        lower: np.ndarray,
        upper: np.ndarray,
        noise: tuple[np.ndarray, np.ndarray] | None = None,
    ) -> Step:
        """Solve one.

        Args:
            A: cost of the changes, shape (N, n, n), symmetric. b: likewise, shape (N, n).
            F: transitions into each row, that of the first is not read, shape (N, n, n). G: of the noises, shape
                (N, n, n). c: what is missing, shape (N, n).
            lower, upper: bounds of the changes, infinite for none, shape (N, n).
            noise: bounds of ``G w`` where it has some, infinite for none, shape (N, d) each; None for none.
        """
        N, n = self.count, self.order
        none = _FREE * (1.0 + np.linalg.norm(G[:, self.disturbed], axis=2))  # PIQP warns of rows without limits
        low, high = (-none, none) if noise is None else (np.maximum(noise[0], -none), np.minimum(noise[1], none))
        free, zero = np.full(N * n, np.inf), np.zeros(N * n)
        programme = Programme(
            h=np.concatenate([A.ravel(), zero + 1.0]),
            g=np.concatenate([b.ravel(), zero]),
            a=self._coupling(F, G),
            limits=(np.concatenate([-c.ravel(), low.ravel()]), np.concatenate([-c.ravel(), high.ravel()])),
            lower=np.concatenate([lower.ravel(), -free]),
            upper=np.concatenate([upper.ravel(), free]),
        )
        found, prices, status = self.handed(programme)
        changes, noises = found.reshape(2, N, n)
        return Step(changes, noises, prices[: N * n].reshape(N, n), status)

    def _coupling(self, F: np.ndarray, G: np.ndarray) -> np.ndarray:
        """Nonzeros of the transitions' matrix."""
        columns = np.empty((self.count, self.order, self.order + 1))
        columns[:, :, 0] = -1.0
        columns[:-1, :, 1:] = F[1:].transpose(0, 2, 1)
        of_noise = np.concatenate([G, G[:, self.disturbed]], axis=1).transpose(0, 2, 1)
        return np.concatenate([columns.ravel()[self._kept], of_noise.ravel()])

    def solve_free(self, A: np.ndarray, b: np.ndarray, F: np.ndarray, G: np.ndarray, c: np.ndarray) -> Step:
        """Solve one without bounds.

        Args:
            A, b, F, G, c: as in `solve`.
        """
        free = np.full((self.count, self.order), np.inf)
        return self.solve(A, b, F, G, c, -free, free)

    def handed(self, programme: Programme) -> tuple[np.ndarray, np.ndarray, str]:
        """What the solver finds.

        Args:
            programme: with numbers.

        Returns:
            z, the multipliers of the rows of A, and the solver's status.
        """
        h, g, a, (least, most), lower, upper = programme
        nothing, none = np.zeros(len(g)), np.zeros(len(least))
        found = self._call(h, g, a, least, most, lower, upper, nothing, nothing, none, *self._rest)
        status = str(self._solver.stats(self._call.memory)["unified_return_status"])
        return found[0].copy(), found[2].copy(), status


class _SweptProgram(WindowProgram):
    """One that sweeps over the rows where no bound counts, which is quicker; the solver has the rest."""

    def solve_free(self, A: np.ndarray, b: np.ndarray, F: np.ndarray, G: np.ndarray, c: np.ndarray) -> Step:
        found = _free_sweep(self.count, self.order).solve(A, b, F, G, c)
        return Step(
            *found, _SOLVED if all(np.isfinite(part).all() for part in found) else "numbers that are not finite"
        )


@lru_cache(maxsize=64)
def window_program(count: int, order: int, disturbed: tuple[int, ...] = ()) -> WindowProgram:
    """The programme of a size, made once.

    Args:
        count: N, rows. order: n, states. disturbed: states whose noises have bounds.
    """
    return _SweptProgram(count, order, disturbed=disturbed)


def _sparsity(counts: list[np.ndarray], rows: list[np.ndarray], height: int | None = None) -> Any:
    """Compressed columns: how many entries each has, and their rows; square unless a height is given."""
    ends = np.concatenate([[0], np.cumsum(np.concatenate(counts))]).astype(int)
    width = len(ends) - 1
    return ca.Sparsity(height or width, width, ends.tolist(), np.concatenate(rows).astype(int).tolist())


@lru_cache(maxsize=64)
def _free_sweep(count: int, order: int) -> _FreeSweep:
    """The sweep over windows of a size, made once."""
    return _FreeSweep(count, order)


def _backwards(n: int) -> ca.Function:
    """From what the later rows cost, as matrix and vector of the change in a row, to what they and the row cost."""
    later, A, F, G = (ca.SX.sym(name, n, width) for name, width in (("later", n + 1), ("A", n), ("F", n), ("G", n)))
    b, c = ca.SX.sym("b", n), ca.SX.sym("c", n)
    S, s = A + later[:, :n], b + later[:, n]
    SG = S @ G
    factors = ca.ldl(ca.densify(ca.SX.eye(n) + G.T @ SG), False)
    gains = ca.ldl_solve(ca.horzcat(SG.T @ F, SG.T @ c + G.T @ s), *factors)
    K, k = gains[:, :n], gains[:, n]
    T, d = F - G @ K, c - G @ k
    P = T.T @ S @ T + K.T @ K  # a sum of squares: it stays one with rounding
    p = T.T @ (S @ d + s) + K.T @ k
    results = ca.horzcat(0.5 * (P + P.T), p), gains, ca.horzcat(S, s)
    return ca.Function("backwards", [later, A, b, F, G, c], [ca.densify(r) for r in ca.cse(list(results))])


def _forwards(n: int) -> ca.Function:
    """From the change before a row to the change in it, and its noise."""
    before, c = ca.SX.sym("before", n), ca.SX.sym("c", n)
    F, G, gains = ca.SX.sym("F", n, n), ca.SX.sym("G", n, n), ca.SX.sym("gains", n, n + 1)
    w = -(gains[:, :n] @ before + gains[:, n])
    return ca.Function("forwards", [before, F, G, c, gains], [ca.densify(F @ before + G @ w + c), ca.densify(w)])
