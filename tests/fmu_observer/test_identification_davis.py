"""Davis coefficients from acceleration runs: against SciPy, exact data and published sets; intervals by Monte Carlo."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from fmu_observer.identification import identify_davis, identify_davis_from_acceleration
from fmu_observer.identification.acceleration_run import PARAMETERS, speeds_and_sensitivities
from fmu_observer.identification.davis_estimate import IdentificationError
from fmu_observer.identification.output_error import fit_runs

Array = NDArray[np.float64]

SETS = {  # (2.2) and Table 5.1, by mass: w0, w1, w2 and an effort that accelerates to some speed
    "A": (0.01, 0.1, 0.001, 3.0),
    "B": (0.02, 0.003, -0.00024, 1.0),
    "C": (0.0852, 0.04, -5e-5, 1.5),
    "LoA": (0.46, 5.7e-3, -2.4e-4, 1.2),
    "BaA": (0.35, 3e-3, -1e-4, 1.2),
    "EBA": (0.25, 5e-3, -2e-4, 1.2),
}
TIME = np.linspace(0.0, 50.0, 500)
LOA = np.array([1.2 - 0.46, 5.7e-3, -2.4e-4, 5.5])
NOISE = 0.02


def run_of(parameters: Array, time: Array = TIME, forcing: Array | None = None) -> Array:
    """Speeds by SciPy, in a formulation that shares nothing with the package."""

    def rate(t: float, v: Array) -> Array:
        known = 0.0 if forcing is None else np.interp(t, time, forcing)
        return np.asarray(parameters[0] + known - parameters[1] * v - parameters[2] * v**2)

    options: dict[str, Any] = {
        "method": "DOP853",
        "rtol": 1e-12,
        "atol": 1e-12,
        "max_step": np.inf if forcing is None else 0.1,
    }
    return np.asarray(solve_ivp(rate, (time[0], time[-1]), [parameters[3]], t_eval=time, **options).y[0])


def test_speeds_are_those_of_scipy_and_sensitivities_those_of_differences() -> None:
    found = speeds_and_sensitivities(TIME, LOA[:, None])[:, 0]
    assert found[0] == pytest.approx(run_of(LOA), abs=1e-8)
    for i in range(len(PARAMETERS)):
        step = np.zeros(4)
        step[i] = 1e-5 * (1.0 if LOA[i] == 0.0 else abs(LOA[i]))
        change = run_of(LOA + step) - run_of(LOA - step)
        assert found[1 + i] == pytest.approx(change / (2 * step[i]), rel=1e-3, abs=1e-4 * np.abs(found[1 + i]).max())


@pytest.mark.parametrize("name", SETS)
def test_exact_data_give_back_every_set(name: str) -> None:
    w0, w1, w2, effort = SETS[name]
    speeds = run_of(np.array([effort - w0, w1, w2, 4.0]))
    found = identify_davis(TIME, speeds, effort=effort, mass=1.0)
    assert [c.value for c in found.coefficients] == pytest.approx([effort - w0, w0, w1, w2], rel=1e-5)
    assert found.identified


def test_a_coasting_train_and_an_effort_that_changes_tell_the_constant_part() -> None:
    coasting = run_of(np.array([-0.1, 2e-3, 2e-4, 40.0]))
    found = identify_davis(TIME, coasting, effort=0.0, mass=80e3)
    assert found.davis_a is not None
    assert [c.value for c in found.coefficients[1:]] == pytest.approx([8e3, 160.0, 16.0], rel=1e-4)
    effort = np.interp(TIME, [0.0, 20.0, 30.0, 50.0], [1.0, 1.0, 0.2, 0.2])
    driven = identify_davis(TIME, run_of(np.array([-0.1, 2e-3, 2e-4, 5.5]), forcing=effort), effort=effort, mass=1.0)
    assert [c.value for c in driven.coefficients[1:]] == pytest.approx([0.1, 2e-3, 2e-4], rel=1e-3)


def covered(speeds: Array, *levels: float) -> Array:
    """Shares of runs whose intervals hold the true parameters, a row for each level."""
    fits = fit_runs(TIME, speeds)
    assert fits.converged.all()
    errors = np.abs(fits.parameters - LOA[:, None])
    return np.array([np.mean(errors < fits.half_widths(level), axis=1) for level in levels])


def test_intervals_cover_as_often_as_they_say() -> None:
    """600 runs; 93 to 97 % is two standard deviations of a binomial share of 95 %."""
    speeds = run_of(LOA) + NOISE * np.random.default_rng(3).standard_normal((600, len(TIME)))
    usual, half = covered(speeds, 0.95, 0.5)
    assert np.all((usual > 0.93) & (usual < 0.97))
    assert np.all((half > 0.45) & (half < 0.55))


def test_intervals_cover_where_the_sensor_has_a_memory() -> None:
    """Noise of first order, as a filter leaves it: too narrow by half if it were taken for white."""
    rng = np.random.default_rng(4)
    noise = np.zeros((400, len(TIME)))
    for k in range(1, len(TIME)):
        noise[:, k] = 0.6 * noise[:, k - 1] + NOISE * rng.standard_normal(400)
    shares = covered(run_of(LOA) + noise, 0.95)
    assert np.all((shares > 0.92) & (shares < 0.98))


def test_regression_on_accelerations_as_in_the_thesis() -> None:
    """Conditions of an independent check that gave w = (0.459, 5.80e-3, -2.415e-4): both are within the intervals of
    what is drawn here, and the true set is in 95 % of 400 drawings.
    """
    w0, w1, w2, effort = SETS["LoA"]
    speeds = np.linspace(5.0, 45.0, 801)[1:]
    exact = effort - (w0 + w1 * speeds + w2 * speeds**2)
    rng = np.random.default_rng(5)
    hits = []
    for _ in range(400):
        drawn = exact + NOISE * rng.standard_normal(len(speeds))
        found = identify_davis_from_acceleration(speeds, drawn, effort=effort, mass=1.0)
        inside = [c.low < true < c.high for c, true in zip(found.coefficients[1:], (w0, w1, w2), strict=True)]
        hits.append(inside)
    assert np.all(np.abs(np.mean(hits, axis=0) - 0.95) < 0.03)
    ours, theirs = found.coefficients[1:], (0.459, 5.80e-3, -2.415e-4)
    assert all(abs(c.value - other) < 3.0 * c.half_width for c, other in zip(ours, theirs, strict=True))


def test_a_narrow_run_says_what_cannot_be_told_and_which_run_would_do() -> None:
    rng = np.random.default_rng(6)
    part = slice(200, 300)
    speeds = run_of(LOA) + NOISE * rng.standard_normal(len(TIME))
    found = identify_davis(TIME[part], speeds[part])
    assert [c.identified for c in found.coefficients] == [False, False, False]
    told = found.remarks[-1]
    assert "Cannot be identified" in told
    assert "nearly the same curve" in told
    proposed = float(told.split("from 5 to ")[1].split(" m/s")[0])
    long = np.linspace(0.0, 90.0, 900)
    wide = run_of(LOA, long) + NOISE * rng.standard_normal(len(long))
    assert identify_davis(long[wide < proposed], wide[wide < proposed]).identified
    assert "# not identified" in found.toml()


def test_only_the_difference_of_effort_and_constant_part_shows() -> None:
    speeds = run_of(LOA)
    blind = identify_davis(TIME, speeds)
    assert blind.davis_a is None
    assert blind.net_acceleration.value == pytest.approx(0.74, rel=1e-6)
    assert "effort/mass - w0 = 0.74 m/s2" in blind.remarks[0]
    heavy = identify_davis(TIME, speeds, effort=1.2 * 40e3, mass=40e3)
    assert heavy.davis_a is not None
    assert heavy.davis_a.value == pytest.approx(0.46 * 40e3, rel=1e-5)
    assert "each per mille of rise reads as 392 N" in heavy.remarks[0]
    assert heavy.resistance(np.array([17.0])) == pytest.approx([0.48754 * 40e3], rel=1e-4)


def test_what_the_model_does_not_say_is_remarked() -> None:
    wrong = run_of(LOA, forcing=np.where(TIME > 25.0, 0.2, 0.0)) + 0.01 * np.random.default_rng(7).standard_normal(500)
    found = identify_davis(TIME, wrong)
    assert any("Neighbouring residuals are alike" in remark for remark in found.remarks)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"speed": np.zeros(500)}, "No sample is above 5 m/s"),
        ({"speed": np.full(500, 20.0)}, "Nothing accelerates"),
        ({"speed": np.where(TIME[7] == TIME, np.nan, 20.0)}, "sample 8"),
        ({"time": TIME[:10], "speed": np.linspace(6.0, 12.0, 10)}, "Only 10 samples"),
        ({"time": TIME[::-1]}, "does not increase"),
        ({"time": TIME[:-1]}, "equal length"),
        ({"effort": 60e3}, "needs the mass"),
        ({"effort": [1.0, 2.0], "mass": 1.0}, "one finite number or 500"),
        ({"mass": -1.0}, "expected a number above 0"),
        ({"level": 95.0}, "between 0 and 1"),
        ({"resolution": 0.0}, "above 0"),
    ],
)
def test_bad_input_is_told_in_words(change: dict[str, Any], message: str) -> None:
    given: dict[str, Any] = {"time": TIME, "speed": run_of(LOA)} | change
    with pytest.raises(IdentificationError, match=message):
        identify_davis(given.pop("time"), given.pop("speed"), **given)
