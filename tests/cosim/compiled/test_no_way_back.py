"""An FMU that steps only where no state will be set back comes as far as any, in both steppers, while none is saved."""

from __future__ import annotations

from pathlib import Path

import lying_fmus
import numpy as np
import pytest

import cosim


def _speed(path: Path, stepper: str) -> np.ndarray:
    scenario = cosim.Scenario(folder=path.parent, stop=0.5, step=0.1, master={"stepper": stepper})
    scenario.add("plant", fmu=path.name, parameters={"force": 1.0})
    return np.asarray(scenario.run(warn=lambda _: None)["plant.speed"])


@pytest.mark.compiler
@pytest.mark.parametrize("stepper", ["python", "compiled"])
def test_steps_are_announced_as_final_while_no_state_is_saved(stepper: str, tmp_path: Path) -> None:
    found = _speed(lying_fmus.build(tmp_path / "lie", "STEPS_ONLY_AHEAD"), stepper)
    np.testing.assert_array_equal(found, _speed(lying_fmus.build(tmp_path / "honest"), stepper))
    assert found[-1] != found[0]
