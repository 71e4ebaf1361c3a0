"""Directional derivatives against finite differences: honest ones pass, wrong ones do not, kinks are no mistake."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fmus.check.findings import CheckOutcome, Verdict
from fmus.check.finite_differences import compare

CURVES: dict[str, tuple[Callable[[float], float], Callable[[float], float]]] = {
    "sine": (np.sin, np.cos),
    "cube": (lambda x: x**3, lambda x: 3.0 * x * x),
    "large": (lambda x: 1e9 + 1e6 * x, lambda _x: 1e6),
    "exponential": (lambda x: np.exp(0.1 * x), lambda x: 0.1 * np.exp(0.1 * x)),
}


def compared(curve: Callable[[float], float], slope: float, at: float) -> CheckOutcome:
    return compare(
        lambda _n, value: np.array([curve(value)]), lambda _n: np.array([slope]), {"x": at}, ["y"], {"x": 1.0}
    )


@given(st.sampled_from(sorted(CURVES)), st.floats(-100.0, 100.0))
def test_exact_derivatives_pass_anywhere(name: str, at: float) -> None:
    curve, slope = CURVES[name]
    assert compared(curve, slope(at), at).verdict is Verdict.PASS


@given(
    st.sampled_from(["cube", "large", "exponential"]), st.floats(1.0, 100.0), st.sampled_from([0.98, 1.02, -1.0, 0.0])
)
def test_wrong_derivatives_fail(name: str, at: float, factor: float) -> None:
    curve, slope = CURVES[name]
    outcome = compared(curve, factor * slope(at), at)
    assert outcome.verdict is None  # what a failure means is the catalogue's
    assert "the derivative of y along x is said to be" in outcome.detail


@pytest.mark.parametrize(
    ("slope", "verdict"), [(1.0, "pass"), (-1.0, "pass"), (0.0, "pass"), (1.1, None), (np.nan, None)]
)
def test_at_a_kink_every_slope_between_is_right(slope: float, verdict: str | None) -> None:
    assert compared(abs, slope, 0.0).verdict == verdict


@pytest.mark.parametrize("at", [0.0, 1.0, 7.3])
def test_what_is_rounded_away_inside_is_no_mistake(at: float) -> None:
    """Terms of 1e4 that cancel leave multiples of 1.8e-12, which a slope of 4e-6 over a step of 1e-6 hardly fills."""
    curve = lambda x: (1e4 - 4e-6 * x) - 1e4  # noqa: E731
    assert compared(curve, -4e-6, at).verdict is Verdict.PASS
    assert compared(curve, -4e-4, at).verdict is None
