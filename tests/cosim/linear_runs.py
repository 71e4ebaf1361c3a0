"""Runs of linear systems cut into components: for the laws of algorithms, lines and step control."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from coupled_runs import execution_order
from test_fmus.masses import Chain, Cut

from cosim.components.component import Component
from cosim.components.fmi3 import FMI3Component
from cosim.components.loading import load_block, load_fmu
from cosim.coupling.connection import connect
from cosim.coupling.plan import Plan, make_plan
from cosim.master.algorithms.gauss_seidel import GaussSeidel
from cosim.master.axis import TimeAxis
from cosim.master.control.fixed import FixedStep
from cosim.master.control.multirate import set_rates
from cosim.master.interpolation.attach import attach_interpolators
from cosim.master.master import Master, close


@dataclass
class LinearRun:
    """What a run left, beside the closed form of the whole.

    Args:
        table: rows. interpolators: by component, how it was told of its lines. master: after the run.
    """

    cut: Cut
    chain: Chain
    table: np.ndarray
    interpolators: Mapping[str, str]
    master: Master

    @property
    def error(self) -> float:
        """Largest error of any position or speed, at any row."""
        exact = self.chain.reference(self.table["time"])
        return max(
            float(np.abs(self.table[signal] - exact[quantity]).max()) for quantity, signal in self.cut.signals.items()
        )

    @property
    def energy_error(self) -> float:
        """Largest error of the energy, as a share of the energy at the start."""
        n = self.chain.count
        positions = np.stack([self.table[self.cut.signals[f"p{i + 1}"]] for i in range(n)], axis=1)
        speeds = np.stack([self.table[self.cut.signals[f"v{i + 1}"]] for i in range(n)], axis=1)
        exact = self.chain.reference(self.table["time"]).energy
        return float(np.abs(self.chain.of_states(positions, speeds).energy - exact).max() / exact[0])


def load(cut: Cut, folder: Path, version: Any, **capabilities: Any) -> dict[str, Component]:
    """The parts of a cut as components: FMUs of version 1, 2 or 3, or blocks ("block2", "block3")."""
    if isinstance(version, str):
        return {name: load_block(s, name, int(version[-1])) for name, s in cut.systems().items()}  # type: ignore[arg-type]
    return {name: load_fmu(path, name) for name, path in cut.fmus(folder, version, **capabilities).items()}


def prepare(
    components: Mapping[str, Component],
    connections: Sequence[str],
    h: float,
    count: int,
    *,
    inputs: Any = "hold",
    algorithm: Callable[[Plan], Any] = GaussSeidel,
    control: Callable[[Any], Any] = FixedStep,
    every: Mapping[str, int] | None = None,
    substeps: Mapping[str, int] | None = None,
    start: float = 0.0,
) -> tuple[Master, Mapping[str, str]]:
    """A master ready to run, and the interpolators of its lines."""
    pairs = connect([tuple(c.split(" -> ")) for c in connections], components)  # type: ignore[misc]
    order = execution_order(components, pairs)
    for name, component in components.items():
        if inputs != "hold" and isinstance(component, FMI3Component):
            component.request_intermediate_updates([c.target[1] for c in pairs if c.target[0] == name])
        component.instantiate()
    plan = make_plan(components, pairs, order)
    interpolators = {} if inputs == "hold" else attach_interpolators(plan, inputs)
    axis = TimeAxis(start, h, count)
    master = Master(plan, axis, algorithm=algorithm, control=control)
    set_rates(plan, axis, every or {}, substeps or {}, {})
    return master, interpolators


def run_cut(
    cut: Cut,
    chain: Chain,
    folder: Path,
    h: float,
    count: int,
    version: Any = 2,
    *,
    capabilities: Any = None,
    **how: Any,
) -> LinearRun:
    """A whole run of a cut; `how` as for `prepare`."""
    components = load(cut, folder, version, **(capabilities or {}))
    master, interpolators = prepare(components, cut.connections, h, count, **how)
    try:
        master.run()
    finally:
        close(master.plan)
    return LinearRun(cut, chain, master.recorder.table(), interpolators, master)
