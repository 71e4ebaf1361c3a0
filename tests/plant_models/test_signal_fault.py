"""Faults of any signal against their closed forms."""

from __future__ import annotations

import numpy as np
import pytest

from plant_models.faults import SignalFault
from plant_models.hybrid import Runtime, scalar_names


def _course(system: SignalFault, healthy: np.ndarray, step: float = 0.1, **parameters: object) -> np.ndarray:
    """Outputs at ``k * step`` of a signal of shape (n, channels), shape (n, outputs)."""
    runtime = Runtime(system)
    names = list(scalar_names(system.parameter_signals))
    for name, value in parameters.items():
        values = np.atleast_1d(np.asarray(value, dtype=float))
        first = names.index(name) if name in names else names.index(f"{name}[1]")
        runtime.p[first : first + len(values)] = values
    rows = []
    for k, row in enumerate(healthy):
        runtime.u[: len(row)] = row
        runtime.start(0.0) if k == 0 else runtime.advance(step * k)
        rows.append(runtime.update_outputs().copy())
    return np.array(rows)


T = 0.1 * np.arange(100)
SIGNAL = 3.0 + np.sin(T)
WITHIN = (T > 2.0 - 1e-9) & (T < 5.0 - 1e-9)


@pytest.mark.parametrize(
    ("gain", "offset", "expected"),
    [(0.0, 7.0, 7.0 + 0.0 * T), (5.0, 0.0, 5.0 * SIGNAL), (1.0, -2.0, SIGNAL - 2.0), (0.5, 1.0, 0.5 * SIGNAL + 1.0)],
    ids=["stuck", "gain", "offset", "gain and offset"],
)
def test_a_fault_acts_from_its_onset_to_its_end(gain: float, offset: float, expected: np.ndarray) -> None:
    rows = _course(
        SignalFault(), SIGNAL[:, None], fault_onset=2.0, fault_length=3.0, fault_gain=gain, fault_offset=offset
    )
    assert rows[:, 0] == pytest.approx(np.where(WITHIN, expected, SIGNAL), rel=1e-12)
    assert (rows[:, 1] == WITHIN).all()
    assert (rows[:, 2] == (T < 5.0 - 1e-9)).all()


def test_a_ramped_fault_rises_holds_and_falls() -> None:
    rows = _course(
        SignalFault(),
        SIGNAL[:, None],
        fault_onset=1.0,
        fault_rise=2.0,
        fault_length=3.0,
        fault_fall=1.0,
        fault_gain=0.0,
        fault_offset=4.0,
    )
    weight = np.interp(T, [1.0, 3.0, 6.0, 7.0], [0.0, 1.0, 1.0, 0.0])
    assert rows[:, 0] == pytest.approx(SIGNAL + weight * (4.0 - SIGNAL), rel=1e-9)


def test_a_fault_concerns_its_channel_and_faults_add_up() -> None:
    healthy = np.stack([SIGNAL, 2.0 * SIGNAL, -SIGNAL], axis=1)
    rows = _course(
        SignalFault(channels=3, fault_count=2),
        healthy,
        fault_channel=[2.0, 3.0],
        fault_onset=[2.0, 0.0],
        fault_length=[3.0, 20.0],
        fault_gain=[3.0, 1.0],
        fault_offset=[0.0, 5.0],
    )
    assert rows[:, 0] == pytest.approx(SIGNAL)
    assert rows[:, 1] == pytest.approx(np.where(WITHIN, 6.0, 2.0) * SIGNAL)
    assert rows[:, 2] == pytest.approx(5.0 - SIGNAL)
    assert rows[-1, 4] == 1.0  # the second is not over


def test_lost_samples_leave_the_last_one() -> None:
    course = np.arange(1500.0)
    parameters = {"fault_onset": 50.0, "fault_length": 100.0, "sample_period": 0.1}
    frozen = _course(SignalFault(losses=True), course[:, None], fault_loss=1.0, **parameters)[:, 0]
    assert (frozen[:500] == course[:500]).all()
    assert (frozen[500:] == 499.0).all()
    seen = _course(SignalFault(losses=True), course[:, None], fault_loss=0.3, seed=4.0, **parameters)[:, 0]
    lost = seen[500:] != course[500:]
    assert lost.mean() == pytest.approx(0.3, abs=5.0 * (0.3 * 0.7 / 1000) ** 0.5)
    assert (seen[1:][seen[1:] != course[1:]] == seen[:-1][seen[1:] != course[1:]]).all()


def test_options_are_checked() -> None:
    with pytest.raises(ValueError, match="channels must be at least 1"):
        SignalFault(channels=0)
    with pytest.raises(ValueError, match="unknown unit symbol"):
        SignalFault(unit="furlong")
