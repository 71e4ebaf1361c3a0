"""Recordings of the drive, and filters replayed over them, for the scripts beside this file.

A recording is one run of the scenario ``traction_drive``: 1 s, 10 001 samples, noise of one seed.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cache

import numpy as np

import cosim
from cosim.run.outcome import Outcome
from cosim.studies.replay import Replay
from fmu_observer.observers.motors.motor_ekf import ROWS

SEEDS = tuple(range(10))
STATES = ("current_d", "current_q", "speed", "angle")


@cache
def recording(seed: int) -> Outcome:
    """One run of the drive with sensors, the filter beside it.

    Args:
        seed: of the noise of the motor.

    Returns:
        The outcome.
    """
    scenario = cosim.Scenario.load("traction_drive").set("motor.seed", float(seed))
    return scenario.run()


@cache
def replay(seed: int) -> Replay:
    """The filter of one recording, ready to be run again.

    Args:
        seed: of the noise of the motor.
    """
    return Replay(recording(seed), "filter")


def errors(seed: int, candidates: np.ndarray, states: Sequence[str] = STATES) -> np.ndarray:
    """Mean square errors of filters with given covariances over one recording.

    Args:
        seed: of the recording.
        candidates: variances per sample of current d, current q, speed, angle, and of both measured currents, shape
            (members, 6).
        states: of which errors are taken.

    Returns:
        Mean squares [A2, A2, rad2/s2, rad2], shape (members, len(states)); the start is left out.
    """
    parameters = {"process_variance": candidates[:, :4], "measurement_variance": candidates[:, 4:]}
    reported = replay(seed).run(states, parameters, members=len(candidates))
    true = np.stack([recording(seed)[f"motor.{state}"] for state in states], axis=1)
    return np.asarray(np.mean((reported - true)[:, 1:] ** 2, axis=1))


def current_cost(seed: int, candidates: np.ndarray) -> np.ndarray:
    """The cost of the tables: mean square errors of both currents, added [A2], shape (members,).

    Args:
        seed: of the recording. candidates: as for `errors`.
    """
    return errors(seed, candidates, STATES[:2]).sum(axis=1)


def of_rows(rows: Sequence[str]) -> np.ndarray:
    """Printed rows as candidates, shape (rows, 6).

    Args:
        rows: names in `ROWS`.
    """
    table: Mapping[str, Sequence[float]] = ROWS
    return np.array([table[row] for row in rows])


def drive(seed: int, **changes: object) -> cosim.Scenario:
    """The scenario of the recordings with other values.

    Args:
        seed: of the noise of the motor. changes: values by name, ``__`` in place of the point.
    """
    scenario = cosim.Scenario.load("traction_drive").set("motor.seed", float(seed))
    for name, value in changes.items():
        scenario.set(name.replace("__", "."), value)
    return scenario


def in_run(scenario: cosim.Scenario, observer: str = "filter") -> np.ndarray:
    """Mean square errors of the observer that ran beside the motor.

    Args:
        scenario: with a component ``motor``. observer: name of the component.

    Returns:
        Of both currents together [A2], speed [rad2/s2] and angle [rad2], shape (3,); the start is left out.
    """
    outcome = scenario.run()
    squares = [np.mean((outcome[f"{observer}.{s}"] - outcome[f"motor.{s}"])[1:] ** 2) for s in STATES]
    return np.array([squares[0] + squares[1], *squares[2:]])
