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


@pytest.mark.parametrize(("latency", "most"), [(0.0, 450), (0.25, 600)], ids=["on time", "late, replayed"])
def test_a_step_with_a_telegram_to_two_observers(telegrams: ModuleType, latency: float, most: int) -> None:
    counted = telegrams.run("block3", "python", latency, stop=8.0, counted=True)
    assert len(counted.calls[True]) >= 2
    assert median(counted.calls[True]) <= most
    assert median(counted.calls[False]) <= 120
