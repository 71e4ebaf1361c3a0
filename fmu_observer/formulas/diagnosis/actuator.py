"""Actuators: natural frequency and damping from recordings of reference and position, by NumPy and SciPy, and residuals
of readings against their reference, pure functions that trace.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import scipy

from fmu_observer.formulas.diagnosis.residual_filters import (
    Filtered,
    ResidualFilter,
    filtered,
    residual_filter,
    settled,
)
from plant_models.hybrid import Array


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
        ValueError: recordings are not of one length, or the actuator does not move enough to show both.
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
        raise ValueError("identified_actuator: the actuator does not move enough to show frequency and damping.")
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


def second_order_residual(
    coefficients: ResidualFilter,
    memory: tuple[Array, Array],
    measured: Array,
    reference: Array,
    frequency: Array,
    damping: Array,
    starts: Array = 0.0,
) -> Filtered:
    """``wn^2 F{y - r} + 2 zeta wn s F{y} + s^2 F{y}``, zero for ``y'' = wn^2 (r - y) - 2 zeta wn y'``.

    Args:
        coefficients: of `residual_filter`. memory: of the sample before, two numbers. measured: y. reference: r.
        frequency: wn [rad/s]. damping: zeta [1]. starts: 1 at the first sample, which takes it that both have been
            constant, else 0.

    Returns:
        Residual in units of y per s2, and the memory for the next sample.

    Source:
        Omar 2012, (7.6.1), (7.6.2).
    """
    signals = (frequency * frequency * (measured - reference), 2.0 * damping * frequency * measured, measured)
    return filtered(coefficients, _started(coefficients, memory, starts, signals), *signals)


def first_order_residual(
    coefficients: ResidualFilter,
    memory: tuple[Array, Array],
    measured: Array,
    reference: Array,
    time_constant: Array,
    starts: Array = 0.0,
) -> Filtered:
    """``F{y - r} + tau s F{y}``, zero for ``tau y' = r - y``.

    Args:
        coefficients, memory, measured, reference, starts: as of `second_order_residual`. time_constant: tau of the
            actuator [s].

    Returns:
        Residual in units of y, and the memory for the next sample.

    Source:
        Omar 2012, 7.8.1; the formula is ours, the figure with it is lost.
    """
    signals = (measured - reference, time_constant * measured, 0.0 * measured)
    return filtered(coefficients, _started(coefficients, memory, starts, signals), *signals)


def centred(reading: Array, before: Array, share: Array = 1.0) -> Array:
    """A reading half a sample period ago, where Tustin's rule takes a reference to be that is held between samples.

    The rule joins samples by straight lines. A reference that was held over the last period reaches its residual half a
    period late, and each step of the reference shows as if the actuator were faster than it is. Readings that are as
    late as that compare with it.

    Args:
        reading: of this sample. before: of the sample before. share: 1 for half a period, 0 for the reading itself [1].
    """
    return reading + 0.5 * share * (before - reading)


def rate_residual(
    coefficients: ResidualFilter, memory: tuple[Array, Array], integral: Array, rate: Array, starts: Array = 0.0
) -> Filtered:
    """``s F{z} - F{w}``, zero for ``z' = w``: an estimated position, or torsion, against a measured speed.

    Args:
        coefficients: of `residual_filter`. memory: of the sample before, two numbers. integral: z. rate: w.
        starts: see `second_order_residual`.

    Returns:
        Residual in units of w, and the memory for the next sample.

    Source:
        Omar 2012, (7.7.5).
    """
    signals = (-rate, integral, 0.0 * integral)
    return filtered(coefficients, _started(coefficients, memory, starts, signals), *signals)


def _started(
    coefficients: ResidualFilter, memory: tuple[Array, Array], starts: Array, signals: tuple[Array, Array, Array]
) -> tuple[Array, Array]:
    first = settled(coefficients, *signals)
    return memory[0] + starts * (first[0] - memory[0]), memory[1] + starts * (first[1] - memory[1])
