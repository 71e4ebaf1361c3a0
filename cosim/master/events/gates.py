"""The gate: which connected inputs of a component with Event Mode may be sent when. Knows inputs and clocks, not time.

FMI 3.0: discrete inputs change in Event Mode only, clocked ones only while one of their clocks is active; everything
may be sent during initialisation except clocked inputs.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence, Set

import numpy as np

from cosim.components.component import Component
from cosim.coupling.inputs import Inputs
from fmus.fmi.clocks import clock_references
from fmus.fmi.types import is_continuous

Send = Callable[[], None]


class Gate:
    """Sends parts of the connected inputs of one component; `inputs.send` becomes the part that Step Mode allows.

    Args:
        component: with Event Mode. inputs: its connected inputs; `gather` stays as it is.
        events_pass: discrete inputs are sent in Event Mode; otherwise in Step Mode like the others, and clocked ones
            never.
    """

    def __init__(self, component: Component, inputs: Inputs, *, events_pass: bool = True) -> None:
        self._component, self._inputs, self._events_pass = component, inputs, events_pass
        self._kinds = [component.variables[name] for name in inputs.names]
        self._clocks = [clock_references(v) for v in self._kinds]
        flows = [is_continuous(v) and not clocks for v, clocks in zip(self._kinds, self._clocks, strict=True)]
        unclocked = [i for i, clocks in enumerate(self._clocks) if not clocks]
        self._discrete = np.array([i for i in unclocked if not flows[i]], dtype=np.intp)
        self._unclocked = np.array(unclocked, dtype=np.intp)
        self._texts = inputs.non_numeric
        self._text_clocks = self._clocks_of_texts(component)
        flowing = [i for i in unclocked if flows[i]]
        self._passing = np.array(flowing if events_pass else unclocked, dtype=np.intp)
        self._send_flowing = self._part(component, flowing)
        self._send_unclocked = self._part(component, unclocked)
        self._groups = [
            (clocks, np.array(places, dtype=np.intp), self._part(component, places))
            for clocks, places in self._clocked_groups()
        ]
        self._sent: tuple[object, ...] = ()
        self._sent_clocked: dict[int, bytes] = {}
        inputs.gate(self._send_at_first, self._passing)

    @property
    def listened(self) -> np.ndarray:
        """Places of the numbers among the connected inputs of which a change is an event, shape (k,)."""
        return self._discrete

    @property
    def told(self) -> bytes | None:
        """What the component was told of these last, as doubles; None where it is not known, or texts are listened to
        as well.
        """
        known = self._sent[0] if len(self._sent) == 1 else None
        return known if isinstance(known, bytes) else None

    @property
    def listens(self) -> bool:
        """Whether a change of some input is an event for the component."""
        return len(self._discrete) > 0 or (self._texts is not None and not self._text_clocks)

    def open(self) -> None:
        """The component runs: from now on Step Mode takes continuous inputs only."""
        self._inputs.gate(self._send_flowing, self._passing)

    def changed(self) -> bool:
        """Whether gathered discrete inputs differ from what the component knows."""
        return self.listens and self._discrete_values() != self._sent

    def flow(self) -> bytes:
        """The gathered inputs without clock, to be compared."""
        return self._inputs.buffer[self._unclocked].tobytes()

    def send(self) -> None:
        """In Event Mode and during initialisation: send all gathered inputs without clock."""
        self._send_unclocked()
        if self._texts is not None and not self._text_clocks:
            self._texts.send()
        self._sent = self._discrete_values()

    def send_clocked(self, active: Set[int], *, fresh: bool) -> bool:
        """In Event Mode: send the gathered inputs of active clocks that are new; True where there were any.

        Args:
            active: value references of active clocks. fresh: one of them was not active before.
        """
        sent = False
        for number, (clocks, places, send) in enumerate(self._groups):
            values = self._inputs.buffer[places].tobytes()
            if clocks & active and (fresh or self._sent_clocked.get(number) != values):
                send()
                self._sent_clocked[number] = values
                sent = True
        if self._texts is not None and self._text_clocks & active and fresh:
            self._texts.send()
        return sent

    def save(self) -> object:
        """What was sent last."""
        return self._sent, dict(self._sent_clocked)

    def restore(self, state: object) -> None:
        """Return to what was saved.

        Args:
            state: as `save` gave it.
        """
        assert isinstance(state, tuple)
        self._sent, self._sent_clocked = state[0], dict(state[1])

    # -- internals --------------------------------------------------------------------------------------------------

    def _send_at_first(self) -> None:
        """What Initialization Mode allows; once that is over, what Step Mode does."""
        if self._component.running and self._events_pass:
            self._send_flowing()
        else:
            self.send()

    def _discrete_values(self) -> tuple[object, ...]:
        numbers = self._inputs.buffer[self._discrete].tobytes()
        return numbers, *(self._texts.held if self._texts is not None else ())

    def _clocks_of_texts(self, component: Component) -> frozenset[int]:
        names = () if self._texts is None else self._texts.names
        return frozenset(r for name in names for r in clock_references(component.variables[name]))

    def _clocked_groups(self) -> list[tuple[frozenset[int], list[int]]]:
        groups: dict[frozenset[int], list[int]] = {}
        for i, clocks in enumerate(self._clocks):
            if clocks:
                groups.setdefault(clocks, []).append(i)
        return list(groups.items())

    def _part(self, component: Component, places: Sequence[int]) -> Send:
        """A call that sends some of the gathered inputs."""
        if not places:
            return _nothing
        write, buffer = component.writer([self._inputs.names[i] for i in places])
        gathered, index = self._inputs.buffer, np.array(places, dtype=np.intp)

        def send() -> None:
            gathered.take(index, out=buffer, mode="clip")
            write()

        return send


def _nothing() -> None:
    """No inputs."""
