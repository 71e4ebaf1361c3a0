"""The cascade of two continuous-discrete observers: its sampled odometer."""

import numpy as np
import pytest
from observer_runner import SteadyMotion, in_step

from fmu_observer.certificates.gap_findings import DECREASE
from fmu_observer.observers.train import MultirateCdo
from plant_models.hybrid import scalar_names

MOTION = SteadyMotion(speed=20.0)


@pytest.mark.parametrize(
    ("parameters", "changed", "before", "sampled"),
    [({}, 0.11, 0.19, 0.2), ({"odometer_period": 0.25}, 0.0, 0.249, 0.25)],
    ids=["as it stands", "set"],
)
def test_the_odometer_is_read_at_its_period_only(
    parameters: dict[str, float], changed: float, before: float, sampled: float
) -> None:
    runner = in_step(MultirateCdo(), MOTION)
    runner.set("p", parameters)
    runner.runtime.start(0.0)
    runner.runtime.advance(changed)
    runner.set("u", {"odometer": 25.0})
    runner.runtime.advance(before)
    assert abs(runner.state("odometer_innovation")) < 1e-9
    runner.runtime.advance(sampled)
    assert runner.state("odometer_innovation") == pytest.approx(-5.0, abs=1e-6)


def test_a_balise_leaves_the_wheel_stage_alone() -> None:
    runner = in_step(MultirateCdo(), MOTION)
    runner.runtime.start(0.0)
    before = runner.runtime.x.copy()
    runner.balise(-3.0)
    changed = np.flatnonzero(runner.runtime.x != before)
    names = [list(scalar_names(runner.runtime.system.states))[i] for i in changed]
    assert [name for name in names if not name.startswith("gate")] == ["balise_innovation"]
    assert runner.outputs()["innovation"] == 3.0


def test_the_wheel_stage_alone_decides_nothing_about_balises_but_can_spoil_the_certificate() -> None:
    observer = MultirateCdo()
    assert next(observer.findings(0.4)).holds
    fast = next(observer.findings(0.4, {"theta_1": 60.0}))  # theta_1 times the period: 6, beyond 5
    assert not fast.holds
    assert fast.numbers[DECREASE] == next(observer.findings(0.4)).numbers[DECREASE]
    assert "spectral radius" in fast.explain()
