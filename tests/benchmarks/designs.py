"""Benchmark: what gain designs cost, from pole placement to linear matrix inequalities. Nothing is asserted.

``python tests/benchmarks/designs.py``. Certificates remember their answers, so designs that certify are measured once,
in a fresh process; the others are medians.
"""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable
from typing import Any

import numpy as np

from fmu_observer.certificates.polytope import polytope_stability
from fmu_observer.design.augmented_gains import design_for_gap, position_gains
from fmu_observer.design.decoupling import decoupled_gain
from fmu_observer.design.extended_disturbance import extended_gain
from fmu_observer.design.pole_placement import observer_gain
from fmu_observer.design.quasi_lpv_published import SECTION_5_3_1, SEEN
from fmu_observer.design.residual_analysis import h_infinity_norm
from fmu_observer.design.residual_channel import residual_channel
from fmu_observer.design.robust_residual import ResidualProblem, design_robust_residual
from fmu_observer.design.theorem7 import design_theorem7, largest_eta
from fmu_observer.models.train.coupled_vehicles_model import coupled_vehicles
from fmu_observer.observers.train.gains.gap_aware import design_adaptive, design_high_gain, design_takagi_sugeno

REPETITIONS = 5
TRACK: dict[str, Any] = {"spacing": 100.0, "speeds": (5.0, 14.0)}
CHAIN, FIRST = np.eye(4, k=1), np.eye(1, 4)
ROBUST = ResidualProblem(SECTION_5_3_1.vertices, SEEN, np.eye(3)[:, :1], 0.3, decay=0.2, alpha=0.2)
RESIDUAL = residual_channel(SECTION_5_3_1.vertices[0], SECTION_5_3_1.gains[0], SEEN, np.eye(3)[:, :1])

REPEATED: dict[str, Callable[[], Any]] = {
    "pole placement, 4 states": lambda: observer_gain(CHAIN, FIRST, [-1.0, -2.0, -3.0, -4.0]),
    "augmented observer, 4 poles": lambda: position_gains([-1.0, -1.5, -2.0, -2.5]),
    "Theorem 7, train (0.1 s, 3 1/s)": lambda: design_theorem7("takagi_sugeno_train", 0.1, 3.0),
    "Theorem 7, E1 core (0.2 s, 1 1/s)": lambda: design_theorem7(
        "triangularisable_example", 0.2, 1.0, performance=False
    ),
    "Theorem 7, E2 (0.4 s, 0.1 1/s)": lambda: design_theorem7("non_triangularisable_example", 0.4, 0.1),
    "proportional-integral observer, 3 states": lambda: extended_gain(
        -0.1 * np.eye(1), np.eye(1), np.eye(1), 2, [-50.0, -50.0, -1.5]
    ),
    "decoupling observer, locomotive and wagon": lambda: decoupled_gain(coupled_vehicles(), [-2.0, -2.5, -3.0]),
    "robust residual, two vertices": lambda: design_robust_residual(ROBUST),
    "H-infinity norm, 3 states": lambda: h_infinity_norm(RESIDUAL),
    "decay rate over two vertices": lambda: polytope_stability(SECTION_5_3_1.errors),
    "largest eta, train, 0.5 s": lambda: largest_eta("takagi_sugeno_train", 0.5, 3.0),
}
ONCE: dict[str, Callable[[], Any]] = {
    "augmented observer certified for 0.5 s": lambda: design_for_gap(0.5),
    "high gain for a balise every 100 m": lambda: design_high_gain(**TRACK),
    "Takagi-Sugeno for a balise every 100 m": lambda: design_takagi_sugeno(**TRACK, trust="balises"),
    "adapting gain for a balise every 100 m": lambda: design_adaptive(**TRACK, acceleration=0.7),
}


def main() -> None:
    """Print a line for each design."""
    for name, design in REPEATED.items():
        design()  # cvxpy and its solver are loaded here
        print(f"{name:<48} {1e3 * statistics.median(seconds(design) for _ in range(REPETITIONS)):10.2f} ms", flush=True)
    for name, design in ONCE.items():
        print(f"{name:<48} {1e3 * seconds(design):10.2f} ms, certificate included", flush=True)


def seconds(call: Callable[[], Any]) -> float:
    """Duration [s] of a call."""
    begin = time.perf_counter()
    call()
    return time.perf_counter() - begin


if __name__ == "__main__":
    main()
