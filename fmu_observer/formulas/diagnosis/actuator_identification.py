"""Natural frequency and damping of an actuator from recordings of its reference and its position. NumPy and SciPy over
recordings; nothing of it runs inside a detector.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import scipy

from fmu_observer.formulas.diagnosis.residual_filters import ResidualFilter, residual_filter


class _ActuatorParameters(NamedTuple):
    """Parameters of ``y'' = wn^2 (r - y) - 2 zeta wn y'``.

    Attributes:
        frequency: wn [rad/s]. damping: zeta [1].
    """

    frequency: float
    damping: float


def identified_actuator(
    measured: np.ndarray,
    reference: np.ndarray,
    sample_period: float,
    time_constant: float = 0.06,
    nominal: _ActuatorParameters | None = None,
) -> _ActuatorParameters:
    """Parameters for which the filtered model holds best over a recording: Omar 2012, (7.6.2), (7.6.8).

    The thesis has least squares in mind. The noise of the reading stands on both sides of them, and they are biased.
    What a nominal actuator makes of the reference knows nothing of that noise: taken as instruments, with which the
    equation errors must not correlate, its filtered positions take the bias away [ours].

    Args:
        measured: readings y, shape (samples,). reference: r that acted over the period before each, shape (samples,).
        sample_period: Ts [s]. time_constant: tau of the filters [s]. nominal: parameters of the instruments; None for
            least squares.

    Raises:
        ValueError: recordings are not of one length, or the actuator does not move enough to tell both.
    """
    reading, asked = _recordings(measured, reference)
    filters = residual_filter(time_constant, sample_period)
    settled = int(10.0 * time_constant / sample_period)
    rows = _terms(filters, reading, asked)[:, settled:]
    instruments = rows
    if nominal is not None:
        instruments = _terms(filters, _response(nominal, asked, sample_period), asked)[:, settled:]
    moments = instruments[:2] @ rows[:2].T
    if not np.linalg.cond(moments) < 1e12:
        raise ValueError("identified_actuator: the actuator does not move enough to tell frequency and damping.")
    square, slope = np.linalg.solve(moments, instruments[:2] @ -rows[2])
    if square <= 0.0:
        raise ValueError(f"identified_actuator: wn^2 comes out as {square:g}: too much noise, or too little motion.")
    return _ActuatorParameters(float(np.sqrt(square)), float(slope / (2.0 * np.sqrt(square))))


def _recordings(measured: np.ndarray, reference: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    reading, asked = np.asarray(measured, dtype=float), np.asarray(reference, dtype=float)
    if reading.shape != asked.shape or asked.ndim != 1 or asked.size < 4:
        raise ValueError(
            f"identified_actuator: expected recordings of one length, at least 4 samples; got {reading.shape} and "
            f"{asked.shape}."
        )
    return reading, asked


def _response(actuator: _ActuatorParameters, reference: np.ndarray, sample_period: float) -> np.ndarray:
    """Positions at the samples of an actuator that rests at the first reference, shape (samples,)."""
    square, slope = actuator.frequency**2, 2.0 * actuator.damping * actuator.frequency
    held = scipy.signal.cont2discrete(([square], [1.0, slope, square]), sample_period)
    ahead = np.append(reference[1:], 0.0) - reference[0]  # what acts from this sample on
    return np.asarray(reference[0] + scipy.signal.lfilter(held[0].ravel(), held[1], ahead))


def _terms(filters: ResidualFilter, measured: np.ndarray, reference: np.ndarray) -> np.ndarray:
    """``F{y - r}``, ``s F{y}`` and ``s^2 F{y}``, shape (3, samples - 1); readings half a period late, as Tustin's rule
    has a held reference.
    """
    late = 0.5 * (measured[1:] + measured[:-1])
    signals = (late - reference[1:], late - late[0], late - late[0])
    numerators = (filters.level, filters.first, filters.second)
    below = [1.0, *filters.denominator]
    return np.stack([scipy.signal.lfilter(b, below, y) for b, y in zip(numerators, signals, strict=True)])
