"""The probe against slaves that lie in one way each, and against honest ones."""

from __future__ import annotations

from collections.abc import Callable
from copy import deepcopy
from math import exp
from typing import Any, ClassVar

import pytest
from coupled_runs import Motion, Pushed, block
from fmpy.fmi1 import FMICallException
from mock_slaves import ERROR, FMI2, Counter, EventMode, Mock, Train, component

from cosim.components.loading import load_fmu
from fmus.check.probe import ProbeReport, probe

H = 0.01


def probed(slave: type[Mock], h: float = H) -> ProbeReport:
    return probe(lambda: component(slave()), {}, 0.0, h)


class OwnStep(Train):
    """Moves in steps of its own, 10 ms, whenever it is asked to go beyond where it is."""

    own = 0.01
    memory = ("v", "x", "time", "reached")

    def begin(self) -> None:
        super().begin()
        self.reached = 0.0

    def move(self, t: float, h: float) -> None:
        while self.reached < t + h - 1e-9:
            super().move(self.reached, self.own)
            self.reached += self.own


class Unshortened(Train):
    """Accepts a shortened step and returns the result of the whole one."""

    def move(self, t: float, h: float) -> None:
        super().move(t, H)


class Rounding(Train):
    """Does very short steps as asked, and every other one as if it were the whole."""

    def move(self, t: float, h: float) -> None:
        super().move(t, H if h > 0.05 * H else h)


class HalfRestored(Train):
    """Restores position and speed, but not a filter that acts on the train a while later."""

    def begin(self) -> None:
        super().begin()
        self.hidden = [0.0, 0.0]

    def move(self, t: float, h: float) -> None:
        pull, self.hidden = self.hidden[0], [self.hidden[1], self.v["effort"]]
        effort, self.v["effort"] = self.v["effort"], pull
        super().move(t, h)
        self.v["effort"] = effort


class LateRestored(HalfRestored):
    """Restores the filter but for its newest entry, which takes a second step to act."""

    def setFMUstate(self, state: Any) -> None:
        newest = self.hidden[-1]
        super().setFMUstate(state)
        self.hidden[0], self.hidden[-1] = state["hidden"][0], newest

    setFMUState = setFMUstate
    memory = ("v", "x", "time", "hidden")


class Restoring(HalfRestored):
    """The same filter, saved and restored."""

    memory = ("v", "x", "time", "hidden")


class HalfReset(Train):
    """A reset forgets the position and keeps the speed."""

    def reset(self) -> None:
        speed = self.x["v"]
        super().reset()
        self.x["v"] = speed


class NoReset(Train):
    def reset(self) -> None:
        raise FMICallException("fmi3Reset", ERROR)


class NoState(Train):
    def getFMUstate(self) -> Any:
        raise FMICallException("fmi3GetFMUState", ERROR)

    getFMUState = getFMUstate


class NoSymbol(Train):
    """The library does not even have the function."""

    def getFMUState(self) -> Any:
        raise AttributeError("function getFMUState not found")


class Single(Train):
    capabilities: ClassVar[dict[str, Any]] = {"canBeInstantiatedOnlyOncePerProcess": True}


class Fragile(Train):
    """Stands at first, and breaks when it is pushed too hard."""

    def begin(self) -> None:
        self.x = {"p": 0.0, "v": 0.0}

    def move(self, t: float, h: float) -> None:
        if self.v["effort"] > 1e4:
            raise FMICallException("fmi3DoStep", ERROR)
        super().move(t, h)


class Dead(Train):
    """Nothing moves it."""

    def begin(self) -> None:
        self.x = {"p": 0.0, "v": 0.0}

    def move(self, t: float, h: float) -> None:
        pass


class Broken(Train):
    def exitInitializationMode(self) -> None:
        raise FMICallException("fmi3ExitInitializationMode", ERROR)


class Sampled(Train):
    """Honest, with an output that changes every 50 ms only, and one that is noise-like but repeatable."""

    outputs: ClassVar[dict[str, Any]] = Train.outputs | {"held": 0.0}

    def compute(self) -> None:
        super().compute()
        self.v["held"] = round(self.time / 0.05 - 0.5 + 1e-9)


class Train2(FMI2, Train):
    """The honest train as an FMI 2 slave."""


@pytest.mark.parametrize("h", [0.01, 0.1])
@pytest.mark.parametrize("slave", [Train, Train2, Counter, Sampled, Restoring, EventMode])
def test_honest_slaves_pass(slave: type[Mock], h: float) -> None:
    report = probed(slave, h)
    assert (report.honest_step, report.exact_state, report.repeatable) == (True, True, True), report.remarks


def test_honest_blocks_pass() -> None:
    for system in (Motion(), Pushed()):
        for version in (2, 3):
            report = probe(lambda s=system, v=version: block(s, "plant", v), {}, 0.0, 0.1)
            assert (report.honest_step, report.exact_state, report.repeatable, report.excited) == (True,) * 4, (
                report.remarks
            )


@pytest.mark.parametrize("h", [0.01, 0.02, 0.1])
def test_steps_of_its_own_are_seen_at_any_communication_step(h: float) -> None:
    """Also where the communication step is a multiple of the slave's own, so that halves of it look right."""
    report = probed(OwnStep, h)
    assert not report.honest_step
    assert report.repeatable
    assert any("steps of other lengths" in remark for remark in report.remarks)


@pytest.mark.parametrize("slave", [Unshortened, Rounding])
def test_unshortened_result_is_seen(slave: type[Mock]) -> None:
    assert not probed(slave).honest_step


@pytest.mark.parametrize("slave", [HalfRestored, LateRestored])
def test_state_that_is_restored_in_part_is_seen(slave: type[Mock]) -> None:
    report = probed(slave)
    assert (report.declares_state, report.exact_state) == (True, False)
    assert report.honest_step


class Restarting(Train):
    """Each step ends a little off, by `off` of the speed: its solver starts anew with whatever order it had before."""

    off = 0.0

    def begin(self) -> None:
        super().begin()
        self.order = 0  # not part of the state

    def move(self, t: float, h: float) -> None:
        super().move(t, h)
        self.order = (self.order + 1) % 5
        self.x["v"] *= 1.0 + self.off * self.order


@pytest.mark.parametrize(
    ("off", "restores"), [(0.0, "exact"), (1e-9, "within_tolerance"), (1e-5, "within_tolerance"), (0.05, "no")]
)
def test_restored_to_within_the_solver_is_another_verdict_than_not_restored(off: float, restores: str) -> None:
    report = probed(type("Solver", (Restarting,), {"off": off}))
    assert report.restores == restores, report.remarks
    assert report.exact_state is (restores == "exact")
    assert report.restore_mismatch == pytest.approx(15.0 * off, rel=0.9)
    if off and report.honest_step:
        assert report.spread["position"] > 0.0


@pytest.mark.parametrize("slave", [HalfRestored, LateRestored, NoState])
def test_a_state_that_lacks_something_is_not_taken_for_a_solver(slave: type[Mock]) -> None:
    assert probed(slave).restores == "no"


def test_bad_reset_is_seen_and_spoils_no_other_finding() -> None:
    for slave in (HalfReset, NoReset):
        report = probed(slave)
        assert (report.repeatable, report.honest_step, report.exact_state) == (False, True, True), report.remarks


@pytest.mark.parametrize("slave", [NoState, NoSymbol])
def test_state_that_cannot_be_taken_is_seen(slave: type[Mock]) -> None:
    report = probed(slave)
    assert not report.exact_state
    assert report.honest_step
    assert any("getFMUState" in remark for remark in report.remarks)


def test_one_instance_for_each_process_is_not_probed() -> None:
    made = []

    def make() -> Any:
        made.append(component(Single()))
        return made[-1]

    report = probe(make, {}, 0.0, H)
    assert (report.honest_step, report.exact_state, report.repeatable) == (False,) * 3
    assert "one instance per process" in report.remarks[0]
    assert len(made) == 1
    assert made[0].slave.calls == []


def test_an_excitation_that_breaks_the_slave_is_not_used() -> None:
    report = probed(Fragile)
    assert (report.excited, report.honest_step, report.exact_state) == (True, True, True), report.remarks


def test_what_does_not_move_is_remarked() -> None:
    report = probed(Dead)
    assert not report.excited
    assert any("findings are weak" in remark for remark in report.remarks)


def test_a_slave_that_cannot_start_is_reported_not_raised() -> None:
    report = probed(Broken)
    assert (report.honest_step, report.exact_state, report.repeatable, report.excited) == (False,) * 4
    assert any("exitInitializationMode" in remark for remark in report.remarks)


def test_what_is_not_declared_is_not_tried() -> None:
    class Modest(Train):
        capabilities: ClassVar[dict[str, Any]] = {
            "canGetAndSetFMUstate": False,
            "canHandleVariableCommunicationStepSize": False,
        }

        def getFMUstate(self) -> Any:
            raise AssertionError("not declared")

        def move(self, t: float, h: float) -> None:
            assert abs(h - H) < 1e-12
            super().move(t, h)

    report = probed(Modest)
    assert (report.declares_state, report.declares_variable_step, report.exact_state, report.honest_step) == (
        False,
    ) * 4
    assert report.repeatable


def test_every_instance_is_freed_and_start_values_are_used() -> None:
    made: list[Any] = []

    class Heavy(HalfReset):
        parameters: ClassVar[dict[str, Any]] = {"mass": 1.0}

        def move(self, t: float, h: float) -> None:
            assert self.v["mass"] == 7.0
            super().move(t, h)

    def make() -> Any:
        made.append(component(Heavy()))
        return made[-1]

    report = probe(make, {"mass": 7.0}, 0.0, H)
    assert report.honest_step, report.remarks
    assert len(made) > 2  # the reset does not work, so fresh instances are taken
    assert all(c.slave.freed for c in made)


def test_report_as_plain_data() -> None:
    data = probed(Train).to_dict()
    assert data["component"] == "mock"
    assert data["remarks"] == []


def test_a_decay_that_is_fast_against_the_step_is_no_lie() -> None:
    class Fast(Mock):
        outputs: ClassVar[dict[str, Any]] = {"y": 1.0, "position": 0.0}

        def begin(self) -> None:
            self.x = {"y": 1.0}

        def compute(self) -> None:
            self.v["y"], self.v["position"] = self.x["y"], self.time

        def move(self, t: float, h: float) -> None:
            self.x["y"] *= exp(-30.0 * h)

    assert probed(Fast, 0.1).honest_step


@pytest.mark.compiler
@pytest.mark.parametrize("version", [2, 3])
def test_native_locomotive_passes(version: Any) -> None:
    import fmus
    import plant_models

    path = fmus.cached_fmu(plant_models.PLANTS["locomotive"](), fmi_version=version)
    make: Callable[[], Any] = lambda: load_fmu(path, "locomotive")  # noqa: E731 - the probe takes a factory
    report = probe(make, {}, 0.0, 0.1)
    assert (report.honest_step, report.exact_state, report.repeatable, report.excited) == (True,) * 4, report.remarks
    assert deepcopy(report) == report
