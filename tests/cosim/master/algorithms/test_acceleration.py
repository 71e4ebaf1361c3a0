"""The accelerations alone, against the theorems about them on linear maps, and against SciPy on others."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from scipy.optimize import root

from cosim.master.algorithms.acceleration import (
    LONGEST,
    Acceleration,
    Newton,
    _Aitken,
    _FixedPoint,
    make_acceleration,
    scaled_norm,
)

numbers = st.floats(-3.0, 3.0)


def search(
    acceleration: Acceleration, g: object, z: np.ndarray, rounds: int, scale: np.ndarray | None = None
) -> np.ndarray:
    """The guess after so many calls of the map."""
    acceleration.begin(np.ones(len(z)) if scale is None else scale)
    for _ in range(rounds):
        z = acceleration.next(z, g(z))  # type: ignore[operator]
    return z


@given(numbers, numbers, numbers)
def test_one_value_is_found_in_two_sweeps_whatever_the_gain(gain: float, offset: float, start: float) -> None:
    """Both are the secant method then."""
    assume(abs(gain - 1.0) > 0.01)
    wanted = offset / (1.0 - gain)
    assume(abs(start - wanted) > 1e-3)
    for made in (_Aitken(1), Newton(1), Newton(1, lambda: np.array([[gain]]))):
        found = search(made, lambda z: gain * z + offset, np.array([start]), 2)
        # roundings over |1 - gain| >= 0.01 and a difference >= 1e-5
        assert found[0] == pytest.approx(wanted, rel=1e-9, abs=1e-9)


@given(st.integers(1, 5), st.integers(0, 10_000), st.floats(0.1, 6.0))
def test_newton_with_the_whole_jacobian_needs_one_sweep(n: int, seed: int, size: float) -> None:
    rng = np.random.default_rng(seed)
    matrix, offset = size * rng.normal(size=(n, n)), rng.normal(size=n)
    system = np.eye(n) - matrix
    assume(np.linalg.cond(system) < 1e4)
    wanted = np.linalg.solve(system, offset)
    assume(np.abs(wanted).max() < LONGEST * np.abs(offset).max())  # no step is longer
    found = search(Newton(n, lambda: matrix), lambda z: matrix @ z + offset, np.zeros(n), 1)
    np.testing.assert_allclose(found, wanted, rtol=1e-9, atol=1e-9)


@given(st.integers(1, 4), st.integers(0, 10_000), st.floats(0.1, 3.0), st.booleans())
def test_broyden_needs_no_more_than_two_sweeps_for_each_value(n: int, seed: int, size: float, units: bool) -> None:
    """Broyden's method ends after at most 2 n steps on a linear map. D. M. Gay, SIAM J. Numer. Anal. 16 (1979) 623-630.

    The more so where a part of the Jacobian is known, and whatever the units are.
    """
    rng = np.random.default_rng(seed)
    scale = 10.0 ** rng.integers(-4, 5, size=n) if units else np.ones(n)
    matrix, offset = size * rng.normal(size=(n, n)) * scale[:, None] / scale, rng.normal(size=n) * scale
    system = np.eye(n) - matrix
    assume(np.linalg.cond(system * scale / scale[:, None]) < 100.0)
    wanted = np.linalg.solve(system, offset)
    for known in (None, np.triu(matrix)):
        made = Newton(n, lambda known=known: known)
        z, residuals = np.zeros(n), []
        made.begin(scale)
        for _ in range(2 * n + 1):
            residuals.append(float(np.abs((matrix @ z + offset - z) / scale).max()))
            if residuals[-1] < 1e-8:
                break
            z = made.next(z, matrix @ z + offset)
        assert min(residuals[-1], float(np.abs((z - wanted) / scale).max())) < 1e-6 * max(1.0, *residuals)


def test_what_broyden_has_learnt_serves_the_next_search() -> None:
    """The second search of the same linear map is shorter, and saving and restoring keeps that bit for bit."""
    rng = np.random.default_rng(3)
    matrix, offset = rng.normal(size=(3, 3)), rng.normal(size=3)

    def guesses(made: Newton, factor: float) -> list[np.ndarray]:
        z = [np.zeros(3)]
        made.begin(np.ones(3))
        while np.abs(matrix @ z[-1] + factor * offset - z[-1]).max() > 1e-9:
            z.append(made.next(z[-1], matrix @ z[-1] + factor * offset))
        return z

    made = Newton(3)
    first = guesses(made, 1.0)
    learnt = made.save()
    later = guesses(made, 1.1)
    assert len(later) < len(first)
    other = Newton(3)
    other.restore(learnt)
    assert [z.tobytes() for z in guesses(other, 1.1)] == [z.tobytes() for z in later]


@pytest.mark.parametrize("slope", [1.0, 1.0 + 1e-15])
def test_a_map_without_fixed_point_is_not_followed_to_infinity(slope: float) -> None:
    """``G(z) = z + 0.1``: 50 guesses stay within 50 * 1e4 residuals, where 0.1 is still a large share of the value."""
    for made in (_Aitken(1), Newton(1), Newton(1, lambda: np.array([[slope]]))):
        found = search(made, lambda z: slope * z + 0.1, np.array([0.0]), 50)
        assert abs(found[0]) < 0.11 * 50 * 1e4
        assert scaled_norm(found, slope * found + 0.1, 1e-7, 1e-12) > 1.0


def test_newton_agrees_with_scipy_on_a_nonlinear_map() -> None:
    def g(z: np.ndarray) -> np.ndarray:
        return np.array([2.0 - 0.9 * np.tanh(3.0 * z[1]), 0.3 * z[0] ** 2 - 1.5 * z[1]])

    found = search(Newton(2), g, np.array([1.0, 0.5]), 25)
    wanted = root(lambda z: g(z) - z, [1.0, 0.5], tol=1e-14)
    assert wanted.success
    np.testing.assert_allclose(found, wanted.x, rtol=1e-10)


def test_where_there_is_no_direction_newton_exchanges_plainly() -> None:
    """``G(z) = z + 1``: the slope is 1 and the equation singular."""
    found = search(Newton(1, lambda: np.array([[1.0]])), lambda z: z + 1.0, np.array([0.0]), 4)
    assert found[0] == 4.0


@given(numbers, st.floats(0.05, 1.0))
def test_a_constant_relaxation_multiplies_the_error(gain: float, w: float) -> None:
    found = search(_FixedPoint(1, w), lambda z: gain * z, np.array([1.0]), 3)
    assert found[0] == pytest.approx((1.0 - w * (1.0 - gain)) ** 3, rel=1e-9, abs=1e-12)


@pytest.mark.parametrize("kind", [_Aitken, Newton])
def test_a_problem_in_other_units_takes_an_equal_way(kind: type[Acceleration]) -> None:
    matrix, offset, units = np.array([[0.4, 0.3], [-0.2, 0.5]]), np.array([1.0, -2.0]), np.array([1e-3, 1e6])
    for rounds in (2, 3, 4):
        plain = search(kind(2), lambda z: matrix @ z + offset, np.zeros(2), rounds)
        other = search(kind(2), lambda z: units * (matrix @ (z / units) + offset), np.zeros(2), rounds, units)
        np.testing.assert_allclose(other / units, plain, rtol=1e-9)


def test_the_scaled_norm_counts_tolerances() -> None:
    z, g = np.array([1.0, 100.0, 0.0]), np.array([1.1, 100.0, 1e-3])
    assert scaled_norm(z, g, 1e-2, 1e-2) == pytest.approx(0.1 / (1e-2 + 1.1e-2), rel=1e-12)
    assert scaled_norm(z, np.array([1.0, np.nan, 0.0]), 1e-2, 1e-2) == np.inf
    assert scaled_norm(np.zeros(0), np.zeros(0), 1e-2, 1e-2) == 0.0


@pytest.mark.parametrize(("name", "kind"), [("fixed-point", _FixedPoint), ("aitken", _Aitken), ("newton", Newton)])
def test_accelerations_by_name(name: str, kind: type[Acceleration]) -> None:
    made = make_acceleration(name, 2, 0.5)
    assert type(made) is kind
    assert made.name == name
