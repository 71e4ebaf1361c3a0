"""Wind, turbine, controller, one of its ten faults and the diagnosis as one system, of which many members run at once.

The parts are those that ship. At a sampling instant their order is that of a co-simulation: sensors, fault, diagnosis,
controller. Of the 440 000 samples of a run are kept when the alarm of the fault came and went, how often others came,
and the largest residuals.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

import fmus
from fmu_observer.observers.exhibits.wind_turbine_diagnosis import ALARM_NAMES, WindTurbineDiagnosis
from plant_models.exhibits.wind_turbine import Wind, WindTurbine, WindTurbineController
from plant_models.hybrid import HybridSystem, PeriodicEvent, memory, output_signal, parameter, vector
from plant_models.hybrid.signal import Signal
from plant_models.hybrid.state_layout import StateLayout
from plant_models.hybrid.system import Array

PARTS = {"wind": Wind(), "turbine": WindTurbine(), "controller": WindTurbineController()}
DIAGNOSIS = WindTurbineDiagnosis()
SYSTEMS = {**PARTS, "diagnosis": DIAGNOSIS}
DIAGNOSED = StateLayout(DIAGNOSIS.states)
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
_ENDS = np.cumsum([s.width for s in _STATES])
LAYOUT = {s.name: slice(int(end) - s.width, int(end)) for s, end in zip(_STATES, _ENDS, strict=True)}
"""Where each state of the loop stands."""

FIXED = {name: system.start_parameters() for name, system in PARTS.items()}
"""Parameters of the parts."""


class WindTurbineLoop(HybridSystem):
    """The closed loop with one fault at a time, and what came of it."""

    by_name = False

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

    def flow(self, t: Array, x: Array, u: Any, p: Any) -> Array:
        """The turbine turns."""
        inputs = self._turbine_inputs(t, x, None, p)
        return PARTS["turbine"].state_derivative(t, self._part("turbine", x), inputs, FIXED["turbine"])

    def output(self, t: Array, x: Array, u: Any, p: Any) -> dict[str, Array]:
        """Estimated efficiency."""
        return {"efficiency": x[LAYOUT["diagnosis_held_efficiency_estimate"].start]}

    def jump(self, event: str, t: Array, x: Array, u: Any, p: Any) -> Array:
        """A sampling instant, or one of the diagnosis alone."""
        if event != "sampling":
            return self._with(x, diagnosis=self._diagnosed(event, t, x, None, p))
        wind = PARTS["wind"].jump_vector("gust", t, self._part("wind", x), vector(u.gust_noise), self._wind(p))
        x = self._with(x, wind=wind)
        inputs, turbine = self._turbine_inputs(t, x, u, p), self._part("turbine", x)
        x = self._with(x, turbine=PARTS["turbine"].jump_vector("sampling", t, turbine, inputs, FIXED["turbine"]))
        readings = self._readings(t, x, p)
        controller = self._part("controller", x)
        given = DIAGNOSIS.unpack_inputs(
            vector(
                readings["wind"],
                *readings["rotor"],
                *readings["generator"],
                readings["torque"],
                *readings["pitch"],
                controller[2],
                controller[1],
            )
        )
        told = self._diagnosed("sampling", t, x, given, p)
        asked = vector(readings["generator"][0], readings["power"])
        moved = PARTS["controller"].jump_vector("sampling", t, controller, asked, FIXED["controller"])
        log = self._logged(t, x, told, p)
        return self._with(self._with(x, diagnosis=told, controller=moved), log=log)

    def _diagnosed(self, event: str, t: Array, x: Array, given: Any, p: Any) -> Array:
        before = self._part("diagnosis", x)
        changed = DIAGNOSIS.jump(event, t, DIAGNOSED.named(before), given, p)
        return DIAGNOSED.flat(changed, "the diagnosis", before.shape[1:], before)

    # -- parts ------------------------------------------------------------------------------------------------------

    def _slots(self, part: str) -> list[slice]:
        if part == "log":
            return [LAYOUT[s.name] for s in _LOG]
        system = DIAGNOSIS if part == "diagnosis" else PARTS[part]
        return [LAYOUT[f"{part}_{s.name}"] for s in system.states]

    def _part(self, part: str, x: Array) -> Array:
        return np.hstack([x[slot] for slot in self._slots(part)])

    def _with(self, x: Array, **parts: Array) -> Array:
        pieces = {slot.start: x[slot] for slot in LAYOUT.values()}
        for part, new in parts.items():
            first = 0
            for slot in self._slots(part):
                pieces[slot.start] = new[first : first + slot.stop - slot.start]
                first += slot.stop - slot.start
        return np.hstack([pieces[start] for start in sorted(pieces)])

    def _wind(self, p: Any) -> Any:
        names = ("mean_from", "mean_to", "sine_amplitude", "turbulence_std", "sample_period")
        pairs = zip(PARTS["wind"].parameter_signals, FIXED["wind"], strict=True)
        return vector(*(getattr(p, s.name) if s.name in names else value for s, value in pairs))

    def _turbine_inputs(self, t: Array, x: Array, u: Any, p: Any) -> Any:
        blown = PARTS["wind"].output_vector(t, self._part("wind", x), np.zeros(1), self._wind(p))[0]
        controller = self._part("controller", x)
        acts = self._acts(t, p)
        into = [self._is(p, 7) * acts * 1000.0 * p.size]
        into += [0.97 + self._is(p, 10) * acts * p.size * (0.25 - 0.97)]
        # Fault 9 comes in 30 s and goes in 30 s; its onset and end are those of the whole.
        ramp = np.clip(np.minimum((t - p.onset) / 30.0, (p.end - t) / 30.0), 0.0, 1.0)
        abrupt, slow = self._is(p, 8) * acts * p.size, self._is(p, 9) * ramp * p.size
        into += [11.11, 11.11 + abrupt * (5.73 - 11.11), 11.11 + slow * (3.42 - 11.11)]
        into += [0.6, 0.6 + abrupt * (0.45 - 0.6), 0.6 + slow * (0.9 - 0.6)]
        count = sum(s.width for s in PARTS["turbine"].noises)
        noises = [0.0] * count
        if u is not None:
            parts = [getattr(u, s.name) for s in PARTS["turbine"].noises]
            noises = [part[i] for part, s in zip(parts, PARTS["turbine"].noises, strict=True) for i in range(s.width)]
        return vector(blown, controller[2], controller[1], *into, *noises)

    def _readings(self, t: Array, x: Array, p: Any) -> dict[str, Any]:
        def held(name: str) -> list[Array]:
            slot = LAYOUT[f"turbine_held_{name}"]
            return [x[i] for i in range(slot.start, slot.stop)]

        acts = self._acts(t, p)
        pitch, rotor, generator = held("pitch"), held("rotor_speed"), held("generator_speed")
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
        single = {"wind": held("wind")[0], "torque": held("torque")[0], "power": held("power")[0]}
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

    def _logged(self, t: Array, x: Array, told: Array, p: Any) -> Array:
        was, now = (DIAGNOSED.named(state) for state in (self._part("diagnosis", x), told))
        log = {s.name: x[LAYOUT[s.name].start] if s.size is None else x[LAYOUT[s.name]] for s in _LOG}
        acts = self._acts(t, p)
        own = 0.0 * t
        raised_before, raised = _told(was), _told(now)
        mine = [np.where(np.abs(p.own - i) < 0.5, np.where(p.fault > 0.0, 1.0, 0.0), 0.0) for i in range(_ALARMS)]
        for i in range(_ALARMS):
            own = np.maximum(own, np.maximum(mine[i], mine[NOT_ISOLATED]) * raised[i])
        over = np.where(p.fault > 0.0, np.where(t >= p.end - 1e-6, 1.0, 0.0), 0.0)
        rises = [raised[i] * (1.0 - raised_before[i]) for i in range(_ALARMS)]
        values = (
            np.where(log["first_raised"] < 0.0, np.where(own * acts > 0.0, t, -1.0), log["first_raised"]),
            np.where(log["first_clear"] < 0.0, np.where((1.0 - own) * over > 0.0, t, -1.0), log["first_clear"]),
            np.where(own > 0.0, t, log["last_raised"]),
            log["covered"] + own * acts,
            *(log["false_begun"][i] + rises[i] * (1.0 - mine[i] * acts) for i in range(_ALARMS)),
        )
        settled = np.where(t >= SETTLED, 1.0, 0.0)
        peaks = [np.maximum(log["peak"][i], settled * _largest(now, name, p)) for i, (name, _) in enumerate(PEAKS)]
        return vector(*values, *peaks)


def _told(m: Any) -> list[Array]:
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
    given = {"fault": faults, "seed": seeds, "onset": begins, "end": ends, "own": own, **values}
    for name, value in given.items():
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
