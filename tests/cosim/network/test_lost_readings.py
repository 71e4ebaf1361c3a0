"""A reading whose packet is lost is missing where it can be left out, and never read as a new one."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import cosim
from fmu_observer import OBSERVERS

TRAIN = {"mass": 90e3, "davis_a": 900.0, "davis_b": 32.0, "davis_c": 1.7}
EFFORT = {"effort": 60e3}
SIGNAL, ARRIVED = "network.odometer.reading", "network.arrived.odometer.reading"
LEAVING_OUT = sorted(
    name
    for name, system in OBSERVERS.items()
    if any(s.name == "odometer" and s.can_be_missing for s in system().input_signals)
    and {"mass", "davis_a", "odometer_period"} <= {p.name for p in system().parameters}
    and any(s.name == "odometer_fault" for s in system().outputs)
)


def run(name: str, backend: str = "block3", stepper: str = "python", **network: Any) -> Any:
    """A train that pulls away with a constant effort; its observer hears the odometer by packets."""
    made = cosim.Scenario(stop=30.0, step=0.05, certificates="ignore", seed=1)
    forces = {"traction_coefficient": 1.0, "brake_coefficient": 1.0}
    made.add("train", model="longitudinal_train", parameters=TRAIN | forces | EFFORT, **{"as": backend})
    made.add("odometer", model="odometer", parameters={"sample_period": 0.1}, **{"as": backend})
    made.add("observer", observer=name, parameters=TRAIN | {"odometer_period": 0.1} | EFFORT, **{"as": backend})
    made.connect("train.speed -> odometer.wheel_speed", "odometer.reading -> observer.odometer")
    made.network(nodes={"tachometer": ["odometer.reading"]}, period=0.1, **network)
    made.master(stepper=stepper)
    return made.run(warn=lambda _: None)


def missed(outcome: Any) -> int:
    found = next(c for c in outcome.result.summary["components"] if c["name"] == "observer")
    return int(found["events"]["missed_samples"])


@pytest.mark.parametrize("name", LEAVING_OUT)
def test_lost_packets_are_no_wheel_fault(name: str) -> None:
    """Whoever leaves the odometer out raises no flag more with loss than without, and is as near to the train."""
    whole, lossy = (run(name, loss_fraction=share) for share in (0.0, 0.3))
    assert ARRIVED not in whole.result.table.dtype.names  # without loss nothing changes
    lost = sum(p.kind == "lost" for p in lossy.result.packets)
    assert lost - 1 <= missed(lossy) <= lost  # one that is lost at the end is not sampled any more
    assert (lossy["observer.odometer_fault"] > 0.0).sum() <= (whole["observer.odometer_fault"] > 0.0).sum()
    errors = [np.abs(o["observer.position"] - o["train.position"]).max() for o in (whole, lossy)]
    # three readings in ten held for 30 s would lag by .3 * .1 s * 19 m/s, .6 m or more
    assert errors[1] < errors[0] + 0.1
    assert any("left out, at observer.odometer" in note for note in lossy.result.summary["notes"])


@pytest.mark.parametrize(
    ("backend", "stepper"), [("block2", "python"), ("fmu3", "python"), ("fmu3", "compiled"), ("fmu2", "compiled")]
)
def test_blocks_and_fmus_leave_out_the_same(backend: str, stepper: str) -> None:
    reference, outcome = (run("quasi_lpv_uio", *how, loss_fraction=0.3) for how in ((), (backend, stepper)))
    assert outcome.result.summary["master"]["stepper"]["name"] == stepper
    assert missed(outcome) == missed(reference) > 50
    np.testing.assert_allclose(outcome["observer.position"], reference["observer.position"], rtol=1e-10, atol=1e-10)
    np.testing.assert_array_equal(np.isnan(outcome[ARRIVED]), np.isnan(reference[ARRIVED]))


def test_a_gap_begins_when_the_lost_packet_would_arrive_and_ends_with_the_next() -> None:
    outcome = run("quasi_lpv_uio", loss_fraction=0.3, delay=0.03)
    time, arrived, held = outcome["time"], outcome[ARRIVED], outcome[SIGNAL]
    gone = {p.number for p in outcome.result.packets if p.kind == "lost"}
    for k in range(1, 290):  # between two deliveries
        inside = (time > 0.1 * k + 0.03 + 1e-6) & (time < 0.1 * k + 0.13 - 1e-6)
        assert inside.any()
        assert np.isnan(arrived[inside]).all() == (k in gone)
        assert np.isfinite(held[inside]).all()
        if k not in gone:
            np.testing.assert_array_equal(arrived[inside], held[inside])
