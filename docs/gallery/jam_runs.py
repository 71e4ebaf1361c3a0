"""Many braking trains with a jam of the odometer's wheel each, and what the quasi-LPV observer makes of them.

Used by the scripts of the gallery and by ``docs/studies/jam_detection.py``. The trains are integrated here, by
Runge-Kutta of order four in NumPy; the observers run as one batch.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

import fmus
from fmu_observer.observers.train import QuasiLpvUio
from plant_models.railway.sensors.pulses import pulse_length, reading_bound

PERIOD = 0.2  # [s], between two readings
STEP = 0.02  # [s], of the trains
GRACE = 0.5  # [s]: as `cosim.evaluation.fault_detection.GRACE`
ROOM = 2.0  # [s]
WHEEL_RADIUS = 0.46  # [m]
LARGEST = 2.0  # [m/s2]: trains on set D brake at up to 1.54
STANDING = 0.5  # [m/s]: below, nothing is judged
OUTPUTS = ("speed", "position", "odometer_fault", "recovering", "residual", "disturbance")


class Case(NamedTuple):
    """A braking: preset of the observer, Davis coefficients of the train [m/s2, 1/s, 1/m], speed [m/s], true and known
    brake [m/s2], threshold [m/s], duration [s].
    """

    preset: str
    davis: tuple[float, float, float]
    speed: float
    brake: float
    known: float
    threshold: float
    duration: float


SET_B, SET_D = (0.02, 0.003, -0.00024), (0.46, 5.7e-3, -2.4e-4)
CASES = {
    "3.3.4": Case("as_published", SET_B, 45.0, 0.9, 0.68, 0.9, 50.0),
    "HS": Case("as_published_5_3_1", SET_D, 45.0, 1.0, 0.8, 0.65, 36.0),
    "AS": Case("as_published_5_3_1", SET_D, 30.0, 1.0, 0.8, 0.62, 26.0),
    "LS": Case("as_published_5_3_1", SET_D, 17.0, 1.0, 0.8, 0.4, 16.0),
}
"""Scenario 3.3.4, and the brakings of chapter 5 from 45, 30 and 17 m/s on low adhesion. The brake is not printed: ours,
with 0.2 m/s2 of it unknown to the observer.
"""


class Trains(NamedTuple):
    """Times [s], shape (k,), speeds [m/s] and positions [m], shape (members, k), every `STEP`."""

    t: np.ndarray
    v: np.ndarray
    p: np.ndarray


@dataclass(frozen=True)
class Jams:
    """One fault a member, each field of shape (members,): onset [s], length [s], depth [1], below zero for a skid."""

    onset: np.ndarray
    length: np.ndarray
    depth: np.ndarray

    @property
    def turned(self) -> Jams:
        """The same faults with the other sign: a wheel that is as much too fast as it was too slow."""
        return replace(self, depth=-self.depth)


def trains(case: Case, members: int, rng: np.random.Generator | None = None) -> Trains:
    """Trains that brake on the grade ``0.05 sin(0.1 t + phase)``, the phase drawn where there is a generator."""
    count = round(case.duration / STEP) + 1
    phase = np.zeros(members) if rng is None else rng.uniform(0.0, 2.0 * np.pi, members)
    a, b, c = case.davis
    v = np.zeros((members, count))
    v[:, 0] = case.speed
    for k in range(count - 1):
        grade = 0.05 * np.sin(0.1 * k * STEP + phase)

        def rate(speed: np.ndarray, grade: np.ndarray = grade) -> np.ndarray:
            return -case.brake - (a + b * speed + c * speed * speed) - grade

        k1 = rate(v[:, k])
        k2 = rate(v[:, k] + 0.5 * STEP * k1)
        k3 = rate(v[:, k] + 0.5 * STEP * k2)
        k4 = rate(v[:, k] + STEP * k3)
        after = v[:, k] + STEP / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
        v[:, k + 1] = np.where((v[:, k] <= 0.0) | (after <= 0.0), 0.0, after)
    way = np.cumsum(0.5 * STEP * (v[:, 1:] + v[:, :-1]), axis=1)
    return Trains(STEP * np.arange(count), v, np.concatenate([np.zeros((members, 1)), way], axis=1))


def station_stop(stand: float, members: int, rng: np.random.Generator) -> tuple[Trains, np.ndarray]:
    """Trains that run at 20 m/s, brake at 30 s, stand, depart and cruise for 60 s, and the known effort at the readings
    [m/s2]: 0.7 m/s2 of braking and pulling, of which the brake's last 0.2 m/s2 are unknown; resistance of set B.
    """
    a, b, c = SET_B
    count = round((62.0 + stand + 100.0) / STEP) + 1
    t, phase = STEP * np.arange(count), rng.uniform(0.0, 2.0 * np.pi, members)
    v, effort = np.full((members, count), 20.0), np.zeros((members, count))
    cruise, leaves = a + b * 20.0 + c * 400.0, 62.0 + stand
    for k in range(count - 1):
        pulls = t[k] >= leaves
        wanted = np.where(v[:, k] < 20.0, 0.7, cruise) if pulls else cruise if t[k] < 30.0 else -0.7
        effort[:, k] = wanted
        unknown = 0.03 * np.sin(0.1 * t[k] + phase) + (0.2 if 30.0 <= t[k] < leaves else 0.0)
        rolls = v[:, k] > 0.0
        push = wanted - rolls * (a + b * v[:, k] + c * v[:, k] ** 2 + unknown)
        v[:, k + 1] = np.maximum(v[:, k] + STEP * np.where(rolls | (wanted > 0.0), push, 0.0), 0.0)
    effort[:, -1] = effort[:, -2]
    way = np.cumsum(0.5 * STEP * (v[:, 1:] + v[:, :-1]), axis=1)
    return Trains(t, v, np.concatenate([np.zeros((members, 1)), way], axis=1)), at_samples(effort)


def random_jams(rng: np.random.Generator, members: int, case: Case, lengths: Any, depths: Any) -> Jams:
    """A jam a member: onset drawn over the period after the arming delay, length and depth drawn from lists."""
    last = 9.0 if case.speed < 20.0 else 12.0
    return Jams(rng.uniform(7.0, last, members), rng.choice(lengths, members), rng.choice(depths, members))


def readings(run: Trains, jams: Jams | None, noise: float, rng: np.random.Generator, aggregated: bool) -> np.ndarray:
    """Readings every `PERIOD`, shape (members, samples): means over the period, or samples of the wheel's speed."""
    wheel = run.v.copy()
    if jams is not None:
        inside = (run.t >= jams.onset[:, None] - 1e-9) & (run.t < (jams.onset + jams.length)[:, None] - 1e-9)
        wheel *= np.where(inside, 1.0 - jams.depth[:, None], 1.0)
    every = round(PERIOD / STEP)
    if aggregated:
        # the wheel holds its speed over a step: the way is exact for edges on the grid
        way = np.concatenate([np.zeros((len(wheel), 1)), np.cumsum(STEP * wheel[:, :-1], axis=1)], axis=1)
        way -= 0.5 * STEP * (run.v[:, :1] - run.v)
        means = np.diff(way[:, ::every], axis=1) / PERIOD
        read = np.concatenate([wheel[:, :1], means], axis=1)
    else:
        read = wheel[:, ::every]
    moving = run.v[:, ::every] > 0.0
    return np.maximum(read + noise * moving * rng.standard_normal(read.shape), 0.0)


def counted(read: np.ndarray, teeth: float) -> np.ndarray:
    """Readings of a wheel with so many teeth: whole pulses of what is read, shape (members, samples)."""
    step = float(pulse_length(teeth, WHEEL_RADIUS)) / PERIOD  # [m/s], of one pulse in a period
    count = np.floor(np.cumsum(read, axis=1) / step)
    return np.concatenate([read[:, :1], np.diff(count, axis=1) * step], axis=1)


def balises(run: Trains, spacing: float = 200.0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Member, stamp [s] and place [m] of every passing."""
    found = []
    for member, p in enumerate(run.p):
        places = np.arange(spacing, p[-1], spacing)
        found += [(member, np.interp(place, p, run.t), place) for place in places]
    members, stamps, places = np.array(found).reshape(-1, 3).T
    return members.astype(int), stamps, places


def observe(
    case: Case,
    run: Trains,
    read: np.ndarray,
    rules: str = "repaired",
    *,
    aggregated: bool = True,
    with_balises: bool = True,
    effort: np.ndarray | None = None,
    noise: float | None = None,
    teeth: float = 0.0,
    **values: Any,
) -> dict[str, np.ndarray]:
    """Outputs of the observer at the readings, each of shape (members, samples).

    With the printed rules the reading is held, and rule 4 is off; with the repaired ones the innovation is held, the
    age of an aggregated reading made up for. With `noise` [m/s] the observer is told what that and `teeth` of the
    odometer can do, and how hard these trains brake.
    """
    repaired = rules == "repaired"
    observer = QuasiLpvUio(rules=rules, hold="innovation" if repaired else "reading")  # type: ignore[arg-type]
    batch = fmus.Batch(observer, len(read), case.preset)
    chosen = {"threshold": case.threshold, "estimated_speed": case.speed}
    chosen |= {"reading_age": 0.5 * PERIOD * aggregated} if repaired else {"rule_4": 0.0}
    if noise is not None and repaired:
        bound = float(reading_bound(noise, teeth, WHEEL_RADIUS, PERIOD))
        chosen |= {"odometer_noise": bound, "acceleration_limit": LARGEST}
    for name, value in (chosen | values).items():
        batch.set(name, value)
    if with_balises:
        members, stamps, places = balises(run)
        batch.notify("balise", members=members, stamps=stamps, position=places)
    batch.set("effort", -case.known if effort is None else effort[:, 0])
    batch.set("odometer", read[:, 0])
    batch.start()
    # An input is held from one instant to the next, and the sample at the end of a step must see the new reading.
    ahead = np.concatenate([read[:, 1:], read[:, -1:]], axis=1)
    varied = {"odometer": ahead} | ({} if effort is None else {"effort": effort})
    found = batch.run(PERIOD * np.arange(1, read.shape[1]), results=list(OUTPUTS), inputs=varied)
    assert not batch.failures, batch.failures
    return {name: found[:, :, i] for i, name in enumerate(OUTPUTS)}


def odometer_error(position: np.ndarray, read: np.ndarray, spacing: float) -> np.ndarray:
    """Integrated odometer, reset at balises, minus position at the samples, shape (members, samples) [m]."""
    way = np.concatenate([np.zeros((len(read), 1)), np.cumsum(PERIOD * read[:, :-1], axis=1)], axis=1)
    error = way - position
    last = np.floor(position / spacing) if np.isfinite(spacing) else np.zeros_like(position)
    passed = np.concatenate([np.zeros((len(read), 1), bool), np.diff(last, axis=1) > 0], axis=1)
    latest = np.maximum.accumulate(np.where(passed, np.arange(read.shape[1]), 0), axis=1)
    return np.asarray(error - np.take_along_axis(error, latest, axis=1))


@dataclass(frozen=True)
class Verdicts:
    """What became of the jams, a value a member.

    Attributes:
        found: whether the jam was told. delay: from its onset to that [s], NaN where it was not.
        late: from its end to that of the fault reported [s], infinite where that was not before rest, NaN where the jam
        was not told, or was over less than `ROOM` before rest. false: number of faults told without a jam. on: whether
        a fault was still reported when the train came to rest. moving: time for which the train moved and faults were
        judged [s].
    """

    found: np.ndarray
    delay: np.ndarray
    late: np.ndarray
    false: np.ndarray
    on: np.ndarray
    moving: np.ndarray


def verdicts(run: Trains, jams: Jams, reported: np.ndarray, after: float = 6.0, *, standing: bool = False) -> Verdicts:
    """Judge what was told (`odometer_fault`, shape (members, samples)), while the trains move, or all the time."""
    t = PERIOD * np.arange(reported.shape[1])
    moving = (run.v[:, :: round(PERIOD / STEP)] > STANDING) | standing
    fault = (reported > 0.5) & moving
    start, end = jams.onset, jams.onset + jams.length
    near = (t >= start[:, None] - 1e-9) & (t <= end[:, None] + GRACE)
    rises = np.diff(fault.astype(int), axis=1, prepend=0) > 0
    found = (rises & near).any(axis=1)  # a detection is of the fault in which it begins
    first = np.argmax(rises & near, axis=1)
    over = ~fault & (t >= end[:, None])
    ended = over.any(axis=1) & moving[np.arange(len(t_over := np.argmax(over, axis=1))), t_over]
    last = np.argmax(~moving, axis=1) - 1
    rest = np.where((~moving).any(axis=1), last, len(t) - 1)
    evaluated = found & (end + ROOM < t[rest])
    return Verdicts(
        found,
        np.where(found, t[first] - start, np.nan),
        np.where(evaluated, np.where(ended, t[t_over] - end, np.inf), np.nan),
        (rises & ~near).sum(axis=1),
        fault[np.arange(len(rest)), rest],
        np.maximum(moving.sum(axis=1) * PERIOD - after, 0.0),
    )


def at_samples(values: np.ndarray) -> np.ndarray:
    """Of what stands every `STEP`, that at the readings."""
    return values[:, :: round(PERIOD / STEP)]


def before_balises(position: np.ndarray, spacing: float = 200.0) -> np.ndarray:
    """Numbers of the last samples before the balises, of one train at its samples, shape (samples,)."""
    return np.flatnonzero(np.diff(np.floor(position / spacing)) > 0)
