"""States of `adaptive_davis`: what flows, and what is kept from sample to sample."""

from __future__ import annotations

from typing import Any

import numpy as np

from fmu_observer.formulas.adaptation.adaptive_law import Sizes
from fmu_observer.observers.train.train_signals import LAST_INNOVATION, POSITION, SPEED
from plant_models.hybrid import memory, state

SIZES = Sizes(2, 3, 2, sampled=True)
SCALE = 30.0  # [m/s]: constants are what each term of the resistance is at this speed [m/s2]
FIRST_GAIN = 1.0  # [ours], of R
PRIOR = (100.0, 5.0, 0.02, 0.02, 0.02)  # standard deviations at the start [m], [m/s], [m/s2] three times [ours]
FIRST = np.diag([*np.square(PRIOR), *([0.0] * SIZES.q)])  # where c and lambda are zero
_UPPER = "upper triangle row by row"


def _symmetric(size: int) -> dict[str, Any]:
    return {"shape": (size, size), "symmetric": True}


STATES = (
    POSITION,
    SPEED,
    state("sensitivity", "1", 0.0, "Sensitivity lambda of position and speed, row by row", shape=(2, 3)),
    state("inverse_s", "1", np.eye(2), f"Inverse of S, {_UPPER}", **_symmetric(2)),
    state("elapsed", "s", 0.0, "Time since the last sample"),
    state("decay", "1", np.eye(2), "What is left of a sampled innovation, row by row", shape=(2, 2)),
    state("fade", "s", 0.0, f"Integral of its Gramian, {_UPPER}", **_symmetric(2)),
    state("own_transition", "1", (0.0, 1.0), "Transition of an error of speed since the last sample", size=2),
    state("forced_transition", "1", 0.0, "Transition of a sampled innovation, row by row", shape=(2, 2)),
    state("gathered_noise", "1", 0.0, "Covariance of noise since the last sample, upper triangle", **_symmetric(2)),
    memory("corrections", "m/s2", 0.0, f"Corrections of a, b, c, at {SCALE:g} m/s", size=3),
    memory("sampled_innovation", "m/s", 0.0, "Innovation of balise (weighed) and odometer", size=2),
    memory("adaptation_gain", "1", FIRST_GAIN * np.eye(3), f"Adaptation gain R, {_UPPER}", **_symmetric(3)),
    memory("seen_sensitivity", "1", 0.0, "Sensitivity chi of the innovation, row by row", shape=(2, 3)),
    memory("mean_excitation", "1", 0.0, "Mean Gramian of the excitation, upper triangle", **_symmetric(3)),
    memory("error_covariance", "1", FIRST, f"Covariance of the errors, {_UPPER}", **_symmetric(SIZES.error)),
    memory("learnt", "1", 0.0, "1 for each coefficient that is learnt until the next sample", size=3),
    memory("samples_used", "1", 0.0, "Balises and readings used so far", size=2),
    LAST_INNOVATION,
    memory("last_reading", "m/s", 0.0, "Last reading of the odometer that was not missing"),
)
