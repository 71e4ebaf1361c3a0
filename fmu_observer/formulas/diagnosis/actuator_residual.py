"""Whether the measured position or torque of an actuator follows from its reference: the model, filtered, so that no
derivative of a noisy reading is taken. Pure functions that trace; they rest on the filters of residuals.
"""

from __future__ import annotations

from fmu_observer.formulas.diagnosis.residual_filters import Filtered, ResidualFilter, filtered, settled
from plant_models.hybrid import Array


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
        coefficients: of `residual_filter`. memory: of the sample before, two numbers. measured: y. reference: r.
        time_constant: tau of the actuator [s]. starts: see `second_order_residual`.

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
