"""The table of errors in docs/reference/algorithms.md comes out: recomputed against the closed form of the whole."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from iterated_runs import run
from test_algorithms import load, worst_error
from test_fmus.masses import Chain, cuts

PAGE = Path(__file__).parents[4] / "docs" / "reference" / "algorithms.md"
CHAIN = Chain.two()
LONG = 5.0
"""Length of a run [s]."""

WAYS: dict[str, dict[str, Any]] = {
    "Jacobi": {"algorithm": "jacobi"},
    "Gauss-Seidel": {"algorithm": "gauss-seidel"},
    "iterate": {"algorithm": "iterate"},
    "Gauss-Seidel, extrapolate": {"algorithm": "gauss-seidel", "inputs": "extrapolate"},
    "iterate, interpolate": {"algorithm": "iterate", "inputs": "interpolate"},
}
ROWS = [(name, way) for name in ("displacement-displacement", "force-displacement", "force-force") for way in WAYS]


def measured(folder: Path, name: str, way: str) -> tuple[float, float, float, float]:
    """Error at 10 ms and at 5 ms, order, and share of the energy won after the run at 10 ms."""
    cut = cuts(CHAIN)[name]
    errors, gains = [], []
    for h in (0.01, 0.005):
        parts = load(cut, folder, 2, input_derivatives=True)
        table, _ = run(parts, cut.connections, h, round(LONG / h), WAYS[way])
        errors.append(worst_error(cut, CHAIN, table))
        states = [np.stack([table[-1:][cut.signals[f"{q}{i}"]] for i in (1, 2)], axis=1) for q in "pv"]
        gains.append(CHAIN.of_states(*states).energy[0] / CHAIN.reference([0.0]).energy[0] - 1.0)
    return errors[0], errors[1], float(np.log2(errors[0] / errors[1])), float(gains[0])


def line(name: str, way: str, numbers: tuple[float, float, float, float]) -> str:
    coarse, fine, order, gain = numbers
    return f"| {name} | {way} | {coarse:.1e} | {fine:.1e} | {order:.1f} | {gain:+.0e} |"


@pytest.mark.compiler
@pytest.mark.parametrize(("name", "way"), ROWS)
def test_a_row_of_the_table_is_what_comes_out(tmp_path: Path, name: str, way: str) -> None:
    """To the digits shown; an energy that is kept to rounding is shown as such."""
    found = re.search(
        rf"^\| {re.escape(name)} \| {re.escape(way)} \|(.*)\|$", PAGE.read_text(encoding="utf-8"), re.MULTILINE
    )
    assert found is not None
    coarse, fine, order, gain = (float(cell) for cell in found[1].split("|"))
    numbers = measured(tmp_path, name, way)
    assert (coarse, fine) == pytest.approx(numbers[:2], rel=0.06)  # two digits
    assert order == pytest.approx(numbers[2], abs=0.06)
    assert gain == pytest.approx(numbers[3], rel=0.5, abs=1e-9)  # one digit
