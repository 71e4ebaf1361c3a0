"""Noise of a motor: what is added to its state and to its measured currents at every sample. Declarations and pure
functions, for the continuous motor and its Euler form.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from plant_models.hybrid import Array, PeriodicEvent, input_signal, parameter

STATE_NAMES = ("current_d", "current_q", "speed", "angle")
PUBLISHED_NOISE = {"process_variance": (1e-3, 1e-3, 1e-3, 1e-3), "measurement_variance": (0.1, 0.1)}
"""Variances of one sample as the tables of the thesis demand them: not deviations, not densities."""

NOISE_PARAMETERS = (
    parameter("sample_period", "s", 1e-4, "Time between two samples T_s", min=1e-7),
    parameter(
        "process_variance",
        "1",
        0.0,
        "Variances added per sample to current d, current q, speed, angle, in squares of their units; 0: none",
        min=0.0,
        size=4,
    ),
    parameter(
        "measurement_variance",
        "A2",
        0.0,
        "Variances of both measured currents; 0: exact",
        min=0.0,
        size=2,
    ),
)


def sampling_event(name: str) -> PeriodicEvent:
    """The event at which a motor is sampled, with the standard normal numbers of one sample.

    Args:
        name: of the event.

    Returns:
        The event, of period `sample_period`.
    """
    process = tuple(
        input_signal(f"{state}_noise", "1", 0.0, f"Standard normal number of the {state}", variability="discrete")
        for state in STATE_NAMES
    )
    measurement = tuple(
        input_signal(f"measurement_noise_{i}", "1", 0.0, f"Standard normal number, axis {i}", variability="discrete")
        for i in (1, 2)
    )
    return PeriodicEvent(name, "sample_period", None, (*process, *measurement), "The motor is sampled")


def process_noise(u: Any, p: Any) -> tuple[Array, Array, Array, Array]:
    """What one sample adds to the state, in the units of the state.

    Args:
        u: inputs with the noises of `sampling_event`. p: parameters with `process_variance`.

    Returns:
        Added to the current along d [A] and q [A], the speed [rad/s] and the angle [rad].
    """
    numbers = (u.current_d_noise, u.current_q_noise, u.speed_noise, u.angle_noise)
    first, second, third, fourth = (np.sqrt(p.process_variance[i]) * number for i, number in enumerate(numbers))
    return first, second, third, fourth
