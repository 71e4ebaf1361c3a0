"""Random runs of an observer with a held odometer reading, in a batch, beside a train whose motion is known exactly.

The train is ``dv = u - w1 v - d``, its effort, disturbance and unknown inputs constant over 50 ms each, so that one
matrix exponential moves it. Used by the gallery and by the tests.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy

from fmu_observer import OBSERVERS
from fmu_observer.certificates.bounds import improved_dmo_bound
from fmus import Batch

PIECE = 0.05  # [s]
SAMPLE = 4  # pieces an odometer sample
W1 = 0.04  # [1/s], set C
SLOWEST, FASTEST = 4.0, 45.0  # [m/s]: the train turns round before
WITHIN = 0.98  # of the largest acceleration: what the drag adds within a piece is less than the rest


@dataclass(frozen=True)
class Unknown:
    """What the observer does not know, and its bounds do.

    Args:
        noise: of the reading [m/s]. acceleration: not tracked [m/s2]. jerk_rate: second derivative of the disturbance
            [m/s4]. missing: share of samples that are discarded.
    """

    noise: float = 0.0
    acceleration: float = 0.0
    jerk_rate: float = 0.0
    missing: float = 0.0


@dataclass(frozen=True)
class Worst:
    """Largest share that errors took of each bound, over all runs and instants; NaN for one that was not asked.

    Attributes:
        rows: instants looked at. published: of the i-DMO bound with the error norm of the last sample.
        carried, error, position: of the outputs `carried_bound`, `error_bound`, `position_bound`.
        error_bound: mean of that output [m/s]. carried_bound: mean of that output [m/s].
        largest: largest speed error [m/s].
    """

    rows: int
    published: float
    carried: float
    error: float
    position: float
    error_bound: float
    carried_bound: float
    largest: float


def random_runs(
    preset: str,
    members: int,
    seconds: float = 5.0,
    seed: int = 0,
    unknown: Unknown = Unknown(),
    observer: str = "discrete_measurement_observer",
    xi: float = 1.7,
    lost: str = "held",
) -> Worst:
    """Many short runs; accelerations jump between their limits, or lie anywhere between them.

    Args:
        preset: of the observer, one of set C. members: runs. seconds: length of each. seed: of all that is drawn.
        unknown: inputs that the observer does not know. observer: name. xi: largest acceleration [m/s2].
        lost: option `missing` of the observer.
    """
    rng = np.random.default_rng(seed)
    count = round(seconds / PIECE)
    true, effort, readings, faults = _motions(rng, members, count, unknown, xi)
    system = OBSERVERS[observer](missing=lost)
    batch = Batch(system, members, preset)
    batch.set("internal_step", 5e-3)  # its fourth order leaves 1e-9 m/s at poles of 3 1/s
    reported = {
        "acceleration_max": xi,
        "odometer_error": unknown.noise,
        "unknown_acceleration": unknown.acceleration,
        "unknown_jerk_rate": unknown.jerk_rate,
        "start_position_error": 0.0,
    }
    for name, value in reported.items():
        batch.set(name, value)
    start = true[:, 0]
    batch.set("estimated_speed", start[:, 1] + rng.uniform(-0.5, 0.5, members))
    batch.set("estimated_disturbance", start[:, 2] + rng.uniform(-0.3, 0.3, members))
    batch.set("effort", effort[:, 0])
    batch.set("odometer", readings[:, 0])
    batch.start()
    instants = PIECE * np.arange(1, count + 1)
    for k in range(20, count, 20):  # a balise every second
        batch.notify("balise", np.arange(members), instants[k - 1], balise_position=true[:, k, 0])
    names = ("position", "estimated_speed", "estimated_disturbance", "estimated_disturbance_rate")
    bounds = ("carried_bound", "error_bound", "position_bound", "sample_age")
    # what is sampled at an instant is the input of the step that ends there
    ahead = {"odometer": readings, "odometer_fault": faults}
    inputs = {"effort": effort} | {name: np.roll(values, -1, axis=1) for name, values in ahead.items()}
    taken = batch.run(instants, (*names, *bounds), inputs)
    if batch.failures:
        raise RuntimeError(f"{len(batch.failures)} runs failed: {next(iter(batch.failures.values()))}")
    errors = true[:, :, :4] - taken[:, :, :4]
    carried, reading, position, age = (taken[:, :, 4 + i] for i in range(4))
    speed = np.abs(errors[:, :, 1])
    published = np.nan
    if unknown == Unknown(missing=unknown.missing) and lost == "held":
        norm, beta, m, gain = np.linalg.norm(errors[:, :, 1:], axis=2), *_published(system, preset)
        last = np.arange(count + 1) - np.rint(age / PIECE).astype(int)
        at_sample = np.take_along_axis(norm, last, axis=1)
        published = _share(norm, improved_dmo_bound(age, at_sample, beta, m, gain, xi))
    return Worst(
        rows=speed.size,
        published=published,
        carried=_share(speed, carried),
        error=_share(speed, reading),
        position=_share(np.abs(errors[:, :, 0]), position),
        error_bound=float(reading.mean()),
        carried_bound=float(carried.mean()),
        largest=float(speed.max()),
    )


def _motions(
    rng: np.random.Generator, members: int, count: int, unknown: Unknown, xi: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """States ``[p, v, d, d']`` at each instant, shape (members, count + 1, 4); effort, reading and fault, each of shape
    (members, count + 1).
    """
    moved = _transition()
    state = np.zeros((members, 7))  # p, v, d, d', d'', effort less what is not tracked, 1 for shape
    state[:, 1] = rng.uniform(12.0, 35.0, members)
    state[:, 2], state[:, 3] = rng.uniform(-0.5, 0.5, members), rng.uniform(-0.1, 0.1, members)
    shape = (members, count + 1)
    true, effort, readings, faults = np.empty((*shape, 4)), np.empty(shape), np.empty(shape), np.zeros(shape)
    wanted = np.zeros(members)
    bang = rng.random(members) < 0.5
    usual = WITHIN * xi - unknown.acceleration - 2.0 * PIECE * unknown.jerk_rate
    for k in range(count + 1):
        true[:, k] = state[:, :4]
        drawn = np.where(bang, np.sign(rng.uniform(-1.0, 1.0, members)), rng.uniform(-1.0, 1.0, members))
        change = rng.random(members) < 0.3
        wanted = np.where(change, usual * drawn, wanted)
        wanted = np.where(state[:, 1] < SLOWEST, usual, np.where(state[:, 1] > FASTEST, -usual, wanted))
        effort[:, k] = wanted + W1 * state[:, 1] + state[:, 2]
        state[:, 4] = unknown.jerk_rate * np.sign(rng.uniform(-1.0, 1.0, members))
        # the rate of the disturbance stays within what the effort of a piece leaves
        state[:, 4] = np.where(np.abs(state[:, 3]) > 0.2, -np.sign(state[:, 3]) * unknown.jerk_rate, state[:, 4])
        state[:, 5] = effort[:, k] + unknown.acceleration * np.sign(rng.uniform(-1.0, 1.0, members))
        noise = np.where(bang, np.sign(rng.uniform(-1.0, 1.0, members)), rng.uniform(-1.0, 1.0, members))
        readings[:, k] = state[:, 1] + unknown.noise * noise
        if k % SAMPLE == 0 and k > 0:
            faults[:, k] = rng.random(members) < unknown.missing
            readings[:, k] = np.where(faults[:, k] > 0.0, rng.uniform(0.0, 60.0, members), readings[:, k])
        state = state @ moved.T
    return true, effort, readings, faults


def _transition() -> np.ndarray:
    A = np.zeros((7, 7))
    A[0, 1], A[1, 1], A[1, 2], A[1, 5], A[2, 3], A[3, 4] = 1.0, -W1, -1.0, 1.0, 1.0, 1.0
    return np.asarray(scipy.linalg.expm(A * PIECE))


def _published(system: object, preset: str) -> tuple[float, float, float]:
    bounds = system.error_bounds(preset=preset)  # type: ignore[attr-defined]
    return bounds.beta, bounds.m, bounds.gain


def _share(error: np.ndarray, bound: np.ndarray) -> float:
    """Largest share, where errors are more than the observer's integration makes."""
    return float((np.maximum(error - 1e-7, 0.0) / np.maximum(bound, 1e-12)).max())
