"""Diagnosis of the wind-turbine benchmark: which of its ten faults acts. The residuals stand in the files beside this
one, their formulas in `fmu_observer.formulas.diagnosis`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from fmu_observer.formulas.diagnosis.redundancy import larger
from fmu_observer.formulas.diagnosis.window_inversion import Alarm, evaluate
from fmu_observer.observers.exhibits.drive_train_residuals import (
    DRIVE_MEMORY,
    DRIVE_PARAMETERS,
    GAINS,
    GAINS_PERIOD,
    WINDOW,
    end_shaft_block,
    sample_speeds,
    sample_torque,
)
from fmu_observer.observers.exhibits.efficiency_inversion import (
    EFFICIENCY_MEMORY,
    EFFICIENCY_PARAMETERS,
    sample_torques,
    update_efficiency,
)
from fmu_observer.observers.exhibits.pitch_residuals import (
    BLADES,
    PITCH_MEMORY,
    PITCH_PARAMETERS,
    SENSORS,
    end_block,
    sample_pitch,
    trusted,
    trusted_pitches,
)
from fmu_observer.observers.exhibits.wind_turbine_limits import WARNINGS, repeats, warned
from plant_models.exhibits.wind_turbine.rotor import Rotor
from plant_models.hybrid import Array, HybridSystem, PeriodicEvent, vector
from plant_models.hybrid.signal import discrete_output, input_signal, memory, parameter, warning_output


class _Group(NamedTuple):
    """Alarms of one kind: name of the output, how many, by whose persistence, and what the output says."""

    output: str
    size: int
    kind: str
    text: str


_GROUPS = (
    _Group("pitch_sensor_fault", SENSORS, "sensor", "sensors of the pitch of blades 1, 1, 2, 2, 3, 3"),
    _Group("rotor_sensor_fault", 2, "sensor", "sensors of the rotor speed"),
    _Group("generator_sensor_fault", 2, "sensor", "sensors of the generator speed"),
    _Group("torque_fault", 1, "torque", "converter of the generator"),
    _Group("pitch_actuator_fault", BLADES, "actuator", "pitch actuators of the blades"),
    _Group("efficiency_fault", 1, "efficiency", "drive train, by its efficiency"),
)
_ALARMS = sum(group.size for group in _GROUPS)
ALARM_NAMES = tuple(f"{g.output}[{i + 1}]" if g.size > 1 else g.output for g in _GROUPS for i in range(g.size))
"""The alarms by name, in the order of the outputs."""

_LIMITS = (
    ("pitch_difference_limit", "deg", 1.9, "Difference of two pitch sensors"),
    ("rotor_difference_limit", "rad/s", 0.21, "Difference of the sensors of the rotor speed"),
    ("generator_difference_limit", "rad/s", 0.42, "Difference of the sensors of the generator speed"),
    ("pitch_single_limit", "deg2/s4", 1.3e5, "Residual of a pitch sensor, one sample"),
    ("pitch_triple_limit", "deg2/s4", 1.4e5, "Residual of a pitch sensor, three samples"),
    ("pitch_brief_limit", "deg2/s4", 45.0, "Residual of a pitch actuator, one sample"),
    ("pitch_long_limit", "deg2/s4", 4.5e3, "Residual of a pitch actuator, long window"),
    ("speed_limit", "rad2/s2", 8.5e-3, "Residual of a sensor of rotor or generator speed"),
    ("shaft_angle_limit", "rad", 0.02, "Angle between rotor and generator by their speeds, long window"),
    ("torque_limit", "N2.m2", 1.2e5, "Residual of the generator torque"),
    ("efficiency_limit", "1", 0.1, "Deviation of the efficiency from the nominal one"),
)
_RATIOS = (
    ("ratio_pitch_sensors", BLADES, "Difference of the two pitch sensors of each blade over its limit"),
    ("ratio_rotor_sensors", None, "Difference of the sensors of the rotor speed over its limit"),
    ("ratio_generator_sensors", None, "Difference of the sensors of the generator speed over its limit"),
    ("ratio_shaft_angle", None, "Angle between rotor and generator by their speeds over its limit"),
    ("ratio_torque", None, "Residual of the generator torque over its limit"),
    ("ratio_pitch_actuators", BLADES, "Larger residual of each pitch actuator over its limit"),
    ("ratio_efficiency", None, "Deviation of the efficiency over its limit"),
)
_PERSISTENCE = (("sensor", 1.0, 5.0), ("torque", 1.0, 1.0), ("actuator", 1.0, 1.0), ("efficiency", 1.0, 1.0))

_RESIDUALS = (
    ("pitch_difference", "deg", BLADES, "Difference of the two pitch sensors of each blade"),
    ("speed_difference", "rad/s", 2, "Difference of the sensors of rotor and of generator speed"),
    ("pitch_single", "deg2/s4", SENSORS, "Residual of each pitch sensor, one sample"),
    ("pitch_triple", "deg2/s4", SENSORS, "Residual of each pitch sensor, three samples"),
    ("pitch_brief", "deg2/s4", BLADES, "Residual of each pitch actuator, one sample"),
    ("pitch_long", "deg2/s4", BLADES, "Residual of each pitch actuator, long window"),
    ("speed_residual", "rad2/s2", 4, "Residual of rotor sensors 1, 2, generator sensors 1, 2"),
    ("torque_residual", "N2.m2", None, "Residual of the generator torque"),
    ("estimated_torsion", "rad", None, "Torsion of the shaft from the last five samples"),
    ("efficiency_estimate", "1", None, "Efficiency of the drive train from the last minutes"),
    ("efficiency_crossings", "1", None, "Intervals of the grid that bracket the efficiency; 0: it lies outside"),
)


class WindTurbineDiagnosis(HybridSystem):
    """Faults of a wind turbine from its readings and references: Omar 2012, chapter 7.

    Sensors of the pitch, of the rotor and of the generator speed come in pairs. Where a pair disagrees one of it is at
    fault, and the model shows which: the pitch actuator for the pitch (7.6.2), the torsion of the shaft for the speeds
    (7.7.5). Where a pair agrees and both contradict the model, the actuator is at fault (7.6.14). The torque of the
    generator is compared with its reference (7.8.1). The efficiency of the drive train comes from a window of 30
    updates, 300 s (7.7.7): before it is full the efficiency is nominal. At most one fault at a time is assumed.
    `fault` is 1 while any is detected: also where a pair disagrees and the model does not show which sensor it is, and
    where the sensors of each speed agree, but their speeds turn rotor and generator against each other by more than the
    shaft can twist (the angle of five seconds): one speed or the gear's ratio is off. `undecided` counts these. Speeds
    that are all off by one share contradict nothing, and are not detected.

    The torque of the wind is estimated from measured wind, rotor speed and pitch with the rotor's formula. Wind that is
    measured with a bias ruins the efficiency: `wind_bias` is subtracted.

    Residuals are sums of squares over windows: one and three samples for pitch sensors, one sample and five seconds for
    pitch actuators, two for speeds, three for the torque. The thesis prints no threshold; these come from runs without
    a fault [ours].

    Presets: `repaired` (default) compares actuators with references half a sample late; `as_published` does not
    (`centring` 0), so that each step of a reference shows as if there were a fault. Limits are the same: none is
    printed.

    Source: Omar 2012, (7.6.1)-(7.8.1), Table 7.1; thresholds, persistence and the filters' Tustin rule are ours.
    """

    name = "wind_turbine_diagnosis"
    description = "Faults of a wind turbine: sensors, converter, pitch actuators, efficiency of the drive train"
    source = "Omar 2012, sections 7.5-7.8; thresholds ours"
    internal_step = 1e-2  # nothing flows
    bounded_parameters = "all"
    states = (
        memory("samples", "1", 0.0, "Samples since the start"),
        memory("repeated", "1", 0.0, "Samples at which no reading of speeds and torque was a new one"),
        *PITCH_MEMORY,
        *DRIVE_MEMORY,
        *EFFICIENCY_MEMORY,
        memory("undecided_pairs", "1", 0.0, "Pairs of sensors that disagree while no model tells which one is it"),
        memory("undecided_alarm", "1", (0.0, 0.0, 0.0), "Alarm of such pairs: raised, contrary, since", size=3),
        memory("raised", "1", 0.0, "1 for each alarm that is raised", size=_ALARMS),
        memory("contrary", "1", 0.0, "Samples in a row that spoke against each alarm's state", size=_ALARMS),
        memory("since", "s", 0.0, "Last change of each alarm", size=_ALARMS),
    )
    inputs = (
        input_signal("wind_speed", "m/s", 9.0, "Measured wind speed", display_unit="km/h"),
        input_signal("rotor_speed", "rad/s", 0.0, "Rotor speed, by two sensors", size=2),
        input_signal("generator_speed", "rad/s", 0.0, "Generator speed, by two sensors", size=2),
        input_signal("torque", "N.m", 0.0, "Measured torque of the generator"),
        input_signal("pitch", "deg", 0.0, "Pitch of blades 1, 1, 2, 2, 3, 3, by two sensors each", size=SENSORS),
        input_signal("torque_reference", "N.m", 0.0, "Torque asked of the converter"),
        input_signal("pitch_reference", "deg", 0.0, "Pitch asked of the blades"),
    )
    outputs = (
        *(
            discrete_output(g.output, "1", f"1 for a fault of {g.text}", size=g.size if g.size > 1 else None)
            for g in _GROUPS
        ),
        discrete_output("fault", "1", "1 while a fault is detected, whether it is isolated or not"),
        warning_output(
            "undecided",
            "Pairs of sensors of which one is at fault, not known which, or speeds of rotor and generator apart",
            "detected a fault that it could not isolate: two sensors of one quantity disagree by more than their "
            "limit, and neither contradicts the model by more than its own, compare both with a third; or the two "
            "of each speed agree, but turn the shaft by more than it can twist (ratio_shaft_angle), check the "
            "scales of both pairs and gear_ratio",
            ("fault", "ratio_rotor_sensors", "ratio_generator_sensors", "ratio_shaft_angle"),
        ),
        *(
            discrete_output(
                f"{g.output}_time", "s", f"Last change of the alarm of {g.text}", size=g.size if g.size > 1 else None
            )
            for g in _GROUPS
        ),
        *(discrete_output(name, "1", text, size=n) for name, n, text in _RATIOS),
        *WARNINGS,
        *(discrete_output(name, unit, text, size=n) for name, unit, n, text in _RESIDUALS),
    )
    parameters = (
        parameter("sample_period", "s", 0.01, "Time between two samples", min=1e-6),
        parameter("block_period", "s", 0.5, "Blocks of the long window, of which it has ten", min=1e-6),
        parameter("settling_time", "s", 10.0, "Time from the start on in which nothing is judged", min=0.0),
        parameter("sensor_hold", "s", 5.0, "After an alarm of a pitch sensor, its blade's actuator waits", min=0.0),
        *PITCH_PARAMETERS,
        *DRIVE_PARAMETERS,
        *EFFICIENCY_PARAMETERS,
        parameter("wind_bias", "m/s", 1.5, "Known mean error of the measured wind", display_unit="km/h"),
        parameter("rotor_radius", "m", Rotor().radius, "Radius of the rotor R", min=1e-3),
        parameter("air_density", "kg/m3", Rotor().air_density, "Density of the air", min=0.0),
        parameter("largest_coefficient", "1", Rotor().largest_coefficient, "Largest power coefficient", min=0.0),
        *(parameter(name, unit, start, f"{text} from which it counts", min=0.0) for name, unit, start, text in _LIMITS),
        *(
            parameter(f"{kind}_{way}_after", "1", start, f"Samples in a row that {way} an alarm: {kind}", min=1.0)
            for kind, *starts in _PERSISTENCE
            for way, start in zip(("raise", "clear"), starts, strict=True)
        ),
    )
    presets = {"repaired": {}, "as_published": {"centring": 0.0}}
    default_preset = "repaired"
    events = (
        PeriodicEvent("sampling", "sample_period", description="Readings are taken, residuals and alarms follow"),
        PeriodicEvent("block_end", "block_period", description="The long window moves on"),
        PeriodicEvent("efficiency_update", "update_period", description="The efficiency is estimated anew"),
    )

    def requirements(self, p: Any) -> dict[str, Array]:
        """Parameters keep their bounds; limits of zero, grids that do not rise, and gains of the torsion that belong to
        another sample period are refused.
        """
        limits: Mapping[str, Array] = {
            f"{name} must be above zero: any reading would be a fault": np.where(getattr(p, name) > 0.0, 1.0, 0.0)
            for name, *_ in _LIMITS
        }
        return super().requirements(p) | dict(limits) | _grid_requirements(p) | _period_requirements(p)

    def jump(self, event: str, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        """New residuals and alarms; or the long window, or the window of the efficiency moves on."""
        if event == "block_end":
            return end_block(x) | end_shaft_block(x)
        if event == "efficiency_update":
            return update_efficiency(x, p)
        starts = np.where(x.samples > 0.0, 0.0, 1.0)
        new: dict[str, Array] = {"samples": x.samples + 1.0, "repeated": x.repeated + repeats(x, u, starts)}
        new |= sample_pitch(x, u.pitch, u.pitch_reference, p, starts)
        m = x._replace(**new)
        pitches = trusted_pitches(u.pitch, p.pitch_difference_limit, m.held_pitch_triple)
        rotor = trusted(u.rotor_speed, p.rotor_difference_limit, m.held_speed_residual[:2])
        aerodynamics = Rotor(p.rotor_radius, p.air_density, p.largest_coefficient)
        driving = aerodynamics.torque(u.wind_speed - p.wind_bias, rotor, [pitches[i] for i in range(BLADES)])
        new |= sample_torque(m, u.torque, u.torque_reference, p, starts)
        new |= sample_speeds(m, u.rotor_speed, u.generator_speed, driving, u.torque, p, starts)
        m = m._replace(**new)
        generator = trusted(u.generator_speed, p.generator_difference_limit, m.held_speed_residual[2:])
        new |= sample_torques(m, generator, driving, u.torque)
        new |= {"shaft_partial": m.shaft_partial + p.sample_period * (rotor - generator / p.gear_ratio)}
        settled = _settled(m, p)
        exceeds, undecided = _evaluated(m, t, p)
        alarms = _alarms(m, [settled * value for value in exceeds], t, p)
        new |= {name: vector(*values) for name, values in zip(Alarm._fields, zip(*alarms, strict=True), strict=True)}
        pairs = settled * undecided
        found = evaluate(Alarm(*m.undecided_alarm), t, pairs, p.sensor_raise_after, p.sensor_clear_after)
        return new | {"undecided_pairs": pairs, "undecided_alarm": vector(*found)}

    def output(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        found: dict[str, Array] = {}
        at = 0
        for group in _GROUPS:
            place = at if group.size == 1 else slice(at, at + group.size)
            found |= {group.output: x.raised[place], f"{group.output}_time": x.since[place]}
            at += group.size
        any_raised = x.undecided_alarm[0]  # detected is reported although it is not isolated
        for i in range(_ALARMS):
            any_raised = np.maximum(any_raised, x.raised[i])
        residuals = {name: getattr(x, f"held_{name}") for name, *_ in _RESIDUALS}
        whole = {"fault": any_raised, "undecided": x.undecided_pairs}
        return found | residuals | whole | _ratios(x, p) | warned(x, p)


def _evaluated(m: Any, t: Array, p: Any) -> tuple[list[Array], Array]:
    """Which residuals speak for each alarm, in the order of `_GROUPS`, and how many pairs stay undecided."""
    sizes = [
        np.maximum(m.held_pitch_single[i] / p.pitch_single_limit, m.held_pitch_triple[i] / p.pitch_triple_limit)
        for i in range(SENSORS)
    ]
    sizes += [m.held_speed_residual[i] / p.speed_limit for i in range(4)]
    differences = [m.held_pitch_difference[i] / p.pitch_difference_limit for i in range(BLADES)]
    differences += [m.held_speed_difference[0] / p.rotor_difference_limit]
    differences += [m.held_speed_difference[1] / p.generator_difference_limit]
    disagree = [np.where(value > 1.0, 1.0, 0.0) for value in differences]
    sensors: list[Array] = []
    undecided: Array = 0.0
    for i, whole in enumerate(disagree):
        found = larger(whole, sizes[2 * i], sizes[2 * i + 1])
        sensors += [found.first, found.second]
        undecided = undecided + found.undecided
    turned = np.where(np.abs(m.held_shaft_angle) > p.shaft_angle_limit, 1.0, 0.0)
    undecided = undecided + turned * (1.0 - disagree[BLADES]) * (1.0 - disagree[BLADES + 1])
    torque = np.where(m.held_torque_residual > p.torque_limit, 1.0, 0.0)
    actuators = [
        np.where(
            np.maximum(m.held_pitch_brief[i] / p.pitch_brief_limit, m.held_pitch_long[i] / p.pitch_long_limit) > 1.0,
            (1.0 - disagree[i]) * _believed(m, 2 * i, t, p) * _believed(m, 2 * i + 1, t, p),
            0.0,
        )
        for i in range(BLADES)
    ]
    deviation = np.abs(m.held_efficiency_estimate - p.nominal_efficiency)
    return [*sensors, torque, *actuators, np.where(deviation > p.efficiency_limit, 1.0, 0.0)], undecided


def _ratios(m: Any, p: Any) -> dict[str, Array]:
    """Residuals over their limits, by name of the output; zero while nothing is judged yet."""
    actuators = [
        np.maximum(m.held_pitch_brief[i] / p.pitch_brief_limit, m.held_pitch_long[i] / p.pitch_long_limit)
        for i in range(BLADES)
    ]
    values = (
        m.held_pitch_difference / p.pitch_difference_limit,
        m.held_speed_difference[0] / p.rotor_difference_limit,
        m.held_speed_difference[1] / p.generator_difference_limit,
        np.abs(m.held_shaft_angle) / p.shaft_angle_limit,
        m.held_torque_residual / p.torque_limit,
        vector(*actuators),
        np.abs(m.held_efficiency_estimate - p.nominal_efficiency) / p.efficiency_limit,
    )
    settled = _settled(m, p)
    return {name: settled * value for (name, *_), value in zip(_RATIOS, values, strict=True)}


def _settled(m: Any, p: Any) -> Array:
    return np.where(m.samples * p.sample_period > p.settling_time, 1.0, 0.0)


def _believed(m: Any, sensor: int, t: Array, p: Any) -> Array:
    """1 where no alarm of a pitch sensor is raised or was a short while ago: a fault that comes and goes in noise."""
    calm = np.where(t - m.since[sensor] > p.sensor_hold, 1.0, np.where(m.since[sensor] > 0.0, 0.0, 1.0))
    return calm * (1.0 - m.raised[sensor])


def _alarms(m: Any, exceeds: Sequence[Array], t: Array, p: Any) -> list[Alarm]:
    kinds = [group.kind for group in _GROUPS for _ in range(group.size)]
    return [
        evaluate(
            Alarm(m.raised[i], m.contrary[i], m.since[i]),
            t,
            exceeds[i],
            getattr(p, f"{kind}_raise_after"),
            getattr(p, f"{kind}_clear_after"),
        )
        for i, kind in enumerate(kinds)
    ]


def _grid_requirements(p: Any) -> dict[str, Array]:
    """Grids of the efficiency that rise."""
    return {
        "grid_highest must be above grid_lowest: the grid of the efficiency rises": np.where(
            p.grid_highest > p.grid_lowest, 1.0, 0.0
        ),
        "most_efficiency must be above least_efficiency: the grid lies between them": np.where(
            p.most_efficiency > p.least_efficiency, 1.0, 0.0
        ),
    }


def _period_requirements(p: Any) -> dict[str, Array]:
    """Gains of the torsion that belong to the sample period."""
    own: Array = 0.0  # 1 where gains other than the default ones were given
    for i in range(WINDOW):
        own = np.maximum(own, np.where(np.abs(p.rotor_speed_gain[i] - GAINS[0, i]) > 1e-9 * abs(GAINS[0, i]), 1.0, 0.0))
    fits = np.where(np.abs(p.sample_period - GAINS_PERIOD) <= 1e-9, 1.0, 0.0)
    text = (
        f"sample_period must be {GAINS_PERIOD:g} s, for which the default gains of the torsion are made; for another "
        "one give rotor_speed_gain, generator_speed_gain, rotor_torque_gain, generator_torque_gain of torsion_gains()"
    )
    return {text: np.maximum(own, fits)}
