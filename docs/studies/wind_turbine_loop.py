"""Wind, turbine, controller, one of its ten faults and the diagnosis as one system, of which many members run at once.

The parts are those that ship. At a sampling instant their order is that of a co-simulation: sensors, fault, diagnosis,
controller. Of the 440 000 samples of a run are kept when the alarm of the fault came and went, how often others came,
and the largest residuals.
"""

from __future__ import annotations

from collections import namedtuple
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

import fmus
from fmu_observer.observers.exhibits.wind_turbine_diagnosis import ALARM_NAMES, WindTurbineDiagnosis
from plant_models.exhibits.wind_turbine import Wind, WindTurbine, WindTurbineController
from plant_models.hybrid import Array, HybridSystem, PeriodicEvent, Signal, memory, output_signal, parameter, vector

PARTS = {"wind": Wind(), "turbine": WindTurbine(), "controller": WindTurbineController()}
DIAGNOSIS = WindTurbineDiagnosis()
SYSTEMS = {**PARTS, "diagnosis": DIAGNOSIS}
SETTLED = 20.0  # [s]: residuals count from here on
PEAKS = (
    ("pitch_difference", 3),
    ("rotor_difference", 1),
    ("generator_difference", 1),
    ("pitch_single", 6),
    ("pitch_triple", 6),
    ("pitch_brief", 3),
    ("pitch_long", 3),
    ("speed", 4),
    ("shaft_angle", 1),
    ("torque", 1),
    ("efficiency", 1),
)
"""Residuals whose limits are parameters of the diagnosis, ``NAME_limit``, and over how many sensors."""

NOT_ISOLATED = len(ALARM_NAMES)
"""Place behind `ALARM_NAMES` of a fault that is detected and not isolated; as own alarm: that any is detected."""
SPEED_SENSORS = 11
"""Number of the fault of the four sensors of rotor and generator speed, each off by its own share `off`."""
OWN_ALARM = {1: 4, 2: 3, 3: 6, 4: 7, 5: 8, 6: 9, 7: 10, 8: 12, 9: 13, 10: 14, SPEED_SENSORS: NOT_ISOLATED}
"""Place of the alarm of each fault in `ALARM_NAMES`."""

_ALARMS = NOT_ISOLATED + 1
_LOG = (
    memory("first_raised", "s", -1.0, "Own alarm first raised during the fault"),
    memory("first_clear", "s", -1.0, "Own alarm first clear after the fault"),
    memory("last_raised", "s", -1.0, "Own alarm last raised"),
    memory("covered", "1", 0.0, "Samples of the fault with the own alarm"),
    memory("false_begun", "1", 0.0, "Alarms that began and are not the fault's own in its time", size=_ALARMS),
    memory("peak", "1", 0.0, "Largest residuals", size=len(PEAKS)),
)


def _renamed(part: str, system: HybridSystem, variability: str) -> list[Signal]:
    return [replace(s, name=f"{part}_{s.name}") for s in system.states if s.variability == variability]


_STATES = (
    *(s for part, system in SYSTEMS.items() for s in _renamed(part, system, "continuous")),
    *(s for part, system in SYSTEMS.items() for s in _renamed(part, system, "discrete")),
    *_LOG,
)
FIXED: dict[str, Any] = {part: system.unpack_parameters(system.start_parameters()) for part, system in PARTS.items()}
"""Parameters of the parts."""
_OWN: dict[str, Any] = {part: namedtuple(part, [s.name for s in system.states]) for part, system in SYSTEMS.items()}


def _part(part: str, x: Any) -> Any:
    """States of the loop that are a part's, by the part's own names."""
    return _OWN[part]._make(getattr(x, f"{part}_{name}") for name in _OWN[part]._fields)


def _whole(part: str, changed: dict[str, Array]) -> dict[str, Array]:
    """States of a part by their names in the loop."""
    return {f"{part}_{name}": value for name, value in changed.items()}


def _inputs(system: HybridSystem, **values: Array) -> Any:
    return system.unpack_inputs(system.start_inputs())._replace(**values)


class WindTurbineLoop(HybridSystem):
    """The closed loop with one fault at a time, and what came of it."""

    name = "wind_turbine_loop"
    description = "Wind turbine, controller, fault and diagnosis"
    source = "Omar 2012, chapter 7"
    internal_step = 5e-3
    states = _STATES
    outputs = (output_signal("efficiency", "1", "Estimated efficiency"),)
    events = (
        PeriodicEvent(
            "sampling",
            "sample_period",
            noises=(*PARTS["wind"].noises, *PARTS["turbine"].noises),
            description="Everything is sampled",
        ),
        PeriodicEvent("block_end", "block_period", description="The long window moves on"),
        PeriodicEvent("efficiency_update", "update_period", description="The efficiency is estimated anew"),
    )
    parameters = (
        parameter("fault", "1", 0.0, "Number of the fault, 0 for none"),
        parameter("onset", "s", 0.0, "Begin of the fault"),
        parameter("end", "s", 0.0, "End of the fault"),
        parameter("size", "1", 1.0, "Its size, in that of the benchmark"),
        parameter(
            "off", "1", 0.0, "Shares by which fault 11 makes rotor sensors 1, 2, generator sensors 1, 2 read", size=4
        ),
        parameter("own", "1", 0.0, "Place of its alarm"),
        parameter("mean_from", "m/s", 9.0, "Mean wind at the start"),
        parameter("mean_to", "m/s", 14.0, "Mean wind at the end"),
        parameter("sine_amplitude", "m/s", 3.0, "Amplitude of the sine of the wind"),
        parameter("turbulence_std", "m/s", 1.2, "Standard deviation of the turbulence"),
        parameter("sample_period", "s", 0.01, "Time between two samples"),
        *(s for s in DIAGNOSIS.parameters if s.name != "sample_period"),
    )

    def flow(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        """The turbine turns."""
        inputs = self._turbine_inputs(t, x, p)
        return _whole("turbine", PARTS["turbine"].flow(t, _part("turbine", x), inputs, FIXED["turbine"]))

    def output(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        """Estimated efficiency."""
        return {"efficiency": x.diagnosis_held_efficiency_estimate}

    def jump(self, event: str, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        """A sampling instant, or one of the diagnosis alone."""
        if event != "sampling":
            return _whole("diagnosis", DIAGNOSIS.jump(event, t, _part("diagnosis", x), None, p))
        gust = _inputs(PARTS["wind"], gust_noise=u.gust_noise)
        new = _whole("wind", PARTS["wind"].jump("gust", t, _part("wind", x), gust, self._wind(p)))
        x = x._replace(**new)
        noises = {s.name: getattr(u, s.name) for s in PARTS["turbine"].noises}
        inputs, turbine = self._turbine_inputs(t, x, p)._replace(**noises), _part("turbine", x)
        new |= _whole("turbine", PARTS["turbine"].jump("sampling", t, turbine, inputs, FIXED["turbine"]))
        readings = self._readings(t, x._replace(**new), p)
        before, controller = _part("diagnosis", x), _part("controller", x)
        stated = _inputs(
            DIAGNOSIS,
            wind_speed=readings["wind"],
            rotor_speed=vector(*readings["rotor"]),
            generator_speed=vector(*readings["generator"]),
            torque=readings["torque"],
            pitch=vector(*readings["pitch"]),
            torque_reference=controller.held_torque,
            pitch_reference=controller.held_pitch,
        )
        diagnosed = DIAGNOSIS.jump("sampling", t, before, stated, p)
        asked = _inputs(
            PARTS["controller"], generator_speed=readings["generator"][0], generator_power=readings["power"]
        )
        moved = PARTS["controller"].jump("sampling", t, controller, asked, FIXED["controller"])
        log = self._logged(t, x, before, before._replace(**diagnosed), p)
        return new | _whole("diagnosis", diagnosed) | _whole("controller", moved) | log

    # -- parts ------------------------------------------------------------------------------------------------------

    def _wind(self, p: Any) -> Any:
        names = ("mean_from", "mean_to", "sine_amplitude", "turbulence_std", "sample_period")
        return FIXED["wind"]._replace(**{name: getattr(p, name) for name in names})

    def _turbine_inputs(self, t: Array, x: Any, p: Any) -> Any:
        """Of the turbine, without noise."""
        blown = PARTS["wind"].output(t, _part("wind", x), None, self._wind(p))["wind_speed"]
        acts = self._acts(t, p)
        # Fault 9 comes in 30 s and goes in 30 s; its onset and end are those of the whole.
        ramp = np.clip(np.minimum((t - p.onset) / 30.0, (p.end - t) / 30.0), 0.0, 1.0)
        abrupt, slow = self._is(p, 8) * acts * p.size, self._is(p, 9) * ramp * p.size
        return _inputs(
            PARTS["turbine"],
            wind_speed=blown,
            torque_reference=x.controller_held_torque,
            pitch_reference=x.controller_held_pitch,
            torque_offset=self._is(p, 7) * acts * 1000.0 * p.size,
            efficiency=0.97 + self._is(p, 10) * acts * p.size * (0.25 - 0.97),
            pitch_frequency=vector(11.11, 11.11 + abrupt * (5.73 - 11.11), 11.11 + slow * (3.42 - 11.11)),
            pitch_damping=vector(0.6, 0.6 + abrupt * (0.45 - 0.6), 0.6 + slow * (0.9 - 0.6)),
        )

    def _readings(self, t: Array, x: Any, p: Any) -> dict[str, Any]:
        acts = self._acts(t, p)
        pitch, rotor, generator = (
            list(held) for held in (x.turbine_held_pitch, x.turbine_held_rotor_speed, x.turbine_held_generator_speed)
        )
        pitch[4] = self._stuck(pitch[4], 10.0, self._is(p, 1) * acts)
        pitch[3] = pitch[3] * (1.0 + 4.0 * p.size * self._is(p, 2) * acts)
        rotor[0] = self._stuck(rotor[0], 3.5, self._is(p, 3) * acts)
        rotor[1] = rotor[1] * (1.0 + 4.0 * p.size * self._is(p, 4) * acts)
        generator[0] = self._stuck(generator[0], 50.0, self._is(p, 5) * acts)
        generator[1] = generator[1] * (1.0 + 4.0 * p.size * self._is(p, 6) * acts)
        shares = [1.0 + p.off[i] * self._is(p, SPEED_SENSORS) * acts for i in range(4)]
        rotor, generator = (
            [value * shares[first + i] for i, value in enumerate(pair)] for first, pair in ((0, rotor), (2, generator))
        )
        single = {"wind": x.turbine_held_wind, "torque": x.turbine_held_torque, "power": x.turbine_held_power}
        return {"pitch": pitch, "rotor": rotor, "generator": generator, **single}

    @staticmethod
    def _stuck(value: Array, at: float, acts: Array) -> Array:
        return np.where(acts > 0.0, at, value)

    @staticmethod
    def _is(p: Any, number: int) -> Array:
        return np.where(np.abs(p.fault - number) < 0.5, 1.0, 0.0)

    @staticmethod
    def _acts(t: Array, p: Any) -> Array:
        return np.where(t >= p.onset - 1e-6, np.where(t < p.end - 1e-6, 1.0, 0.0), 0.0)

    def _logged(self, t: Array, x: Any, was: Any, now: Any, p: Any) -> dict[str, Array]:
        """The log behind a sampling instant.

        Args:
            x: states of the loop. was, now: states of the diagnosis before and after the instant.
        """
        acts = self._acts(t, p)
        own = 0.0 * t
        raised_before, raised = _reported(was), _reported(now)
        mine = [np.where(np.abs(p.own - i) < 0.5, np.where(p.fault > 0.0, 1.0, 0.0), 0.0) for i in range(_ALARMS)]
        for i in range(_ALARMS):
            own = np.maximum(own, np.maximum(mine[i], mine[NOT_ISOLATED]) * raised[i])
        over = np.where(p.fault > 0.0, np.where(t >= p.end - 1e-6, 1.0, 0.0), 0.0)
        rises = [raised[i] * (1.0 - raised_before[i]) for i in range(_ALARMS)]
        false = (x.false_begun[i] + rises[i] * (1.0 - mine[i] * acts) for i in range(_ALARMS))
        settled = np.where(t >= SETTLED, 1.0, 0.0)
        peaks = (np.maximum(x.peak[i], settled * _largest(now, name, p)) for i, (name, _) in enumerate(PEAKS))
        return {
            "first_raised": np.where(x.first_raised < 0.0, np.where(own * acts > 0.0, t, -1.0), x.first_raised),
            "first_clear": np.where(x.first_clear < 0.0, np.where((1.0 - own) * over > 0.0, t, -1.0), x.first_clear),
            "last_raised": np.where(own > 0.0, t, x.last_raised),
            "covered": x.covered + own * acts,
            "false_begun": vector(*false),
            "peak": vector(*peaks),
        }


def _reported(m: Any) -> list[Array]:
    """The alarms, and behind them whether a fault is detected that is not isolated."""
    return [*(m.raised[i] for i in range(NOT_ISOLATED)), m.undecided_alarm[0]]


def _largest(now: Any, name: str, p: Any) -> Array:
    if name == "efficiency":
        return np.abs(now.held_efficiency_estimate - p.nominal_efficiency)
    if name in ("rotor_difference", "generator_difference"):
        return now.held_speed_difference[0 if name == "rotor_difference" else 1]
    if name == "torque":
        return now.held_torque_residual
    if name == "shaft_angle":
        return np.abs(now.held_shaft_angle)
    values = now.held_speed_residual if name == "speed" else getattr(now, f"held_{name}")
    count = dict(PEAKS)[name]
    largest = values[0]
    for i in range(1, count):
        largest = np.maximum(largest, values[i])
    return largest


LOOP = WindTurbineLoop()
"""One system for all batches of a process: traced once."""

INTERVALS = {
    1: (1000.0, 1200.0),
    2: (2500.0, 2700.0),
    **dict.fromkeys((3, 4, 5, 6, 7, 10), (2000.0, 3400.0)),
    8: (2900.0, 3000.0),
    9: (3500.0, 3600.0),
}
"""Begin and end of each fault [s]: Omar 2012, Table 7.1."""


@dataclass(frozen=True)
class Outcome:
    """What came of the members of a batch, each entry of shape (members,) unless said otherwise.

    Attributes:
        onset: from the begin of the fault to its alarm [s], NaN where there was none.
        clear: from the end of the fault to the first sample without the alarm [s]. gone: to the last one with it [s].
        coverage: share of the fault with the alarm [1]. false: alarms that are not the fault's own in its time, shape
            (members, alarms). peaks: largest residuals, in the order of `PEAKS`, shape (members, residuals).
        efficiency: estimated, at `instants` [s], shape (members, instants).
    """

    onset: np.ndarray
    clear: np.ndarray
    gone: np.ndarray
    coverage: np.ndarray
    false: np.ndarray
    peaks: np.ndarray
    efficiency: np.ndarray
    instants: np.ndarray


def run_members(
    faults: Sequence[int], seeds: Sequence[int], stop: float, interval: tuple[float, float] | None = None, **values: Any
) -> Outcome:
    """Runs of the loop, a member for each fault with its seed.

    Args:
        faults: numbers, 0 for none. seeds: of the noise and the wind, one each. stop: end of the runs [s].
        interval: begin and end of the faults [s]; None for those of the benchmark.
        values: parameters, one number for all or shape (members,).
    """
    batch = fmus.Batch(LOOP, len(faults))
    begins, ends = np.array([interval or INTERVALS.get(f, (0.0, 0.0)) for f in faults]).T
    own = [OWN_ALARM.get(f, 0) for f in faults]
    stated = {"fault": faults, "seed": seeds, "onset": begins, "end": ends, "own": own, **values}
    for name, value in stated.items():
        batch.set(name, value)
    batch.start()
    instants = np.unique([*np.arange(0.0, stop, 10.0), stop])
    efficiency = batch.run(instants[1:], results=["efficiency"])[:, :, 0]
    if batch.failures:
        raise RuntimeError(f"{batch.failures}")

    def found(name: str) -> np.ndarray:
        return np.asarray(batch.get(name), dtype=float)

    first, clear = found("first_raised"), found("first_clear")
    samples = np.maximum(np.round((ends - begins) / 0.01), 1.0)
    return Outcome(
        np.where(first < 0.0, np.nan, first - begins),
        np.where((first < 0.0) | (clear < 0.0), np.nan, clear - ends),
        np.where(first < 0.0, np.nan, found("last_raised") - ends),
        found("covered") / samples,
        np.stack([found(f"false_begun[{i + 1}]") for i in range(_ALARMS)], axis=1),
        np.stack([found(f"peak[{i + 1}]") for i in range(len(PEAKS))], axis=1),
        efficiency,
        instants,
    )
