"""Answers of an FMU that the stepper in C keeps for Python: each reaches the call that it is for, or none."""

from __future__ import annotations

import ctypes
from typing import Any

import numpy as np
import pytest

from cosim import Scenario
from cosim.compiled.recorded_returns import RecordedReturn


@pytest.mark.parametrize("version", [2, 3])
def test_a_response_is_never_written_into_another_call(version: int) -> None:
    target = np.zeros(3)
    place = target.ctypes.data_as(ctypes.POINTER(ctypes.c_double))
    function = {2: "fmi2GetReal", 3: "fmi3GetFloat64"}[version]
    recorded = RecordedReturn(values=np.array([1.0, 2.0]).tobytes())
    for count in (1, 3):
        with pytest.raises(RuntimeError, match=f"{function} for {8 * count} bytes met an answer of 16"):
            recorded(
                function, None, None, ctypes.c_size_t(count), place, *([ctypes.c_size_t(count)] if version == 3 else [])
            )
    recorded(function, None, None, ctypes.c_size_t(2), place, *([ctypes.c_size_t(2)] if version == 3 else []))
    assert target.tolist() == [1.0, 2.0, 0.0]


def run(stepper: str) -> np.ndarray:
    """A receiver that counts missing samples, and says at a telegram what Python must finish."""
    scenario = Scenario(stop=0.4, step=0.1, certificates="ignore").master(stepper=stepper)
    scenario.add("train", model="longitudinal_train", parameters={"train_speed": 20.0}, **{"as": "fmu3"})
    alone = {"odometer": 0.0}
    scenario.add("observer", observer="stopping_uio", preset="repaired", parameters=alone, **{"as": "fmu3"})
    scenario.balises(layout="positions", positions=[2.0], position="train.position", speed="train.speed")
    outcome = scenario.run(warn=lambda _: None)
    assert outcome.failure is None
    return outcome.result.table


@pytest.mark.compiler
def test_a_receiver_that_counts_missing_samples_gives_equal_numbers_in_both_steppers(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Its count was read in the middle of a telegram, with the answer that its outputs were to get."""
    astray: list[Exception] = []
    response = RecordedReturn.__call__

    def watched(self: RecordedReturn, *arguments: Any) -> int:
        try:
            return response(self, *arguments)
        except RuntimeError as error:
            astray.append(error)
            raise

    monkeypatch.setattr(RecordedReturn, "__call__", watched)
    assert run("compiled").tobytes() == run("python").tobytes()
    assert astray == []
