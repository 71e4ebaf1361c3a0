"""Checks of saved states in co-simulation: restored, as bytes, and in another instance."""

from __future__ import annotations

from fmus.check.behaviour import again, continuation, difference, go_elsewhere
from fmus.check.bench import WARM_UP_STEPS
from fmus.check.checks.life import by
from fmus.check.context import Context
from fmus.check.findings import Outcome, skipped
from fmus.check.restoring import restoring
from fmus.check.slave import FmuSlave

NO_STATE = "does not declare canGetAndSetFMUstate"
NO_BYTES = "does not declare canSerializeFMUstate"


def round_trip(context: Context) -> Outcome:
    """Save, go on, go elsewhere, restore, redo: bit-identical."""
    if not context.bench.component.can_save:
        return skipped(NO_STATE)
    return by(restoring(context.bench).problem, "what follows a restored state is identical, bit for bit")


def serialised(context: Context) -> Outcome:
    """The same through bytes, in the same instance."""
    return _through_bytes(context, elsewhere=False)


def other_instance(context: Context) -> Outcome:
    """The same in a second instance, through bytes: a state itself belongs to the instance it was taken from."""
    if context.only_once:
        return skipped("declares canBeInstantiatedOnlyOncePerProcess")
    return _through_bytes(context, elsewhere=True)


def _through_bytes(context: Context, *, elsewhere: bool) -> Outcome:
    bench = context.bench
    slave = bench.component
    assert isinstance(slave, FmuSlave)
    if not slave.can_save or not slave.declared.canSerializeFMUstate:
        return skipped(NO_BYTES)
    path = continuation(bench)
    bench.begin()
    bench.steps((bench.h,) * WARM_UP_STEPS)
    content, saved_at = _saved(bench.component), bench.now
    first = bench.steps(path)
    target = context.fresh_bench() if elsewhere else bench
    try:
        if elsewhere:
            target.begin()
        go_elsewhere(target)
        _restore(target.component, content)
        problem = difference(bench, first, again(target, saved_at, path))
    finally:
        if elsewhere:
            target.put_away()
    place = "in another instance" if elsewhere else "from bytes"
    return by(problem and f"after a state restored {place} {problem}", f"what follows a state restored {place} is identical")


def _saved(slave: object) -> bytes:
    assert isinstance(slave, FmuSlave)
    state = slave.save()
    try:
        return slave.serialize(state)
    finally:
        slave.release(state)


def _restore(slave: object, content: bytes) -> None:
    assert isinstance(slave, FmuSlave)
    state = slave.deserialize(content)
    try:
        slave.restore(state)
    finally:
        slave.release(state)
