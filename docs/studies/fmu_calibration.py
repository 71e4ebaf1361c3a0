"""How often the confidence regions of a calibrated sealed FMU hold the true mass and Davis coefficients.

`python docs/studies/fmu_calibration.py` prints the table of `docs/reference/fmu_as_model.md`: one FMU, one instance,
500 recordings that differ by their noise. A minute of one core.
"""

from __future__ import annotations

import os
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

import fmus
from cosim.calibration.fitting import calibrate
from cosim.calibration.fmu_runs import FmuRuns
from cosim.calibration.recorded_signals import RecordedSignals
from plant_models import PLANTS

RECORDINGS = 500
LEVEL, NOISE = 0.95, 0.05  # [m/s]
TRUE = {"mass": 80e3, "davis_a": 1800.0, "davis_b": 80.0, "davis_c": 7.0}
GUESS = {"mass": 76e3, "davis_a": 1600.0, "davis_b": 90.0, "davis_c": 6.0}
KNOWN = {"traction_coefficient": 1.0, "brake_coefficient": 1.0, "internal_step": 0.1, "train_speed": 3.0}
TIME = np.arange(0.0, 200.5, 1.0)
EFFORT = np.where(TIME < 80, 60e3, np.where(TIME < 140, 0.0, np.where(TIME < 180, 40e3, -20e3)))
"""Traction, coasting, traction, brake: mass and resistance act differently in each."""


def coverage(recordings: int) -> dict[str, float]:
    """Shares of recordings whose region, and whose interval of each parameter, hold the true values.

    Args:
        recordings: how many.
    """
    truth, inside = np.array(list(TRUE.values())), np.zeros(1 + len(TRUE))
    with TemporaryDirectory() as folder:
        path = fmus.build_fmu(PLANTS["longitudinal_train"](), Path(folder) / "line.fmu", fmi_version=3)
        runs = FmuRuns(path, list(TRUE), fixed=KNOWN, guesses=GUESS)
        speed = runs.run(TRUE, _recorded(np.zeros_like(TIME)))[0]
        for k in range(recordings):
            noise = NOISE * np.random.default_rng([2026, k]).standard_normal(len(TIME))
            fit = calibrate(runs, _recorded(speed + noise), level=LEVEL).fit
            inside[0] += fit.covers(truth, LEVEL)
            inside[1:] += np.abs(fit.parameters - truth) <= fit.half_widths(LEVEL)
        runs.close()
    return dict(zip(("joint region", *TRUE), (inside / recordings).tolist(), strict=True))


def _recorded(speed: np.ndarray) -> RecordedSignals:
    return RecordedSignals(TIME, {"speed": speed}, {"effort": EFFORT}, {"speed": "m/s"})


def main() -> None:
    """Print the table."""
    for name, share in coverage(RECORDINGS).items():
        print(f"{name:<14}{100.0 * share:6.1f} %")
    print(f"{sum(os.times()[:4]):.0f} s")  # of this process and the one of the FMU


if __name__ == "__main__":
    main()
