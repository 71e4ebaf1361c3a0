"""The master: time axis, rows, failures on the way, termination, events of the components themselves."""

from __future__ import annotations

import math
from typing import Any, ClassVar

import numpy as np
import pytest
from coupled_runs import Balises, Listener, Motion, Pushed, Staircase, block, positions, prepare, ran, run
from fmpy.fmi1 import FMICallException
from fmpy.fmi2 import fmi2LastSuccessfulTime, fmi2Terminated
from hypothesis import given, settings
from hypothesis import strategies as st
from mock_slaves import DISCARD, ERROR, FATAL, FMI2, Counter, EventMode, Mock, Train, component

from cosim.balises.telegram import Channel, FalseTelegram
from cosim.errors import CouplingError, RunError
from cosim.master.axis import TimeAxis
from cosim.master.master import Master, close
from fmus.fmi.standard import TIME_TOLERANCE

# -- time and rows
# ------------------------------------------------------------------------------------------------------


@given(st.floats(-1e3, 1e5), st.floats(1e-3, 1.0), st.integers(1, 60))
@settings(max_examples=25, deadline=None)
def test_rows_lie_exactly_on_the_indexed_axis(start: float, h: float, count: int) -> None:
    seen = run([component(Counter(), "c")], [], h, count, start=start)
    np.testing.assert_array_equal(seen.time, [start + k * h for k in range(count + 1)])
    np.testing.assert_allclose(seen["c.total"], [h * k for k in range(count + 1)], rtol=1e-6)


def test_a_row_holds_the_values_of_its_own_time() -> None:
    seen = run([block(Motion(), "plant")], [], 0.1, 20, starts={"plant": {"v0": 3.0, "a": 1.0}})
    t = seen.time
    np.testing.assert_allclose(seen["plant.position"], 3.0 * t + 0.5 * t * t, rtol=1e-14)
    assert len(t) == 21


@given(st.integers(1, 40), st.sampled_from([1, 2, 5]))
@settings(max_examples=15, deadline=None)
def test_dividing_the_step_changes_nothing_for_blocks_on_their_grid(count: int, division: int) -> None:
    """Inputs constant, steps multiples of the internal one: bit-identical."""
    whole = run([block(Pushed(), "p")], [], 0.1, count, starts={"p": {"push": 0.7}})
    fine = run([block(Pushed(), "p")], [], 0.1 / division, count * division, starts={"p": {"push": 0.7}})
    for name in ("p.position", "p.speed"):
        np.testing.assert_array_equal(fine[name][::division], whole[name])


@given(st.permutations(["steps", "plant", "listener", "lonely"]))
@settings(max_examples=12, deadline=None)
def test_listing_order_does_not_matter_where_nothing_loops(listing: list[str]) -> None:
    systems = {"steps": Staircase(), "plant": Pushed(), "listener": Listener(), "lonely": Motion()}
    pairs = [("steps.push", "plant.push"), ("plant.speed", "listener.speed")]
    balises = Balises(positions(2.0, 3.7), receivers=["listener"])
    seen, reference = (
        run([block(systems[n], n) for n in order], pairs, 0.1, 10, balises)
        for order in (listing, ["steps", "plant", "listener", "lonely"])
    )
    for name in reference.table.dtype.names:
        np.testing.assert_array_equal(seen[name], reference[name])


def test_an_event_gives_two_rows_before_and_after() -> None:
    parts = [block(Motion(), "plant"), block(Listener(), "listener")]
    seen = run(parts, [("plant.speed", "listener.speed")], 0.1, 10, Balises(positions(5.0), receivers=["listener"]))
    at = np.flatnonzero(seen.time == seen.events[0].stamp)
    assert len(at) == 2
    assert seen["listener.heard"][at].tolist() == [0.0, 1.0]
    assert seen["plant.position"][at] == pytest.approx([5.0, 5.0], abs=1e-9)
    assert seen["listener.integrated"][at] == pytest.approx([5.0, 5.0], abs=1e-9)
    assert np.all(np.diff(seen.time) >= 0.0)


def test_progress_is_reported_up_to_the_end() -> None:
    reported: list[float] = []
    master = prepare([component(Counter(), "c")], [], 0.1, 100)
    master._progress = reported.append
    master.run()
    assert reported[-1] == master.axis.stop
    assert reported == sorted(reported)
    assert master.timing.stepping > 0.0


# -- failures
# -----------------------------------------------------------------------------------------------------------


class Failing(Train):
    error: Exception = FMICallException("fmi3DoStep", ERROR)

    def move(self, t: float, h: float) -> None:
        if t > 0.45:
            raise self.error
        super().move(t, h)


class Failing2(FMI2, Failing):
    error = FMICallException("fmi2DoStep", ERROR)


def fails(slave: Mock, match: str, **arguments: Any) -> Master:
    parts = [component(Counter(), "before"), component(slave, "train"), component(Counter(), "after")]
    master = prepare(parts, [], 0.1, 20, **arguments)
    with pytest.raises(RunError, match=match) as error:
        master.run()
    assert error.value.component == "train"
    close(master.plan)
    assert all(c.slave.freed for c in parts if c.slave.calls)
    return master


@pytest.mark.parametrize("slave", [Failing, Failing2])
def test_a_step_that_fails_ends_the_run_and_keeps_the_rows(slave: type[Mock]) -> None:
    master = fails(slave(), r"Component 'train' at t = 0.5 s: doStep failed: fmi.DoStep failed with status 3 \(error\)")
    np.testing.assert_array_equal(ran(master).time, [0.1 * k for k in range(6)])


def test_any_other_exception_of_a_slave_is_explained_too() -> None:
    slave = Failing()
    slave.error = ZeroDivisionError("division by zero")
    fails(slave, r"'train' at t = 0.5 s: doStep failed: division by zero")


def test_after_a_fatal_error_the_slave_is_left_alone() -> None:
    slave = Failing()
    slave.error = FMICallException("fmi3DoStep", FATAL)
    fails(slave, r"status 4 \(fatal\)")
    assert slave.calls == []


def test_reading_and_writing_that_fail_name_the_variables() -> None:
    class Unreadable(Train):
        def _get(self, references: Any) -> list[float]:
            if self.time > 0.25:
                raise FMICallException("fmi3GetFloat64", ERROR)
            return super()._get(references)

        getFloat64 = _get

    class Unwritable(Train):
        def _set(self, references: Any, values: Any) -> None:
            if self.time > 0.25:
                raise FMICallException("fmi3SetFloat64", ERROR)
            super()._set(references, values)

        setFloat64 = _set

    fails(Unreadable(), r"'train' at t = 0.3 s: reading position, speed failed: fmi3GetFloat64")
    master = prepare(
        [component(Counter(), "source"), component(Unwritable(), "train")], [("source.total", "train.effort")], 0.1, 9
    )
    with pytest.raises(RunError, match=r"'train' at t = 0.3 s: writing effort failed: fmi3SetFloat64"):
        master.run()
    assert ran(master).time[-1] == 0.1 * 3


class Discarding(FMI2, Train):
    says: ClassVar[dict[int, Any]] = {}

    def move(self, t: float, h: float) -> None:
        if t > 0.45:
            raise FMICallException("fmi2DoStep", DISCARD)
        super().move(t, h)

    def getBooleanStatus(self, kind: int) -> bool:
        return self._status(kind)

    def getRealStatus(self, kind: int) -> float:
        return self._status(kind)

    def _status(self, kind: int) -> Any:
        if kind not in self.says:
            raise FMICallException("fmi2GetStatus", ERROR)
        return self.says[kind]


def test_a_discarded_step_says_how_far_it_came() -> None:
    slave = Discarding()
    slave.says = {fmi2LastSuccessfulTime: 0.53, fmi2Terminated: False}
    fails(slave, r"at t = 0.5 s: doStep was discarded: asked for 0.6 s, it came to 0.53 s; try a smaller")
    fails(Discarding(), r"doStep was discarded: asked for 0.6 s, it does not say how far it came; try a smaller")


def test_a_discarded_step_with_termination_ends_the_run_without_failure() -> None:
    """The slave stands at 0.53 s: a row of 0.6 s would hold no values of that time."""
    slave = Discarding()
    slave.says = {fmi2LastSuccessfulTime: 0.53, fmi2Terminated: True}
    master = prepare([component(Counter(), "c"), component(slave, "train")], [], 0.1, 20)
    master.run()
    assert master.ended_early == "Component 'train' asked to terminate at t = 0.53 s."
    assert ran(master).time[-1] == 0.5
    close(master.plan)
    assert slave.calls == ["terminate", "freeInstance"]


@pytest.mark.parametrize(("stop", "last"), [(0.6, 0.6), (0.53, 0.5)])
def test_a_request_to_terminate_ends_the_run(stop: float, last: float) -> None:
    class Leaving(Train):
        def doStep(self, t: float, h: float) -> tuple[bool, bool, bool, float]:
            if t + h < stop - 1e-9:
                return super().doStep(t, h)
            super().doStep(t, stop - t)
            return False, True, False, stop

    slave = Leaving()
    master = prepare([component(Counter(), "c"), component(slave, "train")], [], 0.1, 20)
    master.run()
    assert master.ended_early == f"Component 'train' asked to terminate at t = {stop:g} s."
    assert ran(master).time[-1] == pytest.approx(last)
    close(master.plan)
    assert slave.calls == ["terminate", "freeInstance"]


class TurnsNan(Train):
    def compute(self) -> None:
        super().compute()
        if self.time > 0.45:
            self.v["speed"] = math.nan


def test_nan_names_the_signal_and_keeps_the_rows_with_it() -> None:
    master = fails(TurnsNan(), r"Component 'train' at t = 0.5 s: output train.speed is nan; the run ends here")
    table = ran(master).table
    assert table["time"][-1] == 0.5
    assert np.isnan(table["train.speed"][-1])
    assert not np.isnan(table["train.speed"][:-1]).any()


def test_a_component_that_chokes_on_nan_is_not_the_one_that_is_blamed() -> None:
    class Picky(Counter):
        def move(self, t: float, h: float) -> None:
            if math.isnan(self.v["rate"]):
                raise ValueError("rate is not a number")
            super().move(t, h)

    master = prepare(
        [component(TurnsNan(), "train"), component(Picky(), "picky")], [("train.speed", "picky.rate")], 0.1, 20
    )
    with pytest.raises(RunError, match=r"Component 'train' at t = 0.5 s: output train.speed is nan"):
        master.run()
    assert ran(master).time[-1] == 0.4


def test_infinities_of_opposite_sign_are_seen() -> None:
    class Odd(Mock):
        outputs: ClassVar[dict[str, Any]] = {"a": 0.0, "b": 0.0}

        def compute(self) -> None:
            self.v["a"], self.v["b"] = (math.inf, -math.inf) if self.time > 0.25 else (1e308, 1e308)

    master = prepare([component(Odd(), "odd")], [], 0.1, 9)
    with pytest.raises(RunError, match=r"odd.a is inf"):
        master.run()
    assert ran(master).time[-1] == 0.1 * 3


# -- FMI 3 events of the components themselves
# --------------------------------------------------------------------------


class Clockwork(EventMode):
    """Time events every 0.07 s from 0.05 s on; counts them, and demands to be stopped exactly there."""

    outputs: ClassVar[dict[str, Any]] = {"events": 0.0, "total": 0.0}
    first_event = 0.05

    def begin(self) -> None:
        super().begin()
        self.x |= {"total": 0.0}

    def compute(self) -> None:
        self.v["events"], self.v["total"] = self.x["events"], self.x["total"]

    def move(self, t: float, h: float) -> None:
        assert t + h <= self.next_event + 1e-9, "stepped over the event"
        self.x["total"] += h

    def on_event(self) -> None:
        assert abs(self.time - self.next_event) < 1e-9
        super().on_event()
        self.next_event = 0.05 + 0.07 * self.x["events"]


@pytest.mark.parametrize("h", [0.01, 0.05, 0.1, 0.5])
def test_time_events_are_hit_whatever_the_step(h: float) -> None:
    seen = run([component(Clockwork(), "c")], [], h, round(1.0 / h))
    assert seen["c.events"][-1] == math.floor((1.0 - 0.05) / 0.07) + 1
    assert seen["c.total"][-1] == pytest.approx(1.0, abs=1e-12)


def test_a_time_event_a_rounding_beyond_a_communication_point_belongs_to_it() -> None:
    class Off(Clockwork):
        first_event = 0.3 + 1e-13

        def on_event(self) -> None:
            super().on_event()
            self.next_event = 100.0

    slave = Off()
    seen = run([component(slave, "c")], [], 0.1, 5)
    assert seen["c.events"].tolist() == [0, 0, 0, 1, 1, 1]


def test_a_slave_that_returns_early_is_asked_again() -> None:
    class Short(Train):
        """Never goes further than 30 ms at a time."""

        def doStep(self, t: float, h: float) -> tuple[bool, bool, bool, float]:
            part = min(h, 0.03)
            super().doStep(t, part)
            return False, False, part < h, t + part

    whole, parts = (run([component(s, "train")], [], 0.1, 10) for s in (Train(), Short()))
    np.testing.assert_allclose(parts["train.position"], whole["train.position"], rtol=1e-12)
    assert parts.plan.steps[0].component.calls == 40


def test_what_an_early_return_leaves_of_a_step_is_done_in_the_next() -> None:
    """Each call begins where the last one ended and asks for the communication point, both to the last bit."""
    asked: list[tuple[float, float]] = []
    reached = [0.0]

    class Halving(Train):
        def doStep(self, t: float, h: float) -> tuple[bool, bool, bool, float]:
            asked.append((t, t + h))
            super().doStep(t, 0.5 * h)
            reached.append(t + 0.5 * h)
            return False, False, True, reached[-1]

    seen = run([component(Halving(), "train")], [], 2.0**-5, 200)
    assert [t for t, _ in asked] == reached[:-1]
    assert sorted({until for _, until in asked}) == seen["time"].tolist()[1:]  # dyadic: no sum is rounded
    assert 0.0 < seen["time"][-1] - reached[-1] <= TIME_TOLERANCE


@pytest.mark.parametrize(
    ("reached", "match"), [(0.0, "returned early 10000 times"), (-1.0, "reached"), (math.nan, "reached nan s")]
)
def test_an_early_return_that_leads_nowhere_is_refused(reached: float, match: str) -> None:
    class Stuck(Train):
        def doStep(self, t: float, h: float) -> tuple[bool, bool, bool, float]:
            return False, False, True, t + reached

    master = prepare([component(Stuck(), "train")], [], 0.1, 2)
    with pytest.raises(RunError, match=match):
        master.run()


def test_discrete_states_that_do_not_settle_are_refused() -> None:
    class Endless(EventMode):
        def updateDiscreteStates(self) -> tuple[bool, bool, bool, bool, bool, float]:
            return True, False, False, False, False, 0.0

    master = prepare([component(Endless(), "c")], [], 0.1, 2)
    with pytest.raises(RunError, match="discrete states do not settle in 100 updates"):
        master.run()


# -- balises
# ------------------------------------------------------------------------------------------------------------


def test_the_plant_is_no_receiver_and_receivers_come_after_it() -> None:
    class Hearing(Listener):
        name = "hearing"

        def output(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
            return super().output(t, x, u, p)

    plant, listener = block(Motion(), "plant"), block(Listener(), "listener")
    with pytest.raises(CouplingError, match="the watched plant cannot receive its own balises"):
        prepare([plant, listener], [], 0.1, 2, Balises(positions(1.0), receivers=["plant"]))
    master = prepare([plant, listener], [], 0.1, 2, Balises(positions(1.0), receivers=["listener"]))
    master.plan.steps.reverse()
    with pytest.raises(CouplingError, match="listener receives balises, so it must be stepped after the plant 'plant'"):
        Master(master.plan, TimeAxis(0.0, 0.1, 2), master.balises)


@given(st.floats(0.0, 1.0), st.floats(0.0, 0.5), st.integers(0, 5))
@settings(max_examples=15, deadline=None)
def test_every_balise_passed_is_delivered_or_missed_or_still_on_its_way(
    missed: float, latency: float, seed: int
) -> None:
    channel = Channel(latency=latency, latency_jitter=0.2, missed_fraction=missed, seed=seed)
    layout = positions(*(0.7 + 0.9 * k for k in range(12)))
    parts = [block(Motion(), "plant"), block(Listener(), "listener")]
    seen = run(parts, [], 0.1, 8, Balises(layout, receivers=["listener"], channel=channel))
    service = seen.master.balises
    kinds = [e.kind for e in seen.events]
    assert service.passed == 12
    assert kinds.count("missed") + kinds.count("true") + len(service.mailbox.waiting) == 12
    delivered = [e.delivered_at for e in seen.events if e.kind == "true"]
    assert delivered == sorted(delivered)


def test_without_receivers_telegrams_are_logged_and_shown() -> None:
    seen = run([block(Motion(), "plant")], [], 0.1, 10, Balises(positions(5.0)))
    assert [(e.identity, dict(e.outcomes)) for e in seen.events] == [("B1", {})]
    assert len(seen.time) == 13


def test_false_telegrams_claim_a_position_off_the_true_one() -> None:
    """In metres, whatever unit the plant counts in; one stamped before the start is told at the start."""

    class Kilometres(Motion):
        name = "kilometres"

        def output(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
            return {name: 1e-3 * value for name, value in super().output(t, x, u, p).items()}

    channel = Channel(false_telegrams=(FalseTelegram(0.55, 30.0), FalseTelegram(-1.0, 5.0)))
    parts = [block(Kilometres(), "plant"), block(Listener(), "listener")]
    seen = run(parts, [], 0.1, 10, Balises(positions(1e5), receivers=["listener"], channel=channel, scale=1000.0))
    early, late = seen.events
    assert (early.stamp, early.position, early.kind) == (0.0, 5.0, "false")
    assert late.true_position == pytest.approx(0.55 * 13.9, rel=1e-12)
    assert late.position == late.true_position + 30.0
    assert seen["listener.heard"][-1] == 2.0


def test_the_telegram_carries_the_odometer_reading_of_the_crossing() -> None:
    parts = [block(Motion(), "plant"), block(Listener(), "listener")]
    balises = Balises(positions(5.0), receivers=["listener"], odometer="plant.speed")
    seen = run(parts, [], 0.1, 10, balises, starts={"plant": {"v0": 10.0, "a": 2.0}})
    assert seen.events[0].odometer_reading == pytest.approx(10.0 + 2.0 * seen.events[0].stamp, rel=1e-12)
