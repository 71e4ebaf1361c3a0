"""The interruption: how a component notifies whoever steps it that it met an event on the way. Imports nothing."""

from __future__ import annotations

from typing import Any


class EventMet(Exception):  # noqa: N818 - nothing went wrong; the step ends earlier than asked
    """A component returned early from its step, because of an event that nobody knew of in advance.

    Args:
        component: it stands at the event, which it has not handled yet.
        time: of the event [s].
    """

    def __init__(self, component: Any, time: float) -> None:
        super().__init__(f"{component.name} met an event at t = {time!r} s")
        self.component, self.time = component, time
