"""Remarks: what a user should know about a coupled system before it runs, in words. Changes nothing."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from cosim.components.component import Component
from cosim.coupling.connection import Connection, local_sources
from cosim.coupling.graph import undeclared
from cosim.run.component_models import make_system, values_in_use
from cosim.scenario.schema import ScenarioTable

ROUNDING = 1e-9  # of a period over a step


def coupling_warnings(
    table: ScenarioTable, components: Mapping[str, Component], connections: Sequence[Connection]
) -> tuple[list[str], list[str]]:
    """Doubts and notes about what is connected, and what is not.

    Args:
        table: the scenario. components: by name. connections: checked.

    Returns:
        Texts that warn, and texts that only explain.
    """
    doubts = []
    deaf = [
        name
        for name, of in table.components.items()
        if of.tolerance is not None and components[name].fmi_version == 1 and components[name].tolerance is None
    ]
    if deaf:
        doubts.append(
            f"FMI 1.0 co-simulation has no call that takes a tolerance; it does nothing for {', '.join(deaf)}."
        )
    doubts += _counted_too_late(table, connections)
    notes = []
    hidden = [
        f"{name}.{signal}" for name, signals in local_sources(connections, components).items() for signal in signals
    ]
    if hidden:
        notes.append(
            f"Local variables that others read; no FMU declares what acts on them at once: {', '.join(hidden)}."
        )
    silent = undeclared(components.values())
    if silent:
        notes.append(f"Declare no dependencies, algebraic loops through them assumed absent: {', '.join(silent)}.")
    return doubts, notes


def _counted_too_late(table: ScenarioTable, connections: Sequence[Connection]) -> list[str]:
    """Outputs that are the difference of an input over a period which ends between two communication points: there a
    held input is that of the point before, and the reading is wrong by the way since.
    """
    targets, sources = {c.target for c in connections}, {c.source for c in connections}
    doubts = []
    for name, of in table.components.items():
        system = make_system(of, name) if of.model is not None and table.master.inputs == "hold" else None
        differences = getattr(system, "differences", {})
        read = {output for output in differences if (name, output) in sources} or set([*differences][:1])
        for output in (output for output in differences if output in read):
            signal, period = differences[output]
            seconds = float(getattr(values_in_use(of, system), period))
            steps = seconds / table.step
            if (name, signal) in targets and (abs(steps - round(steps)) > ROUNDING * steps or round(steps) < 1):
                doubts.append(
                    f"{name}: {output} counts {signal} every {seconds:g} s ({period}), no whole number of steps of "
                    f"{table.step:g} s; between communication points its input is that of the point before, so it is "
                    f"off by up to {100.0 / steps:.2g} % of the speed. Take a step that divides the period."
                )
    return doubts
