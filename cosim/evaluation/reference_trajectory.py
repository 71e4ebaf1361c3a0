"""The trajectory that a recording was most likely made on: odometer and balises smoothed over the whole run. Touches no
files.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cosim.errors import ScenarioError
from fmu_observer.formulas.filtering.covariance_consistency import Consistency, evaluate
from fmu_observer.formulas.filtering.kalman import integrated_noise
from fmu_observer.formulas.filtering.smoothing import extended_pass, smooth

JERK = 0.1  # spectral density of the train's jerk [m2/s5] [ours]
SCALE = 0.02  # how far the odometer's wheel radius may be off, relative [1] [ours]
_DRIFT = 1e-7  # spectral density of that [1/s] [ours]
GATE = 5.0  # standard deviations beyond which a reading is taken for a slip
SLIP = 1.0  # how far a reading may be off what the train can have reached, however uncertain that is [m/s] [ours]
HELD = 0.5  # share of repeated readings from which on the odometer is taken to be held between samples
SIGNALS = {
    "position": ("m", "Position of the train"),
    "speed": ("m/s", "Speed of the train"),
    "acceleration": ("m/s2", "Acceleration of the train"),
    "odometer_scale": ("1", "Relative error of the odometer"),
}


@dataclass(frozen=True)
class ReferenceTrajectory:
    """What is known of a run after its end.

    Attributes:
        time: instants of odometer readings and balises [s], shape (N,).
        values: position [m], speed [m/s], acceleration [m/s2], relative error of the odometer [1], shape (N, 4).
        deviations: of them, shape (N, 4).
        readings: odometer readings used. left_out: those beyond the gate, slips. balises: telegrams used.
        found: whether noises and jerk were of the size assumed, by the normalised innovations.
    """

    time: np.ndarray
    values: np.ndarray
    deviations: np.ndarray
    readings: int
    left_out: int
    balises: int
    found: Consistency


def sampled_rows(time: np.ndarray, odometer: np.ndarray) -> np.ndarray:
    """Rows at which an odometer was read: all instants, or those with a new value where most readings repeat the last.

    Args:
        time: [s], shape (rows,), never falling. odometer: readings [m/s], shape (rows,).

    Returns:
        Numbers of rows.
    """
    rows = np.flatnonzero(np.append(np.diff(time) > 0.0, True) & np.isfinite(odometer))
    new = np.append(True, np.diff(odometer[rows]) != 0.0)
    return rows[new] if len(rows) and np.mean(~new) > HELD else rows


def reference_trajectory(
    time: np.ndarray,
    odometer: np.ndarray,
    stamps: np.ndarray,
    positions: np.ndarray,
    *,
    odometer_std: float,
    balise_std: float | np.ndarray,
    jerk_density: float = JERK,
    scale_std: float = SCALE,
    gate: float = GATE,
    slip: float = SLIP,
) -> ReferenceTrajectory:
    """Smooth odometer readings and balise passings by a train whose jerk is white noise.

    States are position, speed, acceleration and the relative error s of the odometer, which reads ``(1 + s) v``.
    Readings beyond the gate, in slip or with a blocked wheel, are left out; telegrams never are. After a slip that
    lasts, the next balises say how fast the train has become.

    Args:
        time: of the odometer readings [s], rising, shape (rows,). odometer: readings [m/s], shape (rows,).
        stamps: when balises were passed [s], shape (k,). positions: theirs [m], shape (k,).
        odometer_std: standard deviation of a reading [m/s]. balise_std: of a balise's position [m], one or shape (k,).
        jerk_density: spectral density of the jerk [m2/s5]. scale_std: of s at the start [1].
        gate: in standard deviations. slip: the same as a speed [m/s]; the nearer of the two counts.

    Returns:
        The trajectory at all instants of readings and passings.

    Raises:
        ScenarioError: too few readings, no balise, or a number that is not positive.
    """
    _check(len(time), len(stamps), odometer_std, balise_std, jerk_density, scale_std)
    instants, samples = _samples(time, odometer, stamps, positions)
    R = _covariances(instants, stamps, odometer_std, balise_std)
    steps = np.diff(instants)
    first = float(odometer[0])
    run = float(np.ptp(instants)) * max(float(np.abs(odometer).max()), 1.0)
    back = float(positions[0]) - float(np.trapezoid(np.where(time <= stamps[0], odometer, 0.0), time))
    start = np.array([back, first, 0.0, 0.0])
    P = np.diag([run**2, max(first**2, 1.0), 1.0, scale_std**2])
    passed = extended_pass(
        start,
        P,
        lambda k, x: _moved(x, steps[k]),
        np.stack([_process(dt, jerk_density) for dt in steps]),
        lambda _, x: _seen(x),
        R,
        samples,
        np.array([gate, np.inf]),
        np.array([slip, np.inf]),
    )
    smoothed = smooth(passed)
    used = int(passed.degrees.sum())
    balises = int(np.count_nonzero(np.isfinite(samples[:, 1])))
    known = ~np.isnan(passed.nis)
    found = evaluate(passed.nis[known][3:], passed.degrees[known][3:].astype(float), white=True)
    there = int(np.isfinite(samples).sum())
    return ReferenceTrajectory(
        instants, smoothed.estimates, smoothed.deviations, len(time), there - used, balises, found
    )


def _check(
    readings: int,
    balises: int,
    odometer_std: float,
    balise_std: float | np.ndarray,
    jerk_density: float,
    scale_std: float,
) -> None:
    """Refuse what no trajectory follows from."""
    for name, number in {"odometer_std": odometer_std, "jerk_density": jerk_density, "scale_std": scale_std}.items():
        if not number > 0.0:
            raise ScenarioError(f"{name} = {number:g}; expected a positive number.")
    if not np.all(np.asarray(balise_std) > 0.0):
        raise ScenarioError("balise_std holds a number that is not positive; expected metres above zero.")
    if readings < 3 or not balises:
        raise ScenarioError(
            f"there are {readings} odometer readings and {balises} balises; a trajectory needs 3 and 1 at least."
        )


def _samples(
    time: np.ndarray, odometer: np.ndarray, stamps: np.ndarray, positions: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """All instants, shape (n,), and reading and position at each, NaN where there is none, shape (n, 2)."""
    instants = np.union1d(time, stamps)
    samples = np.full((len(instants), 2), np.nan)
    samples[np.searchsorted(instants, time), 0] = odometer
    samples[np.searchsorted(instants, stamps), 1] = positions
    return instants, samples


def _covariances(
    instants: np.ndarray, stamps: np.ndarray, odometer_std: float, balise_std: float | np.ndarray
) -> np.ndarray:
    """Of reading and position at all instants, shape (n, 2, 2)."""
    spreads = np.full(len(instants), 1.0)
    spreads[np.searchsorted(instants, stamps)] = balise_std
    R = np.zeros((len(instants), 2, 2))
    R[:, 0, 0], R[:, 1, 1] = odometer_std**2, spreads**2
    return R


def _moved(x: np.ndarray, dt: float) -> tuple[np.ndarray, np.ndarray]:
    F = np.eye(4)
    F[0, 1], F[0, 2], F[1, 2] = dt, 0.5 * dt**2, dt
    return F @ x, F


def _process(dt: float, density: float) -> np.ndarray:
    """Covariance of integrated white jerk over a step, and of the drift of the odometer."""
    Q = np.zeros((4, 4))
    Q[:3, :3] = integrated_noise(3, dt, density)
    Q[3, 3] = _DRIFT * dt
    return Q


def _seen(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Odometer reading and position, with their Jacobian."""
    return np.array([(1.0 + x[3]) * x[1], x[0]]), np.array([[0.0, 1.0 + x[3], 0.0, x[1]], [1.0, 0.0, 0.0, 0.0]])
