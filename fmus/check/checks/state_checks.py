"""Checks of saved states in co-simulation: restored, as bytes, and in another instance."""

from __future__ import annotations

from fmus.check.behaviour import again, continuation, difference, go_elsewhere
from fmus.check.check import BYTES, LIMIT, NO_BYTES, NO_REDOING, STATES, Check
from fmus.check.context import Context
from fmus.check.findings import CheckOutcome, failed, noted, passed
from fmus.check.restoring import near, restoring
from fmus.check.runner import WARM_UP_STEPS
from fmus.fmi.slave import Slave

_WITHIN = "within the tolerance of its solver"


def _through_bytes(context: Context, *, elsewhere: bool) -> CheckOutcome:
    runner = context.runner
    path = continuation(runner)
    runner.begin()
    runner.steps((runner.h,) * WARM_UP_STEPS)
    content, saved_at = _saved(runner.component), runner.now
    first = runner.steps(path)
    target = context.fresh_runner() if elsewhere else runner
    try:
        if elsewhere:
            target.begin()
        go_elsewhere(target)
        _restore(target.component, content)
        redone = again(target, saved_at, path)
    finally:
        if elsewhere:
            target.put_away()
    place = "in another instance" if elsewhere else "from bytes"
    problem = difference(runner, first, redone)
    if not problem:
        return passed(f"what follows a state restored {place} is identical")
    what = f"after a state restored {place} {problem}"
    return noted(f"{what}; {_WITHIN}") if near(runner, first, redone) else failed(what)


def _saved(slave: Slave) -> bytes:
    state = slave.save()
    try:
        return slave.serialize(state)
    finally:
        slave.release(state)


def _restore(slave: Slave, content: bytes) -> None:
    state = slave.deserialize(content)
    try:
        slave.restore(state)
    finally:
        slave.release(state)


class StateRoundTripCheck(Check, failing=LIMIT, advice=NO_REDOING, compares=True, place=11, declares=STATES):
    """Save, go on, go elsewhere, restore, redo: identical, or as near as its solver is, or something else."""

    name = "state round trip"

    @staticmethod
    def run(context: Context) -> CheckOutcome:
        found = restoring(context.runner)
        if found.restores == "exact":
            return passed("what follows a restored state is identical, bit for bit")
        if found.restores == "within_tolerance":
            return noted(f"{found.problem}; {_WITHIN}, {found.mismatch:.1g} of its size, which goes into the bounds")
        return failed(f"not restored: {found.problem}")


class SerialisedStateCheck(Check, failing=LIMIT, advice=NO_BYTES, compares=True, place=12, declares=BYTES):
    """The same through bytes, in the same instance."""

    name = "serialised state"

    @staticmethod
    def run(context: Context) -> CheckOutcome:
        return _through_bytes(context, elsewhere=False)


class StateInAnotherInstanceCheck(
    Check, failing=LIMIT, advice=NO_BYTES, compares=True, place=13, several=True, declares=BYTES
):
    """The same in a second instance, through bytes: a state itself belongs to the instance it was taken from."""

    name = "state in another instance"

    @staticmethod
    def run(context: Context) -> CheckOutcome:
        return _through_bytes(context, elsewhere=True)
