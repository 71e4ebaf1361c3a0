"""The plan: slices, columns, conversions, what is recorded; and the recorder."""

from __future__ import annotations

import numpy as np
import pytest
from coupled_runs import Listener, Motion, block
from hypothesis import given
from hypothesis import strategies as st
from mock_slaves import Counter, Mock, component, started, variable

from cosim.coupling.connection import connect
from cosim.coupling.plan import Plan, make_plan
from cosim.errors import CouplingError
from cosim.master.algorithms.links import downstream
from cosim.results.recorder import Recorder
from cosim.results.result import SignalInfo


def plan(extra: dict[str, list[str]] | None = None) -> Plan:
    components = {"listener": block(Listener(), "listener"), "plant": block(Motion(), "plant")}
    for made in components.values():
        made.instantiate()
    return make_plan(components, connect([("plant.speed", "listener.speed")], components), ["plant", "listener"], extra)


def test_outputs_lie_in_one_array_in_the_order_of_stepping() -> None:
    made = plan({"listener": ["integral", "last"]})
    names = [s.name for s in made.signals]
    own = ["integrated", "last", "at", "heard", "integral"]
    # an output asked for again comes once
    assert names == ["plant.position", "plant.speed", *(f"listener.{n}" for n in own)]
    listener = made.find("listener")
    assert listener.outputs.base is made.values.base
    assert (listener.columns.start, listener.columns.stop) == (2, 7)
    assert made.column("listener.last") == 3
    np.testing.assert_array_equal(made.continuous, [True, True, True, False, False, False, True])
    np.testing.assert_array_equal(listener.continuous, made.continuous[2:])
    assert made.signals[1].unit == "m/s"


def test_what_takes_of_a_component_is_distinguished_from_what_it_takes() -> None:
    made = plan()
    listener = np.zeros(len(made.values), dtype=bool)
    listener[made.find("listener").columns] = True
    np.testing.assert_array_equal(downstream(made, ["plant"]), listener)
    assert not downstream(made, ["listener"]).any()


@pytest.mark.parametrize(
    ("call", "match"),
    [
        (
            lambda: plan().column("listener.integral"),
            "'listener.integral' is neither an output nor recorded; did you mean",
        ),
        (lambda: plan().find("plent"), "No component 'plent' in this run; did you mean 'plant'"),
        (lambda: plan({"listener": ["integrl"]}), "listener: no variable 'integrl'; did you mean 'integral'"),
        (lambda: plan({"listener": ["balise"]}), "listener.balise cannot be recorded: it is a Clock"),
    ],
)
def test_what_is_not_there_is_named(call, match: str) -> None:
    with pytest.raises(CouplingError, match=match):
        call()


def test_a_whole_number_is_never_interpolated() -> None:
    class Whole(Mock):
        def more_variables(self):
            return [variable("gear", "output", 9, "Int32", variability="continuous")]

    made = component(Whole(), "w")
    assert not make_plan({"w": made}, [], ["w"]).continuous[0]


@given(st.integers(0, 200), st.integers(0, 3))
def test_the_recorder_keeps_every_row(rows: int, expected: int) -> None:
    recorder = Recorder([SignalInfo("a.x"), SignalInfo("a.y")], expected)
    values = np.zeros(2)
    for k in range(rows):
        values[:] = k, -k  # the same array again and again, as the master does
        recorder.add(0.1 * k, values)
    table = recorder.table()
    assert table.dtype.names == ("time", "a.x", "a.y")
    np.testing.assert_array_equal(table["a.y"], -np.arange(rows))
    np.testing.assert_array_equal(table["time"], 0.1 * np.arange(rows))


def test_components_without_inputs_or_outputs_are_stepped() -> None:
    class Quiet(Mock):
        pass

    components = {"quiet": started(Quiet(), "quiet"), "counter": started(Counter(), "counter")}
    made = make_plan(components, [], ["quiet", "counter"])
    for step in made.steps:
        step.step(0.0, 0.1)
    assert [s.name for s in made.signals] == ["counter.total"]
    assert components["quiet"].calls == 1
