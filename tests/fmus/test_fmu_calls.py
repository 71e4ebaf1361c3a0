"""Wrong calls are refused with a message, and change nothing."""

from __future__ import annotations

import math
from collections.abc import Callable
from ctypes import byref, c_double
from typing import Any

import numpy as np
import pytest
from fmpy.fmi1 import FMICallException
from fmpy.fmi3 import FMU3ScheduledExecution

pytestmark = pytest.mark.compiler

OK, WARNING = 0, 1  # status


def refused(made: Any, words: str, call: Callable[[], Any]) -> None:
    """The call fails, the log says why, and the values are what they were."""
    before, lines = made.values(), len(made.log)
    with pytest.raises(FMICallException):
        call()
    assert any(words in line for line in made.log[lines:]), made.log
    np.testing.assert_array_equal(made.values(), before)


@pytest.fixture
def running(version: int, component: Callable[..., Any]) -> Any:
    """A tracker in step mode at 1 s."""
    made = component("tracker", version)
    made.initialize()
    made.step(0.0, 1.0)
    return made


def _getter(made: Any) -> Any:
    return made.slave.getReal if made.version == 2 else made.slave.getFloat64


def _setter(made: Any) -> Any:
    return made.slave.setReal if made.version == 2 else made.slave.setFloat64


def test_unknown_value_reference(running: Any) -> None:
    refused(running, "no variable with value reference 999", lambda: _getter(running)([999]))
    refused(running, "no variable with value reference 0", lambda: _getter(running)([0]))  # they count from 1
    refused(running, "no variable with value reference 4294967295", lambda: _setter(running)([4294967295], [1.0]))


def test_wrong_type(running: Any) -> None:
    announcer = running.references(["balise_count" if running.version == 2 else "balise"])
    refused(running, "is of another type", lambda: _getter(running)(announcer))
    refused(running, "is of another type", lambda: _setter(running)(announcer, [1.0]))
    refused(running, "no variables of this type", lambda: running.slave.getBoolean([1]))
    refused(running, "no variables of this type", lambda: running.slave.setString([1], ["x"]))


def test_nothing_is_set_when_one_of_several_is_wrong(running: Any) -> None:
    references = [*running.references(["odometer"]), 999]
    before = running.get("odometer")
    refused(running, "no variable", lambda: _setter(running)(references, [77.0, 1.0]))
    assert running.get("odometer") == before


@pytest.mark.parametrize(("name", "words"), [("position_out", "is computed"), ("time", "is computed")])
def test_computed_variables_cannot_be_set(running: Any, name: str, words: str) -> None:
    refused(running, words, lambda: running.set(**{name: 1.0}))


@pytest.mark.parametrize("name", ["position", "gain", "internal_step"])
def test_start_values_cannot_be_set_while_running(running: Any, name: str) -> None:
    refused(running, f"{name} (value reference", lambda: running.set(**{name: 1.0}))
    assert "only in: Instantiated, Initialization Mode" in running.log[-1]


@pytest.mark.parametrize("h", [0.0, -0.1, math.nan, math.inf])
def test_step_size_must_be_positive(running: Any, h: float) -> None:
    refused(running, "is not a positive number", lambda: running.step(1.0, h))


@pytest.mark.parametrize("t", [0.0, 0.9, 1.001, math.nan])
def test_step_must_begin_where_the_model_stands(running: Any, t: float) -> None:
    refused(running, "but the model stands at 1 s" if not math.isnan(t) else "", lambda: running.step(t, 0.1))


def test_accumulated_rounding_is_forgiven(running: Any) -> None:
    running.step(1.0 + 1e-12, 0.1)
    np.testing.assert_allclose(running.get("time"), 1.1, atol=1e-11)


def test_wrong_mode(version: int, component: Callable[..., Any]) -> None:
    made = component("tracker", version)
    refused(made, "not allowed in Instantiated; allowed in: Step Mode", lambda: made.step(0.0, 0.1))
    refused(made, "allowed in: Initialization Mode", made.slave.exitInitializationMode)
    made.initialize()
    refused(made, "not allowed in Step Mode", made.slave.enterInitializationMode)
    made.slave.terminate()
    refused(made, "not allowed in Terminated", lambda: made.step(0.0, 0.1))


def test_impossible_timing_is_refused_at_initialisation(version: int, component: Callable[..., Any]) -> None:
    for name, value in (
        ("internal_step", 0.0),
        ("period", -1.0),
        ("slow_offset", math.inf),
        ("seed", -2.0),
        ("seed", 0.5),
        ("internal_step", math.nan),
    ):
        made = component("sampler", version)
        with pytest.raises(FMICallException):
            made.initialize(**{name: value})
        assert f"time cannot run with parameter {name}" in made.log[-1]


def test_broken_state_is_reported_by_name(version: int, component: Callable[..., Any]) -> None:
    made = component("oscillator", version)
    made.initialize()
    saved = made.save()
    made.set(force=math.nan)
    with pytest.raises(FMICallException):
        made.step(0.0, 0.1)
    assert "state position is not a finite number" in made.log[-1]
    made.restore(saved)
    made.step(0.0, 0.1)
    assert np.isfinite(made.values()).all()


def test_token_must_fit(version: int, component: Callable[..., Any]) -> None:
    made = component("gain", version)
    stranger = type(made)(*_identity(made))
    stranger.slave.guid = "{not-this-one}"
    with pytest.raises(Exception, match=r"[Ii]nstantiate"):
        stranger.instantiate()
    assert "do not belong together" in stranger.log[-1]


def _identity(made: Any) -> tuple[Any, Any]:
    from pathlib import Path

    folder = Path(made.slave.unzipDirectory)
    return folder / "modelDescription.xml", folder


def test_other_interface_types_are_refused(component: Callable[..., Any]) -> None:
    slave = component("gain", 3).slave
    other = FMU3ScheduledExecution(
        guid=slave.guid,
        unzipDirectory=slave.unzipDirectory,
        modelIdentifier=slave.modelIdentifier,
        instanceName="other",
    )
    with pytest.raises(Exception, match=r"[Ii]nstantiate"):
        other.instantiate()


def test_unsupported_fmi2_functions(component: Callable[..., Any]) -> None:
    made = component("oscillator", 2)
    made.initialize()
    refused(made, "maxOutputDerivativeOrder = 0", lambda: made.slave.getRealOutputDerivatives([2], [1]))
    refused(made, "canInterpolateInputs = false", lambda: made.slave.setRealInputDerivatives([1], [1], [1.0]))
    refused(made, "synchronous", made.slave.cancelStep)


def test_unsupported_fmi3_functions(component: Callable[..., Any]) -> None:
    made = component("tracker", 3)
    made.initialize()
    slave = made.slave
    refused(made, "no structural parameters", slave.enterConfigurationMode)
    refused(made, "they have no interval", lambda: slave.fmi3GetIntervalDecimal(slave.component, None, 0, None, None))
    refused(
        made,
        "fmi3GetContinuousStates: not allowed in Step Mode",
        lambda: slave.fmi3GetContinuousStates(slave.component, byref(c_double()), 1),
    )


def test_missing_arrays_are_refused(version: int, component: Callable[..., Any]) -> None:
    made = component("oscillator", version)
    made.initialize()
    slave = made.slave
    if version == 2:
        refused(made, "is missing", lambda: slave.fmi2GetReal(slave.component, None, 2, None))
    else:
        values = (c_double * 1)()
        refused(made, "is missing", lambda: slave.fmi3GetFloat64(slave.component, None, 2, None, 2))
        refused(made, "all variables are scalars", lambda: slave.fmi3GetFloat64(slave.component, None, 2, values, 1))


def test_fmi3_clocks_need_event_mode(component: Callable[..., Any]) -> None:
    made = component("tracker", 3)
    made.initialize()
    clock = made.references(["balise"])
    refused(made, "allowed in: Event Mode", lambda: made.slave.setClock(clock, [True]))
    refused(made, "balise_position (value reference", lambda: made.set(balise_position=1.0))
    made.slave.enterEventMode()
    refused(made, "allowed in: Step Mode", lambda: made.step(0.0, 0.1))
    made.slave.setClock(clock, [True])
    assert made.slave.getClock(clock) == [True]
    refused(made, "clock balise is active", made.slave.enterStepMode)
    made.slave.setClock(clock, [False])
    made.slave.enterStepMode()


def test_fmi3_event_mode_only_where_asked_for(component: Callable[..., Any]) -> None:
    made = component("sampler", 3)
    made.initialize()
    refused(made, "eventModeUsed = false", made.slave.enterEventMode)


def test_no_instance_is_no_crash(version: int, component: Callable[..., Any]) -> None:
    made = component("gain", version)
    slave = made.slave
    for call in (
        (lambda: slave.fmi2Reset(None)) if version == 2 else (lambda: slave.fmi3Reset(None)),
        (lambda: slave.fmi2DoStep(None, 0.0, 0.1, 1)) if version == 2 else (lambda: slave.fmi3EnterStepMode(None)),
    ):
        with pytest.raises(FMICallException):
            call()


def test_without_event_mode_the_log_warns_and_initialisation_is_ok(component: Callable[..., Any]) -> None:
    """Strict masters end a run at a status other than OK."""
    made = component("tracker", 3)
    slave = made.slave
    slave.instantiate(
        loggingOn=True, eventModeUsed=False, logMessage=lambda _e, status, _c, text: made.log.append((status, text))
    )
    slave.enterInitializationMode()
    leave = slave.dll.fmi3ExitInitializationMode
    assert leave(slave.component) == OK
    assert [(status, b"eventModeUsed is false" in text) for status, text in made.log] == [(WARNING, True)]
    assert slave.doStep(0.0, 0.1)[0] is False
