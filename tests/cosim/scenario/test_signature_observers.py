"""Observers by signatures beside their plants: what the scenario expects, and what the gains do."""

import numpy as np
import pytest

from cosim import Scenario

pytestmark = pytest.mark.compiler


def test_states_and_rate_are_reported_and_gains_order_the_errors() -> None:
    outcome = Scenario.load("signature_observers").run(warn=lambda _text: None)
    assert outcome.failure is None
    assert all(evaluated.passed for evaluated in outcome.expectations)
    late = outcome.result.time >= 2.5
    errors = {
        name: float(np.sqrt(np.mean(np.square(outcome[f"{name}.x2"] - outcome["plant.x2"])[late])))
        for name in ("table", "smooth", "model")
    }
    alone = float(np.sqrt(np.mean(np.square(outcome["table.x2_look_up"] - outcome["plant.x2"])[late])))
    assert errors["smooth"] < errors["table"] < alone < errors["model"]  # Figs 4.16 to 4.18
    first = outcome["table.window_full"].argmax()
    assert outcome.result.time[first] == pytest.approx(2 * 5e-3)  # three samples, the first of them at the start
