"""Bounds of the error between two samples, as pure functions in plain NumPy that CasADi can trace.

All speak of an observer ``dxh = A xh + B u + K (y_k - C xh)`` whose measurement ``y_k`` is held since the sample, of
the norm of its whole error e, and of the time s since then. They rest on ``|exp((A - K C) t)| <= beta exp(-m t)``.
They know no noise, no unknown input and no error of the model.
"""

from __future__ import annotations

import numpy as np

from plant_models.hybrid import Array


def dmo_bound(s: Array, sample_error: Array, beta: Array, m: Array, gain: Array, deviation: Array) -> Array:
    """``beta e^(-m s) |e_k| + beta |K| M_y / m (1 - e^(-m s))``: Aguiar Cota 2019, (4.11), (4.16).

    Args:
        s: time since the sample [s]. sample_error: norm of the error at the sample [m/s and derivatives].
        beta: overshoot [1], at least 1. m: decay rate [1/s], positive. gain: Euclidean norm of K [1/s].
        deviation: M_y, the most that the measurement differs from the held one, over all of its range [m/s].

    Returns:
        Bound of the norm of the error [m/s], of the shape of the arguments.
    """
    faded = np.exp(-m * s)
    return beta * faded * sample_error + beta * gain * deviation / m * (1.0 - faded)


def improved_dmo_bound(s: Array, sample_error: Array, beta: Array, m: Array, gain: Array, rate: Array) -> Array:
    """``beta e^(-m s) |e_k| + beta xi |K| / m (s - (1 - e^(-m s)) / m)``: Aguiar Cota 2019, (4.19), i-DMO.

    Valid where ``|y(s) - y_k| <= xi s``: xi is the largest rate of the measurement, the print says the lowest.

    Args:
        s: time since the sample [s]. sample_error: norm of the error at the sample [m/s and derivatives].
        beta: overshoot [1], at least 1. m: decay rate [1/s], positive. gain: Euclidean norm of K [1/s].
        rate: xi, largest acceleration or deceleration of what is measured [m/s2].

    Returns:
        Bound of the norm of the error [m/s], of the shape of the arguments.
    """
    faded = np.exp(-m * s)
    return beta * faded * sample_error + beta * rate * gain / m * (s - (1.0 - faded) / m)


def comparison_bound(s: Array, first: Array, beta: Array, m: Array, growth: Array, forcing: Array) -> Array:
    """``beta e^(-(m - a) s) |x_k| + b / (m - a) (1 - e^(-(m - a) s))``: Aguiar Cota 2019, Lemma 4-1, (4.20)-(4.21).

    It bounds x where ``|x| <= beta e^(-m s) |x_k| + integral of e^(-m (s - q)) (a |x| + b)``.

    Args:
        s: time since the sample [s]. first: norm of x at the sample. beta: overshoot [1], at least 1.
        m: decay rate [1/s]. growth: a [1/s]. forcing: b, in units of x a second.

    Returns:
        Bound of the norm of x, of the shape of the arguments.
    """
    return beta * np.exp(-(m - growth) * s) * first + forcing * _faded_integral(s, m - growth)


def cdo_bound(
    s: Array, sample_error: Array, beta: Array, m: Array, gain: Array, deviation: Array, output_norm: Array = 1.0
) -> Array:
    """``beta e^(-(m - a) s) |e_k| + beta lambda M / (m - a) (1 - e^(-(m - a) s))``, ``a = beta lambda |C|``.

    Aguiar Cota 2019, (4.29) with the exponent of the first term corrected: it follows from Lemma 4-1, while the print
    has ``e^(-m s)`` there, see `printed_cdo_bound`.

    Args:
        s: time since the sample [s]. sample_error: norm of the error at the sample [m/s and derivatives].
        beta: overshoot [1], at least 1. m: decay rate [1/s], positive. gain: lambda, largest norm of K [1/s].
        deviation: most that the estimated measurement differs from the held one [m/s]. output_norm: norm of C [1].

    Returns:
        Bound of the norm of the error [m/s], of the shape of the arguments. It grows exponentially where ``a > m``.
    """
    return comparison_bound(s, sample_error, beta, m, beta * gain * output_norm, beta * gain * deviation)


def printed_cdo_bound(
    s: Array, sample_error: Array, beta: Array, m: Array, gain: Array, deviation: Array, output_norm: Array = 1.0
) -> Array:
    """(4.29) of Aguiar Cota 2019 as printed, with ``e^(-m s)`` in its first term. It is no bound: see `cdo_bound`.

    Args:
        s: time since the sample [s]. sample_error: norm of the error at the sample [m/s and derivatives].
        beta: overshoot [1]. m: decay rate [1/s]. gain: lambda, largest norm of K [1/s].
        deviation: most that the estimated measurement differs from the held one [m/s]. output_norm: norm of C [1].

    Returns:
        What the print calls a bound [m/s], of the shape of the arguments.
    """
    forced = beta * gain * deviation * _faded_integral(s, m - beta * gain * output_norm)
    return beta * np.exp(-m * s) * sample_error + forced


def improved_cdo_bound(s: Array, sample_error: Array, beta: Array, m: Array, gain: Array, rate: Array) -> Array:
    """(4.40) of Aguiar Cota 2019, i-CDO: `improved_dmo_bound` with the largest norm of K for that of the sample.

    Args:
        s: time since the sample [s]. sample_error: norm of the error at the sample [m/s and derivatives].
        beta: overshoot [1], at least 1. m: decay rate [1/s], positive.
        gain: lambda, largest Euclidean norm of K over all estimates [1/s].
        rate: xi, largest acceleration or deceleration of what is measured [m/s2].

    Returns:
        Bound of the norm of the error [m/s], of the shape of the arguments.
    """
    return improved_dmo_bound(s, sample_error, beta, m, gain, rate)


def _faded_integral(s: Array, rate: Array) -> Array:
    """``(1 - e^(-rate s)) / rate``, which is s where the rate is zero."""
    still = np.where(rate == 0.0, 1.0, rate)
    return np.where(rate == 0.0, s, (1.0 - np.exp(-still * s)) / still)
