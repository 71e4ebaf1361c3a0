"""The scenario `lost_effort`: three observers beside a locomotive that spins, judged by the coupler that none of them
sees.
"""

from __future__ import annotations

import numpy as np
import pytest

from cosim import Scenario

STIFFNESS, DAMPING = 2.5e6, 5e4  # of the plant's coupler [N/m], [N.s/m]


@pytest.mark.compiler
def test_the_coupler_of_a_spinning_locomotive() -> None:
    outcome = Scenario.load("lost_effort").run()
    assert outcome.failure is None
    assert outcome.expectations
    assert all(one.passed for one in outcome.expectations)
    table = outcome.result.table
    force, speeds = table["train.coupler_force[1]"], (table["train.speed"], table["train.wagon_speed[1]"])
    true = (force - DAMPING * (speeds[0] - speeds[1])) / STIFFNESS
    late = table["time"] > 8.0  # wrong starts are forgotten
    names = ("luenberger", "proportional_integral_uio", "decoupling_uio")
    worst = [1e3 * float(np.abs(table[f"{name}.elongation"] - true)[late].max()) for name in names]
    assert table["train.slip"].max() > 1.0
    # What is left of the third is the constant resistance of the wagon, 190 N and more over stiffness: 0.1 mm and more.
    assert worst[2] < 1.0 < worst[1] < 3.0
    assert worst[0] > 10.0
