"""Splitting steps anywhere changes a run by no more than the order of its method: two masses, cut and coupled again."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from linear_runs import run_cut
from test_fmus.masses import Chain, cuts

from cosim.coupling.plan import Plan
from cosim.master.algorithms.algorithm import IterationSettings
from cosim.master.algorithms.gauss_seidel import GaussSeidel
from cosim.master.algorithms.iterate import Iterate
from cosim.master.algorithms.jacobi import Jacobi
from cosim.master.control.control import StepControl
from cosim.master.system import Row, System

CHAIN = Chain.two()
DURATION = 0.5
"""Length of a run [s]."""
COARSE, FINE = 25, 50
"""Steps of a run."""


class Split(StepControl):
    """Every step in parts that end at given shares of it.

    Args:
        system: what is stepped. shares: between 0 and 1, increasing; used in turn, one list for each step.
    """

    name = "split"

    def __init__(self, system: System, shares: Sequence[Sequence[float]]) -> None:
        super().__init__(system)
        self._shares, self._number = shares, 0

    def step(self, t: float, until: float) -> Sequence[Row]:
        inner = self._shares[self._number % len(self._shares)]
        self._number += 1
        rows: list[Row] = []
        for begin, end in pairwise([t, *(t + share * (until - t) for share in inner), until]):
            rows += self.system.advance(begin, end)
        return rows


def everything(plan: Plan) -> Iterate:
    return Iterate(plan, [[step.component.name for step in plan.steps]], IterationSettings())


METHODS: dict[str, tuple[Callable[[Plan], Any], str, int]] = {
    "Gauss-Seidel, hold": (GaussSeidel, "hold", 1),
    "Jacobi, hold": (Jacobi, "hold", 1),
    "Gauss-Seidel, extrapolate": (GaussSeidel, "extrapolate", 2),
    "iterate, interpolate": (everything, "interpolate", 2),
}
PLACES = st.integers(10_000, 990_000).map(lambda part: part / 1e6)
"""A millionth of a step apart at least: nearer than 1e-9 s two times are one, and FMI 2.0 knows no step of length
zero.
"""
SPLITS = st.lists(st.lists(PLACES, max_size=3, unique=True).map(sorted), min_size=1, max_size=7)


def change_and_error(folder: Path, method: str, shares: Sequence[Sequence[float]], count: int) -> tuple[float, float]:
    """What splitting changes of the positions and speeds at most, and the error of the run that is not split."""
    algorithm, inputs, _ = METHODS[method]
    cut = cuts(CHAIN)["displacement-displacement"]
    how = {"algorithm": algorithm, "inputs": inputs, "capabilities": {"input_derivatives": True}}
    whole = run_cut(cut, CHAIN, folder, DURATION / count, count, **how)
    split = run_cut(cut, CHAIN, folder, DURATION / count, count, control=lambda system: Split(system, shares), **how)
    np.testing.assert_array_equal(split.table["time"], whole.table["time"])
    return max(
        float(np.abs(split.table[signal] - whole.table[signal]).max()) for signal in cut.signals.values()
    ), whole.error


@pytest.mark.compiler
@pytest.mark.parametrize("method", METHODS)
def test_a_split_changes_no_more_than_the_order_of_the_method(tmp_path: Path, method: str) -> None:
    """The change is below the error of the run itself, which is of the method's order, or half as much again for uneven
    parts.
    """

    @given(SPLITS)
    @settings(max_examples=4)
    def law(shares: list[list[float]]) -> None:
        (coarse, error), (fine, smaller) = (
            change_and_error(tmp_path, method, shares, count) for count in (COARSE, FINE)
        )
        assert np.log2(error / smaller) == pytest.approx(METHODS[method][2], abs=0.05)  # the next term is of order h
        assert coarse <= 1.5 * error
        assert fine <= 1.5 * smaller

    law()
