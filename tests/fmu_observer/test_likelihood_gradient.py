"""Exact gradients of the innovation likelihood: against central differences, and the value against a run."""

from __future__ import annotations

import numpy as np
import pytest

from fmu_observer import OBSERVERS
from fmu_observer.design.likelihood import AccumulatedOutput
from plant_models.hybrid import Runtime, scalar_names

NAMES = ("process_covariance[1]", "process_covariance[4]", "measurement_covariance[1]")
VALUES = np.array([2e-3, 1e-2, 3e-4])
SAMPLES = 60


def measured() -> np.ndarray:
    """Inputs at the samples of a pendulum that nobody simulated: any numbers will do."""
    random = np.random.default_rng(1)
    return np.stack([random.normal(0.0, 0.5, SAMPLES), 0.3 * np.sin(0.1 * np.arange(SAMPLES))], axis=1)


def test_value_and_gradient() -> None:
    """Differences of 1e-5 leave 1e-8 of a smooth function, and rounding of 1e-16 / 1e-5."""
    system = OBSERVERS["extended_kalman_filter"](model="pendulum")
    rows = measured()
    reported = AccumulatedOutput(system, rows, NAMES)
    value, gradient = reported(VALUES)
    moves = 1e-5 * np.diag(VALUES)
    differences = [(reported(VALUES + m)[0] - reported(VALUES - m)[0]) / (2.0 * m.sum()) for m in moves]
    np.testing.assert_allclose(gradient, differences, rtol=1e-6)

    runtime = Runtime(system)
    places = [scalar_names(system.parameter_signals).index(name) for name in NAMES]
    runtime.p[places] = VALUES
    period = runtime.p[scalar_names(system.parameter_signals).index("sample_period")]
    runtime.u[:] = rows[0]
    runtime.start(0.0)
    for k in range(1, SAMPLES):
        runtime.u[:] = rows[k]
        runtime.advance(k * period)
    outputs = dict(zip(scalar_names(system.outputs), runtime.update_outputs(), strict=True))
    assert value == pytest.approx(outputs["innovation_likelihood"], rel=1e-12)  # the same operations in another order


def test_what_it_refuses() -> None:
    system = OBSERVERS["extended_kalman_filter"](model="pendulum")
    with pytest.raises(ValueError, match="no parameter 'process'"):
        AccumulatedOutput(system, measured(), ["process"])
    with pytest.raises(ValueError, match="no output 'cost'"):
        AccumulatedOutput(system, measured(), NAMES, output="cost")
    with pytest.raises(ValueError, match="shape"):
        AccumulatedOutput(system, measured()[:, :1], NAMES)
    with pytest.raises(ValueError, match="one periodic event"):
        AccumulatedOutput(OBSERVERS["takagi_sugeno_cdo"](), measured(), [])
