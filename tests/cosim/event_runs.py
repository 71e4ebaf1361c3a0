"""Runs of components with events of their own, without a scenario: for the tests of clocks and event iteration."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from coupled_runs import Balises, Recorded, _service, execution_order
from mock_slaves import set_start

from cosim.components.component import Component
from cosim.components.loading import load_fmu
from cosim.coupling.clocks import connect_clocks
from cosim.coupling.connection import connect
from cosim.coupling.plan import Plan, make_plan
from cosim.master.algorithms.gauss_seidel import GaussSeidel
from cosim.master.axis import TimeAxis
from cosim.master.control.fixed import FixedStep
from cosim.master.master import Master, close


@dataclass
class EventRun(Recorded):
    """What a run left behind."""

    master: Master

    def jumps(self, name: str) -> list[float]:
        """The times at which a signal differs from the row before [s]."""
        return self.time[1:][np.diff(self.table[name]) != 0.0].tolist()

    def end(self, name: str) -> float:
        return float(self.table[name][-1])


def prepare(
    components: Sequence[Component],
    connections: Sequence[str],
    h: float,
    count: int,
    *,
    start: float = 0.0,
    algorithm: Callable[[Plan], Any] = GaussSeidel,
    control: Callable[[Any], Any] = FixedStep,
    events: Any = "propagate",
    balises: Balises | None = None,
    starts: dict[str, dict[str, float]] | None = None,
    order: Sequence[str] = (),
) -> Master:
    by_name = {c.name: c for c in components}
    clocks, pairs = connect_clocks([tuple(c.split(" -> ")) for c in connections], by_name)  # type: ignore[misc]
    connected = connect(pairs, by_name)
    before = [] if balises is None else [(balises.plant, name) for name in balises.receivers]
    order = order or execution_order(by_name, connected, before)
    for component in components:
        component.instantiate()
        for name, value in (starts or {}).get(component.name, {}).items():
            set_start(component, name, value)
    plan = make_plan(by_name, connected, order, None, clocks)
    service = None if balises is None else _service(plan, balises)
    return Master(plan, TimeAxis(start, h, count), service, algorithm=algorithm, control=control, events=events)


def run(*arguments: Any, **keywords: Any) -> EventRun:
    """`prepare`, run, close."""
    master = prepare(*arguments, **keywords)
    try:
        master.run()
    finally:
        close(master.plan)
    return EventRun(master.recorder.table(), master)


def parts(**paths: Path) -> list[Component]:
    """Loaded FMUs by name."""
    return [load_fmu(path, name) for name, path in paths.items()]
