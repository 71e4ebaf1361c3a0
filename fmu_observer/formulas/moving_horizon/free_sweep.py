"""A Gauss-Newton step over a window without active bounds: one sweep backwards and one forwards, as for a regulator.

It knows matrices and no model. Two calls of compiled loops take a third of the time of the solver with bounds.
"""

from __future__ import annotations

from functools import lru_cache

import casadi as ca
import numpy as np

from fmu_observer.formulas.moving_horizon.window_stages import BufferedCall


class FreeSweep:
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


@lru_cache(maxsize=64)
def free_sweep(count: int, order: int) -> FreeSweep:
    """The sweep over windows of a size, made once.

    Args:
        count: N, rows. order: n, states.
    """
    return FreeSweep(count, order)


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
