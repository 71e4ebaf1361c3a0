"""The coupler-break risk: levels, hysteresis, rate, peak hold, and the train's own coupler."""

import numpy as np
import pytest
from coupled_train import journey
from hypothesis import given, settings
from hypothesis import strategies as st
from observer_runner import SystemRunner

from fmu_observer.detection import CouplerRisk

BENCH = SystemRunner(CouplerRisk())


def started(force: float, **parameters: float) -> SystemRunner:
    runner = BENCH  # tracing it costs more than the run
    runner.runtime.reset()
    runner.set("p", parameters)
    runner.set("u", {"coupler_force": force})
    runner.runtime.start(0.0)
    return runner


def then(runner: SystemRunner, force: float, seconds: float = 1.0) -> dict[str, float]:
    """Outputs after the force has come slowly, and has stayed."""
    now = float(runner.runtime.u[0])
    for share in np.linspace(0.0, 1.0, 200)[1:]:
        runner.set("u", {"coupler_force": now + share * (force - now)})
        runner.runtime.advance(runner.runtime.t + 0.05)
    runner.runtime.advance(runner.runtime.t + seconds)
    return runner.outputs()


def test_levels_go_up_at_the_limits_and_down_below_them() -> None:
    runner = started(0.0)
    # warning 340 kN, alarm 510 kN; left below 80 % of them, 272 and 408 kN
    story = [
        (335e3, 0),
        (345e3, 1),
        (300e3, 1),
        (270e3, 0),
        (505e3, 1),
        (515e3, 2),
        (420e3, 2),
        (400e3, 1),
        (280e3, 1),
        (0.0, 0),
    ]
    assert [then(runner, force)["risk"] for force, _ in story] == [level for _, level in story]


def test_compression_is_no_risk() -> None:
    out = then(started(0.0), -800e3)
    assert (out["risk"], out["utilisation"], out["peak_tension"]) == (0.0, 0.0, 0.0)


def test_a_tension_there_from_the_start_has_not_risen() -> None:
    runner = started(300e3)
    runner.runtime.advance(0.5)
    assert runner.outputs()["risk"] == 0.0
    assert runner.outputs()["tension_rate"] == 0.0
    assert runner.outputs()["utilisation"] == pytest.approx(300.0 / 850.0, abs=1e-12)


@pytest.mark.parametrize(("rate", "level"), [(300e3, 0.0), (400e3, 1.0), (800e3, 2.0)])
def test_a_fast_rise_counts_before_the_force_is_there(rate: float, level: float) -> None:
    runner = started(0.0)
    for k in range(1, 601):
        runner.set("u", {"coupler_force": rate * 0.001 * (k - 0.5)})
        runner.runtime.advance(0.001 * k)
        if k * 0.001 * rate > 250e3:
            break
    assert runner.outputs()["tension_rate"] == pytest.approx(rate, rel=0.06)  # of a ramp, three time constants at least
    assert runner.outputs()["risk"] == level


def test_the_peak_is_held_and_forgotten() -> None:
    runner = started(200e3)
    runner.set("u", {"coupler_force": 50e3})
    runner.runtime.advance(4.98)
    assert runner.outputs()["peak_tension"] == 200e3
    runner.runtime.advance(5.04)
    assert runner.outputs()["peak_tension"] == 50e3
    for force, until in ((100e3, 5.1), (60e3, 9.9)):  # a later one is held as long
        runner.set("u", {"coupler_force": force})
        runner.runtime.advance(until)
    assert runner.outputs()["peak_tension"] == 100e3


@settings(max_examples=25, deadline=None)
@given(forces=st.lists(st.floats(-1e6, 1e6), min_size=2, max_size=30), hold=st.integers(0, 10))
def test_level_and_peak_of_any_history(forces: list[float], hold: int) -> None:
    """The level never lies below that of the tension now; the peak is at least the tension, at most the largest of the
    past.
    """
    runner = started(forces[0], peak_hold_time=hold * 0.02)
    seen = []
    for k, force in enumerate(forces):
        runner.set("u", {"coupler_force": force})
        runner.runtime.advance(0.02 * (k + 1))
        out, tension = runner.outputs(), max(force, 0.0)
        seen.append(tension)
        assert out["risk"] >= (2.0 if tension > 510e3 else 1.0 if tension > 340e3 else 0.0)
        assert tension <= out["peak_tension"] <= max([max(forces[0], 0.0), *seen])


def test_a_step_of_effort_pulls_the_first_coupler_as_measured() -> None:
    """Spec 5.7: 83 kN on the level, peak 62.16 kN after 0.63 s: far from breaking, and the detector sees that peak."""
    trip = journey(lambda _t: 83e3, [3.0])
    assert trip.coupler_force.max() == pytest.approx(62.16e3, rel=0.005)  # from 0.5 m/s here, where a resistance acts
    assert trip.time[int(trip.coupler_force.argmax())] == pytest.approx(0.63, abs=0.015)
    runner = started(float(trip.coupler_force[0]))
    worst = 0.0
    for t, force in zip(trip.time[1:], trip.coupler_force[1:], strict=True):
        runner.set("u", {"coupler_force": float(force)})
        runner.runtime.advance(float(t))
        worst = max(worst, runner.outputs()["risk"])
    assert worst == 0.0
    assert runner.outputs()["peak_tension"] == pytest.approx(trip.coupler_force.max(), rel=1e-3)  # checked every 0.02 s
