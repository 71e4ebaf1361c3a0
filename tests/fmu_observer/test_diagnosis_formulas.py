"""Filters, windows, alarms, redundancy and window inversion: the formulas of fault detection against closed forms."""

import numpy as np
import pytest
import scipy

from fmu_observer.formulas.diagnosis.actuator import _ActuatorParameters, identified_actuator
from fmu_observer.formulas.diagnosis.redundancy import larger
from fmu_observer.formulas.diagnosis.residual_filters import filtered, residual_filter, settled
from fmu_observer.formulas.diagnosis.window_inversion import (
    Alarm,
    evaluate,
    grid_around,
    invert,
    smoothed,
    windowed_square,
)

ROUNDING = 1e-12  # relative, of some tens of operations


@pytest.mark.parametrize(("order", "tau"), [(0, 0.06), (1, 0.06), (2, 0.06), (2, 0.6), (1, 0.01)])
def test_filters_are_tustins_of_scipy(order: int, tau: float) -> None:
    period = 0.01
    numerator = [1.0] + [0.0] * order
    b, a = scipy.signal.bilinear(numerator, np.poly([-1.0 / tau] * 2) * tau**2, 1.0 / period)
    signal = np.random.default_rng(order).normal(size=300)
    coefficients, memory, found = residual_filter(tau, period), (0.0, 0.0), []
    for value in signal:
        stated = [0.0, 0.0, 0.0]
        stated[order] = value
        out = filtered(coefficients, memory, *stated)
        memory = out.memory
        found.append(out.value)
    expected = scipy.signal.lfilter(b, a, signal)
    # A double pole at 0.98 is known to 1e-8 from the coefficients of a polynomial, which scipy goes through.
    np.testing.assert_allclose(found, expected, atol=1e-7 * np.abs(expected).max())


def test_a_settled_filter_has_no_transient() -> None:
    coefficients = residual_filter(0.6, 0.01)
    memory = settled(coefficients, level=3.0, first=-2.0, second=5.0)
    for _ in range(5):
        value, memory = filtered(coefficients, memory, 3.0, -2.0, 5.0)
        assert value == pytest.approx(3.0, abs=1e-9)  # s^2 F has gains of 5e4 1/s2, which cancel


@pytest.mark.parametrize("samples", [1, 2, 3, 7])
def test_windows_sum_the_last_squares(samples: int) -> None:
    residual = np.random.default_rng(samples).normal(size=50)
    window = np.zeros(samples - 1)
    for k, x in enumerate(residual):
        value, window = windowed_square(window, x)
        assert value == pytest.approx(np.sum(residual[max(0, k - samples + 1) : k + 1] ** 2), rel=ROUNDING)


def test_an_alarm_waits_for_samples_in_a_row() -> None:
    above = [1, 1, 0, 1, 1, 1, 0, 1, 0, 0, 1, 0, 0, 0]
    alarm, raised = Alarm(0.0, 0.0, 0.0), []
    for k, exceeds in enumerate(above):
        alarm = evaluate(alarm, 0.1 * k, exceeds, raise_after=3, clear_after=2)
        raised.append(int(alarm.raised))
    assert raised == [0, 0, 0, 0, 0, 1, 1, 1, 1, 0, 0, 0, 0, 0]
    assert alarm.since == pytest.approx(0.9)
    assert evaluate(Alarm(0.0, 0.0, 0.0), 7.0, 1.0) == (1.0, 0.0, 7.0)  # without persistence at once


def test_sensors_that_disagree_are_distinguished_by_the_model() -> None:
    assert larger(1.0, 9.0, 2.0) == (1.0, 0.0, 0.0, 0.0)
    assert larger(1.0, 0.5, 0.7) == (0.0, 0.0, 1.0, 0.0)
    assert larger(0.0, 9.0, 2.0) == (0.0, 0.0, 0.0, 1.0)
    assert larger(0.0, 1.2, 1.1) == (0.0, 0.0, 0.0, 1.0)  # a threshold is exceeded above 1, whatever by
    assert larger(0.0, 1.2, 0.9) == (0.0, 0.0, 0.0, 0.0)
    assert larger(1.0, 1.1, 1.2) == (0.0, 1.0, 0.0, 0.0)


@pytest.mark.parametrize("true", [0.35, 0.5, 0.62, 0.8])
def test_a_grid_that_brackets_finds_a_linear_response(true: float) -> None:
    grid = grid_around(0.5, 5)
    assert grid == pytest.approx([0.35, 0.475, 0.6, 0.725, 0.85])
    found = invert(grid, [3.0 * (value - true) for value in grid], 0.5)
    assert found.value == pytest.approx(true, rel=ROUNDING)
    assert found.crossings == 1.0


def test_a_grid_that_does_not_bracket_is_reported() -> None:
    grid = grid_around(1.0, 3, most=1.5)
    assert grid == pytest.approx([0.7, 1.1, 1.5])
    assert invert(grid, [v - 1.9 for v in grid], 1.0) == (1.5, 0.0)
    assert invert(grid, [v - 0.2 for v in grid], 1.0) == (0.7, 0.0)
    several = invert([0.0, 1.0, 2.0, 3.0], [-1.0, 1.0, -1.0, 1.0], 2.4)
    assert several == (2.5, 3.0)  # the explanation nearest to the last estimate
    assert smoothed(1.0, 0.25, 0.2) == pytest.approx(0.4)
    with pytest.raises(ValueError, match="brackets nothing"):
        grid_around(1.0, 1)
    with pytest.raises(ValueError, match="equally many"):
        invert([1.0, 2.0], [0.0], 1.0)


def test_a_nominal_response_takes_the_bias_of_the_noise_off_the_actuators_parameters() -> None:
    rng = np.random.default_rng(1)
    reference = np.repeat(rng.uniform(0.0, 1.5, 100), 50)  # [deg]: steps each 0.5 s
    held = scipy.signal.cont2discrete(([11.11**2], [1.0, 2.0 * 0.6 * 11.11, 11.11**2]), 0.01)
    true = scipy.signal.lfilter(held[0].ravel(), held[1], np.append(reference[1:], 0.0))
    assert identified_actuator(true, reference, 0.01) == pytest.approx((11.11, 0.6), rel=5e-3)  # of Tustin's rule
    noisy = true + 0.2 * rng.standard_normal(true.size)
    biased = identified_actuator(noisy, reference, 0.01)
    assert biased.damping < 0.9 * 0.6
    nominal = _ActuatorParameters(5.73, 0.45)  # far off
    assert identified_actuator(noisy, reference, 0.01, nominal=nominal) == pytest.approx((11.11, 0.6), rel=0.03)
    with pytest.raises(ValueError, match="one length"):
        identified_actuator(noisy[:-1], reference, 0.01)
    with pytest.raises(ValueError, match="does not move"):
        identified_actuator(np.ones(200), np.ones(200), 0.01)
