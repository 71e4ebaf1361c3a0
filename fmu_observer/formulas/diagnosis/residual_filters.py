"""Filtered derivatives of noisy signals, sampled: ``F = 1 / (1 + tau s)^2``, ``s F`` and ``s^2 F`` by Tustin's rule.

Pure functions that trace. All three have one denominator, so a residual that sums several of them over several signals
carries two numbers from sample to sample, not two for each.
"""

from __future__ import annotations

from typing import NamedTuple

from plant_models.hybrid import Array


class ResidualFilter(NamedTuple):
    """Coefficients of ``F``, ``s F`` and ``s^2 F`` in ``z^-1``.

    Attributes:
        level: numerator of F, three numbers [1]. first: of ``s F``, three numbers [1/s].
        second: of ``s^2 F``, three numbers [1/s2]. denominator: behind the leading one, two numbers [1].
    """

    level: tuple[Array, Array, Array]
    first: tuple[Array, Array, Array]
    second: tuple[Array, Array, Array]
    denominator: tuple[Array, Array]


class Filtered(NamedTuple):
    """What a filter gives at a sample.

    Attributes:
        value: the output. memory: what is carried to the next sample, two numbers of the same unit.
    """

    value: Array
    memory: tuple[Array, Array]


def residual_filter(time_constant: Array, sample_period: Array) -> ResidualFilter:
    """Coefficients of the filters: Omar 2012, (7.6.3)-(7.6.5), with ``s = 2 / Ts (z - 1) / (z + 1)``.

    Tustin's rule is ours, the print has the continuous filters alone. At tau = 0 F is no filter, and its derivatives
    oscillate from sample to sample.

    Args:
        time_constant: tau of both poles [s], positive. sample_period: Ts [s], positive.
    """
    ratio = 2.0 * time_constant / sample_period
    gain = 1.0 / ((1.0 + ratio) * (1.0 + ratio))
    pole = (ratio - 1.0) / (ratio + 1.0)
    slope = 2.0 / sample_period
    return ResidualFilter(
        (gain, 2.0 * gain, gain),
        (gain * slope, 0.0 * gain, -gain * slope),
        (gain * slope * slope, -2.0 * gain * slope * slope, gain * slope * slope),
        (-2.0 * pole, pole * pole),
    )


def filtered(
    coefficients: ResidualFilter,
    memory: tuple[Array, Array],
    level: Array = 0.0,
    first: Array = 0.0,
    second: Array = 0.0,
) -> Filtered:
    """One sample of ``F{level} + s F{first} + s^2 F{second}``.

    Args:
        coefficients: of `residual_filter`. memory: of the sample before, two numbers; zeros, or `settled`.
        level: signal that is filtered. first: signal of which the first derivative is filtered.
        second: signal of which the second derivative is filtered.

    Returns:
        The sum, and the memory for the next sample.
    """
    now, last, oldest = _numerators(coefficients, level, first, second)
    a1, a2 = coefficients.denominator
    value = now + memory[0]
    return Filtered(value, (last - a1 * value + memory[1], oldest - a2 * value))


def settled(
    coefficients: ResidualFilter, level: Array = 0.0, first: Array = 0.0, second: Array = 0.0
) -> tuple[Array, Array]:
    """Memory of a filter whose inputs have been constant: it starts without a transient.

    Args:
        coefficients: of `residual_filter`. level: see `filtered`. first: see `filtered`. second: see `filtered`.

    Returns:
        The two numbers that `filtered` takes.
    """
    now, _, oldest = _numerators(coefficients, level, first, second)
    return level - now, oldest - coefficients.denominator[1] * level


def _numerators(c: ResidualFilter, level: Array, first: Array, second: Array) -> tuple[Array, Array, Array]:
    b0, b1, b2 = (c.level[i] * level + c.first[i] * first + c.second[i] * second for i in range(3))
    return b0, b1, b2
