"""Efficiency of a wind turbine's drive train from a window of some minutes: simulated for a grid of efficiencies,
bracketed by the measured generator speed. Pure functions on states by name, for the system that carries it.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from fmu_observer.formulas.diagnosis.window_inversion import grid_around, invert, smoothed
from plant_models.hybrid import Array, memory, parameter, vector
from plant_models.hybrid.scan import Arrays, enclosed, scan_table

BLOCKS = 30  # of the window
VALUES = 5  # of the grid, N_e

EFFICIENCY_PARAMETERS = (
    parameter("update_period", "s", 10.0, "Time between two estimates of the efficiency; 30 make the window", min=1e-3),
    parameter("nominal_efficiency", "1", 0.97, "Efficiency of a healthy drive train", min=0.0),
    parameter("grid_lowest", "1", 0.7, "First value of the grid, in last estimates", min=0.0),
    parameter("grid_highest", "1", 1.7, "Last value of the grid, in last estimates", min=0.0),
    parameter("least_efficiency", "1", 0.05, "Least efficiency of the grid", min=1e-3),
    parameter("most_efficiency", "1", 1.5, "Largest efficiency of the grid", min=1e-3),
    parameter("smoothing", "1", 0.2, "Weight of the last estimate, gamma", min=0.0, max=1.0),
    parameter("rotor_inertia", "kg.m2", 55e6, "Inertia of the rotor Jr", min=1e-3),
    parameter("generator_inertia", "kg.m2", 390.0, "Inertia of the generator Jg", min=1e-3),
    parameter("rotor_friction", "N.m.s/rad", 7.11, "Friction of the rotor Br", min=0.0),
    parameter("generator_friction", "N.m.s/rad", 45.6, "Friction of the generator Bg", min=0.0),
)

EFFICIENCY_MEMORY = (
    memory("driving_sum", "N.m", 0.0, "Sum of the estimated torque on the rotor over the block that grows"),
    memory("braking_sum", "N.m", 0.0, "Sum of the measured torque of the generator over it"),
    memory("block_samples", "1", 0.0, "Samples in the block that grows"),
    memory("driving_means", "N.m", 0.0, "Mean torque on the rotor in each block", size=BLOCKS),
    memory("braking_means", "N.m", 0.0, "Mean torque of the generator in each block", size=BLOCKS),
    memory("generator_starts", "rad/s", 0.0, "Generator speed at the end of each block", size=BLOCKS),
    memory("full_blocks", "1", 0.0, "Blocks since the start"),
    memory("held_efficiency_estimate", "1", 0.97, "Efficiency, smoothed, eta_p"),
    memory("held_efficiency_crossings", "1", 1.0, "Intervals of the grid that bracket the measurement"),
    memory("outside_updates", "1", 0.0, "Updates in a row whose grid did not bracket the measurement"),
    memory("last_generator", "rad/s", 0.0, "Generator speed of the last sample"),
)


def sample_torques(m: Any, generator: Array, driving: Array, braking: Array) -> dict[str, Array]:
    """A sample is added to the block that grows.

    Args:
        m: named tuple with `EFFICIENCY_MEMORY`. generator: its speed [rad/s].
        driving: estimated torque of the wind on the rotor [N.m]. braking: measured torque of the generator [N.m].

    Returns:
        New values of the memory by name.
    """
    return {
        "driving_sum": m.driving_sum + driving,
        "braking_sum": m.braking_sum + braking,
        "block_samples": m.block_samples + 1.0,
        "last_generator": generator,
    }


def _simulated_speed(efficiency: Array, start: Array, driving: Array, braking: Array, period: Array, p: Any) -> Array:
    """Generator speed after the blocks of a window.

    The two inertias turn as one, ``(Jr + Ng^2 Jg / eta) w' = tau_r - (Br + Ng^2 Bg / eta) w - Ng tau_g / eta``, exact
    for torques held over a block. Left out is the twisting of the shaft: it swings with 28 rad/s and is gone after a
    minute (its time constant is 18 s), so that windows of some minutes do not see it.

    Source:
        Omar 2012, (7.3.3), repaired, reduced to its slow mode.
    """
    ratio = p.gear_ratio / efficiency
    inertia = p.rotor_inertia + p.gear_ratio * ratio * p.generator_inertia
    friction = p.rotor_friction + p.gear_ratio * ratio * p.generator_friction
    rate = friction / inertia
    kept = np.exp(-rate * period)
    gain = (1.0 - kept) / friction
    (speed,) = enclosed(_turned, 0.0 * efficiency + start / p.gear_ratio, kept, gain, ratio, driving, braking)
    return p.gear_ratio * speed


def _turned(start: Array, kept: Array, gain: Array, ratio: Array, driving: Array, braking: Array) -> Arrays:
    """Rotor speeds after all blocks, one for each efficiency, as a function of arrays alone."""
    tables = (np.stack([driving], axis=1), np.stack([braking], axis=1))
    return scan_table(_block, (start,), tables, (kept, gain, ratio))[0]


def _block(carry: Arrays, row: Arrays, shared: Arrays) -> tuple[Arrays, Arrays]:
    kept, gain, ratio = shared
    return (kept * carry[0] + gain * (row[0][0] - ratio * row[1][0]),), ()


def update_efficiency(m: Any, p: Any) -> dict[str, Array]:
    """The window moves on by a block and is inverted for the efficiency: Omar 2012, (7.7.7), (7.7.8).

    Before the window is full the efficiency stays nominal.

    Args:
        m: named tuple with `EFFICIENCY_MEMORY`. p: parameters with `EFFICIENCY_PARAMETERS` and `gear_ratio`.

    Returns:
        New values of the memory by name.
    """
    samples = np.maximum(m.block_samples, 1.0)
    ends = {"driving_means": m.driving_sum / samples, "braking_means": m.braking_sum / samples}
    ends["generator_starts"] = m.last_generator
    moved = {name: vector(*getattr(m, name)[1:], end) for name, end in ends.items()}
    full_blocks = m.full_blocks + np.where(m.block_samples > 0.0, 1.0, 0.0)
    previous = m.held_efficiency_estimate
    bounds = (p.grid_lowest, p.grid_highest, p.least_efficiency, p.most_efficiency)
    grid = grid_around(previous, VALUES, *bounds)
    start = m.generator_starts[0]  # where the oldest of the moved blocks began
    torques = (moved["driving_means"], moved["braking_means"])
    ends_there = _simulated_speed(vector(*grid), start, *torques, p.update_period, p)
    found = invert(grid, [ends_there[i] - m.last_generator for i in range(VALUES)], previous)
    full = full_blocks > BLOCKS + 0.5  # the block before the window says where it begins
    return {
        **moved,
        "driving_sum": 0.0,
        "braking_sum": 0.0,
        "block_samples": 0.0,
        "full_blocks": full_blocks,
        "held_efficiency_estimate": np.where(full, smoothed(previous, found.value, p.smoothing), p.nominal_efficiency),
        "held_efficiency_crossings": np.where(full, found.crossings, 1.0),
        "outside_updates": np.where(full, np.where(found.crossings > 0.0, 0.0, m.outside_updates + 1.0), 0.0),
    }
