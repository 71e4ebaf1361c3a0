"""How the components of a scenario will move over a step, told before the run: the chains of `cosim.coupling.chain`.

The master builds the chains themselves. Both ask the same functions who takes part in events and what a stage is
called.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

from cosim.balises.service import localiser_stage_text, receiver_stage_text
from cosim.components.component import Component
from cosim.components.fmi3 import FMI3Component
from cosim.coupling.chain import COMPILED_STAGE_TEXT, plain_way
from cosim.coupling.clocks import ClockConnection
from cosim.coupling.connection import Connection
from cosim.coupling.instants import followed
from cosim.master.algorithms.choose import AlgorithmChoice
from cosim.master.control.multirate import rate_stage_text
from cosim.master.events.choose import taking_part
from cosim.master.events.participant import interrupts
from cosim.master.events.stride import event_stage_text
from cosim.network.service import PACKET_STAGE_TEXT
from cosim.scenario.schema import ScenarioTable
from cosim.structure.structure_data import Balises

AT_SET_UP = "chosen at set-up"
COMPILED = f"{COMPILED_STAGE_TEXT} (where the run can use it)"


def movement_chains(
    table: ScenarioTable,
    components: Mapping[str, Component],
    connections: Sequence[Connection],
    clocks: Sequence[ClockConnection],
    choice: AlgorithmChoice,
    balises: Balises | None,
    listeners: Collection[str] | None = None,
) -> dict[str, tuple[str, ...]]:
    """The chain of each component in words, outermost stage first; what a probe decides is named as such.

    Args:
        table: the scenario. components: by name, in execution order. connections: checked.
        clocks: connections between clocks. choice: of the algorithm.
        balises: who finds the balises and who receives the telegrams, or None.
        listeners: who is told of packets by events; None where there is no network.
    """
    part = taking_part(components, connections, clocks, table.master.events, _alone(table, balises))
    propagated = bool(part) and table.master.events == "propagate"
    divided = propagated or listeners is not None
    back = propagated and any(
        isinstance(c, FMI3Component) and interrupts(c, gives=part[name])
        for name, c in components.items()
        if name in part
    )
    connected = {c.target[0] for c in connections}
    ahead = followed(components, connections)
    lines = {c.target[0] for c in connections if c.source_variable in ahead}
    every_line = table.master.inputs != "hold"
    compiled = not part and not every_line and not lines and _may_compile(table, components, connections, choice)
    chains = {}
    for name, component in components.items():
        every, whole = table.components[name].every, not component.can_vary_step
        stages = [rate_stage_text(every)] if every > 1 else []
        stages += [event_stage_text(whole=whole)] if divided and (back or whole) else []
        told = _balise_stage(name, balises)
        stages += told or ([PACKET_STAGE_TEXT] if name in (listeners or ()) else [])
        stages += [COMPILED] if compiled else []
        interpolator = AT_SET_UP if every_line or name in lines else None
        inputs, substeps = name in connected, table.components[name].substeps
        chains[name] = *stages, plain_way(interpolator, substeps, inputs=inputs, gated=name in part)
    return chains


def _balise_stage(name: str, balises: Balises | None) -> list[str]:
    if balises is None:
        return []
    if name == balises.plant:
        return [localiser_stage_text(AT_SET_UP if balises.method == "auto" else balises.method)]
    return [receiver_stage_text(balises.timing)] if name in balises.receivers else []


def _alone(table: ScenarioTable, balises: Balises | None) -> str | None:
    """A watched plant that reports balises by early return."""
    if balises is None or table.balises is None or table.balises.layout == "recorded":
        return None
    early = balises.method == "early-return" or (balises.method == "auto" and table.balises.clock is not None)
    return balises.plant if early else None


def _may_compile(
    table: ScenarioTable,
    components: Mapping[str, Component],
    connections: Sequence[Connection],
    choice: AlgorithmChoice,
) -> bool:
    """Whether nothing that is known before the run keeps it from the compiled stepper."""
    master = table.master
    rates = any(t.every > 1 or t.substeps > 1 for t in table.components.values())
    python = any(c.kind != "FMU" for c in components.values()) or any(c.exact or c.table for c in connections)
    steps = master.control == "fixed" and choice.algorithm in ("gauss-seidel", "jacobi") and master.threads == 1
    return master.stepper != "python" and steps and not rates and not python
