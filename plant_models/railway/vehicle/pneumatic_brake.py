"""The indirect brake of a train: the wave in the brake pipe, the filling of the cylinders, the force on the wheels.

Plain NumPy on numbers, batches and traced symbols. Knows the signal vocabulary, and nothing of vehicles and trains.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from plant_models.hybrid import Array, vector
from plant_models.hybrid.event import PeriodicEvent
from plant_models.hybrid.signal import Signal, memory, parameter, state

BAR = 1e5  # [Pa]

BRAKE_PARAMETERS: tuple[Signal, ...] = (
    parameter(
        "pipe_pressure_released", "Pa", 5.0 * BAR, "Brake pipe with released brakes", min=0.0, display_unit="bar"
    ),
    parameter(
        "pipe_depression_full", "Pa", 1.5 * BAR, "Depression of the full service brake", min=1.0, display_unit="bar"
    ),
    parameter("cylinder_pressure_full", "Pa", 3.5 * BAR, "Brake cylinder at full service", min=1.0, display_unit="bar"),
    parameter("cylinder_pressure_idle", "Pa", 0.3 * BAR, "Taken up by the return spring", min=0.0, display_unit="bar"),
    parameter("filling_time", "s", 1.3, "Time constant of a filling cylinder; 95 % after three of them", min=1e-3),
    parameter("venting_time", "s", 8.0, "Time constant of a venting cylinder", min=1e-3),
    parameter("brake_ratio", "m/s2", 1.0, "Brake force on a braked mass under the full service brake", min=0.0),
    parameter(
        "brake_sample_period",
        "s",
        0.01,
        "Time between two readings of the demand; the wave takes delay_samples of them from vehicle to vehicle",
        min=1e-6,
    ),
)


def filling(cylinder: Array, pipe: Array, p: Any) -> Array:
    """Derivative of a cylinder's pressure [Pa/s], a lag of first order behind what the distributor asks for.

    The distributor asks for `cylinder_pressure_full` at a depression of `pipe_depression_full`, and proportionally for
    less.

    Args:
        cylinder: pressure in the cylinder [Pa]. pipe: pressure in the pipe at the vehicle [Pa]. p: with
            `BRAKE_PARAMETERS`.

    Source: limits Bouchama 2024, section 4.1; the time constants are ours: 95 % after 4 s, empty but for 0.4 bar after
    17 s, inside the 3-5 s and 15-20 s that the passenger setting of the UIC brake allows.
    """
    asked = np.clip((p.pipe_pressure_released - pipe) / p.pipe_depression_full, 0.0, 1.0) * p.cylinder_pressure_full
    return (asked - cylinder) / np.where(asked > cylinder, p.filling_time, p.venting_time)


def brake_force(cylinder: Array, braked_mass: Array, p: Any) -> Array:
    """Braking force at the rims of a vehicle [N], zero or positive; dry friction against the motion.

    ``braked_mass * brake_ratio`` at full cylinder pressure, proportional to the pressure above
    `cylinder_pressure_idle`. The braked mass is what the vehicle carries on its side; that 1 kg of it stands for 1 N at
    full service, 0.31 N per bar above idle, is ours: a train of 100 % braked mass then slows down by 1 m/s2, the size
    of what such trains reach.

    Args:
        cylinder: pressure in the cylinder [Pa]. braked_mass: [kg]. p: with `BRAKE_PARAMETERS`.
    """
    usable = p.cylinder_pressure_full - p.cylinder_pressure_idle
    return braked_mass * p.brake_ratio * np.maximum(cylinder - p.cylinder_pressure_idle, 0.0) / usable


class BrakePipe:
    """The delay of the brake pipe: the first vehicle feels the demand at once, vehicle i ``(i - 1) tau`` later.

    A shift register of readings, one every `brake_sample_period`, with ``delay_samples`` places from vehicle to
    vehicle:
    ``tau = delay_samples * brake_sample_period``. A reading is the mean demand of the period that ends with it, so it
    holds what acted in that period, whether the input changes just before or just after the instant of reading:
    co-simulation changes it after, an importer of model exchange before. For a demand that changes at these instants,
    as that of a controller with this period or a multiple of it, the delay is exact, since they are hit exactly inside
    steps. A change within a period reaches the vehicles behind as the mean of that period.

    Args:
        vehicles: number of vehicles. delay_samples: readings from vehicle to vehicle, one at least.

    Source: the delay ``F_b(t - (i-1) tau)`` of Bouchama 2024, (4.3)-(4.5); tau is not printed. By default it is 5 times
    10 ms,
    ours: 281 m/s over 14.06 m, the speed of the wave with modern distributors.
    """

    def __init__(self, vehicles: int, delay_samples: int) -> None:
        self.delay_samples = delay_samples
        self.state = state("demand_integral", "s", 0.0, "Brake demand, integrated since it was read last")
        length = (vehicles - 1) * delay_samples
        self.memory = memory("pipe_demand", "1", 0.0, "Readings of the brake demand, the newest first", size=length)
        period = "brake_sample_period"
        self.event = PeriodicEvent("brake_reading", period, period, description="The brake demand is read")

    def shifted(self, readings: Array, integral: Array, p: Any) -> Array:
        """The register after a new reading: of a demand with this integral [s] over the last period."""
        return vector(integral / p.brake_sample_period, *readings[:-1])

    def pressure(self, demand: Array, readings: Array, vehicle: int, p: Any) -> Array:
        """Pressure in the pipe [Pa] at a vehicle, 0 is the first one, for the demand [1] at the first one now."""
        there = limited(demand) if vehicle == 0 else readings[vehicle * self.delay_samples - 1]
        return p.pipe_pressure_released - there * p.pipe_depression_full


def limited(demand: Array) -> Array:
    """A brake demand within 0 .. 1."""
    return np.clip(demand, 0.0, 1.0)
