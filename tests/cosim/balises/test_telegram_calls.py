"""What is prepared once is not made again at each telegram: Python calls of a step with a telegram, counted."""

from __future__ import annotations

import importlib
from pathlib import Path
from statistics import median
from types import ModuleType

import pytest

BENCHMARKS = Path(__file__).parents[2] / "benchmarks"


@pytest.fixture
def telegrams(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    monkeypatch.syspath_prepend(str(BENCHMARKS))
    return importlib.import_module("telegrams")


MOST = 480


@pytest.mark.parametrize("latency", [0.0, 0.25], ids=["on time", "late, replayed"])
@pytest.mark.parametrize("kind", ["block3", "block2"])
def test_a_step_with_a_telegram_to_two_observers(telegrams: ModuleType, kind: str, latency: float) -> None:
    counted = telegrams.run(kind, "python", latency, stop=8.0, counted=True)
    assert len(counted.calls[True]) >= 2
    assert median(counted.calls[True]) <= MOST
    assert median(counted.calls[False]) <= 110


@pytest.mark.compiler
@pytest.mark.parametrize("latency", [0.0, 0.25], ids=["on time", "late, replayed"])
@pytest.mark.parametrize("kind", ["fmu3", "fmu2"])
@pytest.mark.parametrize("stepper", ["python", "compiled"])
def test_a_telegram_to_two_observers_that_are_fmus(
    telegrams: ModuleType, kind: str, stepper: str, latency: float
) -> None:
    """Of the compiled stepper all calls in a run, a telegram; what is prepared at the first one counts there."""
    assert median(telegrams.run(kind, stepper, latency, counted=True).calls[True]) <= MOST
