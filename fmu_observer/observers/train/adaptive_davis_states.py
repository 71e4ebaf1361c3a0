"""How `adaptive_davis` lays out its states: what flows, and what is kept from sample to sample. Data and places."""

from __future__ import annotations

import numpy as np

from fmu_observer.observers.adaptation_at_samples import AtSample, Since, first_covariance
from fmu_observer.observers.adaptive_law import Sizes, packed, unpacked, upper
from fmu_observer.observers.train.train_observer import POSITION, SPEED
from plant_models.hybrid import memory, state
from plant_models.hybrid.system import Array

SIZES = Sizes(2, 3, 2, sampled=True)
SCALE = 30.0  # [m/s]: constants are what each term of the resistance is at this speed [m/s2]
FIRST_GAIN = 1.0  # [ours], of R
PRIOR = (100.0, 5.0, 0.02, 0.02, 0.02)  # standard deviations at the start [m], [m/s], [m/s2] three times [ours]
FIRST = first_covariance(PRIOR, SIZES)
STATES = (
    POSITION,
    SPEED,
    state("sensitivity", "1", (0.0,) * 6, "Sensitivity lambda of position and speed, row by row", size=6),
    state("inverse_s", "1", (1.0, 0.0, 1.0), "Inverse of S, upper triangle row by row", size=3),
    state("elapsed", "s", 0.0, "Time since the last sample"),
    state("decay", "1", (1.0, 0.0, 0.0, 1.0), "What is left of a sampled innovation, row by row", size=4),
    state("fade", "s", (0.0,) * 3, "Integral of its Gramian, upper triangle row by row", size=3),
    state("own_transition", "1", (0.0, 1.0), "Transition of an error of speed since the last sample", size=2),
    state("forced_transition", "1", (0.0,) * 4, "Transition of a sampled innovation, row by row", size=4),
    state("gathered_noise", "1", (0.0,) * 3, "Covariance of noise since the last sample, upper triangle", size=3),
    memory("corrections", "m/s2", (0.0,) * 3, f"Corrections of a, b, c, at {SCALE:g} m/s", size=3),
    memory("sampled_innovation", "m/s", (0.0,) * 2, "Innovation of balise (weighed) and odometer", size=2),
    memory(
        "adaptation_gain",
        "1",
        tuple(FIRST_GAIN * (i == j) for i, j in upper(3)),
        "Adaptation gain R, upper triangle row by row",
        size=6,
    ),
    memory("seen_sensitivity", "1", (0.0,) * 6, "Sensitivity chi of the innovation, row by row", size=6),
    memory("mean_excitation", "1", (0.0,) * 6, "Mean Gramian of the excitation, upper triangle", size=6),
    memory(
        "error_covariance",
        "1",
        tuple(float(FIRST[i, j]) for i, j in upper(SIZES.error)),
        "Covariance of the errors, upper triangle row by row",
        size=len(upper(SIZES.error)),
    ),
    memory("learnt", "1", (0.0,) * 3, "1 for each coefficient that is learnt until the next sample", size=3),
    memory("samples_used", "1", (0.0,) * 2, "Balises and readings used so far", size=2),
    memory("last_innovation", "m", 0.0, "Position error seen at the last balise"),
    memory("last_reading", "m/s", 0.0, "Last reading of the odometer that was not missing"),
)
ENDS = np.cumsum([0, *(s.width for s in STATES)])
PLACES = {s.name: slice(int(a), int(b)) for s, a, b in zip(STATES, ENDS[:-1], ENDS[1:], strict=True)}


def of_state(x: Array, name: str) -> Array:
    """Values of a state, shape (its size,).

    Args:
        x: state of the observer. name: of the state.
    """
    return x[PLACES[name]]


def sensitivity_of(x: Array) -> Array:
    """Sensitivity lambda of position and speed, shape (2, 3).

    Args:
        x: state of the observer.
    """
    return _rows(of_state(x, "sensitivity"))


def parts_of(x: Array) -> tuple[AtSample, Since]:
    """What was known at the last sample, and what has happened since.

    Args:
        x: state of the observer.
    """
    one, two = entries(of_state(x, "own_transition"))
    return (
        AtSample(
            of_state(x, "corrections"),
            of_state(x, "sampled_innovation"),
            unpacked(of_state(x, "adaptation_gain"), 3),
            _rows(of_state(x, "seen_sensitivity")),
            unpacked(of_state(x, "mean_excitation"), 3),
            unpacked(of_state(x, "error_covariance"), SIZES.error),
            of_state(x, "learnt"),
        ),
        Since(
            of_state(x, "elapsed")[0],
            _rows(of_state(x, "decay")),
            unpacked(of_state(x, "fade"), 2),
            np.vstack([np.hstack([1.0, one]), np.hstack([0.0, two])]),
            _rows(of_state(x, "forced_transition")),
            unpacked(of_state(x, "gathered_noise"), 2),
        ),
    )


def moving_values(since: Since) -> list[Array]:
    """Entries of a `Since` in the order of the states.

    Args:
        since: values, or derivatives.
    """
    return [
        since.elapsed,
        *(since.decay[i, j] for i in range(2) for j in range(2)),
        *entries(packed(since.fade, 2)),
        since.own[0, 1],
        since.own[1, 1],
        *(since.forced[i, j] for i in range(2) for j in range(2)),
        *entries(packed(since.noise, 2)),
    ]


def just_sampled() -> list[Array]:
    """The same at a sample."""
    none = np.zeros((2, 2))
    return moving_values(Since(0.0, np.eye(2), none, np.eye(2), none, none))


def entries(values: Array) -> list[Array]:
    """Its numbers as a list.

    Args:
        values: shape (k,).
    """
    return [values[i] for i in range(len(values))]


def _rows(values: Array) -> Array:
    """A matrix of two rows."""
    width = len(values) // 2
    return np.vstack([np.hstack(entries(values)[i * width : (i + 1) * width]) for i in range(2)])
