"""Records of a wheel for training: changes from reading to reading of braking and, mirrored, of pulling trains, whose
odometer's wheel rolls, begins to be wrong, or takes up rolling again.

Used by the gallery and by the tests, which train again what ships.
"""

from __future__ import annotations

import numpy as np
from shared.jam_runs import CASES, random_jams, readings, trains

from fmu_observer.detection.wheel_signature import DROP, RISE, STEADY
from fmu_observer.formulas.signatures.classification import PencilSpace, SignatureClassifier, train_classifier

CHANGES = 4  # in a record
LENGTHS = (0.2, 0.4, 0.6, 1.0, 2.0, 3.0)  # [s]
DEPTHS = (0.05, 0.1, 0.2, 0.5, 1.0)
LEAST = 0.6  # [m/s]: a smaller change of one reading is no example of a fault
NOISE, TRAINING_SEED, MEMBERS = 0.05, 1, 60
QUANTITIES = ("max_xi", "min_xi", "max_eta", "min_eta", "mean_xi", "mean_eta", "range_xi", "range_eta")
SPACE = PencilSpace((2, 3), QUANTITIES, (0.1, 1.0, 10.0), margin=0.005, draws=60)


def records(seed: int, noise: float = NOISE, members: int = MEMBERS) -> tuple[np.ndarray, list[str]]:
    """Changes of speed [m/s], the newest last, shape (CHANGES, n), and the class of each record.

    Args:
        seed: of trains, jams and noise. noise: of a reading [m/s]. members: trains a case.
    """
    rng = np.random.default_rng(seed)
    found, labels = list[np.ndarray](), list[str]()
    for case in CASES.values():
        run = trains(case, members, rng)
        jams = random_jams(rng, members, case, LENGTHS, DEPTHS)
        noisy, rolling = readings(run, jams, noise, rng, True), readings(run, None, 0.0, rng, True)
        wrong = np.diff(readings(run, jams, 0.0, rng, True) - rolling, axis=1)
        windows = np.lib.stride_tricks.sliding_window_view(np.diff(noisy, axis=1), CHANGES, axis=1)
        added = np.lib.stride_tricks.sliding_window_view(wrong, CHANGES, axis=1)
        before = (np.abs(added[..., :-1]).max(axis=-1) < 1e-9) & (rolling[:, CHANGES:] > 0.5)
        last = added[..., -1]
        for label, mask in ((STEADY, np.abs(last) < 1e-9), (DROP, last < -LEAST), (RISE, last > LEAST)):
            picked = np.argwhere(mask & before)
            if label == STEADY:
                picked = picked[rng.choice(len(picked), min(400, len(picked)), replace=False)]
            found.append(windows[tuple(picked.T)])
            labels += [label] * len(picked)
    together = np.concatenate(found)
    mirrored = [{DROP: RISE, RISE: DROP}.get(label, label) for label in labels]
    return np.concatenate([together, -together]).T, labels + mirrored


def trained() -> SignatureClassifier:
    """What `wheel_classes` holds, trained again."""
    return train_classifier(*records(TRAINING_SEED), SPACE)
