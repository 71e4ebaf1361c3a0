"""Runs with model exchange FMUs: beside their own co-simulation, by either stepper, by their keys in a scenario."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Literal

import fmpy
import numpy as np
import pytest
from test_fmus.exchange import exchange_fmu

import fmus
from cosim import CosimError, Outcome, Scenario
from fmu_observer import OBSERVERS
from fmus.exchange.model_calls import ModelCalls
from fmus.exchange.motion import Motion
from fmus.exchange.sent import SentValues
from plant_models import Locomotive

MOVING = {"train_speed": 10.0, "wheel_rate": 10.0 / 0.575, "effort": 3e4}


def observed(fmu: Path, interface: str) -> Outcome:
    """An observer FMU that takes balises, on a shipped train."""
    s = Scenario(stop=10.0, step=0.1).add("train", model="locomotive", parameters=MOVING)
    s = s.add("observer", fmu=str(fmu), interface=interface, tolerance=1e-10)  # type: ignore[typeddict-item]
    s = s.connect("train.wheel_speed -> observer.odometer")
    s = s.balises(position="train.position", speed="train.speed", layout="positions", positions=[30.0, 80.0])
    return s.run()


@pytest.mark.parametrize("version", [2, 3])
def test_an_observer_takes_telegrams_in_model_exchange_as_in_co_simulation(
    tmp_path: Path, version: Literal[2, 3]
) -> None:
    """By the clock in FMI 3, by the count in FMI 2."""
    system = OBSERVERS["takagi_sugeno_cdo"]()
    fmu = fmus.build_fmu(system, tmp_path / "observer.fmu", fmi_version=version, preset="long_gaps")
    one, other = (observed(fmu, interface) for interface in ("co-simulation", "model-exchange"))
    for outcome in (one, other):
        assert outcome.failure is None
        assert [event.outcomes["observer"] for event in outcome.result.events] == ["accepted", "accepted"]
    for signal in ("observer.position", "observer.speed"):
        assert np.abs(one[signal] - other[signal]).max() < 1e-7


@pytest.mark.parametrize("version", [2, 3])
def test_a_train_moves_as_under_the_solver_of_fmpy(tmp_path: Path, version: Literal[2, 3]) -> None:
    fmu = fmus.build_fmu(Locomotive(), tmp_path / "train.fmu", fmi_version=version)
    s = Scenario(stop=20.0, step=0.1)
    s = s.add("train", fmu=str(fmu), interface="model-exchange", tolerance=1e-9, parameters=MOVING | {"effort": -4e4})
    ours = s.run()
    theirs = fmpy.simulate_fmu(
        str(fmu),
        fmi_type="ModelExchange",
        solver="CVode",
        relative_tolerance=1e-9,
        stop_time=20.0,
        output_interval=0.1,
        start_values=MOVING | {"effort": -4e4},
        output=["position", "speed"],
    )
    at = np.searchsorted(theirs["time"], ours["time"] - 1e-9)
    for signal in ("position", "speed"):
        assert np.abs(ours[f"train.{signal}"] - theirs[signal][at]).max() < 1e-5


def coupled(fmu: Path, stepper: str) -> Outcome:
    """Two of an FMU; what the first shows is the input of the second, which jumps at each communication point."""
    s = Scenario(stop=2.0, step=0.1).add("plant", fmu=str(fmu), parameters={"input": 0.3})
    s = s.add("other", fmu=str(fmu)).connect("plant.position -> other.input")
    return s.set("master.stepper", stepper).set("master.events", "local").run()


@pytest.mark.parametrize("model", ["TRAIN", "DECAY", "STEPS", "BALL", "REACTION", "ESCAPES"])
@pytest.mark.parametrize("version", [1, 2, 3])
def test_both_steppers_and_a_solver_in_python_give_equal_bits(
    tmp_path: Path, model: str, version: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    fmu = exchange_fmu(tmp_path, model, version)
    outcomes = [coupled(fmu, "python"), coupled(fmu, "compiled")]
    monkeypatch.setattr(ModelCalls, "native", lambda *_: None)
    outcomes.append(coupled(fmu, "python"))
    assert len({outcome.result.table.tobytes() for outcome in outcomes}) == 1
    assert len({outcome.failure for outcome in outcomes}) == 1
    counts = [[c["solver"] for c in outcome.result.summary["components"]] for outcome in outcomes]
    assert counts[0] == counts[1] == counts[2]


@pytest.mark.parametrize(("model", "version"), [("TRAIN", 1), ("TRAIN", 2), ("TRAIN", 3), ("BALL", 1), ("BALL", 2)])
def test_inputs_that_jump_are_handled_without_python(
    tmp_path: Path, model: str, version: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    called = list[str]()

    def noted(where: type, name: str) -> None:
        own = getattr(where, name)

        def note(*arguments: Any, **named: Any) -> Any:
            called.append(name)
            return own(*arguments, **named)

        monkeypatch.setattr(where, name, note)

    noted(Motion, "advance")
    noted(Motion, "proceed")
    noted(SentValues, "put")
    assert coupled(exchange_fmu(tmp_path, model, version), "compiled").failure is None
    assert set(called) == {"put"}  # a value is met first in Python
    assert len(called) <= 8  # of two components, before the first step and in it


def test_the_summary_and_the_structure_say_what_moves_it(tmp_path: Path) -> None:
    s = Scenario(stop=1.0, step=0.1).add("plant", fmu=str(exchange_fmu(tmp_path, "TRAIN")), method="adams")
    solver = s.run().result.summary["components"][0]["solver"]
    assert (solver["name"], solver["method"], solver["tolerance"]) == ("cvode", "adams", 1e-8)
    assert 10 <= solver["steps"] < 60
    assert "model exchange, moved by CVODE here" in str(s.structure())


def test_keys_of_a_solver_belong_to_an_fmu() -> None:
    with pytest.raises(CosimError, match="'method' belongs to an FMU, which a solver moves in model exchange"):
        Scenario(stop=1.0, step=0.1).add("train", model="locomotive", method="adams")
    with pytest.raises(CosimError, match="method"):
        Scenario(stop=1.0, step=0.1).add("train", fmu="x.fmu", method="euler")  # type: ignore[typeddict-item]
