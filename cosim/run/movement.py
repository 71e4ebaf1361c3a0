"""From what is coupled to how each component will move over a step, in words: the chains of `cosim.coupling.chain`.

The master builds the chains themselves. Both ask the same functions who takes part in events and what a stage is
called.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence, Set
from dataclasses import dataclass

from cosim.balises.service import localiser_stage_text, receiver_stage_text
from cosim.components.component import Component
from cosim.components.fmi3 import FMI3Component
from cosim.coupling.chain import COMPILED_STAGE_TEXT, plain_way
from cosim.coupling.connection import Connection
from cosim.coupling.instants import followed
from cosim.master.algorithms.choose import AlgorithmChoice
from cosim.master.control.multirate import rate_stage_text
from cosim.master.events.choose import taking_part
from cosim.master.events.participant import interrupts
from cosim.master.events.stride import event_stage_text
from cosim.network.service import PACKET_STAGE_TEXT
from cosim.run.coupled import Coupled
from cosim.scenario.schema import ScenarioTable
from cosim.structure.structure_data import Balises

AT_SET_UP = "chosen at set-up"
COMPILED = f"{COMPILED_STAGE_TEXT} (where the run can use it)"


@dataclass(frozen=True, slots=True)
class _Steps:
    """How components are brought over a step.

    Args:
        part: which take part in events, and whether each gives some. divided: whether others halt within steps.
        returns: whether a component may end a step early, so that others must go back.
        lines: components with inputs that follow lines. compiled: whether the compiled stepper may take them.
    """

    part: Mapping[str, bool]
    divided: bool
    returns: bool
    lines: Set[str]
    compiled: bool


def movement_chains(
    table: ScenarioTable, coupled: Coupled, order: Sequence[str], choice: AlgorithmChoice, balises: Balises | None
) -> dict[str, tuple[str, ...]]:
    """The chain of each component in words, outermost stage first; what a probe decides is named as such.

    Args:
        table: the scenario. coupled: its components and connections. order: of execution. choice: of the algorithm.
        balises: who finds the balises and who receives the telegrams, or None.
    """
    steps = _steps(table, coupled, order, choice, balises)
    connected = {c.target[0] for c in coupled.routed}
    listeners = [] if coupled.network is None else [listener.component for listener in coupled.network.listeners]
    chains = {}
    for name in order:
        own = table.components[name]
        stages = [rate_stage_text(own.every)] if own.every > 1 else []
        stages += _event_stage(coupled.components[name], steps)
        stages += _balise_stage(name, balises) or ([PACKET_STAGE_TEXT] if name in listeners else [])
        stages += [COMPILED] if steps.compiled else []
        interpolator = AT_SET_UP if name in steps.lines else None
        chains[name] = (
            *stages,
            plain_way(interpolator, own.substeps, inputs=name in connected, gated=name in steps.part),
        )
    return chains


def _steps(
    table: ScenarioTable, coupled: Coupled, order: Sequence[str], choice: AlgorithmChoice, balises: Balises | None
) -> _Steps:
    components, events = {name: coupled.components[name] for name in order}, table.master.events
    part = taking_part(components, coupled.routed, coupled.clocks, events, _alone(table, balises))
    propagated = bool(part) and events == "propagate"
    returns = propagated and any(
        isinstance(c, FMI3Component) and interrupts(c, gives=part[name])
        for name, c in components.items()
        if name in part
    )
    ahead = followed(components, coupled.routed)
    every_line = table.master.inputs != "hold"
    lines = set(order) if every_line else {c.target[0] for c in coupled.routed if c.source_variable in ahead}
    compiled = not part and not lines and _may_compile(table, components, coupled.routed, choice)
    return _Steps(part, propagated or coupled.network is not None, returns, lines, compiled)


def _event_stage(component: Component, steps: _Steps) -> list[str]:
    whole = not component.can_vary_step
    return [event_stage_text(whole=whole)] if steps.divided and (steps.returns or whole) else []


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
