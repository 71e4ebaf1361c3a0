"""The faults of a train's sensors, wheels, traction and brake, and the residuals that they move. Data only."""

from __future__ import annotations

from fmu_observer.formulas.diagnosis.isolation_table import IsolationTable

NONE, SUSPECTED, WHEEL, SENSOR, STUCK, LOSS = 0.0, 1.0, 2.0, 3.0, 4.0, 5.0
"""Fault codes: none; detected and not isolated; the wheel slips or jams; the reading is wrong; it stands still; an
actuator gives less, or more, than it is asked for."""

MOTION = IsolationTable(
    residuals=(
        "odometers",
        "odometer_1_radar",
        "odometer_2_radar",
        "odometer_1_gps",
        "odometer_2_gps",
        "radar_gps",
        "gps_position",
        "way_1",
        "way_2",
        "way_radar",
        "balise",
    ),
    must={
        "odometer_1": ("odometers", "odometer_1_radar", "odometer_1_gps", "way_1"),
        "odometer_2": ("odometers", "odometer_2_radar", "odometer_2_gps", "way_2"),
        "radar": ("odometer_1_radar", "odometer_2_radar", "radar_gps", "way_radar"),
        "gps": ("gps_position",),
        "balise": ("balise",),
        "adhesion": (
            "odometer_1_radar",
            "odometer_2_radar",
            "odometer_1_gps",
            "odometer_2_gps",
            "way_1",
            "way_2",
        ),
    },
    may={
        "odometer_1": ("balise", "gps_position"),
        "odometer_2": ("balise", "gps_position"),
        "radar": ("balise", "gps_position"),
        "gps": ("odometer_1_gps", "odometer_2_gps", "radar_gps"),
        "balise": ("gps_position",),
        "adhesion": ("odometers", "balise", "gps_position"),
    },
    together=(("odometer_1_gps", "odometer_2_gps", "radar_gps"), ("way_1", "way_2", "way_radar")),
)
"""What is measured of the motion: five kinds of sensors, and rails on which both wheels slip."""
MOVED_SOURCES = {"odometer_1": (0,), "odometer_2": (1,), "radar": (2,), "adhesion": (0, 1)}
"""Sources of speed (first odometer, second odometer, radar) that a fault moves. Residuals of satellites and balises are
what no source agrees with: a fault explains them where it moves all sources that were asked."""

BRAKE = IsolationTable(
    residuals=("pressure", "brake_measured", "brake_demanded"),
    must={
        "pressure_sensor": ("pressure", "brake_measured"),
        "cylinder": ("pressure", "brake_demanded"),
        "friction": ("brake_measured", "brake_demanded"),
    },
    may={},
)
"""The brake: its pressure sensor, the filling of its cylinders, and the friction of its shoes."""

TRACTION = IsolationTable(residuals=("traction",), must={"traction": ("traction",)}, may={})
"""The traction: less force at the rims than the effort that is asked for."""

RESIDUALS = (*MOTION.residuals, *BRAKE.residuals, *TRACTION.residuals)
FAULTS = (*MOTION.faults, *BRAKE.faults, *TRACTION.faults)

SENSORS = ("odometer_1", "odometer_2", "radar", "gps", "balise", "pressure_sensor")
_NEEDS = {
    "odometers": ("odometer_1", "odometer_2"),
    "odometer_1_radar": ("odometer_1", "radar"),
    "odometer_2_radar": ("odometer_2", "radar"),
    "odometer_1_gps": ("odometer_1", "gps"),
    "odometer_2_gps": ("odometer_2", "gps"),
    "radar_gps": ("radar", "gps"),
    "gps_position": ("gps", "odometer_1"),
    "way_1": ("balise", "odometer_1"),
    "way_2": ("balise", "odometer_2"),
    "way_radar": ("balise", "radar"),
    "balise": ("balise", "odometer_1"),
    "pressure": ("pressure_sensor",),
    "brake_measured": ("pressure_sensor", "odometer_1"),
    "brake_demanded": ("odometer_1",),
    "traction": ("odometer_1",),
}
"""Sensors that each residual needs; where several sources of speed would do, the first."""


def _available_residuals(fitted: tuple[str, ...]) -> tuple[str, ...]:
    """Residuals that can be computed.

    Args:
        fitted: names from `SENSORS`.

    Raises:
        ValueError: there is no such sensor, or the first odometer is missing.
    """
    unknown = [name for name in fitted if name not in SENSORS]
    if unknown or "odometer_1" not in fitted:
        said = f"unknown sensors {', '.join(unknown)}" if unknown else "odometer_1 is missing"
        raise ValueError(f"Sensors of a train: {said}; known are {', '.join(SENSORS)}, and odometer_1 is needed.")
    alone = not {"odometer_2", "radar"} & set(fitted)  # then a way that is off is as well a balise that is
    return tuple(
        name for name in RESIDUALS if set(_NEEDS[name]) <= set(fitted) and not (alone and name.startswith("way"))
    )


def isolability(fitted: tuple[str, ...]) -> dict[str, tuple[str, ...] | None]:
    """What can be isolated with these sensors, by fault: None where it is not detected, else the faults that it cannot
    be distinguished from; none is an isolated fault.

    Args:
        fitted: names from `SENSORS`; faults of sensors that are not there are left out.

    Raises:
        ValueError: see `_available_residuals`.
    """
    there = _available_residuals(fitted)
    found: dict[str, tuple[str, ...] | None] = {}
    for table in (MOTION, BRAKE, TRACTION):
        faults = [f for f in table.faults if f not in SENSORS or f in fitted]
        detected = table.detectable(there)
        for fault in faults:
            others = tuple(f for f in table.not_isolable(fault, there) if f in faults)
            found[fault] = others if fault in detected else None
    if found["odometer_1"] is None:  # its speed is believed, and the shares of force are found from it
        for fault in ("cylinder", "friction", "traction"):
            found[fault] = (*(found[fault] or ()), "odometer_1")
    if "balise" in fitted and "radar" not in fitted:  # both wheels off alike, from one balise to the next
        found["balise"] = tuple(dict.fromkeys((*(found["balise"] or ()), "adhesion")))
    return found
