"""Late packets and late balises: what observers tell does not depend on the communication step."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from cosim import Outcome, Scenario

pytestmark = pytest.mark.compiler
OBSERVERS = {"predicted": {}, "held": {"predictors": 0, "between_samples": "held"}}
STOP = 6.0
LATE = {"delay": 0.15}
VARYING = {
    "delay": 0.13,
    "delay_model": "uniform",
    "delay_spread": 0.04,
    "jitter": 0.013,
    "loss_fraction": 0.1,
    "duplicate_fraction": 0.2,
    "equalise": 0.19,
    "seed": 3,
}


def run(step: float, network: dict[str, Any], stepper: str = "auto") -> Outcome:
    """Open loop, so that the train itself moves the same whatever the step: a driver would hold its effort over it."""
    scenario = Scenario(stop=STOP, step=step).master(stepper=stepper)
    scenario.add("train", model="locomotive", preset="chapter_3_four_axles", parameters={"effort": 3e4})
    for name, options in OBSERVERS.items():
        parameters = {"delay": network.get("equalise", network["delay"]), "effort": 3e4}
        scenario.add(name, observer="delayed_train_observer", options=options, parameters=parameters)
        scenario.connect(f"train.wheel_speed -> {name}.packet_speed")
    scenario.balises(
        position="train.position", speed="train.speed", layout="spacing", spacing=3.0, track_end=99.0, latency=0.15
    )
    scenario.network(period=0.1, receivers=list(OBSERVERS), nodes={"tachometer": ["train.wheel_speed"]}, **network)
    outcome = scenario.run(warn=lambda _warning: None)
    assert outcome.failure is None
    return outcome


def at(outcome: Outcome, name: str) -> np.ndarray:
    """Last row of each tenth of a second."""
    instants = np.arange(0.1, STOP + 1e-9, 0.1)
    rows = np.searchsorted(outcome["time"], instants + 1e-9) - 1
    return np.asarray(outcome[name])[rows]


@pytest.mark.parametrize("network", [LATE, VARYING], ids=["on communication points", "anywhere"])
def test_observers_behind_a_network_do_not_depend_on_the_step(network: dict[str, Any]) -> None:
    """Internal steps divide a run elsewhere, which leaves rounding: 1e-11 of metres."""
    fine, *others = (run(step, network) for step in (0.001, 0.01, 0.1))
    assert np.ptp(at(fine, "predicted.position")) > 3.0
    for other in others:
        for name in OBSERVERS:
            for what in ("position", "speed"):
                signal = f"{name}.{what}"
                np.testing.assert_allclose(at(other, signal), at(fine, signal), rtol=0.0, atol=1e-9, err_msg=signal)


def test_the_python_stepper_sends_equal_packets() -> None:
    """A balise in a step makes the compiled stepper leave it: what is sent at its end is still measured there."""
    packets = [[(p.stamp, p.values) for p in run(0.1, LATE, stepper).result.packets] for stepper in ("python", "auto")]
    assert packets[0] == packets[1]
