"""Inputs, outputs, parameters and events of the diagnosis of a train. Data only."""

from __future__ import annotations

from fmu_observer.detection.train_isolation import FAULTS, RESIDUALS
from fmu_observer.detection.train_residuals import ABSENT
from plant_models.hybrid import PeriodicEvent, TriggeredEvent
from plant_models.hybrid.signal import Signal, discrete_output, input_signal, output_signal, parameter, warning_output
from plant_models.railway.vehicle.pneumatic_brake import BRAKE_PARAMETERS

_FIT = "-1e9: not fitted"
SHARES = ("traction_efficiency", "brake_performance", "brake_by_demand")

INPUTS = (
    input_signal("odometer_1", "m/s", 0.0, "First odometer"),
    input_signal("odometer_2", "m/s", ABSENT, f"Second odometer, on another axle; {_FIT}", optional=True),
    input_signal("radar", "m/s", ABSENT, f"Doppler radar; {_FIT}", optional=True),
    input_signal(
        "gps_position", "m", ABSENT, f"Satellite position along the track, new at each sample; {_FIT}", optional=True
    ),
    input_signal("cylinder_pressure", "Pa", ABSENT, f"Measured pressure in a brake cylinder; {_FIT}", optional=True),
    input_signal("effort", "N", 0.0, "Effort asked for: traction > 0, electric brake < 0"),
    input_signal("brake_demand", "1", 0.0, "Demand to the air brake, 0..1"),
    input_signal("gradient_force", "N", 0.0, "Downhill pull as a resistance by the map, uphill > 0", optional=True),
)

_TITLES = {
    "odometer_1": "First odometer",
    "odometer_2": "Second odometer",
    "radar": "Radar",
    "gps": "Satellite positions",
    "balise": "Last balise",
    "adhesion": "Rail: both wheels",
    "pressure_sensor": "Pressure sensor",
    "cylinder": "Filling of the brake cylinders",
    "friction": "Friction of the brake",
    "traction": "Traction",
}
_CODES = "0 none, 1 suspected, 2 wheel, 3 wrong, 4 stuck, 5 loss"

OUTPUTS = (
    *(discrete_output(f"{fault}_fault", "1", f"{_TITLES[fault]}: {_CODES}") for fault in FAULTS),
    discrete_output("fault", "1", "1 while a fault is detected, whether it is isolated or not"),
    discrete_output("odometer_fault", "1", "1 while the first odometer is suspected or at fault"),
    discrete_output("fault_count", "1", "How many faults are suspected or isolated"),
    warning_output(
        "several_faults",
        "1 while no single fault explains the alarms, or not that which is isolated; two odometers that are off alike "
        "under an effort that may slip both are told as the rail",
        "detected faults that it could not isolate: no single fault of its table moves all the residuals that are "
        "above their thresholds. Look at the ratios: several sensors are at fault, or one in a way that the table "
        "does not have",
        ("fault", "fault_count"),
    ),
    discrete_output("detection_time", "s", "Instant of the last detection; -1 none"),
    discrete_output("confidence", "1", "1 less threshold over the weakest alarm of the verdict, 0..1"),
    discrete_output("speed", "m/s", "Speed that is believed", display_unit="km/h"),
    output_signal("position", "m", "Position by dead reckoning from the last balise used"),
    discrete_output("traction_efficiency", "1", "Share of traction that reaches the train"),
    discrete_output("brake_performance", "1", "Share of brake force, by the measured pressure"),
    discrete_output("brake_by_demand", "1", "Share of brake force, by the demand"),
    warning_output(
        "isolation_limited",
        "1 where a sensor is missing that isolation needs",
        "a sensor was not connected that isolation needs: without the second odometer a fault of the first is not "
        "told from slip of all wheels, without the radar a false balise is not told from that slip, without the "
        "brake pressure cylinders are not told from friction; TrainDiagnosis.isolability(sensors) says more",
        ("isolation_limited",),
    ),
    *(
        discrete_output(
            f"{share}_unknown", "1", f"1 until {share} was found, and while it lies outside of what is looked through"
        )
        for share in SHARES
    ),
    warning_output(
        "shares_unknown",
        "How many of the three shares of traction and brake are unknown",
        "not every share of traction and brake is known: the run is shorter than the window of force_window coarse "
        "steps, no such effort changed the speed by least_excitation within one while the speeds agreed, or the "
        "share lies outside of least_share to most_share, and what is told is the end",
        ("shares_unknown", *(f"{share}_unknown" for share in SHARES)),
        at_end=True,
    ),
    *(discrete_output(f"ratio_{name}", "1", f"Residual {name} over its threshold") for name in RESIDUALS),
)

_BRAKES = {
    "pipe_pressure_released",
    "pipe_depression_full",
    "cylinder_pressure_full",
    "cylinder_pressure_idle",
    "filling_time",
    "venting_time",
}

PARAMETERS: tuple[Signal, ...] = (
    parameter("sample_period", "s", 0.1, "Time between two samples", min=1e-3),
    parameter("mass", "kg", 166e3, "Mass of the train", min=1.0),
    parameter("rotating_mass", "kg", 2.7e3, "Inertia of the wheels as a mass", min=0.0),
    parameter("davis_a", "N", 1660.0, "Running resistance, constant part", min=0.0),
    parameter("davis_b", "N.s/m", 59.6, "Running resistance, viscous part"),
    parameter("davis_c", "N.s2/m2", 10.85, "Running resistance, aerodynamic part"),
    parameter("full_brake_force", "N", 164e3, "Air brake force of the whole train at full pressure", min=1.0),
    *(s for s in BRAKE_PARAMETERS if s.name in _BRAKES),
    parameter("speed_floor", "m/s", 0.2, "Difference of two speeds that counts as one, at standstill", min=1e-3),
    parameter("speed_share", "1", 0.02, "The same as a share of the speed", min=0.0),
    parameter("threshold_wheels", "1", 0.5, "Of the two odometers, in such differences", min=1e-6),
    parameter("threshold_radar", "1", 0.8, "Of odometer and radar, in such differences", min=1e-6),
    parameter("threshold_gps", "1", 1.43, "Of satellites and any other speed, in such differences", min=1e-6),
    parameter("threshold_position", "m", 5.0, "Of satellite position and dead reckoning, at a balise", min=1e-6),
    parameter("balise_floor", "m", 1.5, "Of the distance of two balises and a way, constant part", min=1e-6),
    parameter("balise_share", "1", 0.01, "The same as a share of the distance", min=0.0),
    parameter("threshold_pressure", "Pa", 2e4, "Of measured and modelled pressure", min=1e-3, display_unit="bar"),
    parameter("threshold_traction", "1", 0.142, "Of the share of traction, from 1", min=1e-6),
    parameter("threshold_brake", "1", 0.17, "Of the share of brake force, from 1", min=1e-6),
    parameter("raise_samples", "1", 3.0, "Samples in a row above the threshold that raise an alarm", min=1.0),
    parameter("clear_samples", "1", 20.0, "Samples in a row below it that clear it", min=1.0),
    parameter("isolation_delay", "s", 2.5, "From an alarm until a fault is isolated; before it is suspected", min=0.0),
    parameter("slip_effort", "N", 20e3, "Effort of the train below which no wheel slips or jams", min=0.0),
    parameter("release_time", "s", 1.0, "How long a wheel may slip after its effort is gone", min=0.0),
    parameter("contrary_time", "s", 1.0, "Time that no wheel explains, until the sensor is at fault", min=0.0),
    parameter("stuck_speed", "m/s", 0.7, "Change of speed that a sensor must show", min=1e-3, display_unit="km/h"),
    parameter("stuck_way", "m", 5.0, "Way that the satellites must show", min=1e-3),
    parameter("stuck_pressure", "Pa", 3e4, "Change of pressure that its sensor must show", min=1e-3),
    parameter("coarse_step", "s", 1.0, "Length of the steps of the window of forces", min=1e-3),
    parameter("least_excitation", "m/s", 1.0, "Change of speed by a force within the window that tells it", min=1e-6),
    parameter("least_speed", "m/s", 1.0, "Speed below which no share is found", min=0.0, display_unit="km/h"),
    parameter("least_share", "1", 0.05, "Smallest share of a force that is looked for", min=1e-3, max=0.999),
    parameter("most_share", "1", 1.5, "Largest share of a force that is looked for", min=1.001),
    parameter("smoothing", "1", 0.2, "Weight of the last share", min=0.0, max=0.999),
)

EVENTS = (
    TriggeredEvent(
        "balise",
        (input_signal("balise_position", "m", 0.0, "Position of the balise just passed", variability="discrete"),),
        "A balise is passed, at its own time stamp",
        verdict="telegram_verdict",
    ),
    PeriodicEvent("sampling", "sample_period", description="The sensors are compared"),
)
