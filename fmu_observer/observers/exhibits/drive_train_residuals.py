"""Speeds of a wind turbine's rotor and generator against the torsion between them, and the torque of the generator
against its reference. Pure functions on states by name, for the system that carries it.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from fmu_observer.formulas.diagnosis.actuator import centred, first_order_residual, rate_residual
from fmu_observer.formulas.diagnosis.finite_window_observer import finite_window_observer, sampled
from fmu_observer.formulas.diagnosis.redundancy import disagreement
from fmu_observer.formulas.diagnosis.residual_filters import residual_filter
from fmu_observer.formulas.diagnosis.window_inversion import windowed_square
from fmu_observer.observers.exhibits.pitch_residuals import BLOCKS
from plant_models.exhibits.wind_turbine.drive_train import DriveTrain
from plant_models.hybrid import Array, matrix, memory, parameter, vector

WINDOW = 5  # samples of the observer of the torsion


def torsion_gains(drive: DriveTrain, sample_period: float, samples: int = WINDOW) -> np.ndarray:
    """How the torsion at the last sample follows from a window: Omar 2012, (7.7.1)-(7.7.3), with exact sampling.

    Args:
        drive: with numbers. sample_period: [s]. samples: of the window, at least 2.

    Returns:
        Gains of rotor speeds [s], generator speeds [s], rotor torques [rad/(N.m)] and generator torques [rad/(N.m)],
        oldest first, shape (4, samples).

    Raises:
        ValueError: the window does not show the torsion.
    """
    A: np.ndarray = np.array(drive.matrix())
    B = np.array([[1.0 / drive.rotor_inertia, 0.0], [0.0, -1.0 / drive.generator_inertia], [0.0, 0.0]])
    observer = finite_window_observer(*sampled(A, B, sample_period), np.eye(2, 3), samples)
    if observer.rank < 3:
        raise ValueError(f"{samples} samples of both speeds do not show the torsion; expected at least 2.")
    return np.vstack([observer.gain_y[2].reshape(samples, 2).T, observer.gain_u[2].reshape(samples, 2).T])


GAINS_PERIOD = 0.01  # [s]
GAINS = torsion_gains(DriveTrain(), GAINS_PERIOD)
"""Default gains; they hold for samples `GAINS_PERIOD` apart."""

DRIVE_PARAMETERS = (
    *(
        parameter(f"{name}_gain", unit, tuple(map(float, row)), f"Torsion per {text} in the window", size=WINDOW)
        for name, unit, text, row in zip(
            ("rotor_speed", "generator_speed", "rotor_torque", "generator_torque"),
            ("s", "s", "rad/(N.m)", "rad/(N.m)"),
            ("rotor speed", "generator speed", "torque on the rotor", "torque of the generator"),
            GAINS,
            strict=True,
        )
    ),
    parameter("gear_ratio", "1", 95.0, "Ratio of the gear Ng", min=1e-3),
    parameter("speed_filter_time", "s", 0.01, "Filter of the residuals of the speed sensors", min=1e-4),
    parameter("torque_filter_time", "s", 0.02, "Filter of the residual of the generator torque", min=1e-4),
    parameter("converter_time", "s", 0.02, "Time constant of a healthy converter", min=1e-6),
)

_HISTORIES = ("rotor_first", "rotor_second", "generator_first", "generator_second", "rotor_torques", "torques")
DRIVE_MEMORY = (
    *(
        memory(name, unit, 0.0, f"{text}, samples before", size=WINDOW - 1)
        for name, unit, text in zip(
            _HISTORIES,
            ("rad/s", "rad/s", "rad/s", "rad/s", "N.m", "N.m"),
            (
                "Rotor speed of sensor 1",
                "Rotor speed of sensor 2",
                "Generator speed of sensor 1",
                "Generator speed of sensor 2",
                "Torque on the rotor",
                "Measured torque of the generator",
            ),
            strict=True,
        )
    ),
    memory("speed_filter", "rad/s", 0.0, "Filters of the speed sensors", shape=(4, 2)),
    memory("speed_squares", "rad2/s2", 0.0, "Square of the sample before, of each speed sensor", size=4),
    memory("torque_filter", "N.m", 0.0, "Filter of the generator torque", size=2),
    memory("torque_squares", "N2.m2", 0.0, "Squares of the two samples before", size=2),
    memory("shaft_partial", "rad", 0.0, "Angle between rotor and generator by their speeds, in the block that runs"),
    memory("shaft_blocks", "rad", 0.0, "The same in the last blocks", size=BLOCKS),
    memory("held_shaft_angle", "rad", 0.0, "The same over the long window"),
    memory("held_speed_difference", "rad/s", 0.0, "Difference of the sensors of rotor and of generator", size=2),
    memory("held_speed_residual", "rad2/s2", 0.0, "Residual of rotor sensors 1, 2, generator sensors 1, 2", size=4),
    memory("held_torque_residual", "N2.m2", 0.0, "Residual of the generator torque"),
    memory("held_estimated_torsion", "rad", 0.0, "Torsion from the last samples, mean of the sensors"),
)


def sample_speeds(
    m: Any, rotor: Array, generator: Array, rotor_torque: Array, torque: Array, p: Any, starts: Array
) -> dict[str, Array]:
    """Residuals of the four speed sensors after a sample: Omar 2012, (7.7.4)-(7.7.6).

    Each sensor stands beside the mean of the two of the other speed; a fault of one speed leaves the other healthy, as
    at most one fault is assumed.

    Args:
        m: named tuple with `DRIVE_MEMORY`. rotor: speeds of the two sensors [rad/s], shape (2,).
        generator: the same [rad/s], shape (2,). rotor_torque: estimated torque of the wind on the rotor [N.m].
        torque: measured torque of the generator [N.m]. p: parameters with `DRIVE_PARAMETERS` and `sample_period`.
        starts: 1 at the first sample, else 0.

    Returns:
        New values of the memory by name.
    """
    now = (rotor[0], rotor[1], generator[0], generator[1], rotor_torque, torque)
    histories = _moved_on(m, now, starts)
    r1, r2, g1, g2, driving, braking = _weighted_windows(histories, p)
    torsions = _beside(r1, r2, g1, g2, 1.0)
    rates = _beside(rotor[0], rotor[1], generator[0], generator[1], -1.0 / p.gear_ratio)
    coefficients = residual_filter(p.speed_filter_time, p.sample_period)
    sensors = zip(m.speed_filter, [torsion + driving + braking for torsion in torsions], rates, strict=True)
    found = [rate_residual(coefficients, *sensor, starts) for sensor in sensors]
    windows = [windowed_square(m.speed_squares[i : i + 1], out.value) for i, out in enumerate(found)]
    return {
        **{name: vector(*values[1:]) for name, values in histories.items()},
        "speed_filter": matrix(*(out.memory for out in found)),
        "speed_squares": vector(*(window.memory[0] for window in windows)),
        "held_speed_difference": vector(disagreement(*rotor), disagreement(*generator)),
        "held_speed_residual": vector(*(window.value for window in windows)),
        "held_estimated_torsion": 0.5 * (torsions[0] + torsions[1]) + driving + braking,
    }


def _weighted_windows(histories: dict[str, list[Array]], p: Any) -> list[Array]:
    """What each window adds to the torsion [rad]."""
    gains: tuple[Array, ...] = (p.rotor_speed_gain, p.rotor_speed_gain, p.generator_speed_gain, p.generator_speed_gain)
    gains += (p.rotor_torque_gain, p.generator_torque_gain)
    return [_weighted(gain, histories[name]) for name, gain in zip(_HISTORIES, gains, strict=True)]


def _moved_on(m: Any, now: Sequence[Array], starts: Array) -> dict[str, list[Array]]:
    """Windows of the readings with those of now; the first ones stand for all before them."""
    return {
        name: [*(np.where(starts > 0.0, value, before) for before in getattr(m, name)), value]
        for name, value in zip(_HISTORIES, now, strict=True)
    }


def sample_torque(m: Any, torque: Array, reference: Array, p: Any, starts: Array) -> dict[str, Array]:
    """Residual of the generator torque over three samples: Omar 2012, 7.8.1.

    Args:
        m: named tuple with `DRIVE_MEMORY`, as it was before the sample. torque: measured [N.m].
        reference: that was held since the last sample [N.m].
        p: parameters with `DRIVE_PARAMETERS`, `centring` and `sample_period`. starts: 1 at the first sample, else 0.

    Returns:
        New values of the memory by name.
    """
    coefficients = residual_filter(p.torque_filter_time, p.sample_period)
    previous = np.where(starts > 0.0, torque, m.torques[WINDOW - 2])
    late = centred(torque, previous, p.centring)
    out = first_order_residual(coefficients, m.torque_filter, late, reference, p.converter_time, starts)
    window = windowed_square(m.torque_squares, out.value)
    return {
        "torque_filter": vector(*out.memory),
        "torque_squares": window.memory,
        "held_torque_residual": window.value,
    }


def end_shaft_block(m: Any) -> dict[str, Array]:
    """The long window of the angle between rotor and generator moves on by a block [ours].

    A shaft twists by some 1e-3 rad and no further: an angle that grows is an error of a speed, or of the gear's ratio.

    Args:
        m: named tuple with `DRIVE_MEMORY`.

    Returns:
        New values of the memory by name.
    """
    kept = [*m.shaft_blocks[1:], m.shaft_partial]
    return {"shaft_blocks": vector(*kept), "shaft_partial": 0.0, "held_shaft_angle": sum(kept[1:], kept[0])}


def _weighted(gain: Array, values: Sequence[Array]) -> Array:
    total = gain[0] * values[0]
    for i in range(1, WINDOW):
        total = total + gain[i] * values[i]
    return total


def _beside(r1: Array, r2: Array, g1: Array, g2: Array, factor: Array) -> tuple[Array, Array, Array, Array]:
    """Each of four sensors with the mean of the two of the other speed, which counts `factor` times."""
    rotor, generator = 0.5 * (r1 + r2), 0.5 * factor * (g1 + g2)
    return r1 + generator, r2 + generator, rotor + factor * g1, rotor + factor * g2
