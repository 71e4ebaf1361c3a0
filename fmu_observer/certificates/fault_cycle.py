"""The estimation error over one fault, in closed form: four phases by whether system and observer are in the fault.

For an observer that takes the effort as zero while it believes in a fault: where system and observer agree its error is
autonomous, where they disagree the effort drives it. Plain linear algebra; it knows no train and no detector.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from math import isfinite, log

import numpy as np
import scipy

from fmu_observer.certificates.matrix_exponential import small_exponential

_SCAN_POINTS = 300  # over seven decades of time
_THIRDS = 60


@dataclass(frozen=True)
class FaultCycle:
    """One fault, from t_k over its onset, detection, end and recovery: Aguiar Cota 2019, (3.19)-(3.33).

    v_ij: i says whether the system is in the fault, j whether the observer is. The error ``e = z - zhat`` follows
    ``A e`` in v00 and v11, ``A e - B u*`` in v10 (the effort is lost, and the observer still counts on it), and ``A e +
    B u*`` in v01.

    Args:
        error_matrix: ``A = A_o - K C``, stable, shape (n, n) [1/s]. effort_column: B, shape (n,).
        effort: u*.
        start: t_k [s]. onset: t_00, the fault begins. detection: t_10, the observer knows. end: t_11, the fault ends.
            recovery: t_01, the observer knows that.

    Raises:
        ValueError: a shape does not fit, the error matrix is not stable, or the instants are not in order.
    """

    error_matrix: np.ndarray
    effort_column: np.ndarray
    effort: float
    start: float
    onset: float
    detection: float
    end: float
    recovery: float

    def __post_init__(self) -> None:
        matrix = np.asarray(self.error_matrix, dtype=float)
        column = np.asarray(self.effort_column, dtype=float).reshape(-1)
        if matrix.ndim != 2 or matrix.shape != (len(column), len(column)):
            raise ValueError(
                f"Fault cycle: error_matrix has shape {matrix.shape}, effort_column {column.shape}; expected "
                f"(n, n) and (n,)."
            )
        slowest = float(np.linalg.eigvals(matrix).real.max())
        if slowest >= 0.0:
            raise ValueError(
                f"Fault cycle: error_matrix has an eigenvalue with real part {slowest:g}; expected a stable one."
            )
        instants = (self.start, self.onset, self.detection, self.end, self.recovery)
        if not all(isfinite(t) for t in instants) or any(b < a for a, b in pairwise(instants)):
            raise ValueError(
                f"Fault cycle: start, onset, detection, end, recovery are {instants}; expected them finite and in this "
                f"order."
            )
        object.__setattr__(self, "error_matrix", matrix)
        object.__setattr__(self, "effort_column", column)

    @property
    def steady_error(self) -> np.ndarray:
        """``inv(A) B u*``, shape (n,): the error at which v10 ends up.

        In a PI observer all of it is in the disturbance, so the residual shows a fault only for a while.
        """
        return np.asarray(np.linalg.solve(self.error_matrix, self.effort_column * self.effort))

    def error(self, time: float, start_error: np.ndarray) -> np.ndarray:
        """The error at a time, by (3.24), (3.25), (3.27) or (3.28), whichever phase it is in.

        Args:
            time: not before t_k [s]. start_error: e(t_k), shape (n,).

        Returns:
            e(t), shape (n,).

        Raises:
            ValueError: the time is before t_k.
        """
        if time < self.start:
            raise ValueError(f"Fault cycle: asked for {time:g} s; expected a time from {self.start:g} s on.")
        free = self._exponential(time - self.start) @ np.asarray(start_error, dtype=float)
        identity = np.eye(len(self.effort_column))
        driven = np.zeros_like(identity)
        if time > self.onset:
            driven = driven - self._exponential(time - self.onset)
            driven = driven + (identity if time <= self.detection else self._exponential(time - self.detection))
        if time > self.end:
            driven = driven + self._exponential(time - self.end)
            driven = driven - (identity if time <= self.recovery else self._exponential(time - self.recovery))
        return np.asarray(free + driven @ self.steady_error)

    def over_the_cycle(self, start_error: np.ndarray) -> np.ndarray:
        """The error at the recovery by the cycle map (3.33), which knows the four dwell times only.

        Args:
            start_error: e(t_k), shape (n,).

        Returns:
            e(t_01), shape (n,).
        """
        d00, d10 = self.onset - self.start, self.detection - self.onset
        d11, d01 = self.end - self.detection, self.recovery - self.end
        identity = np.eye(len(self.effort_column))
        free = self._exponential(d00 + d10 + d11 + d01) @ np.asarray(start_error, dtype=float)
        first = self._exponential(d11 + d01) @ (identity - self._exponential(d10))
        return np.asarray(free + (first - (identity - self._exponential(d01))) @ self.steady_error)

    def next_start(self, start_error: np.ndarray, decay: float) -> float:
        """From when on the error is no larger than it was at t_k: the usable dwell time [s].

        ``t_min = t_01 + (1/m) ln(beta |e(t_01)| / |e(t_k)|)`` with ``|e^{At}| <= beta e^{-mt}`` and the error at the
        recovery from (3.28). A fault that begins after it starts from no larger an error: faults so spaced do not add
        up.

        Args:
            start_error: e(t_k), not zero, shape (n,). decay: m, below the slowest pole's [1/s].

        Returns:
            The time; not before the recovery.

        Raises:
            ValueError: the start error is zero, or the decay is too fast.

        Source: ours, in place of (3.32): see `printed_next_start`.
        """
        start = self._norm_of_start(start_error)
        reached = float(np.linalg.norm(self.error(self.recovery, start_error)))
        if reached == 0.0:
            return self.recovery
        return self.recovery + max(log(overshoot(self.error_matrix, decay) * reached / start) / decay, 0.0)

    def printed_next_start(self, start_error: np.ndarray, decay: float) -> float:
        """The dwell time (3.32) as printed [s], for comparison: it follows the fault backwards to t_k.

        ``t_k + (1/m) ln(beta |e(t_k) + phi(t_k) u*| / |e(t_k)|)``: phi holds exponentials of negative times, which for
        a pole at -50 grow as e^{50 t}. A cycle of half a second makes ``|phi u*|`` 1e15, and the dwell time tens of
        seconds.

        Args:
            start_error: e(t_k), not zero, shape (n,). decay: m [1/s].

        Returns:
            The time.

        Raises:
            ValueError: the start error is zero, or the decay is too fast.
        """
        start = self._norm_of_start(start_error)
        reached = float(np.linalg.norm(np.asarray(start_error, dtype=float) + self.printed_phi()))
        return self.start + log(overshoot(self.error_matrix, decay) * reached / start) / decay

    def printed_phi(self) -> np.ndarray:
        """``phi(t_k) u*`` of (3.32), shape (n,): what the fault does, followed backwards to t_k."""
        back = [self._exponential(self.start - t) for t in (self.detection, self.onset, self.recovery, self.end)]
        return np.asarray((back[0] - back[1] - back[2] + back[3]) @ self.steady_error)

    def _norm_of_start(self, start_error: np.ndarray) -> float:
        start = float(np.linalg.norm(start_error))
        if start == 0.0:
            raise ValueError("Fault cycle: the error at t_k is zero; no later error is as small. Give what it may be.")
        return start

    def _exponential(self, duration: float) -> np.ndarray:
        return small_exponential(self.error_matrix * duration)


def overshoot(error_matrix: np.ndarray, decay: float) -> float:
    """The smallest beta with ``|e^{At}| <= beta e^{-mt}`` for all t: the supremum of the true norm, not a bound.

    Args:
        error_matrix: A, stable, shape (n, n) [1/s]. decay: m, below the decay of the slowest pole [1/s].

    Returns:
        beta [1], at least 1.

    Raises:
        ValueError: A does not decay as fast as m.
    """
    matrix = np.asarray(error_matrix, dtype=float)
    poles = np.linalg.eigvals(matrix)
    slowest = float(-poles.real.max())
    if not 0.0 <= decay < slowest:
        raise ValueError(
            f"Overshoot: the slowest pole decays at {slowest:g} 1/s; expected a decay below, got {decay:g}."
        )

    def size(t: float) -> float:
        return float(np.linalg.norm(small_exponential(matrix * t), 2)) * float(np.exp(decay * t))

    horizon = 30.0 / (slowest - decay)  # by then e^-30 of any overshoot is left
    fastest = float(np.abs(poles).max())
    times = np.concatenate([[0.0], np.geomspace(1e-4 / fastest, horizon, _SCAN_POINTS)])
    sizes = [size(float(t)) for t in times]
    k = int(np.argmax(sizes))
    low, high = times[max(k - 1, 0)], times[min(k + 1, len(times) - 1)]
    for _ in range(_THIRDS):
        third = (high - low) / 3.0
        low, high = (low + third, high) if size(low + third) < size(high - third) else (low, high - third)
    return max(sizes[k], size(0.5 * (low + high)))


def first_crossing(
    error_matrix: np.ndarray, effort_column: np.ndarray, effort: float, threshold: float, row: int = 0
) -> float:
    """How long after its onset a fault shows: when one component of the error first exceeds a threshold in v10 [s].

    From an error of zero: ``e(t) = (I - e^{At}) inv(A) B u*``.

    Args:
        error_matrix: A, stable, shape (n, n) [1/s]. effort_column: B, shape (n,). effort: u*.
        threshold: of the magnitude, positive. row: of the component, the residual's by default.

    Returns:
        The time; inf where the error never reaches the threshold.
    """
    times = _scan(error_matrix)

    def excess(t: float) -> float:
        return _shown(error_matrix, effort_column, row, t) * abs(effort) - threshold

    above = np.flatnonzero([excess(float(t)) > 0.0 for t in times])
    if len(above) == 0:
        return float("inf")
    before = float(times[above[0] - 1]) if above[0] > 0 else 0.0
    return float(scipy.optimize.brentq(excess, before, float(times[above[0]]), xtol=1e-15))


def smallest_effort(error_matrix: np.ndarray, effort_column: np.ndarray, threshold: float, row: int = 0) -> float:
    """The effort whose loss shows at all: that of a smaller one never exceeds the threshold, however long it lasts.

    Args:
        error_matrix: A, stable, shape (n, n) [1/s]. effort_column: B, shape (n,).
        threshold: of the magnitude, positive. row: of the component, the residual's by default.

    Returns:
        Magnitude of the effort, in the unit of u*; its loss then shows as a touch of the threshold.
    """
    times = _scan(error_matrix)
    sizes = [_shown(error_matrix, effort_column, row, float(t)) for t in times]
    k = int(np.argmax(sizes))
    low, high = float(times[max(k - 1, 0)]), float(times[min(k + 1, len(times) - 1)])
    found = scipy.optimize.minimize_scalar(
        lambda t: -_shown(error_matrix, effort_column, row, t),
        bounds=(low, high),
        method="bounded",
        options={"xatol": 1e-6 * high},  # of its square is the error of the peak
    )
    return threshold / max(-float(found.fun), sizes[k])


def _scan(error_matrix: np.ndarray) -> np.ndarray:
    """Times from far below the fastest time constant to far above the slowest [s]."""
    poles = np.linalg.eigvals(np.asarray(error_matrix, dtype=float))
    return np.asarray(np.geomspace(1e-6 / np.abs(poles).max(), 30.0 / -poles.real.max(), _SCAN_POINTS))


def _shown(error_matrix: np.ndarray, effort_column: np.ndarray, row: int, t: float) -> float:
    """Magnitude of a component of the error a time after an effort of one was lost."""
    matrix = np.asarray(error_matrix, dtype=float)
    steady = np.linalg.solve(matrix, np.asarray(effort_column, dtype=float))
    return abs(float(steady[row] - small_exponential(matrix * t)[row] @ steady))
