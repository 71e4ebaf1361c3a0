"""The differentiators as systems: accuracy without and with noise, exactness, filtering, declarations."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from own_condition import own_condition

from fmu_observer.formulas.differentiation.differentiator_gains import LEVANT_GAINS
from fmu_observer.observers.generic.differentiators import FilteringDifferentiator, LevantDifferentiator
from fmu_observer.observers.generic.differentiators.signal_differentiator import SignalDifferentiator
from plant_models.hybrid import Runtime
from plant_models.hybrid.units import parse_unit


def run(system: SignalDifferentiator, signal: np.ndarray, step: float, bound: float = 1.0) -> np.ndarray:
    """Estimates after each step, the signal held over it, shape (len(signal), n + 1)."""
    runtime = Runtime(system)
    runtime.p[:] = bound, step  # bound and internal step
    runtime.start(0.0)
    rows = np.empty((len(signal), system.order + 1))
    for k, value in enumerate(signal):
        runtime.u[0] = value
        runtime.advance((k + 1) * step)
        rows[k] = runtime.x[system.filtering_order :]
    return rows


def sine_errors(rows: np.ndarray, step: float, last: float) -> np.ndarray:
    """Largest errors against sin and its derivatives over the last seconds, shape (n + 1,)."""
    t = step * np.arange(1, len(rows) + 1)
    exact = np.sin(t[:, None] + 0.5 * np.pi * np.arange(rows.shape[1]))
    return np.asarray(np.abs(rows - exact)[t > t[-1] - last].max(axis=0))


@pytest.mark.parametrize(("order", "measured"), [(2, (0.0, 5e-5, 4e-4)), (3, (0.0, 5e-5, 1e-4, 6e-4))])
def test_errors_on_a_sine(order: int, measured: tuple[float, ...]) -> None:
    """Independently measured with L = 1 at a step of 0.1 ms, one digit each; h / 2 of the first derivative is the Euler
    lag.
    """
    step = 1e-4
    errors = sine_errors(run(LevantDifferentiator(order), np.sin(step * np.arange(200_000)), step), step, 6.0)
    np.testing.assert_allclose(errors, measured, rtol=0.15, atol=1e-10)


def test_the_printed_order_of_the_gains_fails() -> None:
    """The same equations with gain i of the table in equation i: independently measured errors 0.2, 0.59 and 1.41 for n
    = 2.
    """
    step, z, gains = 1e-3, np.zeros(3), LEVANT_GAINS[2]
    for k in range(20_000):
        s = z[0] - np.sin(step * k)
        power = np.abs(s) ** (np.array([2.0, 1.0, 0.0]) / 3.0) * np.sign(s)
        z = z + step * (-np.array(gains) * power + np.append(z[1:], 0.0))
    wrong = np.abs(z - np.sin(20.0 + 0.5 * np.pi * np.arange(3)))
    right = sine_errors(run(LevantDifferentiator(2), np.sin(step * np.arange(20_000)), step), step, 1.0)
    assert np.all(wrong > 30.0 * right)
    assert wrong[2] > 0.1


@pytest.mark.parametrize("order", [1, 2])
def test_the_error_with_noise_has_the_exponents_of_the_theorem(order: int) -> None:
    """Noise eps cos(w t), w = eps^(-1/(n+1)), the slowest that the differentiator cannot tell from the signal's own
    limits.
    """
    step, t = 2e-4, 2e-4 * np.arange(60_000)
    sizes = (1e-4, 1e-2)
    errors = []
    for eps in sizes:
        noise = eps * np.cos(eps ** (-1.0 / (order + 1)) * t)
        errors.append(sine_errors(run(LevantDifferentiator(order), np.sin(t) + noise, step, 2.0), step, 6.0))
    exponents = np.log(errors[1] / errors[0]) / np.log(sizes[1] / sizes[0])
    # Two decades of noise; the constants differ by up to a fifth between them, which is 0.05 in the exponent.
    np.testing.assert_allclose(exponents, (order + 1 - np.arange(order + 1)) / (order + 1), atol=0.05)


@settings(max_examples=10, deadline=None)
@given(st.integers(1, 4), st.lists(st.floats(-1.0, 1.0), min_size=5, max_size=5))
def test_polynomials_up_to_the_order_are_differentiated_exactly(order: int, coefficients: list[float]) -> None:
    """But for the lag of an Euler step, half a step of the next derivative, and the chatter of L h^(n+1-i)."""
    step, t = 1e-3, 1e-3 * np.arange(1, 15_001)
    polynomial = np.polynomial.Polynomial(np.array(coefficients[: order + 1]) / 15.0 ** np.arange(order + 1))
    rows = run(LevantDifferentiator(order), polynomial(t - step), step)
    for i in range(order + 1):
        error = np.abs(rows[:, i] - polynomial.deriv(i)(t))[-1000:].max()
        lag = step * i * np.abs(polynomial.deriv(i + 1)(t[-1000:])).max()
        assert error <= lag + 20.0 * step ** (order + 1 - i) + 1e-9


@settings(max_examples=10, deadline=None)
@given(st.floats(0.01, 100.0))
def test_scaling_signal_and_bound_scales_the_estimates(scale: float) -> None:
    """Homogeneity: L and the signal times c give the estimates times c; rounding moves only when a sign changes."""
    step, t = 1e-3, 1e-3 * np.arange(2000)
    plain = run(LevantDifferentiator(2), np.sin(t), step, 1.0)
    scaled = run(LevantDifferentiator(2), scale * np.sin(t), step, scale)
    np.testing.assert_allclose(scaled / scale, plain, atol=0.02)  # chatter of the last state: 20 L h
    np.testing.assert_allclose((scaled / scale)[:, 0], plain[:, 0], atol=1e-6)


def test_the_filter_rejects_what_ruins_the_plain_differentiator() -> None:
    step, t = 1e-3, 1e-3 * np.arange(15_000)
    disturbed = np.sin(t) + 0.5 * np.cos(1000.0 * t)
    plain = sine_errors(run(LevantDifferentiator(1), disturbed, step), step, 5.0)
    filtered = sine_errors(run(FilteringDifferentiator(1, 3), disturbed, step), step, 5.0)
    assert filtered[1] < 0.1
    assert filtered[1] < 0.25 * plain[1]


@pytest.mark.parametrize(("order", "filters"), [(0, 2), (1, 1), (1, 3), (2, 2)])
def test_filtering_differentiators_of_a_clean_sine(order: int, filters: int) -> None:
    step = 1e-3
    errors = sine_errors(
        run(FilteringDifferentiator(order, filters), np.sin(step * np.arange(15_000)), step), step, 5.0
    )
    assert np.all(errors <= 10.0 * step * np.ones(order + 1))


def test_every_order_of_the_table_runs() -> None:
    for order in range(6):
        step = 1e-3
        errors = sine_errors(run(LevantDifferentiator(order), np.sin(step * np.arange(30_000)), step), step, 5.0)
        assert errors[0] < 3.0 * step
        assert np.all(errors < 0.05)


def test_units_follow_the_signal() -> None:
    system = FilteringDifferentiator(2, 2, unit="m/s")
    units = [parse_unit(s.unit).exponents[1:3] for s in system.states]
    # powers of metre and second: filters, value, derivatives
    assert units == [(1, 1), (1, 0), (1, -1), (1, -2), (1, -3)]
    assert parse_unit(system.parameters[0].unit).exponents[1:3] == (1, -4)
    assert [s.name for s in system.outputs] == ["value", "derivative_1", "derivative_2"]
    assert [s.unit for s in LevantDifferentiator(2).outputs] == ["1", "1/s", "1/s2"]


def test_the_condition_is_one_on_the_signal() -> None:
    condition = own_condition(LevantDifferentiator(2), {"bound": 8.0, "internal_step": 0.01})
    assert condition.holds
    assert condition.numbers["unit_sine_rate"] == pytest.approx(2.0)  # the third derivative of sin(2 t) is bounded by 8
    assert [condition.numbers[f"chatter_{i}"] for i in range(3)] == pytest.approx([8e-6, 8e-4, 8e-2])
    with pytest.raises(ValueError, match="bound"):
        own_condition(LevantDifferentiator(2), {"bound": 0.0})  # no signal but a polynomial has such a bound


def test_orders_that_are_not_tabulated() -> None:
    with pytest.raises(ValueError, match=r"order 3 with filtering order 3: .* at most 5"):
        FilteringDifferentiator(3, 3)
    with pytest.raises(ValueError, match=r"at most 5"):
        LevantDifferentiator(6)
    with pytest.raises(ValueError, match=r"filtering order 0, expected at least 1"):
        FilteringDifferentiator(1, 0)
