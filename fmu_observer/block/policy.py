"""Late events: what a block does with an event whose stamp lies before its current time.

``replay`` goes back to the instant of the stamp, jumps, and integrates forward again with the recorded inputs, tunable
parameters and events; ``reject`` counts it and does nothing; ``late`` jumps now as if the event had just happened (for
comparison only). Knows the runtime and its journal, not FMI.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fmu_observer.block.block_journal import BlockJournal, Record, Stamped, new_record
from fmu_observer.event_protocol import LATE_POLICIES, LatePolicy
from plant_models.hybrid import Runtime, Snapshot
from plant_models.hybrid.event import DOUBTED, IGNORED

__all__ = ["LATE_POLICIES", "Counters", "LatePolicy", "advance", "communicate", "jump", "replay"]


@dataclass
class Counters:
    """What became of the events of one block.

    Args:
        accepted: events that took effect, on time or not. replayed: of these, the late ones applied at their stamp.
        late: of these, the late ones applied at the time they arrived. rejected: late events without effect.
        lost: events announced (count raised by more than one, or too many waiting) of which nothing else is known.
        doubted: of the accepted ones, those that the model doubted. ignored: those it doubted and kept out.
    """

    accepted: int = 0
    replayed: int = 0
    late: int = 0
    rejected: int = 0
    lost: int = 0
    doubted: int = 0
    ignored: int = 0

    def evaluated(self, verdict: int) -> bool:
        """Count an event by what the model made of it; whether it took effect.

        Args:
            verdict: number that the model wrote, see `plant_models.hybrid`.
        """
        self.accepted += verdict != IGNORED
        self.doubted += verdict == DOUBTED
        self.ignored += verdict == IGNORED
        return verdict != IGNORED


def advance(runtime: Runtime, journal: BlockJournal | None, until: float) -> None:
    """Advance a runtime to `until` [s], and remember it; nothing where it is there already.

    Args:
        journal: what was remembered so far; None where nothing is remembered.
    """
    if until > runtime.t:
        if journal is not None:
            journal.append(runtime, until)
        runtime.advance(until)


def jump(runtime: Runtime, journal: BlockJournal | None, event: Stamped) -> int:
    """Let a runtime jump now, and remember it; returns the verdict on the event.

    The payload is there for the time of the jump; what was set in `u` stays.

    Args:
        journal: what was remembered so far; None where nothing is remembered.
    """
    if journal is not None:
        journal.append(runtime, runtime.t, event)
    positions = list(event.positions)
    standing = runtime.u[positions]
    runtime.u[positions] = event.payload
    verdict = runtime.trigger(event.name)
    runtime.u[positions] = standing
    return verdict


def communicate(runtime: Runtime, journal: BlockJournal | None) -> None:
    """A communication step ends now; remember it where that means something.

    Args:
        runtime: the system in time. journal: what was remembered so far; None where nothing is remembered.
    """
    if runtime.system.communication_events:
        if journal is not None:
            journal.append(runtime, runtime.t)
        runtime.communicate()


def replay(
    runtime: Runtime, journal: BlockJournal, event: Stamped, stated: np.ndarray, tolerance: float
) -> tuple[str, int]:
    """Live the past again with `event` at its stamp: what comes out is what would be, had it come in time.

    Args:
        runtime: at the present; what it was given is kept.
        journal: rewritten so that the event is part of it.
        event: with a stamp in the past.
        stated: positions in the runtime's `memory` of what is set from outside: inputs, payloads and parameters.
        tolerance: how far the stamp may lie before the first record [s].

    Returns:
        An empty text, or, with nothing changed, the reason why memory does not reach back to the stamp; and the verdict
        on the event. Those after it are judged anew.
    """
    reason = journal.out_of_reach(event.stamp, tolerance, runtime.t)
    if reason:
        return reason, IGNORED
    past = journal.cut(event.stamp)
    present = runtime.memory[stated]
    runtime.restore(Snapshot(past[0].memory, past[0].t, runtime.t0, past[0].ticks))
    if past[0].until > past[0].t:
        advance(runtime, journal, event.stamp)
    verdict = jump(runtime, journal, event)
    again: list[Record] = []
    for record in past:
        runtime.memory[stated] = record.memory[stated]
        moves = record.until > record.t
        if moves and record.until <= runtime.t:
            continue
        until = record.until if moves else runtime.t
        again.append(new_record((runtime.memory.copy(), runtime.t, until, tuple(runtime.ticks), record.event)))
        if record.event is not None:
            jump(runtime, None, record.event)
        elif moves:
            runtime.advance(until)
        else:
            runtime.communicate()
    journal.extend(runtime.t, again)
    runtime.memory[stated] = present
    return "", verdict
