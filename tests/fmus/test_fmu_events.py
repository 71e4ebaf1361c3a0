"""Triggered events: the FMI 3 clock, the FMI 2 stamp and `Runtime.trigger` do the same at the same instant."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from fmu_observer.block import make_block
from fmu_observer.block.block_events import QUEUE_CAPACITY

pytestmark = pytest.mark.compiler

H = 0.1
IDENTITY = ("guid", "unzipDirectory", "modelIdentifier", "instanceName")
FIXTURES_LIVE_ON = [HealthCheck.function_scoped_fixture]  # every example resets its component


def _reference_run(reference: Any, events: list[tuple[float, str, dict[str, float]]], steps: int) -> np.ndarray:
    reference.initialize()
    rows = []
    for k in range(steps):
        end = k * H + H
        for stamp, name, payload in [e for e in events if k * H <= e[0] < end]:
            reference.runtime.advance(stamp)
            reference.set_all(payload)
            reference.runtime.trigger(name)
        reference.runtime.advance(end)
        rows.append(reference.values())
    return np.array(rows)


EVENTS = [
    (0.0, "balise", {"balise_position": 1.0}),
    (0.1875, "telegram", {"telegram_speed": 14.0, "telegram_weight": 0.75}),
    (0.1875, "balise", {"balise_position": 4.0}),
    (0.25, "balise", {"balise_position": 2.5}),
    (0.4375, "telegram", {"telegram_speed": 8.0, "telegram_weight": 0.5}),
]


def test_fmi2_stamps_are_hit_inside_the_step(component: Callable[..., Any], reference: Callable[[str], Any]) -> None:
    made = component("tracker", 2)
    made.initialize()
    rows = []
    for k in range(6):
        for stamp, name, payload in [e for e in EVENTS if k * H <= e[0] < k * H + H]:
            made.event(name, stamp, **payload)
        made.step(k * H, H)
        rows.append(made.values())
    # Two events with one stamp: the one declared first comes first.
    ordered = [EVENTS[0], EVENTS[2], EVENTS[1], *EVENTS[3:]]
    np.testing.assert_array_equal(rows, _reference_run(reference("tracker"), ordered, 6))


def test_fmi3_clocks_tick_in_event_mode(component: Callable[..., Any], reference: Callable[[str], Any]) -> None:
    made = component("tracker", 3)
    made.initialize()
    rows = []
    for k in range(6):
        t = k * H
        for stamp, name, payload in [e for e in EVENTS if k * H <= e[0] < k * H + H]:
            if stamp > t:
                made.step(t, stamp - t)
            made.event(name, **payload)
            t = stamp
        made.step(t, k * H + H - t)
        rows.append(made.values())
    # The importer's step t + (stamp - t) may miss the stamp by a rounding.
    np.testing.assert_allclose(rows, _reference_run(reference("tracker"), EVENTS, 6), rtol=1e-12, atol=1e-12)


@settings(max_examples=40, deadline=None, suppress_health_check=FIXTURES_LIVE_ON)
@given(stamps=st.lists(st.floats(0.0, 0.5), max_size=4, unique=True), position=st.floats(-50.0, 50.0))
def test_any_stamps_in_one_step(
    stamps: list[float], position: float, component: Callable[..., Any], reference: Callable[[str], Any]
) -> None:
    made = component("tracker", 2)
    expected = reference("tracker")
    made.initialize()
    expected.initialize()
    chosen = sorted(stamps)[:2]
    for stamp, name in zip(chosen, ("balise", "telegram"), strict=False):
        value = "balise_position" if name == "balise" else "telegram_speed"
        made.event(name, stamp, **{value: position})
        expected.runtime.advance(stamp)
        expected.set_all({value: position})
        expected.runtime.trigger(name)
    made.step(0.0, 0.5)
    expected.runtime.advance(0.5)
    np.testing.assert_array_equal(made.values(), expected.values())


@pytest.fixture
def tracked(version: int, component: Callable[..., Any], reference: Callable[[str], Any]) -> tuple[Any, Any]:
    """An FMU of the tracker and its reference, initialised."""
    made, expected = component("tracker", version), reference("tracker")
    made.initialize()
    expected.initialize()
    return made, expected


def test_event_without_stamp_happens_now(tracked: tuple[Any, Any]) -> None:
    made, expected = tracked
    made.step(0.0, 0.3)
    expected.runtime.advance(0.3)
    made.event("balise", balise_position=7.0)
    expected.set_all({"balise_position": 7.0})
    expected.runtime.trigger("balise")
    made.step(0.3, 0.1)
    expected.runtime.advance(0.4)
    np.testing.assert_allclose(made.values(), expected.values(), rtol=1e-12, atol=0.0)


def test_fmi3_jump_is_seen_before_the_next_step(component: Callable[..., Any]) -> None:
    made = component("tracker", 3)
    made.initialize()
    made.event("balise", balise_position=10.0)
    np.testing.assert_array_equal(made.get("position", "innovation_out"), [7.0, 10.0])  # gain 0.7


def test_event_ahead_waits_for_its_step(tracked: tuple[Any, Any]) -> None:
    made, expected = tracked
    made.event("balise", stamp=0.25, balise_position=9.0)
    made.step(0.0, 0.1)
    assert made.get("innovation") == 0.0
    made.event("balise", stamp=0.125, balise_position=3.0)  # told later, happens earlier
    for k in (1, 2, 3):
        made.step(k * 0.1, 0.1)
    for stamp, position in ((0.125, 3.0), (0.25, 9.0)):
        expected.runtime.advance(stamp)
        expected.set_all({"balise_position": position})
        expected.runtime.trigger("balise")
    expected.runtime.advance(0.4)
    np.testing.assert_allclose(made.values(), expected.values(), rtol=1e-12, atol=0.0)


def test_late_event_is_rejected_and_reported(version: int, component: Callable[..., Any]) -> None:
    made, plain = component("tracker", version), component("tracker", version)
    made.set_policy(2)
    for one in (made, plain):
        one.initialize()
        one.step(0.0, 0.5)
    made.event("balise", stamp=0.2, balise_position=9.0)
    made.step(0.5, 0.1)
    plain.step(0.5, 0.1)
    np.testing.assert_array_equal(made.values(), plain.values())
    assert [line for line in made.log if "balise" in line and "rejected (1 so far): late_policy is reject" in line]


def test_stamp_is_used_up(version: int, component: Callable[..., Any]) -> None:
    made = component("tracker", version)
    made.initialize()
    made.event("balise", stamp=0.0, balise_position=1.0)
    made.step(0.0, 0.1)
    assert made.get("balise_time") == -1e30
    made.event("balise", balise_position=50.0)  # no stamp: now, not at the old one
    made.step(0.1, 0.1)
    assert made.get("innovation") > 10.0
    assert made.log == []


def test_lost_counts_are_reported(component: Callable[..., Any]) -> None:
    made = component("tracker", 2)
    made.initialize()
    reference = made.references(["balise_count"])
    made.set(balise_position=5.0)
    made.slave.setInteger(reference, [3])
    made.step(0.0, 0.1)
    assert made.get("innovation") != 0.0
    assert "rose from 0 to 3" in made.log[0]
    made.slave.setInteger(reference, [1])
    made.step(0.1, 0.1)
    assert "went down from 3 to 1" in made.log[1]


def test_queue_overflow_is_reported(component: Callable[..., Any]) -> None:
    made = component("tracker", 3)
    made.initialize()
    for i in range(QUEUE_CAPACITY + 1):
        made.event("balise", stamp=100.0 + i, balise_position=1.0)
    assert len(made.log) == 1
    assert f"{QUEUE_CAPACITY} events are waiting already; this one is lost" in made.log[0]


def test_applied_events_are_noted_on_request(version: int, component: Callable[..., Any]) -> None:
    made = component("tracker", version, logging=True)
    made.initialize()
    made.event("balise", stamp=0.0625, balise_position=1.0)
    made.step(0.0, 0.1)
    assert made.log == ["event balise applied at 0.0625 s"]


def test_event_mode_is_declared_where_there_are_events(component: Callable[..., Any]) -> None:
    assert component("tracker", 3).description.coSimulation.hasEventMode
    assert not component("sampler", 3).description.coSimulation.hasEventMode


@pytest.mark.parametrize("name", ["tracker", "takagi_sugeno_cdo", "multirate_cdo"])
def test_fmu_and_block_treat_events_alike(
    name: str, version: int, component: Callable[..., Any], reference: Callable[[str], Any]
) -> None:
    """Events on time, ahead and too late, through the same calls; 1e-12 as in `test_fmu_numbers`."""
    made = component(name, version)
    block = make_block(reference(name).system, version)  # type: ignore[arg-type]
    twin = component(name, version)  # borrows the handle, then drives the block
    twin.slave.freeInstance()
    twin.slave = block
    twin.instantiate()
    runs = []
    for one in (made, twin):
        one.initialize()
        rows = []
        for k in range(40):
            t = k * 0.05
            one.set_all({n: 10.0 + np.sin(t) for n in ("odometer", "effort") if n in one.by_name})
            for stamp in {3: [0.17], 7: [0.35], 12: [0.9, 0.62], 20: [0.4], 30: [None]}.get(k, []):
                one.event("balise", stamp, balise_position=10.0 * (stamp if stamp is not None else t))
            one.step(t, 0.05)
            rows.append(one.values())
        runs.append(np.array(rows))
    assert np.ptp(runs[0], axis=0).max() > 1.0
    np.testing.assert_allclose(runs[0], runs[1], rtol=1e-12, atol=1e-12)
    assert (block.counters.replayed, block.counters.rejected) == (1, 0)


# -- what is no event
# ---------------------------------------------------------------------------------------------------


@pytest.fixture(params=[(2, False), (2, True), (3, False), (3, True)], ids=["fmi2", "fmi2 block", "fmi3", "fmi3 block"])
def counting(request: pytest.FixtureRequest, component: Callable[..., Any], reference: Callable[[str], Any]) -> Any:
    """A tracker told by counts, as FMU and as block."""
    version, is_block = request.param
    made = component("tracker", version, counts=True)
    if is_block:
        made.slave.freeInstance()
        made.slave = make_block(reference("tracker").system, version, announcement="counts")
        made.instantiate()
    return made


def test_count_that_stands_when_time_starts_is_no_event(counting: Any) -> None:
    """An observer that is reset while the reader counts on gets no phantom balise."""
    for standing in (3, 2):
        counting.raise_count("balise", standing)
        counting.initialize(balise_position=50.0)
        counting.step(0.0, H)
        assert counting.get("innovation")[0] == 0.0
        counting.raise_count("balise")
        counting.step(H, H)
        assert counting.get("innovation")[0] != 0.0
        assert counting.log == []
        counting.slave.reset()


def test_count_that_stands_is_no_event_in_model_exchange(exchange: Callable[..., Any]) -> None:
    one = exchange("tracker", 2)
    one.model.setInteger(one.references(["balise_count"]), [3])
    one.initialize(balise_position=50.0)
    one.happen()
    assert one.get("innovation")[0] == 0.0


@pytest.mark.parametrize("stamp", [np.inf, np.nan])
def test_stamp_that_is_no_number_is_lost_with_a_warning(
    stamp: float, counting: Any, caplog: pytest.LogCaptureFixture
) -> None:
    """It would wait for ever."""
    counting.initialize()
    counting.event("balise", stamp=stamp, balise_position=50.0)
    counting.step(0.0, H)
    assert counting.get("innovation")[0] == 0.0
    texts = [*counting.log, *caplog.messages]
    assert len(texts) == 1
    assert "is not a finite number; it is lost" in texts[0]
    assert counting.get("events.lost")[0] == 1
    counting.event("balise", balise_position=50.0)
    counting.step(H, H)
    assert counting.get("innovation")[0] != 0.0


def test_clocked_stamp_that_is_no_number_is_lost(component: Callable[..., Any]) -> None:
    made = component("tracker", 3)
    made.initialize()
    made.event("balise", stamp=np.nan, balise_position=50.0)
    assert made.get("innovation")[0] == 0.0
    assert "is not a finite number" in made.log[0]


@pytest.mark.parametrize("is_block", [False, True])
def test_importer_without_event_mode_is_warned(
    is_block: bool, component: Callable[..., Any], reference: Callable[[str], Any], caplog: pytest.LogCaptureFixture
) -> None:
    warned = {}
    for name, counts, event_mode in [
        ("tracker", False, False),
        ("tracker", False, True),
        ("tracker", True, False),
        ("oscillator", False, False),
    ]:
        made = component(name, 3, counts=counts)
        made.slave.freeInstance()
        if is_block:
            made.slave = make_block(reference(name).system, 3, announcement="counts" if counts else "clocks")
        else:
            made.slave = type(made.slave)(**{n: getattr(made.slave, n) for n in IDENTITY})
        made.event_mode = event_mode
        made.instantiate()
        caplog.clear()
        made.initialize()
        made.step(0.0, H)
        warned[name, counts, event_mode] = [*made.log, *caplog.messages]
    texts = warned.pop(("tracker", False, False))
    assert len(texts) == 1
    assert "eventModeUsed is" in texts[0]
    assert "--events counts" in texts[0]
    assert not any(warned.values())
