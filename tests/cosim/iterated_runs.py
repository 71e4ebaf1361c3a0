"""Runs of cut systems by an algorithm of choice: groups, choice and master as a scenario makes them, without a
scenario.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from cosim.components.component import Component
from cosim.coupling.connection import connect
from cosim.coupling.graph import execution_groups
from cosim.coupling.plan import make_plan
from cosim.master.algorithms.choose import choose_algorithm
from cosim.master.axis import TimeAxis
from cosim.master.interpolation.attach import attach_interpolators
from cosim.master.master import Master, close
from cosim.run.master_setup import _make_algorithm
from cosim.scenario.scenario_tables import MasterTable


def prepare(
    components: Mapping[str, Component],
    connections: Sequence[str],
    h: float,
    count: int,
    table: Mapping[str, Any] | None = None,
) -> Master:
    """A master ready to run; `table` as ``[master]`` of a scenario."""
    wanted = MasterTable.model_validate(table or {})
    pairs = connect([tuple(c.split(" -> ")) for c in connections], components)  # type: ignore[misc]
    groups = execution_groups(components, pairs)
    choice = choose_algorithm(wanted.algorithm, groups, components)
    for component in components.values():
        component.instantiate()
    plan = make_plan(components, pairs, [name for group in groups for name in group.names])
    if wanted.inputs != "hold":
        attach_interpolators(plan, wanted.inputs)
    return Master(plan, TimeAxis(0.0, h, count), algorithm=lambda plan: _make_algorithm(wanted, plan, choice))


def run(*arguments: Any, **keywords: Any) -> tuple[np.ndarray, Mapping[str, Any]]:
    """`prepare`, run, close: the table, and the summary of the algorithm."""
    master = prepare(*arguments, **keywords)
    try:
        master.run()
    finally:
        close(master.plan)
    return master.recorder.table(), master.system.algorithm.summary()
