"""Sessions of pytest inside a test, over results made by hand."""

from __future__ import annotations

import pytest

MADE = """
import numpy as np
import pytest
from cosim.results.result import Result, SignalInfo

def line(slope=1.0, names=("train.speed", "train.position")):
    table = np.zeros(11, [("time", float), *((name, float) for name in names)])
    for name in table.dtype.names:
        table[name] = 0.1 * np.arange(11) * (1.0 if name == "time" else slope)
    return Result(table, [SignalInfo(name, "m/s") for name in names])
"""
ONE = MADE + "def test_line(fmu_regression):\n    fmu_regression(line(SLOPE))\n"
"""A test of a result made by hand: the plugin's ways without the cost of a run."""


def write(pytester: pytest.Pytester, text: str, slope: float = 1.0, name: str = "test_train") -> None:
    pytester.makepyfile(**{name: text.replace("SLOPE", repr(slope))})


def run(pytester: pytest.Pytester, *options: str) -> pytest.RunResult:
    return pytester.runpytest_inprocess("-p", "no:cacheprovider", *options)
