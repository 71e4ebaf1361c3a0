"""A measured speed that never arrives is refused, unless the scenario says that a constant is meant."""

from __future__ import annotations

from typing import Any

import pytest

from cosim import Scenario
from cosim.errors import CouplingError

PYTHON = {"as": "block3"}


def scenario(*lines: str, **parameters: Any) -> Scenario:
    s = Scenario(stop=0.2, step=0.1, certificates="ignore")
    s.add("train", model="longitudinal_train", parameters={"effort": 1.0}, **PYTHON)
    s.add("odometer", model="odometer", **PYTHON)
    s.add("observer", observer="odometer_reset", parameters=parameters, **PYTHON)
    return s.connect(*lines)


WHEEL, READING = "train.wheel_speed -> odometer.wheel_speed", "odometer.reading -> observer.odometer"


@pytest.mark.parametrize(
    ("lines", "missing"),
    [((READING,), "odometer.wheel_speed"), ((WHEEL,), "observer.odometer")],
)
def test_an_odometer_without_source_is_refused(lines: tuple[str, ...], missing: str) -> None:
    with pytest.raises(CouplingError, match=rf"Nothing is connected to {missing}; write a connection"):
        scenario(*lines).run()


def test_a_stated_value_says_that_it_is_meant() -> None:
    assert scenario(WHEEL, odometer=0.0).run().failure is None
    assert scenario(WHEEL, READING).run().failure is None


def test_other_inputs_are_reported_and_the_structure_is_shown() -> None:
    s = Scenario(stop=0.2, step=0.1).add("train", model="longitudinal_train", **PYTHON)
    assert "Unconnected inputs keep their start values: train.effort." in s.run().warnings
    assert scenario(READING).structure().text()
