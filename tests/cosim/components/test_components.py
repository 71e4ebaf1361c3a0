"""Components: life cycle, start values, states, what they say about themselves."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np
import pytest
from coupled_runs import Listener, Pushed, block
from fmpy.fmi1 import FMICallException
from mock_slaves import ERROR, FMI2, Counter, EventMode, Mock, Train, component, read, set_start, started, variable

from cosim.errors import CouplingError, RunError


class Settable(Mock):
    parameters: ClassVar[dict[str, Any]] = {"mass": (1.0, "kg")}
    inputs: ClassVar[dict[str, Any]] = {"u": 0.0}
    outputs: ClassVar[dict[str, Any]] = {"y": 0.0}

    def more_variables(self) -> list[Any]:
        return [
            variable("axles", "parameter", 31, "Int32"),
            variable("label", "parameter", 32, "String"),
            variable("table", "parameter", 33, "Float64", shape=(2, 2)),
            variable("g", "local", 34, "Float64", variability="constant"),
            variable("derived", "calculatedParameter", 35, "Float64"),
        ]


def test_start_values_reach_the_slave() -> None:
    slave = Settable()
    made = component(slave)
    made.instantiate()
    for name, value in (("mass", 3.0), ("u", 0.5), ("axles", 4.0)):
        set_start(made, name, value)
        assert slave.v[name] == value
    assert made.starts == {"mass": 3.0, "u": 0.5, "axles": 4.0}


@pytest.mark.parametrize(
    ("name", "match"),
    [
        ("y", "mock.y cannot be set: it has causality 'output'"),
        ("derived", "mock.derived cannot be set: it has causality 'calculatedParameter'"),
        ("g", "mock.g cannot be set: it is constant"),
        ("label", r"mock.label: expected a text for a String \(got 1.0\)"),
        ("table[3,1]", r"mock: no element 'table\[3,1\]' in a Float64 array of shape \(2, 2\)"),
        ("mas", "mock: no variable 'mas'; did you mean 'mass'"),
    ],
)
def test_what_cannot_be_set_is_refused(name: str, match: str) -> None:
    made = component(Settable())
    made.instantiate()
    with pytest.raises(CouplingError, match=match):
        set_start(made, name, 1.0)


def test_a_start_value_the_slave_refuses_is_a_run_error_with_the_value() -> None:
    class Strict(Settable):
        def setFloat64(self, references: Any, values: Any) -> None:
            raise FMICallException("fmi3SetFloat64", ERROR)

    made = component(Strict())
    made.instantiate()
    with pytest.raises(RunError, match=r"Component 'mock': setting mass = -1.0 failed: fmi3SetFloat64"):
        set_start(made, "mass", -1.0)


@pytest.mark.parametrize("step", ["instantiate", "enterInitializationMode", "exitInitializationMode"])
@pytest.mark.parametrize("interface", [Mock, FMI2])
def test_a_life_that_fails_says_where(step: str, interface: type[Mock]) -> None:
    def refuse(_self: Any, **_: Any) -> None:
        raise FMICallException(step, ERROR)

    slave = type("Broken", (interface,), {step: refuse})()
    with pytest.raises(RunError, match=f"Component 'mock'.*{step} failed"):
        started(slave)


class Train2(FMI2, Train):
    """FMI 2 interface."""


class Clock(EventMode):
    outputs: ClassVar[dict[str, Any]] = {"events": 0.0}
    first_event = 0.25

    def compute(self) -> None:
        self.v["events"] = self.x["events"]

    def on_event(self) -> None:
        super().on_event()
        self.next_event = self.time + 0.25


def test_states_hold_everything_the_component_knows() -> None:
    """Time, pending time events and counts too, as often as one likes."""
    made = started(Clock())
    made.advance(0.0, 0.2)
    state = made.save()
    for _ in range(2):
        made.advance(0.2, 0.6)
        assert (read(made, ["events"]), made.next_event, made.time) == ([2.0], 0.75, 0.6)
        made.restore(state)
        assert (read(made, ["events"]), made.next_event, made.time) == ([0.0], 0.25, 0.2)
    made.release(state)
    assert made.slave.calls == ["freeFMUstate"]


@pytest.mark.parametrize("version", [2, 3])
def test_events_notified_after_a_restore_are_notified_again(version: Any) -> None:
    made = block(Listener(), "listener", version)
    made.instantiate()
    made.enter_initialization(0.0, 1.0)
    made.exit_initialization()
    state = made.save()
    for _ in range(3):
        made.notify(made.events["balise"], 0.0, 0.05, {"position": 3.0, "unknown": 1.0})
        made.advance(0.0, 0.1)
        assert read(made, ["last", "at", "heard"]) == pytest.approx([3.0, 0.05, 1.0])
        assert made.outcomes()["lost"] == 0  # type: ignore[index]
        assert made.time == 0.1
        made.restore(state)
        assert made.time == 0.0


@pytest.mark.parametrize("slave", [Train, Train2])
def test_reset_leads_back_to_the_start(slave: type[Mock]) -> None:
    made = started(slave())
    made.advance(0.0, 0.5)
    moved = read(made, ["position"])
    made.reset()
    made.enter_initialization(0.0, 1.0)
    made.exit_initialization()
    assert read(made, ["position"]) == [0.0]
    made.advance(0.0, 0.5)
    assert read(made, ["position"]) == moved


def test_the_end_comes_once_and_frees_everything() -> None:
    released: list[str] = []
    slave = Train()
    made = type(component(slave))(
        "mock", slave, slave.model_description, release_files=lambda: released.append("files")
    )
    made.instantiate()
    made.enter_initialization(0.0, 1.0)
    made.exit_initialization()
    for _ in range(2):
        made.terminate()
        made.free()
    assert slave.calls == ["terminate", "freeInstance"]
    assert released == ["files"]


def test_a_component_that_fails_at_its_end_stops_nobody() -> None:
    class Stubborn(Train):
        def terminate(self) -> None:
            raise FMICallException("fmi3Terminate", ERROR)

        def freeInstance(self) -> None:
            raise OSError("gone")

    made = started(Stubborn())
    made.terminate()
    made.free()


def test_what_a_component_says_about_itself() -> None:
    counter = component(Counter())
    assert (counter.names("input"), counter.names("output")) == (["rate"], ["total"])
    assert counter.outcomes() is None
    assert not counter.restores_exactly
    made = block(Pushed(), "p")
    assert made.restores_exactly
    assert made.outcomes() is not None
    assert made.variable("push", "input").name == "push"
    settable = component(Settable())
    elements = ["table[1,1]", "table[1,2]", "table[2,1]", "table[2,2]"]
    assert settable.names("parameter") == ["mass", "axles", *elements]  # text is left out


def test_seconds_and_calls_are_counted() -> None:
    made = started(Train())
    for k in range(5):
        made.advance(0.1 * k, 0.1 * (k + 1))
    assert made.calls == 5
    assert made.seconds > 0.0
    assert made.time == 0.5
    assert np.isfinite(made.seconds)


def test_an_fmi2_slave_is_notified_that_it_may_forget_its_past_until_a_state_is_saved() -> None:
    """The localiser sets states back; a slave that had thrown its past away could not follow."""
    slave = Train2()
    made = started(slave)
    made.advance(0.0, 0.1)
    assert slave.may_forget is True
    made.save()
    made.advance(0.1, 0.2)
    assert slave.may_forget is False
