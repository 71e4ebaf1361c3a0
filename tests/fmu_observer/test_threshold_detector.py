"""The three-threshold detector: its rules one by one, its way out, and what it refuses."""

from __future__ import annotations

import numpy as np
import pytest

from fmu_observer.detection.threshold_detector import ThresholdDetector
from plant_models.hybrid import Runtime, scalar_names

SYSTEM = ThresholdDetector()


def verdicts(residuals: list[float], preset: str | None = None, **parameters: float) -> list[tuple[float, float]]:
    """Fault and recovering after each sample of 1 ms."""
    runtime = Runtime(SYSTEM)
    runtime.p[:] = SYSTEM.start_parameters(preset)
    for name, value in parameters.items():
        runtime.p[scalar_names(SYSTEM.parameter_signals).index(name)] = value
    reported = []
    for k, residual in enumerate(residuals):
        runtime.u[0] = residual
        runtime.start(0.0) if k == 0 else runtime.advance(1e-3 * k)
        fault, recovering, _ = runtime.update_outputs()
        reported.append((float(fault), float(recovering)))
    return reported


def test_begin_quiet_end() -> None:
    """A peak at the onset, quiet, a peak of the other sign at the end; between the thresholds nothing changes."""
    residuals = [0.0, 0.004, 0.006, 0.02, 0.006, 0.004, 0.0009, 0.004, -0.004, -0.006, -0.02, -0.003, 0.0, 0.006]
    faults = [0, 0, 1, 1, 1, 1, 1, 1, 1, 0, 0, 0, 0, 1]
    awaited = [0, 0, 0, 0, 0, 0, 1, 1, 1, 0, 0, 0, 0, 0]
    assert verdicts(residuals) == list(zip(map(float, faults), map(float, awaited), strict=True))


def test_the_end_may_have_another_threshold() -> None:
    assert [f for f, _ in verdicts([0.006, 0.0, 0.006, 0.011], threshold_end=0.01)] == [1.0, 1.0, 1.0, 0.0]


def test_a_rise_without_quiet_before_it_counts_for_nothing() -> None:
    """Recovery leaves a peak behind; it is no new fault."""
    assert [f for f, _ in verdicts([0.006, 0.0, 0.006, 0.02, 0.02, 0.02])] == [1.0, 1.0, 0.0, 0.0, 0.0, 0.0]


def test_a_false_alarm_ends_after_its_time_and_as_published_never() -> None:
    once = [0.006, *[0.0] * 30]
    reported = [f for f, _ in verdicts(once, longest_fault=0.02)]
    assert reported == [1.0] * 20 + [0.0] * 11
    assert [f for f, _ in verdicts(once, "as_published")] == [1.0] * 31


def test_the_filter_is_the_exact_lag_of_first_order() -> None:
    runtime = Runtime(SYSTEM)
    runtime.p[:] = SYSTEM.start_parameters("filtered")
    runtime.u[0] = -0.004
    runtime.start(0.0)
    runtime.advance(9e-3)  # ten samples
    assert runtime.x[0] == pytest.approx(0.004 * -np.expm1(-10.0 / 2.0), rel=1e-12)


@pytest.mark.parametrize(
    ("thresholds", "said"),
    [
        ({"threshold_quiet": 0.005}, "threshold_quiet must be below threshold_start"),
        ({"threshold_end": 0.0005}, "threshold_quiet must be below threshold_end"),
        ({"threshold_start": -1.0}, "threshold_start must be"),
    ],
)
def test_thresholds_out_of_order_are_refused_in_words(thresholds: dict[str, float], said: str) -> None:
    with pytest.raises(ValueError, match=said) as raised:
        verdicts([0.0], **thresholds)
    name, value = next(iter(thresholds.items()))
    assert f"{name} = {value!r}" in str(raised.value)
