"""Communication steps: those that cannot be done leave no trace, early returns change nothing, nothing is allocated."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Callable
from ctypes import byref, c_bool, c_double
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from exchange_importer import INSTANCE
from fmpy.fmi1 import FMICallException
from fmpy.fmi2 import fmi2LastSuccessfulTime, fmi2Terminated
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from fmu_observer.block import make_block
from fmu_observer.event_protocol import JOURNAL_CAPACITY
from fmus.build import plan_fmu
from fmus.toolchain.compile import find_compiler

pytestmark = pytest.mark.compiler

H = 0.05
FIXTURES_LIVE_ON = [HealthCheck.function_scoped_fixture]
DISCARD = 2
KINDS = {"fmi2": (2, False), "fmi3 clocks": (3, False), "fmi3 counts": (3, True)}


@pytest.fixture(
    params=[(kind, block) for kind in KINDS for block in (False, True)], ids=lambda p: f"{p[0]}{' block' * p[1]}"
)
def hopper(request: pytest.FixtureRequest, component: Callable[..., Any], reference: Callable[[str], Any]) -> Any:
    """A hopper of each kind, the FMU and the block."""
    kind, is_block = request.param
    version, counts = KINDS[kind]
    made = component("hopper", version, counts=counts)
    if is_block:
        made.slave.freeInstance()
        announcement = "counts" if counts or version == 2 else "clocks"
        made.slave = make_block(reference("hopper").system, version, announcement=announcement)  # type: ignore[arg-type]
        made.instantiate()
    return made


def _another(slave: Any) -> Any:
    """A new slave of the same FMU; fmpy lets go of the library with the instance."""
    identity = {name: getattr(slave, name) for name in ("guid", "unzipDirectory", "modelIdentifier", "instanceName")}
    return type(slave)(**identity)


def _discarded(one: Any, t: float) -> None:
    """A step with an input that is no number, and the input back to what it was."""
    force = one.get("force")[0]
    one.set(force=float("nan"))
    with pytest.raises(FMICallException) as caught:
        one.step(t, H)
    assert caught.value.status == DISCARD
    one.set(force=force)


def _hop(one: Any, failing: set[int], steps: int = 20, horizon: float = 10.0) -> np.ndarray:
    """A run with events ahead, on time and late; before the steps in `failing` one that cannot be done is tried,
    twice.
    """
    one.slave.reset()
    one.initialize(replay_horizon=horizon)
    events = {
        2: [("mark", 14.5 * H)],
        5: [("mark", 2.3 * H), ("kick", 5.5 * H)],
        8: [("kick", 1.7 * H)],
        12: [("kick", 7.1 * H)],
    }
    rows = []
    for k in range(steps):
        one.set(force=float(np.sin(k)), drag=0.2 + 0.01 * k)
        for name, stamp in events.get(k, []):
            one.event(name, stamp, **({"kick_impulse": 1.0 + k} if name == "kick" else {}))
        if k in failing:
            before = one.values()
            _discarded(one, k * H)
            _discarded(one, k * H)
            np.testing.assert_array_equal(one.values(), before)
            assert one.get("time")[0] == pytest.approx(k * H, abs=1e-12)
        one.step(k * H, H)
        rows.append(one.values())
    return np.array(rows)


@settings(max_examples=12, deadline=None, suppress_health_check=FIXTURES_LIVE_ON)
@given(failing=st.sets(st.integers(0, 19), min_size=1, max_size=6))
def test_a_discarded_step_leaves_no_trace(failing: set[int], hopper: Any) -> None:
    """State, queue, counts, time and the remembered past are as before: all that follows is as if it had not been
    tried.
    """
    np.testing.assert_array_equal(_hop(hopper, failing), _hop(hopper, set()))


def test_a_discarded_step_leaves_no_trace_in_a_full_past(component: Callable[..., Any]) -> None:
    """The ring has wrapped round, and the failing step drops its oldest records."""
    one = component("hopper", 2)
    runs = []
    for failing in (False, True):
        one.slave.reset()
        one.initialize(replay_horizon=1e4)
        steps = JOURNAL_CAPACITY // 2 + 500  # two records each
        for k in range(steps):
            one.step(k * H, H)
        reach = steps * H - (JOURNAL_CAPACITY // 2 - 3) * H
        rows = []
        for i, k in enumerate(range(steps, steps + 4)):
            one.event("mark", reach + i * H)
            one.event("kick", reach + (i + 0.5) * H, kick_impulse=0.5)
            if failing:
                _discarded(one, k * H)
            one.step(k * H, H)
            rows.append(one.values())
        runs.append(rows)
    np.testing.assert_array_equal(runs[0], runs[1])
    assert [line for line in one.log if "rejected" in line] == []
    assert one.get("marks") == [4.0]


def test_fmi2_reports_how_far_it_came(component: Callable[..., Any], reference: Callable[[str], Any]) -> None:
    one = component("hopper", 2)
    one.initialize()
    for slave in (one.slave, make_block(reference("hopper").system, 2)):
        one.slave = slave
        if not hasattr(slave, "dll"):
            slave.instantiate()
            one.initialize()
        one.step(0.0, H)
        assert not slave.getBooleanStatus(fmi2Terminated)
        _discarded(one, H)
        assert slave.getRealStatus(fmi2LastSuccessfulTime) == H
        assert slave.getBooleanStatus(fmi2Terminated)  # importers that would try the same step for ever must stop
        one.step(H, H)
        assert not slave.getBooleanStatus(fmi2Terminated)
        assert slave.getRealStatus(fmi2LastSuccessfulTime) == 2 * H
        one.slave = slave if hasattr(slave, "dll") else one.slave
    assert "state position is not a finite number" in one.log[0]


def test_fmi3_reports_how_far_it_came(component: Callable[..., Any]) -> None:
    one = component("hopper", 3)
    one.initialize()
    one.step(0.0, H)
    one.set(force=float("nan"))
    event, terminate, early, reached = c_bool(True), c_bool(), c_bool(True), c_double()
    slave = one.slave
    with pytest.raises(FMICallException) as caught:
        slave.fmi3DoStep(slave.component, H, H, True, byref(event), byref(terminate), byref(early), byref(reached))
    assert caught.value.status == DISCARD
    assert (event.value, terminate.value, early.value, reached.value) == (False, True, False, H)


def test_fmpy_stops_at_a_step_that_cannot_be_done(component: Callable[..., Any]) -> None:
    """It retries a discarded step for ever unless the slave says that it is terminated."""
    from fmpy import simulate_fmu

    one = component("hopper", 2)
    signals = np.array(
        [(0.0, 0.0), (0.2, 0.0), (0.21, np.nan), (1.0, np.nan)], dtype=[("time", float), ("force", float)]
    )
    result = simulate_fmu(one.slave.unzipDirectory, stop_time=1.0, output_interval=0.05, input=signals)
    assert 0.1 < result["time"][-1] < 0.5
    assert np.isfinite(result["position_out"]).all()


# -- early return
# -------------------------------------------------------------------------------------------------------


@pytest.fixture
def early(component: Callable[..., Any], reference: Callable[[str], Any]) -> Callable[[str, bool], Any]:
    """An FMI 3 component that may return early, the FMU or the block."""

    def make(name: str, is_block: bool) -> Any:
        made = component(name, 3)
        made.slave.freeInstance()
        made.slave = make_block(reference(name).system, 3, instance_name=INSTANCE) if is_block else _another(made.slave)
        made.early_return = True
        made.instantiate()
        return made

    return make


def _reach(one: Any, t: float, until: float) -> list[float]:
    """Step to `until` through the early returns; their times."""
    returns = []
    while True:
        event, terminate, was_early, reached = one.slave.doStep(t, until - t)
        assert not event
        assert not terminate
        if not was_early:
            assert reached == pytest.approx(until, abs=1e-12)
            return returns
        assert t < reached < until
        returns.append(reached)
        t = reached


@pytest.mark.parametrize("is_block", [False, True], ids=["fmu", "block"])
def test_early_returns_are_at_the_periodic_instants_and_change_nothing(
    is_block: bool, early: Callable[[str, bool], Any], component: Callable[..., Any]
) -> None:
    one, plain = early("sampler", is_block), component("sampler", 3)
    one.initialize()
    plain.initialize()
    returns = []
    for k in range(10):
        for made in (one, plain):
            made.set(wheel_speed=float(k))
        returns += _reach(one, 0.1 * k, 0.1 * k + 0.1)
        plain.step(0.1 * k, 0.1)
        np.testing.assert_array_equal(one.values(), plain.values())
    inside = [0.03 * k for k in range(1, 34)] + [0.004 + 0.1 * k for k in range(10)]
    wanted = sorted(t for t in inside if abs(t / 0.1 - round(t / 0.1)) > 1e-9)  # at the end of a step nothing is early
    np.testing.assert_allclose(returns, wanted, rtol=0, atol=1e-12)


@pytest.mark.parametrize("is_block", [False, True], ids=["fmu", "block"])
def test_events_come_through_early_returns(
    is_block: bool, early: Callable[[str, bool], Any], component: Callable[..., Any]
) -> None:
    one, plain = early("tracker", is_block), component("tracker", 3)
    for made in (one, plain):
        made.initialize()
        made.event("balise", 0.333, balise_position=4.0)  # ahead
    assert len(_reach(one, 0.0, 0.4)) == 7
    plain.step(0.0, 0.4)
    np.testing.assert_array_equal(one.values(), plain.values())
    for made in (one, plain):
        made.event("telegram", 0.17, telegram_speed=4.0)  # late
    np.testing.assert_array_equal(one.values(), plain.values())


def test_who_does_not_allow_early_returns_gets_none(version: int, component: Callable[..., Any]) -> None:
    one = component("sampler", version)
    one.initialize()
    assert one.slave.doStep(0.0, 0.1) == (None if version == 2 else (False, False, False, 0.1))


# -- whole numbers, rates, log
# ------------------------------------------------------------------------------------------


def test_whole_numbers_are_whole_to_the_outside(hopper: Any) -> None:
    hopper.initialize()
    hopper.event("mark", 0.01)
    hopper.step(0.0, H)
    assert hopper.by_name["marks_out"].type in ("Integer", "Int32")
    getter = hopper.slave.getInteger if hopper.version == 2 else hopper.slave.getInt32
    assert getter(hopper.references(["marks_out"])) == [1]
    setter = hopper.slave.setInteger if hopper.version == 2 else hopper.slave.setInt32
    for call in (
        lambda: setter(hopper.references(["marks_out"]), [3]),
        lambda: setter(hopper.references(["force"]), [3]),
        lambda: getter(hopper.references(["force"])),
        lambda: (hopper.slave.getReal if hopper.version == 2 else hopper.slave.getFloat64)(
            hopper.references(["marks_out"])
        ),
    ):
        with pytest.raises(FMICallException):
            call()


def test_rates_can_be_read(hopper: Any) -> None:
    """Derivatives and indicators as the equations give them, moving and at rest."""
    hopper.initialize(force=0.5)
    position, speed, handed, drag, grip = hopper.get("position", "speed", "handed", "drag", "grip")
    flow = 5.0 * 0.5 + 0.1 * 0.0 + 0.2 - drag * speed - 3.0 * position + 0.1 * handed
    got = hopper.get("der(position)", "der(speed)", "event_indicator.speed")
    np.testing.assert_allclose(got, [speed, flow - grip, speed], rtol=1e-14)
    hopper.slave.reset()
    hopper.initialize(speed=0.0, force=-0.01)
    flow = -0.05 + 0.2
    got = hopper.get("der(position)", "der(speed)", "event_indicator.speed")
    np.testing.assert_allclose(got, [0.0, 0.0, grip - flow], rtol=1e-13, atol=1e-16)


def test_log_categories_are_those_of_the_description(hopper: Any) -> None:
    names = [category.name for category in hopper.description.logCategories]
    assert names == ["logStatusError", "logStatusDiscard", "logStatusWarning", "logEvents"]
    hopper.slave.setDebugLogging(True, names)
    if hopper.version == 3:
        with pytest.raises(FMICallException):
            hopper.slave.setDebugLogging(True, ["logEvents", "logSecrets"])
    else:
        hopper.slave.setDebugLogging(True, ["logAll"])  # FMI 2 does not say that it must be refused


def test_messages_with_a_percent_sign_reach_every_logger(component: Callable[..., Any]) -> None:
    """Many FMI 2 importers print the format as it is: a message is a format without conversions, or "%s" and the
    message.
    """
    from fmpy.fmi2 import FMU2Slave, fmi2CallbackFunctions, fmi2CallbackLoggerTYPE

    made = component("gain", 2)
    seen: list[bytes] = []
    for token in ("{plain}", "{50%d}"):
        identity = {"unzipDirectory": made.slave.unzipDirectory, "modelIdentifier": "gain", "instanceName": "other"}
        other, callbacks = FMU2Slave(guid=token, **identity), fmi2CallbackFunctions()
        callbacks.logger = fmi2CallbackLoggerTYPE(lambda *a: seen.append(a[4]))
        with pytest.raises(Exception, match="nstantiate"):
            other.instantiate(callbacks=callbacks)
    assert b"{plain} was given" in seen[0]
    assert seen[1] == b"%s"


# -- memory
# -------------------------------------------------------------------------------------------------------------

COUNTING = """
#include <stdlib.h>
static int allocation_count;
static void *counted_malloc(size_t n) { allocation_count++; return malloc(n); }
static void *counted_calloc(size_t n, size_t size) { allocation_count++; return calloc(n, size); }
static void *counted_realloc(void *p, size_t n) { allocation_count++; return realloc(p, n); }
__attribute__((visibility("default"))) int allocations(void) { return allocation_count; }
#define malloc counted_malloc
#define calloc counted_calloc
#define realloc counted_realloc
#include "all.c"
"""


@pytest.fixture
def counting(version: int, component: Callable[..., Any], reference: Callable[[str], Any], tmp_path: Path) -> Any:
    """A hopper whose library counts its allocations."""
    plan = plan_fmu(reference("hopper").system, version)  # type: ignore[arg-type]
    for name, content in (plan.source_files() | plan.header_files()).items():
        (tmp_path / name).write_bytes(content)
    (tmp_path / "counting.c").write_text(COUNTING)
    flags = ["-std=c11", "-O1", "-shared", "-fPIC", "-fvisibility=hidden", "-I."]
    command = [*find_compiler().command, *flags, "counting.c", "-o", "counting.so", "-lm"]
    subprocess.run(command, cwd=tmp_path, check=True, capture_output=True)
    made = component("hopper", version)
    made.slave.freeInstance()
    folder = tmp_path / "unpacked"
    shutil.copytree(made.slave.unzipDirectory, folder)
    (library,) = (folder / "binaries").glob("*/hopper.*")
    (tmp_path / "counting.so").replace(library)
    made.slave.unzipDirectory = str(folder)
    made.slave = _another(made.slave)
    made.instantiate()
    return made


def test_nothing_is_allocated_after_instantiation(counting: Any) -> None:
    count = counting.slave.dll.allocations
    assert count() == 1  # all memory of an instance is one piece
    _hop(counting, {3, 8, 9}, steps=60)
    counting.event("mark", -5.0)  # rejected
    counting.step(60 * H, H)
    assert counting.log
    assert count() == 1
    counting.free(counting.save())
    assert count() == 2


# -- steps without an end
# -----------------------------------------------------------------------------------------------


def test_a_step_of_too_many_internal_steps_is_discarded(hopper: Any) -> None:
    """It would never return; 1e9 internal steps of 0.01 s are 1e7 s."""
    hopper.initialize()
    hopper.step(0.0, H)
    before = hopper.values()
    for size in (1e15, 1.001e7):
        with pytest.raises(FMICallException) as caught:
            hopper.step(H, size)
        assert caught.value.status == DISCARD
        text = hopper.log[-1] if hopper.log else str(caught.value)
        assert "more than 1000000000 internal steps" in text
        assert f"{size:.17g}"[:4] in text or repr(size) in text
        assert "internal_step = 0.01" in text
    np.testing.assert_array_equal(hopper.values(), before)
    hopper.step(H, H)
    assert hopper.get("time")[0] == pytest.approx(2 * H)


def test_a_period_far_below_the_step_is_discarded(hopper: Any) -> None:
    """The periodic event would happen 5e10 times."""
    hopper.initialize(period=1e-12)
    with pytest.raises(FMICallException) as caught:
        hopper.step(0.0, H)
    assert caught.value.status == DISCARD
