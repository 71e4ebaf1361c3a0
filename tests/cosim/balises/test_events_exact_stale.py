"""What a balise costs that is used late, at the next communication point: the loss that the package exists to avoid.

Set-up: the high-gain observer with an exact model (K = [2, 1]), a train at a constant 13.9 m/s, balise gaps uniform in
[0.2, 1] x 0.5 s, estimates right from the start, so that nothing but the timing fault is seen.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from coupled_runs import Balises, IdealCdo, Motion, Ran, block, run

from cosim.balises.layout import aperiodic
from plant_models.hybrid import HybridSystem, output_signal

SPEED = 13.9
DRAG = 900.0 + 32.4 * SPEED + 1.65287 * SPEED**2  # davis_a, davis_b, davis_c of the observers
SETTLED = 5.0
SEEDS = range(5)

LOSSES = {
    (2.0, 0.01): 0.028,
    (2.0, 0.05): 0.148,
    (2.0, 0.1): 0.270,
    (8.0, 0.01): 0.20,
    (8.0, 0.05): 1.21,
    (8.0, 0.1): 2.08,
}
"""rms speed error [m/s] by (theta, communication step), independently measured."""


class ConstantEffort(HybridSystem):
    """The effort that just balances the drag."""

    name = "constant_effort"
    outputs = (output_signal("effort", "N"),)

    def output(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"effort": DRAG + 0.0 * t}


SYSTEM = IdealCdo()


def stale_run(theta: float, h: float, seed: int, timing: str, duration: float = 60.0, version: Any = 3) -> Ran:
    layout = aperiodic(duration, seed, min_gap=0.1, max_gap=0.5, dropout_after=np.inf)
    starts = {"observer": {"theta": theta, "estimated_speed": SPEED}, "plant": {"v0": SPEED}}
    parts = [block(Motion(), "plant"), block(ConstantEffort(), "driver"), block(SYSTEM, "observer", version)]
    balises = Balises(layout, receivers=["observer"], timing=timing)
    return run(parts, [("driver.effort", "observer.effort")], h, round(duration / h), balises, starts=starts)


def rms_speed_error(theta: float, h: float, seed: int, timing: str, duration: float = 60.0) -> float:
    return rms_between_rows(stale_run(theta, h, seed, timing, duration), theta)


def rms_between_rows(ran: Ran, theta: float) -> float:
    """rms over time, not over rows: between rows the speed error follows the decaying innovation,
    ``e(s) = e(0) - theta^2 K2 eta(0) (1 - exp(-2 theta s)) / (2 theta)``, K2 = 1; the drag's slope, 1e-3 1/s, is left
    out."""
    rows = np.flatnonzero((ran.time > SETTLED) & np.append(np.diff(ran.time) > 0.0, False))
    length = np.diff(ran.time)[rows]
    error, innovation = ran["observer.speed"][rows] - SPEED, ran["observer.innovation"][rows]
    shares = (np.arange(20) + 0.5) / 20.0
    s = np.outer(length, shares)
    between = error[:, None] - 0.5 * theta * innovation[:, None] * (1.0 - np.exp(-2.0 * theta * s))
    return float(np.sqrt(np.sum(np.mean(between**2, axis=1) * length) / np.sum(length)))


@pytest.mark.parametrize(("theta", "h"), LOSSES)
def test_stale_use_loses_what_was_measured_independently(theta: float, h: float) -> None:
    """Within 20 %, median over balise patterns: the pattern is random, its seed in the other measurement is not
    known.
    """
    losses = [rms_speed_error(theta, h, seed, "stale") for seed in SEEDS]
    assert np.median(losses) == pytest.approx(LOSSES[theta, h], rel=0.2)


@pytest.mark.parametrize(("theta", "h"), LOSSES)
def test_exact_use_loses_nothing(theta: float, h: float) -> None:
    """Closed form: zero. 1e-9 m/s is the rounding of a position of 1e3 m, amplified by theta^2."""
    assert rms_speed_error(theta, h, 0, "exact", 30.0) <= 1e-9


@pytest.mark.parametrize("h", [0.05, 0.1])
def test_fmi2_receivers_are_stale_likewise(h: float) -> None:
    """FMI 2 acts at the start of the step that follows, which is the same instant: equal speeds at all communication
    points.
    """
    first, second = (stale_run(2.0, h, 1, "stale", 20.0, version) for version in (3, 2))
    assert np.max(np.abs(first["observer.speed"] - SPEED)) > 0.1
    np.testing.assert_allclose(first["observer.speed"], second["observer.speed"], rtol=1e-12)


def test_a_stale_telegram_is_logged_and_shown_at_the_communication_point() -> None:
    layout = aperiodic(2.0, 0)
    parts = [block(Motion(), "plant"), block(SYSTEM, "observer")]
    ran = run(parts, [], 0.1, 20, Balises(layout, receivers=["observer"], timing="stale"))
    for event in ran.events:
        k = np.ceil(event.stamp / 0.1 - 1e-6)
        assert event.delivered_at == k * 0.1
        at = np.flatnonzero(ran.time == event.delivered_at)
        innovation = ran["observer.innovation"][at]
        assert len(at) == 2
        assert innovation[0] != innovation[1]
    assert len(ran.time) == 21 + len(ran.events)
