"""Guards of the foundation: names that would collide at the boundary, sizes that do not fit, times that cannot run."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from toy_systems import Clockwork, ImplicitClockwork

from plant_models.hybrid import (
    HybridSystem,
    NumpyKernel,
    PeriodicEvent,
    Runtime,
    TracedKernel,
    TracingError,
    TriggeredEvent,
    vector,
)
from plant_models.hybrid.signal import Signal, input_signal, memory, output_signal, parameter, state


def _payload(name: str) -> Signal:
    return input_signal(name, "1", variability="discrete")


def _system(**attributes: Any) -> HybridSystem:
    made: HybridSystem = type("Faulty", (HybridSystem,), {"name": "faulty", "jump": None, **attributes})()
    return made


@pytest.mark.parametrize("name", ["balise_time", "balise_count"])
def test_a_payload_cannot_take_the_name_of_the_count_or_the_stamp(name: str) -> None:
    with pytest.raises(
        ValueError, match=f"Payload '{name}' of event 'balise' takes a name that every event has itself"
    ):
        TriggeredEvent("balise", (_payload(name),))


@pytest.mark.parametrize(
    "attributes",
    [
        {"states": (state("balise_time", "s"),)},
        {"outputs": (output_signal("balise_count", "1"),)},
        {"parameters": (parameter("balise_time", "s", 1.0),)},
        {"inputs": (input_signal("balise_count", "1"),)},
    ],
)
def test_no_signal_can_take_the_name_of_the_count_or_the_stamp_of_an_event(attributes: dict[str, Any]) -> None:
    with pytest.raises(ValueError, match=r"names used twice or reserved: balise_(time|count)"):
        _system(events=(TriggeredEvent("balise"),), **attributes)


@pytest.mark.parametrize(
    "attributes",
    [
        {"inputs": (input_signal("balise_spacing", "m"),), "events": (TriggeredEvent("balise"),)},
        {"events": (TriggeredEvent("balise"), TriggeredEvent("balise_group"))},
        {"events": (TriggeredEvent("a"), TriggeredEvent("a_b", (_payload("a_b_c"),)))},
    ],
)
def test_nothing_else_may_be_taken_for_payload(attributes: dict[str, Any]) -> None:
    with pytest.raises(ValueError, match="would be taken for payload of event"):
        _system(**attributes)
    # Parameters, states and outputs are not told with an event, so they may begin so.
    _system(events=(TriggeredEvent("balise"),), parameters=(parameter("balise_gain", "1", 1.0),))


@pytest.mark.parametrize("name", ["lambda", "class", "_hidden", "None"])
def test_a_signal_is_no_keyword_and_not_hidden(name: str) -> None:
    with pytest.raises(ValueError, match="is a Python keyword or begins with '_'"):
        Signal(name)


def test_a_period_is_a_scalar_parameter() -> None:
    with pytest.raises(ValueError, match="unknown parameter 'periods'; expected a scalar one"):
        _system(parameters=(parameter("periods", "s", 1.0, size=2),), events=(PeriodicEvent("tick", "periods"),))


def test_a_preset_sets_a_seed_only_where_there_is_noise() -> None:
    with pytest.raises(ValueError, match=r"preset 'a' sets unknown parameters \['seed'\]"):
        _system(presets={"a": {"seed": 3}})
    assert _system(presets={"a": {"internal_step": 0.5}}).start_parameters("a")[0] == 0.5


class _Sized(HybridSystem):
    name = "sized"
    states = (state("x", "1"), state("y", "1"), memory("m", "1"))
    outputs = (output_signal("o", "1"),)
    events = (TriggeredEvent("report"),)

    def __init__(self, output: int = 0) -> None:
        self.size = output
        super().__init__()

    def flow(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"x": x.x, "y": x.x + 1.0}

    def jump(self, event: str, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"m": x.x}

    def output(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"o": vector(*(x.x for _ in range(self.size))) if self.size else x.x}


class _FlatFlow(_Sized):
    def flow(self, t: Any, x: Any, u: Any, p: Any) -> Any:
        return vector(x.x, x.y)


class _FlatJump(_Sized):
    def jump(self, event: str, t: Any, x: Any, u: Any, p: Any) -> Any:
        return vector(x.x, x.y, 1.0)


@pytest.mark.parametrize(
    ("kind", "where"), [(_FlatFlow, r"flow\(\)"), (_FlatJump, r"jump\('report'\)")], ids=["flow", "jump"]
)
def test_one_array_of_all_states_is_refused_with_what_to_return(kind: type[_Sized], where: str) -> None:
    """Symbols alike: both kernels say which function of which system it is, and what it is to return."""
    wanted = r"expected a dictionary of values by name of the state, \{'x': \.\.\., 'y': \.\.\.\}, not one array of all"
    with pytest.raises(
        TracingError, match=f"^sized: cannot trace .*: {where} returns a ArrayInterfaceSX; {wanted}"
    ) as caught:
        TracedKernel(kind())
    assert "test_hybrid_guards.py:" in str(caught.value)
    kernel = NumpyKernel(kind())
    with pytest.raises(TypeError, match=f"^sized: {where} returns a ndarray; {wanted}"):
        kernel.step(0.0, 1.0) if kind is _FlatFlow else kernel.jump("report", 0.0)
    TracedKernel(_Sized())


def test_an_output_that_is_no_scalar_does_not_write_past_its_place() -> None:
    with pytest.raises(ValueError, match="output returns 2 values, expected 1"):
        TracedKernel(_Sized(output=2))


class _Reader(HybridSystem):
    name = "reader"
    states = (state("x", "1"), memory("m", "1"))
    outputs = (output_signal("reported", "1"),)
    parameters = (parameter("period", "s", 1.0),)
    events = (
        TriggeredEvent("report", (_payload("report_value"),)),
        TriggeredEvent("ask"),
        PeriodicEvent("tick", "period"),
    )

    def __init__(self, reads: str) -> None:
        self.reads = reads
        super().__init__()

    def flow(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"x": u.report_value if self.reads == "flow" else x.m}

    def jump(self, event: str, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"m": u.report_value if event in ("report", self.reads) else x.m}

    def output(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"reported": u.report_value}


@pytest.mark.parametrize(("reads", "function"), [("flow", "step"), ("ask", "jump_ask"), ("tick", "jump_tick")])
def test_payload_is_read_at_its_event_only(reads: str, function: str) -> None:
    with pytest.raises(ValueError, match=f"reader: {function} reads report_value, which is known only at the event"):
        TracedKernel(_Reader(reads))
    TracedKernel(_Reader("report"))


# -- time
# ---------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "value", "expected"),
    [
        ("internal_step", 0.0, "a positive number of seconds"),
        ("internal_step", float("nan"), "a positive number of seconds"),
        ("period", -0.1, "a positive number of seconds"),
        ("period", float("inf"), "a positive number of seconds"),
        ("offset", float("nan"), "a finite number of seconds"),
        ("seed", -2.0, "a whole number"),
        ("seed", 1.5, "a whole number"),
        ("seed", 2.0**53, "a whole number"),
        ("seed", float("nan"), "a whole number"),
    ],
)
def test_time_does_not_start_with_illegal_parameters(name: str, value: float, expected: str) -> None:
    system = Clockwork()
    runtime = Runtime(system)
    position = 2 + ["period", "offset", "internal_step", "seed"].index(name)  # behind a vector of two
    runtime.p[position] = value
    with pytest.raises(
        ValueError, match=f"clockwork: time cannot run with parameter {name} = {value!r}; expected {expected}"
    ):
        runtime.start(0.0)


@pytest.mark.parametrize("system", [Clockwork(), ImplicitClockwork()], ids=lambda s: s.method)
def test_a_second_start_begins_anew_at_its_time_with_the_values_at_hand(system: HybridSystem) -> None:
    runtime, fresh = Runtime(system), Runtime(system)
    runtime.start(0.0)
    runtime.advance(0.5)
    fresh.x[:] = runtime.x
    for one in (runtime, fresh):
        one.start(3.0)
        one.advance(4.0)
    np.testing.assert_array_equal(runtime.memory, fresh.memory)
    assert (runtime.t, runtime.t0, runtime.ticks) == (fresh.t, 3.0, fresh.ticks)


def test_after_a_reset_the_next_instant_is_the_first_one() -> None:
    runtime, fresh = Runtime(Clockwork()), Runtime(Clockwork())
    runtime.start(0.0)
    runtime.advance(1.0)
    runtime.reset()
    for one in (runtime, fresh):  # not started: as it was built
        one.advance(0.2)
    np.testing.assert_array_equal(runtime.memory, fresh.memory)
