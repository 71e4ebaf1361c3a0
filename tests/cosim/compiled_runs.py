"""Runs of one scenario by both steppers, for the tests that they cannot be told apart."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from test_fmus.build import linear_fmu

from cosim import Scenario
from cosim.run.outcome import Outcome

COUNTED = ("calls",)


def both(scenario: Scenario, **overrides: Any) -> tuple[Outcome, Outcome]:
    """The outcomes by the Python stepper and by the compiled one."""
    python = scenario.run(overrides={**overrides, "master.stepper": "python"}, warn=lambda _: None)
    compiled = scenario.run(overrides={**overrides, "master.stepper": "compiled"}, warn=lambda _: None)
    return python, compiled


def steps_compiled(outcome: Outcome) -> int:
    """Communication steps that the compiled stepper did."""
    assert outcome.result.summary["master"]["stepper"]["name"] == "compiled", outcome.failure
    return int(outcome.result.summary["master"]["stepper"]["steps_compiled"])


def assert_equal(python: Outcome, compiled: Outcome) -> None:
    """Tables, telegrams, failures, warnings and counters are the same to the last bit."""
    assert python.result.summary["master"]["stepper"]["name"] == "python"
    assert compiled.result.summary["master"]["stepper"]["name"] == "compiled"
    assert compiled.failure == python.failure, f"{compiled.failure!r}, by Python {python.failure!r}"
    a, b = python.result.table, compiled.result.table
    assert a.dtype == b.dtype
    if a.tobytes() != b.tobytes():
        assert len(a) == len(b)
        for name in a.dtype.names or ():
            np.testing.assert_array_equal(b[name], a[name], err_msg=name)
    assert [repr(e) for e in compiled.result.events] == [repr(e) for e in python.result.events]
    assert compiled.result.summary["warnings"] == python.result.summary["warnings"]
    for mine, reference in zip(compiled.result.summary["components"], python.result.summary["components"], strict=True):
        assert (mine["name"], mine["calls"]) == (reference["name"], reference["calls"])
        assert mine["messages"] == reference["messages"]


def random_linear(
    folder: Path, name: str, rng: np.random.Generator, version: Any, inputs: int = 1, outputs: int = 1
) -> Path:
    """A stable linear FMU with random matrices and no direct feedthrough."""
    n = int(rng.integers(1, 4))
    a = rng.normal(size=(n, n)) - 2.0 * np.eye(n)
    b, c = rng.normal(size=(n, inputs)), rng.normal(size=(outputs, n))
    return linear_fmu(folder, name, a, b, c, np.zeros((outputs, inputs)), version=version, x0=rng.normal(size=n))


def chain(folder: Path, fmus: Sequence[Path], **tables: Any) -> Scenario:
    """FMUs in a ring: each one's ``y1`` is the next one's ``u1``."""
    scenario = Scenario(folder=folder, **tables)
    names = [f"c{i}" for i in range(len(fmus))]
    for name, fmu in zip(names, fmus, strict=True):
        scenario.add(name, fmu=str(fmu))
    return scenario.connect(*(f"{a}.y1 -> {b}.u1" for a, b in zip(names, [*names[1:], names[0]], strict=True)))
