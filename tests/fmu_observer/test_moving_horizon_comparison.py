"""The factor graph that the comparison of moving-horizon observers feeds, on rows where it can be known."""

from __future__ import annotations

import importlib.util
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fmu_observer.formulas.moving_horizon import gauss_newton
from fmu_observer.formulas.moving_horizon.arrival_cost import arrival_cost_at
from fmu_observer.formulas.moving_horizon.row_window import WindowRow
from fmu_observer.observers.train.balise_moving_horizon import LAYOUT, BaliseMovingHorizon, Shared
from fmu_observer.observers.train.balise_odometer_transition import ORDER
from plant_models.hybrid import vector

pytestmark = pytest.mark.foreign

STUDIES = Path(__file__).parents[2] / "docs" / "studies"
START, SPREAD = np.array([0.0, 20.0, 0.0, 0.0]), np.diag([4.0, 1.0, 0.01, 0.1])


def test_three_balises_give_what_the_window_of_least_squares_gives(monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("gtsam", reason="there are wheels for Linux on x86-64 only")
    monkeypatch.syspath_prepend(str(STUDIES))
    spec = importlib.util.spec_from_file_location("comparison", STUDIES / "moving_horizon_comparison.py")
    assert spec is not None
    assert spec.loader is not None
    study: Any = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(study)
    monkeypatch.setattr(study, "SCALES", {"geman_mcclure": 1e9})  # so wide that the loss is the square
    monkeypatch.setattr(study, "TINY", 1e-3)

    observer = BaliseMovingHorizon(window=3, loss="squares")
    p = observer.unpack_parameters(observer.start_parameters())
    shared = vector(*(getattr(p, name) for name in Shared._fields))
    moved = observer.problem.moved

    def shaken(x: Any, row: WindowRow, known: Any) -> gauss_newton.Moved:
        into = moved(x, row, known)
        return into._replace(noise=into.noise + 1e-3 * np.eye(ORDER))  # as the graph, which needs some

    graph, x = study.FactorGraphSmoother(), START
    before, rows, points = np.hstack([START, START, SPREAD.ravel()]), [], []
    for k, place in enumerate((0.7, 30.2, 61.0)):
        inputs = vector(
            0.1, 0.0, 0.0, 0.0, 20.0, 27e3, 1.0, 0.0, 0.0
        )  # offsets, speed, effort, a balise of no accuracy
        row = WindowRow(float(k > 0), 1.5, 1.5 * k, inputs, vector(place), vector(1.0))
        rows.append(LAYOUT.packed(row))
        points.append(shaken(x, row, shared).state if k else START)
        graph_row = graph.iterate(None, 1, before, None, x, rows[-1], points[-1], shared)
        ours = replace(
            observer.problem, moved=shaken, bounded=(), limits=lambda _s: gauss_newton.Limits(*2 * [np.zeros(0)])
        )
        found = gauss_newton.solve(ours, arrival_cost_at(START, SPREAD), np.array(rows), np.array(points), shared, 1)
        x = graph_row.estimate
        assert x == pytest.approx(found.estimates[-1], rel=1e-9, abs=1e-9)
