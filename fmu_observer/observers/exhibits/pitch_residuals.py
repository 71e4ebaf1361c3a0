"""Pitch of a wind turbine's blades against its reference: residuals of six sensors, sharp for faults of a sensor, slow
for faults of an actuator. Pure functions on states by name, for the system that carries it.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from fmu_observer.formulas.diagnosis.actuator import centred, second_order_residual
from fmu_observer.formulas.diagnosis.redundancy import disagreement
from fmu_observer.formulas.diagnosis.residual_filters import residual_filter
from fmu_observer.formulas.diagnosis.window_inversion import windowed_square
from plant_models.hybrid import Array, matrix, memory, parameter, vector

BLADES, SENSORS = 3, 6
BLOCKS = 10  # of the long window
_FILTERS = ("sensor_filter", "brief_filter", "long_filter")

PITCH_PARAMETERS = (
    parameter("pitch_frequency", "rad/s", 11.11, "Natural frequency of a healthy pitch actuator", min=1e-3),
    parameter("pitch_damping", "1", 0.6, "Damping ratio of a healthy pitch actuator", min=0.0),
    parameter("sensor_filter_time", "s", 0.06, "Filter of the residuals of pitch sensors", min=1e-4),
    parameter("brief_filter_time", "s", 0.5, "Filter of the residual of one sample, for pitch actuators", min=1e-4),
    parameter("long_filter_time", "s", 0.6, "Filter of the residual over the long window", min=1e-4),
    parameter(
        "centring",
        "1",
        1.0,
        "1: actuators' readings half a sample late, as held references are to Tustin's rule; 0: as printed",
        min=0.0,
        max=1.0,
    ),
    parameter("mean_residual", "deg/s2", 0.0, "Mean of the residual without a fault, Xbar"),
)

PITCH_MEMORY = (
    memory("previous_pitch", "deg", 0.0, "Readings of the sample before", size=SENSORS),
    memory("sensor_filter", "deg/s2", 0.0, "Filters of the pitch sensors", shape=(SENSORS, 2)),
    memory(
        "sensor_squares", "deg2/s4", 0.0, "Squares of the two samples before, of each pitch sensor", shape=(SENSORS, 2)
    ),
    memory("brief_filter", "deg/s2", 0.0, "Filters of the residual of one sample", shape=(SENSORS, 2)),
    memory("long_filter", "deg/s2", 0.0, "Filters of the residual over the long window", shape=(SENSORS, 2)),
    memory("long_partial", "deg2/s4", 0.0, "Sum of the block that grows, of each blade", size=BLADES),
    memory("long_blocks", "deg2/s4", 0.0, "Sums of the blocks of the long window", shape=(BLADES, BLOCKS)),
    memory("held_pitch_difference", "deg", 0.0, "Difference of the two sensors of each blade", size=BLADES),
    memory("held_pitch_single", "deg2/s4", 0.0, "Residual of each pitch sensor, one sample", size=SENSORS),
    memory("held_pitch_triple", "deg2/s4", 0.0, "Residual of each pitch sensor, three samples", size=SENSORS),
    memory("held_pitch_brief", "deg2/s4", 0.0, "Residual of each blade's actuator, one sample", size=BLADES),
    memory("held_pitch_long", "deg2/s4", 0.0, "Residual of each blade's actuator, long window", size=BLADES),
)


def sample_pitch(m: Any, readings: Array, reference: Array, p: Any, starts: Array) -> dict[str, Array]:
    """Residuals of the pitch after a sample: Omar 2012, (7.6.2), (7.6.9), (7.6.10), (7.6.13), (7.6.14).

    An actuator is judged by the smaller one of its two sensors' residuals at each sample, and only where both have one
    sign: a faulty sensor leaves the other, and noise of one sensor counts for nothing [ours].

    Args:
        m: named tuple with `PITCH_MEMORY`. readings: of blades 1, 1, 2, 2, 3, 3 [deg], shape (6,).
        reference: pitch asked of all blades [deg]. p: parameters with `PITCH_PARAMETERS` and `sample_period`.
        starts: 1 at the first sample, else 0.

    Returns:
        New values of the memory by name.
    """
    times = (p.sensor_filter_time, p.brief_filter_time, p.long_filter_time)
    coefficients = [residual_filter(time, p.sample_period) for time in times]
    found = [_residuals(m, i, readings[i], reference, coefficients, p, starts) for i in range(SENSORS)]
    windows = [windowed_square(m.sensor_squares[i], found[i][0].value) for i in range(SENSORS)]
    quick, slow = ([outs[k].value - p.mean_residual for outs in found] for k in (1, 2))
    return {
        **{name: matrix(*(outs[k].memory for outs in found)) for k, name in enumerate(_FILTERS)},
        "previous_pitch": readings,
        "sensor_squares": matrix(*(window.memory for window in windows)),
        "long_partial": vector(*(m.long_partial[i] + _smaller(slow, i) for i in range(BLADES))),
        "held_pitch_difference": vector(*(disagreement(readings[2 * i], readings[2 * i + 1]) for i in range(BLADES))),
        "held_pitch_single": vector(*(outs[0].value * outs[0].value for outs in found)),
        "held_pitch_triple": vector(*(window.value for window in windows)),
        "held_pitch_brief": vector(*(_smaller(quick, i) for i in range(BLADES))),
    }


def _residuals(
    m: Any, i: int, reading: Array, reference: Array, coefficients: Sequence[Any], p: Any, starts: Array
) -> list[Any]:
    """Residuals of a sensor by each of the three filters; those of actuators are centred."""
    previous = np.where(starts > 0.0, reading, m.previous_pitch[i])
    late = centred(reading, previous, p.centring)
    model = (reference, p.pitch_frequency, p.pitch_damping, starts)
    return [
        second_order_residual(of, getattr(m, name)[i], reading if name == "sensor_filter" else late, *model)
        for name, of in zip(_FILTERS, coefficients, strict=True)
    ]


def end_block(m: Any) -> dict[str, Array]:
    """The long window moves on by a block; its sum is that of (7.6.10) at this instant.

    Args:
        m: named tuple with `PITCH_MEMORY`.

    Returns:
        New values of the memory by name.
    """
    blocks = [[*m.long_blocks[i][1:], m.long_partial[i]] for i in range(BLADES)]
    return {
        "long_blocks": matrix(*blocks),
        "long_partial": np.zeros(BLADES),
        "held_pitch_long": vector(*(sum(block[1:], block[0]) for block in blocks)),
    }


def trusted(readings: Array, limit: Array, residuals: Array) -> Array:
    """Mean of two sensors; where they disagree, the one with the smaller residual.

    Args:
        readings: of both, shape (2,). limit: largest difference without a fault.
        residuals: of the model with each, shape (2,).
    """
    first, second = readings
    better = np.where(residuals[0] <= residuals[1], first, second)
    return np.where(disagreement(first, second) > limit, better, 0.5 * (first + second))


def trusted_pitches(readings: Array, limit: Array, residuals: Array) -> Array:
    """Pitch of each blade, shape (3,).

    Args:
        readings: of the six sensors [deg], shape (6,). limit: largest difference of two without a fault [deg].
        residuals: of the six sensors, shape (6,).
    """
    pairs = (slice(2 * i, 2 * i + 2) for i in range(BLADES))
    return vector(*(trusted(readings[pair], limit, residuals[pair]) for pair in pairs))


def _smaller(residuals: Sequence[Array], blade: int) -> Array:
    """Square of the smaller one of two residuals, zero where their signs differ: noise of one sensor has no say."""
    first, second = residuals[2 * blade], residuals[2 * blade + 1]
    return np.where(first * second > 0.0, np.minimum(first * first, second * second), 0.0)
