"""The diagnosis of a train: which of its sensors, wheels, traction and brake is at fault, since when, and how surely.

Declares the hybrid system; residuals, verdicts and shares of force stand in the files beside it.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from fmu_observer.detection.train_diagnosis_signals import EVENTS, INPUTS, OUTPUTS, PARAMETERS
from fmu_observer.detection.train_efficiency import MotionWindow, Share, brake_share, traction_share
from fmu_observer.detection.train_isolation import BRAKE, FAULTS, MOTION, RESIDUALS, WHEEL, isolability
from fmu_observer.detection.train_residuals import ALIKE, HUGE, Readings, readings, tolerance, voted_speed
from fmu_observer.detection.train_verdict import (
    alarms_after,
    availability,
    codes_after,
    contradicted_wheels,
    stuck_sensors,
    wheels,
)
from fmu_observer.formulas.diagnosis.isolation_table import largest
from fmu_observer.formulas.diagnosis.window_inversion import windowed_square
from plant_models.hybrid import Array, HybridSystem, Signal, memory, state, vector
from plant_models.hybrid.event import IGNORED, USED
from plant_models.hybrid.option import require_whole
from plant_models.railway.vehicle.pneumatic_brake import filling, limited

_CONTINUOUS = (
    state("estimated_position", "m", 0.0, "Position by dead reckoning from the last balise"),
    state("way", "m", 0.0, "Ways of first odometer, second odometer and radar since the start", size=3),
    state("modelled_pressure", "Pa", 0.0, "Pressure in the brake cylinder by the demand"),
)
_FIXED = (
    memory("gps_samples", "1", 0.0, "Samples since the satellite positions began"),
    memory("samples", "1", 0.0, "Samples so far"),
    memory("voted_speed", "m/s", 0.0, "Speed that is believed"),
    memory("ratio", "1", 0.0, "Residuals over their thresholds", size=len(RESIDUALS)),
    memory("raised", "1", 0.0, "Alarms", size=len(RESIDUALS)),
    memory("contrary", "1", 0.0, "Samples in a row that speak against an alarm as it is", size=len(RESIDUALS)),
    memory("since", "s", 0.0, "Instants at which alarms changed", size=len(RESIDUALS)),
    memory("group_since", "s", -1.0, "Since when alarms of motion, brake, traction are raised; -1 none", size=3),
    memory("telegrams", "1", 0.0, "Balises so far"),
    memory("refused", "1", 0.0, "1 where the last balise was refused"),
    memory("telegram_verdict", "1", 0.0, "0 used, 2 refused: the last balise"),
    memory("mark", "m", 0.0, "Position of the last balise that was used"),
    memory("way_mark", "m", 0.0, "Ways at that balise", size=3),
    memory("faulty", "1", 0.0, "1 where odometers and radar were at fault since the last balise", size=3),
    memory("disagree", "1", 0.0, "1 for odometers and radar whose ways the last balise contradicts", size=3),
    memory("against_wheel", "s", 0.0, "Time for which no wheel explains the odometers", size=2),
    memory("last_reading", "1", 0.0, "Readings of odometers, radar, satellites, pressure at the last sample", size=5),
    memory("then", "1", 0.0, "Speed, position or pressure believed when each of them changed last", size=5),
    memory("since_pull", "s", 1e3, "Time since the train pulled"),
    memory("since_brake", "s", 1e3, "Time since it braked"),
    memory("code", "1", 0.0, "Fault codes", size=len(FAULTS)),
    memory("detected_at", "s", -1.0, "Instant of the last detection; -1 none"),
    memory("trust", "1", 0.0, "Confidence of the verdict"),
    memory("several", "1", 0.0, "1 where no single fault explains the alarms"),
    memory("coarse_sum", "1", 0.0, "Sums of the coarse step that runs", size=5),
    memory("coarse_samples", "1", 0.0, "Samples in the coarse step that runs"),
    memory("quiet_steps", "1", 0.0, "Coarse steps since speeds disagreed"),
)
_SHARES = (
    memory("share", "1", 1.0, "Shares of traction, brake by measured, brake by demanded pressure", size=3),
    memory("share_found", "1", 0.0, "1 where the grid held the share that was found last", size=3),
)


_SPEED_PAIRS = 6  # residuals of speed stand first in `MOTION`
_SOURCES = ((0, 1), (0, 2), (1, 2), (0, 3), (1, 3), (2, 3))  # of these pairs: odometers, radar and satellites
_MEANS = ("mean_speed", "mean_drive", "mean_measured", "mean_demanded", "mean_other")


class TrainDiagnosis(HybridSystem):
    """Faults of two odometers, radar, satellite positions, balises, brake pressure, brake and traction.

    Every `sample_period` the sensors are compared: pairs of sources of speed over a window, satellite position with
    dead reckoning, pressure with what the demand makes of a cylinder. At a balise its distance from the last one is
    compared with the way of each source. Over a window of some seconds the train as one point is inverted for the share
    of traction and of brake force that arrives. Each residual is divided by its threshold and raises an alarm above 1;
    `MOTION`, `BRAKE` and `TRACTION` say which fault moves which, and the fault that explains the alarms and asks for
    least is reported. One fault at a time in each of the three groups; the second odometer must be on another axle.
    While any alarm is raised `fault` is 1, whether it is isolated, suspected or, as `several_faults` says, explained by
    none, or not by the one that is isolated and stays so. Satellites and balises are compared with every source of
    speed: a fault explains their residuals where it moves all sources that they contradict.

    An odometer that is off while an effort acts that can make its wheel slip or jam is put down to the wheel; where it
    is off for `contrary_time` without such an effort, or to the other side, to the sensor. A wheel that is locked and a
    sensor that reads zero are not distinguished before the brake is released. Slip of all wheels is no explanation
    either where an odometer is off so: two that are off alike are reported as several, and as the rail under an effort
    that slips.

    Sensors that are not connected are not fitted: less can be distinguished then (`isolability`), and
    `isolation_limited` says so. While speeds disagree, and a window after, no share of force is found.

    Args:
        speed_window: samples N of a pair of speeds. gps_window: samples L of a difference of satellite positions.
        force_window: coarse steps M of the window of forces.

    Raises:
        ValueError: a window is not a whole number in its range.

    Presets: `swept` (default; thresholds from fault-free runs, nearly all on dry rails), `wet_rails` (from fault-free
    runs on wet rails, where wheels creep by up to 3 %: wider where wheels are compared with what does not slip); see
    docs/theses/train_diagnosis.md for the false alarms and the delays of both.

    Source: Omar 2012, chapter 7 (redundancy, windowed residuals, grid inversion), for a train; table and thresholds
    ours.
    """

    name = "train_diagnosis"
    description = "Faults of a train's odometers, radar, satellites, balises, brake and traction: isolated and timed"
    source = "Omar 2012, 7.5.1, (7.6.9)-(7.6.13), (7.7.6)-(7.7.8), for a train; table of isolation ours"
    internal_step = 1e-2  # the flow is exact for held inputs, but for the cylinder's lag
    bounded_parameters = "all"
    inputs = INPUTS
    outputs = OUTPUTS
    parameters = PARAMETERS
    events = EVENTS
    presets = {
        "swept": {},
        "wet_rails": {
            "threshold_wheels": 0.55,
            "threshold_radar": 1.2,
            "threshold_traction": 0.16,
            "balise_floor": 1.7,
        },
    }
    default_preset = "swept"
    option_choices = {
        "speed_window": range(2, 51),
        "gps_window": range(2, 101),
        "force_window": range(3, 61),
    }

    def __init__(self, *, speed_window: int = 10, gps_window: int = 20, force_window: int = 8) -> None:
        require_whole(self.name, 2, 50, speed_window=speed_window)
        require_whole(self.name, 2, 100, gps_window=gps_window)
        require_whole(self.name, 3, 60, force_window=force_window)
        self.states = (*_CONTINUOUS, *_remembered(speed_window, gps_window, force_window))
        super().__init__(speed_window=speed_window, gps_window=gps_window, force_window=force_window)

    @staticmethod
    def isolability(fitted: tuple[str, ...]) -> dict[str, tuple[str, ...] | None]:
        """What can be isolated with these sensors, see `fmu_observer.detection.train_isolation.isolability`.

        Args:
            fitted: names of sensors.
        """
        return isolability(fitted)

    def flow(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        pipe = p.pipe_pressure_released - limited(u.brake_demand) * p.pipe_depression_full
        return {
            "estimated_position": x.voted_speed,
            "way": vector(*readings(u).speeds),
            "modelled_pressure": filling(x.modelled_pressure, pipe, p),
        }

    def jump(self, event: str, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        """A sample is judged, or a balise compared."""
        return self._at_balise(x, u, p) if event == "balise" else self._at_sample(t, x, u, p)

    def output(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        read, codes = readings(u), dict(zip(FAULTS, x.code, strict=True))
        enough = read.fitted[0] * read.fitted[1] * read.fitted[2] * read.has_pressure
        faults = {f"{fault}_fault": code for fault, code in codes.items()}
        isolated = [np.where(code > 0.0, 1.0, 0.0) for code in codes.values()]
        unknown = [1.0 - found for found in x.share_found]
        return {
            **faults,
            "fault": largest([np.where(since >= 0.0, 1.0, 0.0) for since in x.group_since] + isolated),
            "odometer_fault": np.where(codes["odometer_1"] > 0.0, 1.0, 0.0),
            "fault_count": sum(isolated),
            "several_faults": x.several,
            "detection_time": x.detected_at,
            "confidence": x.trust,
            "speed": x.voted_speed,
            "position": x.estimated_position,
            "traction_efficiency": x.share[0],
            "brake_performance": x.share[1],
            "brake_by_demand": x.share[2],
            "isolation_limited": 1.0 - enough,
            "traction_efficiency_unknown": unknown[0],
            "brake_performance_unknown": unknown[1],
            "brake_by_demand_unknown": unknown[2],
            "shares_unknown": sum(unknown),
            **{f"ratio_{name}": ratio for name, ratio in zip(RESIDUALS, x.ratio, strict=True)},
        }

    # -- a sample -----------------------------------------------------------------------------------------------------

    def _at_sample(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        read = readings(u)
        speed = voted_speed(read, x.raised[:_SPEED_PAIRS])
        count = np.where(read.has_gps > 0.0, x.gps_samples + 1.0, 0.0)
        gps_full = np.where(count > x.lead_first.shape[0] + 0.5, 1.0, 0.0)
        can = availability(read, gps_full, x.telegrams, x.disagree)
        speeds, windows = _speed_ratios(x, read, speed, p)
        forces, shares = self._shares(x, read, speed, u, p)
        off = np.minimum(np.abs(read.gps - x.estimated_position), _nearest_way(x, read))
        held = dict(zip(RESIDUALS, x.ratio, strict=True))
        held["gps_position"] = off / (p.threshold_position + p.balise_share * np.abs(x.estimated_position - x.mark))
        held["pressure"] = np.abs(read.pressure - x.modelled_pressure) / p.threshold_pressure
        held |= dict(zip(MOTION.residuals[:_SPEED_PAIRS], speeds, strict=True)) | forces
        ratios = [held[name] * there for name, there in zip(RESIDUALS, can.residuals, strict=True)]
        new = {"voted_speed": speed, "samples": x.samples + 1.0, "gps_samples": count, **windows, **shares}
        new |= alarms_after(x, t, ratios, p)
        wheel, efforts = wheels(x, u, self._brake_force(largest([x.modelled_pressure, read.pressure]), p), p)
        now = x._replace(voted_speed=speed, ratio=new["ratio"], raised=new["raised"])
        wrong, against = contradicted_wheels(now, read, wheel, p)
        stuck, seen = stuck_sensors(now, read, wheel, p)
        return new | efforts | against | seen | codes_after(now, t, can, wrong, stuck, x.raised, p)

    def _shares(
        self, x: Any, read: Readings, speed: Array, u: Any, p: Any
    ) -> tuple[dict[str, Array], dict[str, Array]]:
        """Residuals of the shares of force over their thresholds, and new values of states after a coarse step."""
        sums = [total + value for total, value in zip(x.coarse_sum, self._forces(x, read, speed, u, p), strict=True)]
        count = x.coarse_samples + 1.0
        step = count * p.sample_period
        full = np.where(step >= p.coarse_step - 1e-9, 1.0, 0.0)
        quiet = np.where(_loud(x) > 0.0, 0.0, x.quiet_steps + full)
        means = [_moved_on(getattr(x, n), total / count, full) for n, total in zip(_MEANS, sums, strict=True)]
        found = self._found_shares(x, MotionWindow(*means), read, step, p)
        usable = full * np.where(quiet > len(means[0]) - 0.5, 1.0, 0.0)
        counts = [usable * one.found for one in found]
        shares = [np.where(on > 0.0, one.value, old) for on, one, old in zip(counts, found, x.share, strict=True)]
        sought = zip(counts, found, x.share_found, strict=True)
        after = {
            "coarse_sum": vector(*((1.0 - full) * total for total in sums)),
            "coarse_samples": (1.0 - full) * count,
            "quiet_steps": quiet,
            "share": vector(*shares),
            "share_found": vector(*(np.where(on > 0.0, one.bracketed, old) for on, one, old in sought)),
            **{name: vector(*values) for name, values in zip(_MEANS, means, strict=True)},
        }
        pulls, measured, demanded = (np.abs(1.0 - share) for share in shares)
        brakes = (measured / p.threshold_brake, demanded / p.threshold_brake)
        return {"traction": pulls / p.threshold_traction, **dict(zip(BRAKE.residuals[1:], brakes, strict=True))}, after

    def _forces(self, x: Any, read: Readings, speed: Array, u: Any, p: Any) -> list[Array]:
        """Speed, and the accelerations that forces would give now, in the order of `MotionWindow`."""
        mass = p.mass + p.rotating_mass
        return [
            speed,
            np.maximum(u.effort, 0.0) / mass,
            self._brake_force(read.pressure, p) / mass,
            self._brake_force(x.modelled_pressure, p) / mass,
            (np.minimum(u.effort, 0.0) - u.gradient_force) / mass,
        ]

    @staticmethod
    def _found_shares(x: Any, window: MotionWindow, read: Readings, step: Array, p: Any) -> list[Share]:
        """Shares of traction, of the brake by the measured and by the demanded pressure, of a window."""
        mass, (pulled, measured, demanded) = p.mass + p.rotating_mass, x.share
        by_pressure = brake_share(window.measured, window, measured, step, mass, p)
        return [
            traction_share(window, pulled, step, mass, p),
            by_pressure._replace(found=by_pressure.found * read.has_pressure),
            brake_share(window.demanded, window, demanded, step, mass, p),
        ]

    @staticmethod
    def _brake_force(pressure: Array, p: Any) -> Array:
        """Brake force of the whole train [N] at a pressure in the cylinders [Pa]."""
        usable = p.cylinder_pressure_full - p.cylinder_pressure_idle
        return p.full_brake_force * np.maximum(pressure - p.cylinder_pressure_idle, 0.0) / usable

    # -- a balise -----------------------------------------------------------------------------------------------------

    @staticmethod
    def _at_balise(x: Any, u: Any, p: Any) -> dict[str, Array]:
        read, distance = readings(u), u.balise_position - x.mark
        ways = [way - mark for way, mark in zip(x.way, x.way_mark, strict=True)]
        known = np.where(x.telegrams > 0.5, 1.0, 0.0)
        sound = [there * (1.0 - bad) for there, bad in zip(read.fitted, x.faulty, strict=True)]
        errors, limit = [distance - way for way in ways], p.balise_floor + p.balise_share * np.abs(distance)
        ratios, balise = _way_ratios(errors, sound, limit)
        gaps = [np.where(np.abs(error) > limit, 1.0, 0.0) for error in errors]
        held = dict(zip(RESIDUALS, x.ratio, strict=True))
        held |= {f"way_{name}": known * r for name, r in zip(("1", "2", "radar"), ratios, strict=True)}
        held["balise"] = known * balise
        # One that no way agrees with is not used; two in a row mean that the place of the train was wrong.
        refused = np.where(held["balise"] > 1.0, 1.0 - x.refused, 0.0)
        used = 1.0 - refused
        return {
            "estimated_position": np.where(used > 0.0, u.balise_position, x.estimated_position),
            "ratio": vector(*(held[name] for name in RESIDUALS)),
            "telegrams": x.telegrams + 1.0,
            "refused": refused,
            "faulty": np.zeros(3),
            "disagree": vector(*(known * there * gap for there, gap in zip(read.fitted, gaps, strict=True))),
            "telegram_verdict": np.where(used > 0.0, float(USED), float(IGNORED)),
            "mark": np.where(used > 0.0, u.balise_position, x.mark),
            "way_mark": np.where(used > 0.0, x.way, x.way_mark),
        }


def _loud(x: Any) -> Array:
    """1 where two sources of speed disagree of which neither is known to be at fault."""
    known = [np.where(code >= WHEEL, 1.0, 0.0) for code in x.code[:3]]  # these are not believed
    sound = [1.0 - np.maximum(known[i], known[j] if j < len(known) else 0.0) for i, j in _SOURCES]
    return largest([on * both for on, both in zip(x.raised[:_SPEED_PAIRS], sound, strict=True)])


def _moved_on(means: Array, newest: Array, full: Array) -> list[Array]:
    """The means of a window, moved on by one where its coarse step is full."""
    return [np.where(full > 0.0, new, old) for old, new in zip(means, [*means[1:], newest], strict=True)]


def _nearest_way(x: Any, read: Readings) -> Array:
    """Distance of the satellite position from the nearest of the ways since the last balise [m].

    Satellites are off where no source of speed agrees with them, not where one source is.
    """
    ways = zip(x.way, x.way_mark, read.fitted, strict=True)
    gaps = [np.where(there > 0.0, np.abs(read.gps - x.mark - way + mark), HUGE) for way, mark, there in ways]
    return -largest([-gap for gap in gaps])


def _remembered(speed_window: int, gps_window: int, force_window: int) -> tuple[Signal, ...]:
    """The memory."""
    n = speed_window - 1
    return (
        memory("squares_odometers", "1", 0.0, "Squares of the pair of odometers", size=n),
        memory("squares_first_radar", "1", 0.0, "Squares of first odometer and radar", size=n),
        memory("squares_second_radar", "1", 0.0, "Squares of second odometer and radar", size=n),
        memory("lead_first", "m", 0.0, "Leads of the satellite position over the first odometer", size=gps_window),
        memory("lead_second", "m", 0.0, "Leads of the satellite position over the second odometer", size=gps_window),
        memory("lead_radar", "m", 0.0, "Leads of the satellite position over the radar", size=gps_window),
        *_FIXED,
        memory("mean_speed", "m/s", 0.0, "Mean speeds of the coarse steps", size=force_window),
        memory("mean_drive", "m/s2", 0.0, "Acceleration by traction as asked for", size=force_window),
        memory("mean_measured", "m/s2", 0.0, "Deceleration by the measured pressure", size=force_window),
        memory("mean_demanded", "m/s2", 0.0, "Deceleration by the pressure asked for", size=force_window),
        memory("mean_other", "m/s2", 0.0, "Acceleration by electric brake and gradient", size=force_window),
        *_SHARES,
    )


def _speed_ratios(x: Any, read: Readings, speed: Array, p: Any) -> tuple[list[Array], dict[str, Array]]:
    """Residuals of the six pairs of sources of speed over their thresholds.

    The three pairs without the satellites are root mean squares over N samples, those with them the mean over L: the
    lead of the position over the way may not change.
    """
    allowed = tolerance(speed, p)
    ratios: list[Array] = []
    after: dict[str, Array] = {}
    for name, i, j, threshold in (
        ("squares_odometers", 0, 1, p.threshold_wheels),
        ("squares_first_radar", 0, 2, p.threshold_radar),
        ("squares_second_radar", 1, 2, p.threshold_radar),
    ):
        both, before = read.fitted[i] * read.fitted[j], getattr(x, name)
        windowed = windowed_square(before, both * (read.speeds[i] - read.speeds[j]) / allowed)
        ratios.append(np.sqrt(windowed.value / (before.shape[0] + 1.0)) / threshold)
        after[name] = windowed.memory
    for name, way, fitted in zip(("lead_first", "lead_second", "lead_radar"), x.way, read.fitted, strict=True):
        now, lead = read.has_gps * (read.gps - way), getattr(x, name)
        window = lead.shape[0] * p.sample_period
        ratios.append(fitted * np.abs(now - lead[0]) / (window * allowed * p.threshold_gps))
        after[name] = vector(*lead[1:], now)
    return ratios, after


def _way_ratios(errors: list[Array], fitted: list[Array], limit: Array) -> tuple[list[Array], Array]:
    """Residuals of the ways from the last balise to this one over their thresholds.

    Where the ways of all sources are off by much the same, the balise is; else the sources that are off.
    """
    ratios = [f * np.abs(error) / limit for error, f in zip(errors, fitted, strict=True)]
    most = largest(ratios)
    least: Array = HUGE
    for ratio, there_is in zip(ratios, fitted, strict=True):
        least = np.minimum(least, np.where(there_is > 0.0, ratio, HUGE))
    alike = np.where(least < HUGE, np.where(least > ALIKE * most, 1.0, 0.0), 0.0)
    return [(1.0 - alike) * ratio for ratio in ratios], alike * most
