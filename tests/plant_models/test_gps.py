"""The satellite positioning receiver: exact where it is ideal, noisy as it says."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from railway_runs import outputs, started

from plant_models.railway.sensors.gps import Gps

GPS = Gps()


def _fixes(preset: str, count: int, seed: float = 1.0, **changes: float) -> np.ndarray:
    """Readings and drifts of a receiver at rest at 100 m, shape (count, 2)."""
    runtime = started(GPS, preset, u0=[100.0, 0.0, 0.0], seed=seed, **changes)
    rows = np.empty((count, 2))
    for k in range(count):
        runtime.advance(0.1 * k)
        rows[k] = runtime.update_outputs()[:2]
    return rows


@given(positions=st.lists(st.floats(-1e5, 1e5), min_size=2, max_size=6))
def test_an_ideal_fix_is_the_position_at_its_instant_and_counted(positions: list[float]) -> None:
    runtime = started(GPS, "ideal", u0=[positions[0], 0.0, 0.0])
    for k, position in enumerate(positions):
        runtime.u[0] = position
        runtime.advance(0.1 * k)
        seen = positions[0] if k == 0 else position  # the first fix is taken at the start itself
        now = outputs(runtime)
        assert (now["reading"], now["gps_position"], now["gps_count"]) == (seen, seen, k + 1.0)
        assert now["gps_time"] == pytest.approx(0.1 * k, abs=1e-12)


def test_a_fix_is_held_until_the_next() -> None:
    runtime = started(GPS, "ideal", u0=[1.0, 0.0, 0.0], sample_offset=0.03)
    seen = []
    for k in range(1, 30):
        runtime.u[0] = 1.0 + k
        runtime.advance(0.01 * k)
        seen.append((outputs(runtime)["reading"], outputs(runtime)["gps_count"]))
    assert seen == [(0.0, 0.0)] * 2 + [(4.0, 1.0)] * 10 + [(14.0, 2.0)] * 10 + [(24.0, 3.0)] * 7


def test_white_noise_is_white_and_of_half_a_metre() -> None:
    error = _fixes("white", 4000)[:, 0] - 100.0
    # Standard errors of 4000 independent numbers: 1.1 % of the deviation, 0.016 of the correlation; four of them.
    assert error.std() == pytest.approx(0.5, rel=0.045)
    assert abs(np.corrcoef(error[:-1], error[1:])[0, 1]) < 0.064


def test_drift_is_a_stationary_gauss_markov_process() -> None:
    drift = _fixes("half_metre", 20000, drift_time=5.0)[:, 1]
    # 20000 fixes hold about 200 independent drifts of 5 s: 5 % of the deviation; three of them.
    assert drift.std() == pytest.approx(0.5, rel=0.15)
    innovations = drift[1:] - np.exp(-0.1 / 5.0) * drift[:-1]
    assert innovations.std() == pytest.approx(0.5 * np.sqrt(1.0 - np.exp(-0.2 / 5.0)), rel=0.02)
    assert abs(np.corrcoef(innovations[:-1], innovations[1:])[0, 1]) < 0.03


def test_the_first_drift_has_its_full_deviation() -> None:
    firsts = np.array([_fixes("half_metre", 1, seed=float(s))[0, 1] for s in range(400)])
    assert firsts.std() == pytest.approx(0.5, rel=0.15)  # 400 numbers: 3.5 %; four of them
    assert abs(firsts.mean()) < 0.1


def test_the_reading_is_position_plus_drift_plus_white_noise() -> None:
    rows = _fixes("half_metre", 2000)
    white, innovations = rows[1:, 0] - rows[1:, 1] - 100.0, rows[1:, 1] - np.exp(-0.1 / 60.0) * rows[:-1, 1]
    assert white.std() == pytest.approx(0.05, rel=0.07)
    assert abs(np.corrcoef(white, innovations)[0, 1]) < 0.09  # two independent noises: 0.022; four of them
    assert rows[:, 1].std() > 0.1


def test_fixes_are_equal_after_a_restore() -> None:
    runtime = started(GPS, u0=[100.0, 0.0, 0.0], seed=3.0)
    runtime.advance(0.35)
    snapshot = runtime.snapshot()
    runtime.advance(1.0)
    first = runtime.update_outputs().copy()
    runtime.restore(snapshot)
    runtime.advance(1.0)
    assert (runtime.update_outputs() == first).all()
