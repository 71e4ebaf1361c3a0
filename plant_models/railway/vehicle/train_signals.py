"""The signals of the multi-vehicle train: states, inputs, outputs and parameters for so many wagons and axles."""

from __future__ import annotations

from plant_models.hybrid import Signal, input_signal, output_signal, parameter, state
from plant_models.railway.vehicle.coupler import COUPLER_PARAMETERS
from plant_models.railway.vehicle.pneumatic_brake import BRAKE_PARAMETERS
from plant_models.railway.vehicle.resistance import GRAVITY

AXLE_POSITIONS = {1: (9.75,), 4: (3.3, 5.9, 13.6, 16.2)}  # [m] behind the front of 19.5 m; bogies 2.6 m, 10.3 m apart
ONE_WHEEL = 225.0  # [kg.m2], the inertia printed in Table 4.2
POINT_STATES = (
    state("train_position", "m", 0.0, "Position of the train at start"),
    state("train_speed", "m/s", 0.0, "Speed of the train at start"),
)
"""Of a train that is one point, as are `POINT_OUTPUTS`."""
POINT_OUTPUTS = (
    output_signal("position", "m", "Position of the train"),
    output_signal("speed", "m/s", "Speed of the train", display_unit="km/h"),
    output_signal("acceleration", "m/s2", "Acceleration of the train"),
)
DOWNHILL_PULL = output_signal("gradient_force", "N", "Downhill pull as a resistance, uphill > 0")
FREE_FALL = parameter("gravity", "m/s2", GRAVITY, "Acceleration of gravity g", min=0.0)
SLIP_FLOOR = parameter("slip_floor", "m/s", 0.5, "Smallest speed the slip refers to", min=1e-3, display_unit="km/h")


def train_states(wagons: int, axles: int) -> tuple[Signal, ...]:
    """Position, elongations, speeds, rates and cylinder pressures.

    Args:
        wagons: number of wagons. axles: wheelsets of the locomotive.
    """
    return (
        state("train_position", "m", 0.0, "Position of the locomotive's front at start"),
        state("elongation", "m", 0.0, "Elongation of each coupler beyond its neutral place at start", size=wagons),
        state("train_speed", "m/s", 0.0, "Speed of the locomotive at start"),
        state("wagon_velocity", "m/s", 0.0, "Speed of each wagon at start", size=wagons),
        state(
            "axle_rate",
            "rad/s",
            0.0,
            "Angular speed of each axle at start; speed / wheel_radius where it rolls",
            size=axles,
        ),
        state(
            "cylinder", "Pa", 0.0, "Pressure in the brake cylinders at start, the locomotive's first", size=wagons + 1
        ),
    )


def train_inputs(size: int | None) -> tuple[Signal, ...]:
    """Effort and brake demand.

    Args:
        size: number of efforts, one for each axle; None for one that is shared.
    """
    whole = "Effort at the rims, shared by the axles: traction > 0, electric brake < 0"
    each = "Effort at the rims of each axle: traction > 0, electric brake < 0"
    return (
        input_signal("effort", "N", 0.0, whole if size is None else each, size=size),
        input_signal(
            "brake_demand", "1", 0.0, "Indirect brake: depression of the pipe over that of the full service brake"
        ),
    )


def train_outputs(wagons: int, axles: int) -> tuple[Signal, ...]:
    """What is measured, and the forces.

    Args:
        wagons: number of wagons. axles: wheelsets of the locomotive.
    """
    return (
        output_signal("position", "m", "Position of the locomotive's front"),
        output_signal("speed", "m/s", "Speed of the locomotive", display_unit="km/h"),
        output_signal("acceleration", "m/s2", "Acceleration of the locomotive"),
        output_signal("wheel_speed", "m/s", "Circumferential speed of the first axle, r*w", display_unit="km/h"),
        output_signal("slip", "1", "Slip ratio of the first axle (r*w - v) / max(|v|, slip_floor), (3.13)"),
        output_signal("adhesion_force", "N", "Force of the rail on all wheels of the locomotive"),
        output_signal("rim_effort", "N", "Effort at the rims of the locomotive, drive less its indirect brake"),
        output_signal("resistance_force", "N", "Running resistance of the train, against the motion"),
        output_signal("gradient_force", "N", "Downhill pull on the train as a resistance, uphill > 0"),
        output_signal("wagon_brake_force", "N", "Force of the wagons' brakes, against the motion"),
        output_signal("adhesion_degraded", "1", "0 nominal .. 1 degraded adhesion, of the axle where it is largest"),
        output_signal("axle_speed", "m/s", "Circumferential speed of each axle", display_unit="km/h", size=axles),
        output_signal("axle_slip", "1", "Slip ratio of each axle", size=axles),
        output_signal("axle_creep_force", "N", "Force of the rail on each axle by the adhesion curve", size=axles),
        output_signal("wagon_speed", "m/s", "Speed of each wagon", display_unit="km/h", size=wagons),
        output_signal("coupler_force", "N", "Force in each coupler, tension > 0", size=wagons),
        output_signal("pipe_pressure", "Pa", "Brake pipe at each vehicle", display_unit="bar", size=wagons + 1),
        output_signal("cylinder_pressure", "Pa", "Brake cylinder of each vehicle", display_unit="bar", size=wagons + 1),
    )


def train_parameters(wagons: int, axles: int) -> tuple[Signal, ...]:
    """Masses, lengths, wheels, running resistances, couplers and brakes.

    Args:
        wagons: number of wagons. axles: wheelsets of the locomotive.
    """
    return (*_locomotive_parameters(axles), *_wagon_parameters(wagons), *COUPLER_PARAMETERS, *BRAKE_PARAMETERS)


def _locomotive_parameters(axles: int) -> tuple[Signal, ...]:
    return (
        parameter("mass", "kg", 90e3, "Mass of the locomotive M_1", min=1.0),
        parameter("length", "m", 19.5, "Length of the locomotive", min=0.0),
        parameter("braked_mass", "kg", 80e3, "Braked mass of the locomotive's indirect brake", min=0.0),
        parameter("wheel_inertia", "kg.m2", ONE_WHEEL, "Moment of inertia of one axle of the locomotive J", min=1e-3),
        parameter("wheel_radius", "m", 0.575, "Radius of the locomotive's wheels r", min=1e-3),
        FREE_FALL,
        parameter("davis_a", "N", 900.0, "Running resistance of the locomotive, constant part; dry friction", min=0.0),
        parameter("davis_b", "N.s/m", 32.4, "Running resistance of the locomotive, viscous part", min=0.0),
        parameter("davis_c", "N.s2/m2", 1.6529, "Running resistance of the locomotive, aerodynamic part", min=0.0),
        SLIP_FLOOR,
        parameter(
            "axle_position", "m", AXLE_POSITIONS[axles], "Distance of each axle from the front", min=0.0, size=axles
        ),
        parameter(
            "axle_degraded",
            "1",
            1.0,
            "Share of a zone's degradation that each axle finds",
            min=0.0,
            max=1.0,
            size=axles,
        ),
    )


def _wagon_parameters(wagons: int) -> tuple[Signal, ...]:
    return (
        parameter("wagon_mass", "kg", 19e3, "Mass of each wagon M_i", min=1.0, size=wagons),
        parameter("wagon_length", "m", 14.06, "Length of a wagon", min=0.0),
        parameter("wagon_braked_mass", "kg", 21e3, "Braked mass of each wagon", min=0.0, size=wagons),
        parameter("wagon_davis_a", "N", 190.0, "Running resistance of a wagon, constant part; dry friction", min=0.0),
        parameter("wagon_davis_b", "N.s/m", 6.8, "Running resistance of a wagon, viscous part", min=0.0),
        parameter("wagon_davis_c", "N.s2/m2", 2.3, "Running resistance of a wagon, aerodynamic part", min=0.0),
    )
