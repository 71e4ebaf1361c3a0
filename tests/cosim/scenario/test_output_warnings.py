"""Outputs that warn, inputs that are optional: declared once, in block and FMU alike; told with instant and values."""

from __future__ import annotations

from copy import deepcopy
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fmpy.validation import validate_fmu

import cosim
from fmu_observer.annotated_variable import declared_warnings, is_optional
from fmu_observer.description import describe
from fmus import cached_fmu
from fmus.fmi.description import read_description
from plant_models import PLANTS
from plant_models.hybrid import HybridSystem
from plant_models.hybrid.signal import OutputWarning, Signal, input_signal, output_signal, parameter, state


class Kettle(HybridSystem):
    """Warms up by one kelvin a second."""

    name = "kettle"
    states = (state("warmth", "K", 0.0),)
    parameters = (parameter("alarm_at", "K", 2.0), parameter("empty_at", "K", 5.0))
    inputs = (input_signal("draught", "K/s", optional=True), input_signal("sun", "K/s"))
    outputs = (
        output_signal("temperature", "K"),
        output_signal("hot", warning=OutputWarning("is hot & boils", ("temperature",)), unit="1"),
        output_signal("empty", warning=OutputWarning("is empty < at the end", at_end=True), unit="1"),
        output_signal("ready", warning=OutputWarning("was never ready", reaches=0.5), unit="1"),
    )

    def flow(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"warmth": 1.0 + u.sun - u.draught}

    def output(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        hot, empty = np.where(x.warmth > p.alarm_at, 1.0, 0.0), np.where(x.warmth > p.empty_at, 1.0, 0.0)
        return {"temperature": x.warmth, "hot": hot, "empty": empty, "ready": 0.5 * x.warmth}


def _warnings(scenario: cosim.Scenario) -> list[str]:
    outcome = scenario.run()
    assert outcome.failure is None
    return [text for text in outcome.result.summary["warnings"] if text.startswith("kettle")]


HOT = "kettle: is hot & boils; first at 2.5 s (temperature = 2.5), for 1.5 s in all."
FORGOTTEN = "Unconnected inputs keep their start values: kettle.sun."
NOT_READY = "kettle: was never ready; ready came to 0.25 of 0.5."
EMPTY = "kettle: is empty < at the end; seen at the end, 6 s."


@pytest.mark.parametrize("stop", [0.5, 1.0, 4.0, 6.0])
def test_a_run_reports_what_was_not_zero(stop: float) -> None:
    reported = _warnings(cosim.Scenario(stop=stop, step=0.5).add("kettle", model=Kettle()))
    assert reported == {0.5: [NOT_READY], 1.0: [], 4.0: [HOT], 6.0: [HOT.replace("1.5 s in", "3.5 s in"), EMPTY]}[stop]


@pytest.mark.compiler
@pytest.mark.parametrize("version", [2, 3])
def test_an_exported_fmu_carries_its_warnings(version: int) -> None:
    path = cached_fmu(Kettle(), version)  # type: ignore[arg-type]
    assert validate_fmu(str(path)) == []
    description = read_description(Path(path))
    assert declared_warnings(description) == declared_warnings(describe(Kettle(), version))  # type: ignore[arg-type]
    assert declared_warnings(deepcopy(description)) == declared_warnings(description)
    assert [u.variable.name for u in description.outputs] == ["temperature", "hot", "empty", "ready"]
    assert [v.name for v in deepcopy(description).modelVariables if is_optional(v)] == ["draught"]
    assert all(known in description.modelVariables for u in description.outputs for known in u.dependencies)
    scenario = cosim.Scenario(stop=4.0, step=0.5).add("kettle", fmu=str(path))
    assert _warnings(scenario) == [HOT]
    assert [text for text in scenario.run().warnings if text.startswith("Unconnected")] == [FORGOTTEN]


def test_a_davis_set_beyond_its_speeds_and_a_jam_longer_than_the_run_are_reported() -> None:
    s = cosim.Scenario(stop=3.0, step=0.5)
    s.add("train", model="longitudinal_train", preset="set_d", parameters={"train_speed": 49.0})
    s.add("wheel", model="wheel_fault", parameters={"fault_onset[1]": 2.0, "fault_length[1]": 1.5})
    s.set("train.effort", 1.5).connect("train.speed -> wheel.speed")
    reported = [text for text in s.run().result.summary["warnings"] if "first at" in text or "at the end" in text]
    assert len(reported) == 2
    assert reported[0].startswith("train: the train left the speeds from fitted_from to fitted_to")
    assert "first at 1 s (speed = 50.3" in reported[0]
    assert reported[1].startswith("wheel: a given fault is not over when the run ends")
    s.set("train.fitted_to", 60.0).set("wheel.fault_length[1]", 0.5)
    assert not any("first at" in t or "at the end" in t for t in s.run().result.summary["warnings"])


def test_only_scalar_outputs_warn_and_what_they_show_are_outputs() -> None:
    with pytest.raises(ValueError, match="only a scalar output can have one"):
        Signal("speed", "m/s", "input", warning=OutputWarning("is fast"))
    with pytest.raises(ValueError, match="has no text"):
        OutputWarning(" ")

    with pytest.raises(ValueError, match="'speed' is optional; only an input can be"):
        Signal("speed", "m/s", "output", optional=True)

    class Vague(Kettle):
        outputs = (output_signal("hot", "1", warning=OutputWarning("is hot", ("colour",))),)

    with pytest.raises(ValueError, match="the warning of 'hot' is to show colour; expected scalar outputs"):
        Vague()


@pytest.mark.parametrize("name", sorted(PLANTS))
def test_a_warning_of_a_shipped_plant_reads_on_after_its_name(name: str) -> None:
    for signal in PLANTS[name]().outputs:
        if signal.warning is not None:
            assert not signal.warning.text.endswith(".")
            assert signal.warning.text[0].islower()
