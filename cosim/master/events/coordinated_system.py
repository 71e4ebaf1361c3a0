"""The coupled system with the events of its components: a step is divided where they lie."""

from __future__ import annotations

from collections.abc import Sequence, Set

from cosim.balises.service import BaliseService
from cosim.coupling.plan import Plan
from cosim.master.algorithms.algorithm import Algorithm
from cosim.master.events.choose import Events, make_coordinator
from cosim.master.system import Checkpoint, Row, System
from cosim.network.service import NetworkService


class CoordinatedSystem(System):
    """All components of a plan, stepped together from event to event.

    Args:
        plan, algorithm, balises, network: as for `System`.
        events: ``propagate`` events of the components to others, or leave them ``local``.

    `events` is the coordinator, None where none is needed.
    """

    def __init__(
        self,
        plan: Plan,
        algorithm: Algorithm,
        balises: BaliseService | None = None,
        network: NetworkService | None = None,
        events: Events = "propagate",
    ) -> None:
        super().__init__(plan, algorithm, balises, network)
        self.events = make_coordinator(self, events)

    @property
    def meets_events(self) -> bool:  # noqa: D102 - see System
        return self.events is not None and not self.events.all_foreseen

    def start(self, t: float) -> None:
        """All components were initialised at `t` [s]: handle what happens there already.

        Raises:
            RunError: a component failed, or events do not settle.
        """
        if self.events is not None:
            self.events.start(t)

    def advance(self, t: float, until: float) -> Sequence[Row]:
        """As `System.advance`, events of the components on the way included.

        Where a component asks for the end of the run, everybody who can stops there.

        Raises:
            RunError: a component failed, or events do not settle.
        """
        return self.move(t, until) if self.events is None else self.events.advance(t, until)

    def save(self, *, anyway: bool = False) -> Checkpoint:  # noqa: D102 - see System
        checkpoint = super().save(anyway=anyway)
        checkpoint.events = None if self.events is None else self.events.save()
        return checkpoint

    def restore(self, checkpoint: Checkpoint, keep: Set[str] = frozenset()) -> None:  # noqa: D102 - see System
        super().restore(checkpoint, keep)
        if self.events is not None:
            self.events.restore(checkpoint.events)
