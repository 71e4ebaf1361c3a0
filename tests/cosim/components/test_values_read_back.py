"""What an FMU does not take is reported, what it rounds is not, and one that refuses to be read is let be."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from fmpy.model_description import ModelVariable
from hypothesis import given
from hypothesis import strategies as st
from test_fmus.events import DEEDS, hostile_fmu

from cosim import Scenario
from fmus.fmi.elements import Variables
from fmus.fmi.read_back import not_taken


class Held:
    """An instance of FMI 2 with one variable, which holds what it makes of a value."""

    def __init__(self, kind: str, held: Any) -> None:
        variable = ModelVariable(name="p", valueReference=1)
        variable.type, variable.causality = kind, "parameter"
        self.variables, self.fmi_version = Variables(p=variable), 2
        self.negated: frozenset[str] = frozenset()
        self.slave = SimpleNamespace(**{f"get{kind}": held})


def found(kind: str, stated: Any, held: Any) -> list[str]:
    instance: Any = Held(kind, held)
    return [str(one) for one in not_taken(instance, {"p": stated})]


@given(st.floats(width=64), st.booleans())
def test_what_is_held_in_single_precision_is_taken(value: float, single: bool) -> None:
    with np.errstate(over="ignore"):
        held = float(np.float32(value)) if single and 1e-37 < abs(value) < 3e38 else value
    assert found("Real", value, lambda _references: [held]) == []


@given(st.floats(-1e9, 1e9), st.floats(-1e9, 1e9))
def test_what_differs_by_more_is_reported_with_both_values(value: float, bound: float) -> None:
    reported = found("Real", value, lambda _references: [min(value, bound)])
    assert bool(reported) == (bound < value and not np.isclose(bound, value, rtol=1e-6, atol=0.0))
    assert all(text == f"p was set to {value:.9g} and is {bound:.9g}" for text in reported)


def test_whole_numbers_and_texts_are_compared_as_they_are() -> None:
    assert found("Integer", 7, lambda _references: [8]) == ["p was set to 7 and is 8"]
    assert found("Boolean", True, lambda _references: [False]) == ["p was set to True and is False"]
    assert found("String", "a", lambda _references: ["b"]) == ["p was set to 'a' and is 'b'"]
    assert found("String", "a", lambda _references: [""]) == []  # a text that is only written


def test_a_refusal_to_be_read_is_no_finding() -> None:
    def refuse(_references: Any) -> list[float]:
        raise RuntimeError("not now")

    assert found("Real", 1.0, refuse) == []


@pytest.fixture(scope="module")
def fmu(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return hostile_fmu(tmp_path_factory.mktemp("read_back"))


@pytest.mark.compiler
@pytest.mark.parametrize("stepper", ["python", "compiled"])
@pytest.mark.parametrize(
    ("deed", "reported"),
    [("bounds", "at was set to 0.4 and is 0.3"), ("overwrites", "at was set to 0.4 and is 0.3"), ("nothing", "")],
)
def test_a_run_names_what_an_fmu_does_not_take(fmu: Path, deed: str, reported: str, stepper: str) -> None:
    parameters = {"deed": float(DEEDS.index(deed)), "at": 0.4}
    scenario = Scenario(stop=0.5, step=0.1, master={"stepper": stepper}).add("bad", fmu=str(fmu), parameters=parameters)
    warnings = [text for text in scenario.run().warnings if "does not take" in text]
    assert warnings == ([f"bad does not take what it is set: {reported}."] if reported else [])


@pytest.mark.compiler
def test_it_is_said_before_the_first_step_where_it_is_known_there(fmu: Path) -> None:
    said: list[str] = []
    parameters = {"deed": float(DEEDS.index("bounds")), "at": 0.4}
    scenario = Scenario(stop=0.5, step=0.1, master={"stepper": "python"}).add(
        "bad", fmu=str(fmu), parameters=parameters
    )
    scenario.run(warn=said.append, progress=lambda *_: said.append("a step"))
    assert any("does not take" in text for text in said[: said.index("a step")])
