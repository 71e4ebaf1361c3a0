"""Model exchange call by call: modes, what may be set when, told events, late ones, values that are no numbers, saved
states.
"""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from ctypes import POINTER, c_double, cast
from math import inf
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from exchange_importer import Exchange, Importer, Notified
from fmpy import extract, read_model_description
from fmpy.fmi1 import FMICallException
from fmpy.fmi2 import FMU2Model
from fmpy.fmi3 import FMU3Model
from shipped import shipped

from fmu_observer.description import can_exchange
from fmu_observer.event_protocol import EventProtocol
from fmus import RECIPES, cached_fmu, recipe
from fmus.build import BuildDraft, build_fmu, plan_fmu
from fmus.toolchain.targets import choose_targets
from plant_models.hybrid import CommunicationEvent, HybridSystem, input_signal, memory, output_signal, state

pytestmark = pytest.mark.compiler

REPLAY, REJECT, LATE = 1, 2, 3
DISCARD, ERROR = 2, 3
EXCHANGED = ("oscillator", "slider", "sampler", "tracker", "gain", *(n for n in RECIPES if can_exchange(shipped(n))))


class Root(HybridSystem):
    """A square root that has no value below zero."""

    name = "root"
    states = (state("level", "m", 1.0), state("other", "m", 2.0))
    inputs = (input_signal("offset", "m"),)
    outputs = (output_signal("double_level", "m"),)

    def flow(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"level": -1.0, "other": np.sqrt(x.level + u.offset)}

    def output(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"double_level": 2.0 * x.level}


class Follower(HybridSystem):
    """Works on communication steps, so it has no model exchange."""

    name = "follower"
    states = (memory("held", "m"),)
    inputs = (input_signal("stated", "m"),)
    outputs = (output_signal("held_out", "m"),)
    events = (CommunicationEvent("reading"),)

    def jump(self, event: str, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"held": u.stated}

    def output(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"held_out": x.held}


def _status(call: Callable[..., Any], *arguments: Any) -> int:
    with pytest.raises(FMICallException) as refused:
        call(*arguments)
    return int(refused.value.status)


@pytest.fixture(scope="session")
def counting_tracker(reference_system: HybridSystem, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An FMI 3 FMU that is told of events by counts."""
    return build_fmu(reference_system, tmp_path_factory.mktemp("counting"), 3, protocol=EventProtocol("counts"))


@pytest.fixture(scope="session")
def reference_system() -> HybridSystem:
    """An observer with a balise event."""
    return recipe("takagi_sugeno_cdo")


# -- modes
# --------------------------------------------------------------------------------------------------------------


def test_life_runs_through_event_mode_and_continuous_time_mode(version: int, exchange: Callable[..., Exchange]) -> None:
    one = exchange("oscillator", version)
    assert _status(one.model.enterEventMode) == ERROR
    if version == 2:
        one.model.setupExperiment(startTime=0.5)
        one.model.enterInitializationMode()
    else:
        one.model.enterInitializationMode(startTime=0.5)
    assert one.derivatives().tolist() == one.get("der(position)", "der(speed)").tolist()  # they are known from here on
    one.model.exitInitializationMode()
    assert _status(one.model.completedIntegratorStep) == ERROR  # still in event mode
    assert one.update().next_time == inf
    one.model.enterContinuousTimeMode()
    assert _status(one.model.enterContinuousTimeMode) == ERROR
    assert one.model.completedIntegratorStep() == (False, False)
    one.model.setTime(0.75)
    assert one.get("time")[0] == 0.75
    one.model.enterEventMode()
    assert _status(one.model.setContinuousStates, cast(one._x.ctypes.data, POINTER(c_double)), one.nx) == ERROR
    one.model.enterContinuousTimeMode()
    one.model.terminate()
    assert one.states().tolist() == one.get("position", "speed").tolist()  # still readable
    assert _status(one.model.enterEventMode) == ERROR
    assert any("Continuous-Time Mode" in line for line in one.log)


def test_numbers_of_states_and_indicators(version: int, exchange: Callable[..., Exchange]) -> None:
    one = exchange("slider", version)
    one.initialize()
    if version == 3:
        assert (one.model.getNumberOfContinuousStates(), one.model.getNumberOfEventIndicators()) == (3, 1)
    nominals = np.zeros(3)
    one.model.getNominalsOfContinuousStates(cast(nominals.ctypes.data, POINTER(c_double)), 3)
    assert nominals.tolist() == [1.0, 1.0, 1.0]
    for wrong in (2, 4):
        assert (
            _status(one.model.getNominalsOfContinuousStates, cast(nominals.ctypes.data, POINTER(c_double)), wrong)
            == ERROR
        )
    assert f"{wrong} values, expected 3" in one.log[-1]


def test_what_may_be_set_while_a_solver_is_at_work(version: int, exchange: Callable[..., Exchange]) -> None:
    one = exchange("oscillator", version)
    one.initialize()
    one.set(force=3.0)
    for name in ("damping", "stiffness", "acceleration", "der(speed)", "time"):
        with pytest.raises(FMICallException):
            one.set(**{name: 1.0})
    if version == 3:  # only FMI 3 lets a solver write states one by one
        one.set(position=7.0)
        assert one.states().tolist() == [7.0, 0.0]
    else:
        with pytest.raises(FMICallException):
            one.set(position=7.0)
    one.model.enterEventMode()
    one.set(damping=2.0, force=1.0)
    with pytest.raises(FMICallException):
        one.set(stiffness=1.0)


def test_outputs_follow_states_time_and_inputs(version: int, exchange: Callable[..., Exchange]) -> None:
    one = exchange("oscillator", version)
    one.initialize()
    one.set_state(0.0, np.array([0.5, -1.0]))
    assert one.get("position_mm")[0] == 500.0
    before = one.derivatives()[1]
    one.set(force=10.0)
    assert one.derivatives()[1] == pytest.approx(before + 10.0, rel=1e-15)
    assert one.get("acceleration")[0] == one.derivatives()[1]
    gain = exchange("gain", version)
    gain.initialize()
    gain.set_state(4.0, np.zeros(0))
    assert gain.get("twice")[0] == 10.0  # 2 * 3 + t


def test_co_simulation_and_model_exchange_keep_apart(
    version: int, exchange: Callable[..., Exchange], component: Callable[..., Any]
) -> None:
    one, stepped = exchange("slider", version), component("slider", version)
    one.initialize()
    stepped.initialize()
    model, own = one.model, one.model.component
    model.component = stepped.slave.component  # model exchange calls on the co-simulation instance
    try:
        refused = [
            _status(call)
            for call in (model.enterContinuousTimeMode, model.completedIntegratorStep, one.update, one.states)
        ]
        refused.append(_status(model.setTime, 1.0))
    finally:
        model.component = own
    assert refused == [ERROR] * 5
    saved = stepped.save()
    content = stepped.serialize(saved)
    stepped.free(saved)
    with pytest.raises(FMICallException):
        one.restore(content)
    assert "was saved in co-simulation" in one.log[-1]


def test_system_of_communication_steps_has_no_model_exchange(version: int, tmp_path: Path) -> None:
    system = Follower()
    assert not can_exchange(system)
    plan = plan_fmu(system, version)  # type: ignore[arg-type]
    assert plan.description.modelExchange is None
    assert "<ModelExchange" not in plan.description_xml()
    draft = BuildDraft.of(plan, choose_targets())
    fmu = draft.pack(draft.compile(), tmp_path / "follower.fmu")
    description = read_model_description(str(fmu))
    model = (FMU2Model if version == 2 else FMU3Model)(
        guid=description.guid,
        unzipDirectory=extract(str(fmu), str(tmp_path / "out")),
        modelIdentifier="follower",
        instanceName="f",
    )
    with pytest.raises(Exception, match="Failed to instantiate"):
        model.instantiate()
    model.component = None
    model.freeLibrary()


# -- told events
# --------------------------------------------------------------------------------------------------------


def test_stamp_ahead_waits_and_is_the_next_time_event(version: int, exchange: Callable[..., Exchange]) -> None:
    one = exchange("tracker", version)
    importer = Importer(one, one.initialize())
    importer.advance(0.11)
    importer.happen([Notified(0.11, "balise", {"balise_position": 50.0}, stamp=0.1375)])
    assert importer.next_time == 0.1375  # before the periodic event at 0.15
    assert one.get("innovation")[0] == 0.0
    importer.advance(0.1375)
    assert one.get("innovation")[0] > 40.0
    assert importer.next_time == pytest.approx(0.15, rel=1e-15)


def test_payload_is_that_of_the_announcement(version: int, exchange: Callable[..., Exchange]) -> None:
    one = exchange("tracker", version)
    importer = Importer(one, one.initialize())
    importer.happen([Notified(0.0, "balise", {"balise_position": 50.0}, stamp=0.02)])
    importer.happen([Notified(0.0, "telegram", {"telegram_speed": 3.0, "telegram_weight": 1.0})])
    assert one.get("speed")[0] == 3.0
    importer.happen([Notified(0.0, "balise", {"balise_position": -70.0}, stamp=0.04)])
    importer.advance(0.03)
    assert 45.0 < one.get("innovation")[0] <= 50.0
    importer.advance(0.04)
    assert one.get("innovation")[0] < -70.0


@pytest.mark.parametrize(("policy", "applied"), [(REPLAY, False), (REJECT, False), (LATE, True)])
def test_late_event_goes_by_the_policy(
    version: int, policy: int, applied: bool, exchange: Callable[..., Exchange]
) -> None:
    one = exchange("tracker", version)
    reference = [one.by_name["late_policy"].valueReference]
    (one.model.setInteger if version == 2 else one.model.setInt64)(reference, [policy])
    importer = Importer(one, one.initialize())
    importer.advance(0.27)
    importer.happen([Notified(0.27, "balise", {"balise_position": 50.0}, stamp=0.1)])
    assert (one.get("innovation")[0] != 0.0) == applied
    warned = [line for line in one.log if "before the current time" in line]
    assert len(warned) == (0 if applied else 1)
    if policy == REPLAY:
        assert "the past is the solver's" in warned[0]
    importer.advance(0.31)  # and life goes on
    assert importer.next_time == pytest.approx(0.35)


def test_event_that_waited_is_not_late_where_the_solver_stops_behind_it(
    version: int, exchange: Callable[..., Exchange]
) -> None:
    one = exchange("tracker", version)
    one.initialize()
    assert one.happen([Notified(0.0, "balise", {"balise_position": 50.0}, stamp=0.02)]).next_time == 0.02
    one.model.setTime(0.021)  # an importer with a coarse step
    one.happen()
    assert one.get("innovation")[0] == 50.0
    assert one.log == []


def test_counts_announce_in_fmi_3_as_well(counting_tracker: Path, exchange: Callable[..., Exchange]) -> None:
    counted, clocked = exchange(counting_tracker, 3), exchange("takagi_sugeno_cdo", 3)
    rows = []
    for one in (counted, clocked):
        importer = Importer(one, one.initialize(odometer=10.0))
        importer.advance(0.2)
        importer.happen([Notified(0.2, "balise", {"balise_position": 2.5})])
        importer.advance(0.4)
        rows.append(one.get("position", "speed", "innovation"))
    np.testing.assert_array_equal(rows[0], rows[1])
    assert rows[0][2] != 0.0


def test_clock_belongs_into_event_mode(exchange: Callable[..., Exchange]) -> None:
    one = exchange("tracker", 3)
    one.initialize()
    clock = one.references(["balise"])
    assert _status(one.model.setClock, clock, [True]) == ERROR
    assert _status(one.model.setFloat64, one.references(["balise_position"]), [1.0]) == ERROR
    one.model.enterEventMode()
    one.model.setClock(clock, [True])
    assert _status(one.model.enterContinuousTimeMode) == ERROR  # the event would be lost
    assert one.model.getClock(clock) == [True]
    one.update()
    assert one.model.getClock(clock) == [False]


# -- what is no number
# --------------------------------------------------------------------------------------------------


def test_derivative_that_is_no_number_is_discarded(version: int, exchange: Callable[..., Exchange]) -> None:
    one = exchange(Root(), version)
    one.initialize()
    one.set_state(0.5, np.array([-1.0, 0.0]))
    assert _status(one.derivatives) == DISCARD
    assert "derivative of other is not a finite number at 0.5 s" in one.log[-1]
    one.set_state(0.5, np.array([4.0, 0.0]))  # the solver tries elsewhere
    assert one.derivatives().tolist() == [-1.0, 2.0]
    for bad in (np.nan, inf):
        assert _status(one.model.setTime, bad) == ERROR


# -- saved states
# -------------------------------------------------------------------------------------------------------


def _prepared(one: Exchange, system: HybridSystem) -> Importer:
    """Some way into a run, with an event that still waits."""
    inputs = {"effort": 3.0e4, "force": -4.0, "odometer": 9.0, "speed": 9.5, "wheel_speed": 5.0}
    stated = {s.name: inputs[s.name] for s in system.inputs if s.name in inputs}
    importer = Importer(one, one.initialize(**stated), method="Radau", rtol=1e-6, atol=1e-8)
    importer.advance(0.23)
    reported = [Notified(0.23, e.name, {s.name: 2.0 for s in e.payload}, stamp=0.3) for e in system.triggered_events]
    importer.happen(reported)
    importer.advance(0.27)
    return importer


def _continued(one: Exchange, next_time: float) -> np.ndarray:
    importer = Importer(one, type("Said", (), {"next_time": next_time})(), method="Radau", rtol=1e-6, atol=1e-8)
    for t in (0.3, 0.4, 0.5):
        importer.advance(t)
        importer.record(*(v.name for v in one.description.modelVariables if v.type in {"Real", "Float64"}))
    return importer.run.values()


@pytest.mark.each_kind
@pytest.mark.parametrize("name", EXCHANGED)
def test_restored_state_continues_identically(
    name: str, version: int, exchange: Callable[..., Exchange], reference: Callable[[str], Any]
) -> None:
    one, other = exchange(name, version), exchange(name, version)
    next_time = _prepared(one, reference(name).system).next_time
    content = one.save()
    first = _continued(one, next_time)
    assert np.ptp(first, axis=0).max() > 0.0
    one.restore(content)
    assert one.save() == content
    np.testing.assert_array_equal(_continued(one, next_time), first)
    other.initialize(3.0)
    other.restore(content)
    np.testing.assert_array_equal(_continued(other, next_time), first)


OTHER_PROCESS = """
import sys
from pathlib import Path
import numpy as np
sys.path[:0] = [sys.argv[1], str(Path(sys.argv[1]).parent)]
from exchange_importer import Exchange
from test_model_exchange_calls import _continued
one = Exchange(Path(sys.argv[2]), Path(sys.argv[3]))
one.restore(Path(sys.argv[4]).read_bytes())
np.save(sys.argv[5], _continued(one, float(sys.argv[6])))
"""


def test_restored_state_continues_identically_in_another_process(
    version: int,
    exchange: Callable[..., Exchange],
    reference: Callable[[str], Any],
    unpacked: Callable[[Path], Path],
    tmp_path: Path,
) -> None:
    system = reference("multirate_cdo").system
    one = exchange(system, version)
    next_time = _prepared(one, system).next_time
    (tmp_path / "state").write_bytes(one.save())
    fmu = cached_fmu(system, version)  # type: ignore[arg-type]
    places = [Path(__file__).parent, fmu, unpacked(fmu), tmp_path / "state", tmp_path / "rows.npy"]
    subprocess.run([sys.executable, "-c", OTHER_PROCESS, *map(str, places), repr(next_time)], check=True)
    np.testing.assert_array_equal(np.load(tmp_path / "rows.npy"), _continued(one, next_time))


def test_signs_of_dry_friction_are_part_of_the_state(version: int, exchange: Callable[..., Exchange]) -> None:
    """At a state of exactly zero only they tell rest from the beginning of motion."""
    moving, other = exchange("slider", version), exchange("slider", version)
    moving.initialize(speed=0.0, force=4.0)
    other.initialize(speed=0.0)
    assert moving.states()[1] == other.states()[1] == 0.0
    other.restore(moving.save())
    other.set(force=0.0)  # what has begun to move feels the full friction, what rests is held
    assert other.derivatives()[1] == -1.5 / 2.0
    content = bytearray(moving.save())
    sign = content.rfind(np.float64(1.0).tobytes() * 2)  # resolved, then the sign of the one state
    content[sign + 8 : sign + 16] = np.float64(0.5).tobytes()
    with pytest.raises(FMICallException):
        other.restore(bytes(content))


def test_reset_begins_anew(version: int, exchange: Callable[..., Exchange], reference: Callable[[str], Any]) -> None:
    one, system = exchange("tracker", version), reference("tracker").system
    next_time = _prepared(one, system).next_time
    first = _continued(one, next_time)
    one.model.terminate()
    one.model.reset()
    assert one.get("time", "position", "speed").tolist() == [0.0, 0.0, 10.0]
    np.testing.assert_array_equal(_continued(one, _prepared(one, system).next_time), first)


def test_wrong_token_is_refused(
    version: int, unpacked: Callable[[Path], Path], reference: Callable[[str], Any]
) -> None:
    fmu = cached_fmu(reference("gain").system, version)  # type: ignore[arg-type]
    cls = FMU2Model if version == 2 else FMU3Model
    model = cls(guid="another", unzipDirectory=str(unpacked(fmu)), modelIdentifier="gain", instanceName="g")
    with pytest.raises(Exception, match="Failed to instantiate"):
        model.instantiate()
