"""The life of a block: what is allowed when, what is refused, and that every refusal says what, where, when and why."""

from __future__ import annotations

import gc
import pickle
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from block_systems import SWING, Driven, Explosion, H, Swing, kick
from fmpy.fmi1 import FMICallException
from fmpy.fmi2 import FMU2Slave
from fmpy.fmi3 import FMU3Slave

from fmu_observer.block import BlockCallError, BlockError, FMI2Block, FMI3Block, make_block

BOTH = pytest.mark.parametrize("version", [2, 3])


@BOTH
def test_fmpy_takes_a_block_for_a_slave(version: int) -> None:
    block = Driven(SWING, version).block
    assert isinstance(block, FMU2Slave if version == 2 else FMU3Slave)
    assert isinstance(block, FMI2Block if version == 2 else FMI3Block)
    assert block.getVersion() == f"{version}.0"
    assert block.guid == block.model_description.guid
    assert block.modelIdentifier == block.model_description.coSimulation.modelIdentifier == "swing"
    assert not hasattr(block, "dll")  # by this a master tells a block from a library


def test_an_unknown_version_is_refused() -> None:
    with pytest.raises(ValueError, match="FMI version 4 is unknown; use 2 or 3"):
        make_block(SWING, 4)  # type: ignore[arg-type]


@BOTH
def test_a_misspelt_argument_is_refused(version: int) -> None:
    with pytest.raises(TypeError):
        make_block(SWING, version, late_polizy="replay")  # type: ignore[arg-type]
    with pytest.raises(TypeError):
        Driven(SWING, version).block.instantiate(eventModeUse=True)


# -- refused calls
# ------------------------------------------------------------------------------------------------------


def _in_mode(version: int, mode: str) -> Driven:
    driven = Driven(SWING, version, instance_name="pendulum").instantiate()
    if mode == "instantiated":
        return driven
    if mode == "freed":
        driven.block.freeInstance()
        return driven
    driven.enter_initialization()
    if mode == "initialization":
        return driven
    driven.exit_initialization()
    driven.step(0.0)
    if mode == "event":
        driven.block.enterEventMode()
    if mode == "terminated":
        driven.block.terminate()
    return driven


CALLS: dict[str, tuple[Any, set[str]]] = {
    "enterInitializationMode": (lambda d: d.block.enterInitializationMode(), {"instantiated"}),
    "exitInitializationMode": (lambda d: d.block.exitInitializationMode(), {"initialization"}),
    "doStep": (lambda d: d.step(H), {"step"}),
    "terminate": (lambda d: d.block.terminate(), {"step", "event"}),
    "reset": (lambda d: d.block.reset(), {"instantiated", "initialization", "step", "event", "terminated"}),
    "getFMUState": (lambda d: d.block.getFMUState(), {"instantiated", "initialization", "step", "event", "terminated"}),
}
CALLS_2 = {
    "setupExperiment": (lambda d: d.block.setupExperiment(), {"instantiated"}),
    "setInteger": (lambda d: d.block.setInteger(d.vr("mark_count"), [0]), {"instantiated", "initialization", "step"}),
    "getInteger": (
        lambda d: d.block.getInteger(d.vr("mark_count")),
        {"instantiated", "initialization", "step", "terminated"},
    ),
}
CALLS_3 = {
    "enterEventMode": (lambda d: d.block.enterEventMode(), {"step"}),
    "enterStepMode": (lambda d: d.block.enterStepMode(), {"event"}),
    "updateDiscreteStates": (lambda d: d.block.updateDiscreteStates(), {"event"}),
    "setClock": (lambda d: d.block.setClock(d.vr("mark"), [True]), {"event"}),
    "getClock": (
        lambda d: d.block.getClock(d.vr("mark")),
        {"instantiated", "initialization", "step", "event", "terminated"},
    ),
}
MODES = {2: ["instantiated", "initialization", "step", "terminated", "freed"]}
MODES[3] = [*MODES[2], "event"]


@pytest.mark.parametrize(
    ("version", "name", "mode"),
    [(v, n, m) for v, more in ((2, CALLS_2), (3, CALLS_3)) for n in CALLS | more for m in MODES[v]],
)
def test_a_call_is_served_in_its_modes_and_refused_in_the_others(version: int, name: str, mode: str) -> None:
    call, allowed = (CALLS | CALLS_2 | CALLS_3)[name]
    driven = _in_mode(version, mode)
    if mode in allowed:
        call(driven)
        return
    with pytest.raises(BlockCallError) as caught:
        call(driven)
    error = caught.value
    assert isinstance(error, FMICallException)
    assert isinstance(error, BlockError)
    assert (error.function, error.status) == (name, 3)
    t = "0.05" if mode in ("step", "event", "terminated") else "0.0"
    assert str(error).startswith(f"{name}: pendulum at t = {t} s: ")
    assert f"'{mode}'" in str(error) or (mode == "freed" and "has been freed" in str(error))
    assert driven.block.mode == mode


SETTABLE = {
    "torque": {"instantiated", "initialization", "step", "event"},
    "damping": {"instantiated", "initialization", "step", "event"},  # tunable
    "stiffness[2]": {"instantiated", "initialization"},  # fixed
    "internal_step": {"instantiated", "initialization"},
    "angle": {"instantiated", "initialization"},
    "marks[1]": {"instantiated", "initialization"},
    "energy": set(),
    "time": set(),
}
WITH_EVENT = {
    2: {n: {"instantiated", "initialization", "step"} for n in ("kick_impulse", "kick_share[2]", "kick_time")},
    3: {n: {"instantiated", "initialization", "event"} for n in ("kick_impulse", "kick_share[2]", "kick_time")},
}


@pytest.mark.parametrize(
    ("version", "name", "mode"), [(v, n, m) for v in (2, 3) for n in SETTABLE | WITH_EVENT[v] for m in MODES[v]]
)
def test_variables_may_be_set_in_their_modes_only(version: int, name: str, mode: str) -> None:
    driven = _in_mode(version, mode)
    if mode in (SETTABLE | WITH_EVENT[version])[name]:
        driven.set_all({name: 0.125})
        assert driven.get(name) == [0.125]
        return
    with pytest.raises(BlockCallError, match=r"^set(Real|Float64): pendulum at t = ") as caught:
        driven.set_all({"torque": 0.125, name: 0.125} if mode not in ("freed", "terminated") else {name: 0.125})
    assert f"{name} (value reference {driven.vr(name)[0]})" in str(caught.value)
    if mode != "freed":
        assert driven.get("torque") != [0.125]  # nothing is set unless everything may be


def test_the_refusal_of_a_fixed_parameter_says_so() -> None:
    driven = _in_mode(3, "step")
    with pytest.raises(
        BlockCallError, match=r"stiffness\[1\] .* is a fixed parameter and cannot be set in mode 'step'"
    ):
        driven.set_all({"stiffness[1]": 1.0})


@pytest.mark.parametrize(("version", "mode"), [(v, m) for v in (2, 3) for m in MODES[v] if m != "freed"])
def test_outputs_can_be_read_in_every_mode_after_instantiation(version: int, mode: str) -> None:
    driven = _in_mode(version, mode)
    x = driven.get("angle", "rate")
    energy = 0.5 * x[1] ** 2 + 3.0 * (1.0 - np.cos(x[0]))
    assert driven.get("energy")[0] == pytest.approx(energy, rel=1e-14)  # a few roundings
    assert np.isfinite(driven.everything()).all()


@BOTH
def test_a_freed_block_refuses_every_call_until_it_is_instantiated_again(version: int) -> None:
    driven = _in_mode(version, "freed")
    with pytest.raises(BlockCallError, match=r"has been freed; begin anew with instantiate\(\)"):
        driven.get("energy")
    driven.instantiate()
    assert driven.get("time", "angle").tolist() == [0.0, 0.3]


@BOTH
def test_outputs_follow_inputs_parameters_and_start_time_during_initialisation(version: int) -> None:
    class Clock(Swing):
        name = "clock"

        def output(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
            return {"energy": t, "last_sample": p.stiffness[0], "net_torque": u.torque}

    driven = Driven(Clock(), version).instantiate()
    outputs = ("energy", "last_sample", "net_torque")
    assert driven.get(*outputs).tolist() == [0.0, 3.0, 0.5]
    driven.enter_initialization(8.0)
    assert driven.get(*outputs).tolist() == [8.0, 3.0, 0.5]
    driven.set_all({"stiffness[1]": 1.5, "torque": 2.5})
    assert driven.get(*outputs).tolist() == [8.0, 1.5, 2.5]


@BOTH
@pytest.mark.parametrize(
    ("t", "h", "message"),
    [
        (0.3, H, r"currentCommunicationPoint = 0\.3 s, but the block stands at 0\.05 s"),
        (0.0, H, "but the block stands at"),
        (float("nan"), H, "but the block stands at"),
        (H, 0.0, r"communicationStepSize = 0\.0 s is not a positive number"),
        (H, -0.1, "is not a positive number"),
        (H, float("nan"), "is not a positive number"),
        (H, float("inf"), "is not a positive number"),
    ],
)
def test_a_step_that_does_not_continue_is_refused_and_changes_nothing(
    version: int, t: float, h: float, message: str
) -> None:
    driven = _in_mode(version, "step")
    before = driven.everything()
    with pytest.raises(BlockCallError, match=f"^doStep: pendulum at t = 0.05 s: .*{message}"):
        driven.step(t, h)
    np.testing.assert_array_equal(driven.everything(), before)
    driven.step(H)


def test_times_that_differ_by_rounding_are_equal() -> None:
    driven = Driven(SWING, 3).start()
    t = 0.0
    for _ in range(1000):
        driven.step(t, 0.1)
        t += 0.1  # adds up its roundings
    driven.step(100.0, 0.1)
    assert driven.get("time") == [100.1]


@BOTH
@pytest.mark.parametrize("start_time", [float("nan"), float("inf")])
def test_a_start_time_is_a_finite_number(version: int, start_time: float) -> None:
    with pytest.raises(BlockCallError, match=r"start time .* is not a finite number"):
        Driven(SWING, version).instantiate().enter_initialization(start_time)


@BOTH
@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("internal_step", 0.0),
        ("internal_step", -1.0),
        ("period", 0.0),
        ("period", float("nan")),
        ("offset", float("inf")),
        ("seed", -2.0),
        ("seed", 1.5),
        ("seed", 2.0**53),
    ],
)
def test_time_does_not_run_with_illegal_parameters(version: int, name: str, value: float) -> None:
    driven = Driven(SWING, version).instantiate()
    driven.set_all({name: value})
    driven.enter_initialization()
    with pytest.raises(BlockCallError, match=rf"^exitInitializationMode: .*time cannot run with parameter {name} = "):
        driven.block.exitInitializationMode()
    assert driven.block.mode == "initialization"


@BOTH
def test_a_state_that_is_no_number_any_more_is_named(version: int) -> None:
    driven = Driven(SWING, version).start()
    driven.event("kick", H, kick(1.0) | {"kick_impulse": float("nan")})
    with pytest.raises(BlockCallError, match="state rate is not a finite number; check inputs, payloads") as caught:
        driven.step(0.0)
    assert str(caught.value).startswith("doStep: swing at t = 0.0 s")  # where it stands again


def test_an_equation_that_escapes_is_reported_and_a_huge_state_is_not() -> None:
    driven = Driven(Explosion(), 3).start()
    driven.step(0.0, 0.9)
    with pytest.raises(BlockCallError, match="state x is not a finite number"):
        driven.step(0.9, 1.0)
    huge = Driven(Explosion(), 3).start(x=1e-300, quiet=1.7e308, noise=1.7e308)  # their sum is infinite
    huge.step(0.0, 0.1)
    assert huge.get("quiet") == [1.7e308]


@BOTH
def test_unknown_and_foreign_value_references_are_refused_by_name(version: int) -> None:
    driven = Driven(SWING, version).start()
    block, last = driven.block, max(driven.references.values())
    get, put = getattr(block, f"get{block.real_type}"), getattr(block, f"set{block.real_type}")
    trigger = driven.vr("mark_count" if version == 2 else "mark")
    for call in (get, lambda vr: put(vr, [1.0])):
        with pytest.raises(
            BlockCallError, match=f"no variable with value reference {last + 1}; the last one is {last}"
        ):
            call([last + 1])
        with pytest.raises(BlockCallError, match="no variable with value reference 0"):  # they count from 1
            call([0])
        with pytest.raises(BlockCallError, match="is not a real variable but announces an event"):
            call(trigger)
    with pytest.raises(BlockCallError, match="2 value references but 1 values"):
        put(driven.vr("torque", "damping"), [1.0])
    events = block.setInteger if version == 2 else (lambda vr, v: (block.enterEventMode(), block.setClock(vr, v)))
    with pytest.raises(BlockCallError, match=r"torque .* is (of another type|not the clock of an event)"):
        events(driven.vr("torque"), [1])


def test_calls_that_a_block_does_not_have_are_refused_with_fmpys_exception() -> None:
    fmi2, fmi3 = Driven(SWING, 2).block, Driven(SWING, 3).block
    for name, call in {
        "fmi2GetBoolean": lambda: fmi2.getBoolean([1]),
        "fmi2SetString": lambda: fmi2.setString([1], ["a"]),
        "fmi2SetRealInputDerivatives": lambda: fmi2.setRealInputDerivatives([1], [1], [0.0]),
        "fmi3GetInt16": lambda: fmi3.getInt16([1]),
        "fmi3SetBoolean": lambda: fmi3.setBoolean([1], [True]),
        "fmi3GetOutputDerivatives": lambda: fmi3.getOutputDerivatives([1], [1]),
    }.items():
        with pytest.raises(BlockCallError, match=f"^{name}: swing at t = 0.0 s: not supported"):
            call()
    fmi2.freeLibrary()
    fmi2.setDebugLogging(True, ["logStatusError"])
    assert fmi2.getTypesPlatform() == "default"


def test_fmi2_status_calls() -> None:
    driven = Driven(SWING, 2).start()
    driven.step(0.0)
    block = driven.block
    assert block.getRealStatus(2) == H  # fmi2LastSuccessfulTime
    assert block.getBooleanStatus(3) is False  # fmi2Terminated
    with pytest.raises(BlockCallError, match="only fmi2LastSuccessfulTime is known"):
        block.getRealStatus(3)
    with pytest.raises(BlockCallError, match="only fmi2Terminated is known"):
        block.getBooleanStatus(2)


def test_fmi2_says_of_a_discarded_step_that_the_run_should_end() -> None:
    driven = Driven(SWING, 2).start()
    with pytest.raises(BlockCallError, match=r"holds more than .* internal steps or periods"):
        driven.step(0.0, 1e12)
    assert driven.block.getBooleanStatus(3) is True  # fmi2Terminated
    driven.step(0.0)
    assert driven.block.getBooleanStatus(3) is False


def test_an_error_survives_a_trip_between_processes() -> None:
    with pytest.raises(BlockCallError) as caught:
        Driven(SWING, 3).step(0.0)
    copy = pickle.loads(pickle.dumps(caught.value))
    assert (type(copy), copy.function, copy.status, str(copy)) == (BlockCallError, "doStep", 3, str(caught.value))


# -- event mode
# -----------------------------------------------------------------------------------------------------------


def test_without_event_mode_initialisation_ends_in_step_mode_and_event_mode_is_refused() -> None:
    driven = Driven(SWING, 3)
    driven.block.instantiate(eventModeUsed=False)
    driven.enter_initialization()
    driven.block.exitInitializationMode()
    assert driven.block.mode == "step"
    driven.step(0.0)
    with pytest.raises(BlockCallError, match="instantiated with eventModeUsed = False"):
        driven.block.enterEventMode()
    with pytest.raises(BlockCallError, match="expected event"):
        driven.block.updateDiscreteStates()


def test_a_block_that_was_never_instantiated_uses_event_mode_as_soon_as_its_caller_does() -> None:
    with_events, without = Driven(SWING, 3), Driven(SWING, 3)
    for driven in (with_events, without):
        driven.set(angle=0.8)  # before initialisation, and kept
        driven.enter_initialization()
        driven.block.exitInitializationMode()
    without.step(0.0)
    with_events.block.updateDiscreteStates()
    assert with_events.block.mode == "event"
    with_events.block.enterStepMode()
    with_events.step(0.0)
    np.testing.assert_array_equal(with_events.everything(), without.everything())
    without.block.enterEventMode()
    without.block.updateDiscreteStates()
    without.block.enterStepMode()


def test_leaving_event_mode_with_an_active_clock_is_refused() -> None:
    driven = _in_mode(3, "event")
    driven.block.setClock(driven.vr("mark"), [True])
    with pytest.raises(BlockCallError, match="clock mark is active; call updateDiscreteStates first"):
        driven.block.enterStepMode()
    driven.block.updateDiscreteStates()
    driven.block.enterStepMode()


# -- files
# ----------------------------------------------------------------------------------------------------------------


def test_the_folder_for_fmpy_goes_away_with_the_block_without_a_warning() -> None:
    block = Driven(SWING, 3).block
    folder = Path(block.unzipDirectory)
    assert block.unzipDirectory == str(folder)
    assert (folder / "modelDescription.xml").is_file()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        del block
        gc.collect()
    assert not folder.exists()
