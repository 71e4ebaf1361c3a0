"""Event iteration: all that happens at one instant, in super-dense time. Knows participants and the values of the plan.

A super-dense instant: clocks and inputs are set and outputs passed on, in sweeps in plan order, until nothing changes;
then discrete states are updated, which may begin the next super-dense instant. FMI 3.0.2, 2.3.5 (Event Mode).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cosim.coupling.plan import Plan
from cosim.errors import RunError
from cosim.master.events.participant import Participant

MAX_ROUNDS = 100
NAMES_SHOWN = 5


class EventIteration:
    """Takes all participants that are concerned through Event Mode.

    Args:
        plan: the plan. participants: in plan order.

    `count` is the number of instants with an event, `longest` the most super-dense instants that one took.
    """

    def __init__(self, plan: Plan, participants: Sequence[Participant]) -> None:
        self._plan, self._participants = plan, participants
        self.count = self.longest = 0

    def concerns_anybody(self, t: float) -> bool:
        """Whether there is an event at `t` [s]."""
        return any(p.stands_at(t) and (p.wants_event(t) or p.hears()) for p in self._participants)

    def run(self, t: float) -> None:
        """Handle everything that happens at `t` [s]; the values of the plan are those after it.

        Raises:
            RunError: a component failed, or the iteration does not settle; who and what still changes is named.
        """
        members = [p for p in self._participants if p.stands_at(t)]
        values = self._plan.values
        before = earlier = values.copy()
        for round_number in range(1, MAX_ROUNDS + 1):
            earlier, before = before, values.copy()
            for member in members:
                if member.wants_event(t):
                    member.begin_own_event()
            self._pass_on(members, t)
            busy = [member for member in members if member.needs_update]
            if not busy:
                self._finish(members, round_number - 1)
                return
            for member in busy:
                member.update()
        changed = _differs(earlier, before) | _differs(before, values)
        raise self._unsettled(changed, [m.name for m in members if m.needs_update or m.wants_event(t)], t)

    def _pass_on(self, members: Sequence[Participant], t: float) -> None:
        for _ in range(MAX_ROUNDS):
            before = self._plan.values.copy()
            news = [member.exchange() for member in members]
            if not any(news):
                return
        raise self._unsettled(_differs(before, self._plan.values), [], t)

    def _finish(self, members: Sequence[Participant], rounds: int) -> None:
        for member in members:
            member.leave()
        self.count += 1
        self.longest = max(self.longest, rounds)

    def _unsettled(self, changed: np.ndarray, busy: Sequence[str], t: float) -> RunError:
        signals = [self._plan.signals[i].name for i in np.flatnonzero(changed)]
        shown = ", ".join(signals[:NAMES_SHOWN]) + (
            f" and {len(signals) - NAMES_SHOWN} more" if len(signals) > NAMES_SHOWN else ""
        )
        names = list(dict.fromkeys([*busy, *(name.partition(".")[0] for name in signals)]))
        still = f"; still changing: {shown}" if signals else "; no output changes any more"
        reason = (
            f"Events at t = {t:g} s do not settle in {MAX_ROUNDS} rounds{still}; components: {', '.join(names)}. "
            "Look for two components that answer each other for ever, or for an event that is due again at once."
        )
        return RunError(reason, names[0] if names else "", t)


def _differs(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    different: np.ndarray = (a != b) & ~(np.isnan(a) & np.isnan(b))
    return different
