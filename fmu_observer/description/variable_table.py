"""Value references of a system's variables: contiguous blocks, the same for the block and for the exported FMU."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeVar

from fmu_observer.event_protocol import OUTCOME_VARIABLES
from plant_models.hybrid import HybridSystem, Signal, width

ItemOfTable = TypeVar("ItemOfTable")

FIRST_REFERENCE = 1
"""Value references count from here in the order of the variables: each is the index of its variable as well, as FMI 2
counts.

OMSimulator takes the dependencies of FMI 3, which are value references, for such indices, and does not load an FMU
whose references are none.
"""


@dataclass(frozen=True)
class VariableTable:
    """Value references of a system: time, then contiguous blocks in this order.

    Args:
        time: value reference of the independent variable.
        inputs: first value reference of inputs and payloads (noise is not exposed).
        outputs: first of the outputs. states: first of the states. parameters: first of the parameters.
        events: first of the event variables, two for each triggered event (clock or count, then stamp).
        protocol: first of `late_policy` and `replay_horizon`; both are missing where there is no triggered event.
        outcomes: first of the counts of what became of events, see `OUTCOME_VARIABLES`; missing there too.
        derivatives: first of the derivatives of the continuous states.
        indicators: first of the event indicators: one for each state with dry friction, then one for each switching
            function.
        end: first value reference that is not used.
    """

    time: int
    inputs: int
    outputs: int
    states: int
    parameters: int
    events: int
    protocol: int
    outcomes: int
    derivatives: int
    indicators: int
    end: int

    @classmethod
    def of(cls, system: HybridSystem) -> VariableTable:
        """The table of a system, the same for FMI 2 and FMI 3."""
        triggered = len(system.triggered_events)
        counts = [
            1,
            width(exposed_inputs(system)),
            width(system.outputs),
            system.state_count,
            width(system.parameter_signals),
        ]
        counts += [2 * triggered, *((2, len(OUTCOME_VARIABLES)) if triggered else (0, 0))]
        counts += [system.continuous_count, len(system.frictions) + len(system.switchings)]
        return cls(*(FIRST_REFERENCE + sum(counts[:i]) for i in range(len(counts) + 1)))


def referenced(items: Sequence[ItemOfTable], first: int, count: int = 1) -> Sequence[ItemOfTable]:
    """Those that have `count` value references from `first` on, of what stands in the order of the variables.

    Args:
        items: in the order of the variables.
    """
    return items[first - FIRST_REFERENCE : first - FIRST_REFERENCE + count]


def exposed_inputs(system: HybridSystem) -> tuple[Signal, ...]:
    """Inputs and event payloads, without the noises that the runtime draws itself.

    Args:
        system: the hybrid system.
    """
    return system.input_signals[: len(system.input_signals) - len(system.noises)]
