"""States of FMUs are measured: what serves, and what is refused in which words."""

from __future__ import annotations

import re
from collections.abc import Callable
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any, Literal, cast

import lying_fmus
import numpy as np
import pytest
from test_fmus.build import linear_fmu
from test_fmus.events import awkward_fmu

import fmu_observer
import fmus
from cosim.fmu_model.co_simulation import CoSimulationModel
from cosim.fmu_model.linearise import _linearise_model, _objections
from cosim.fmu_model.opening import open_model
from cosim.fmu_model.sealed import FmuModelError, SealedModel
from cosim.fmu_model.trust import check_saving, check_states
from fmus.exchange import native_steps
from fmus.fmi.standard import Interface
from plant_models import PLANTS


@pytest.mark.parametrize("version", [2, 3])
@pytest.mark.parametrize("interface", ["co-simulation", "model-exchange"])
def test_our_fmus_restart_exactly(version: int, interface: Interface) -> None:
    rolling = {"train_speed": 12.0, "wheel_rate": 12.0 / 0.575}  # at rest an event would come in model exchange
    model = open_model(fmus.cached_fmu(PLANTS["locomotive"](), fmi_version=version), interface, parameters=rolling)
    trust = check_states(model, 0.01)
    model.close()
    assert trust.exact
    assert trust.deviation == 0.0
    assert not trust.idle
    assert trust.way == ("restart" if interface == "co-simulation" else "exchange")


def test_a_transition_is_a_step_of_the_run() -> None:
    model = open_model(fmus.cached_fmu(PLANTS["locomotive"](), fmi_version=3))
    x, u = np.array([5.0, 12.0, 21.0]), np.array([4e4])
    model.restart(0.0, x, u)
    model.advance(0.0, 0.1)
    model.advance(0.1, 0.1)
    whole = model.read()[0]
    middle, _ = model.transition(0.0, 0.1, x, u)
    np.testing.assert_array_equal(model.transition(0.1, 0.1, middle, u)[0], whole)
    model.close()


@pytest.mark.parametrize("version", [2, 3])
@pytest.mark.parametrize("step", [1.0 / 60.0, 0.1])
def test_a_step_is_handed_over_as_it_is_wherever_it_begins(tmp_path: Path, version: Literal[2, 3], step: float) -> None:
    """The FMU refuses lengths that are no whole multiples of its input; ``(t + h) - t`` is none but for rounding."""
    model = open_model(awkward_fmu(tmp_path, "exact-steps", f"exact{version}", version=version), states=())
    model.restart(1e4, np.zeros(0), np.array([step]))
    for k in range(20):
        model.advance(1e4 + k * step, step)
    model.close()


def begun(real: Callable[[float, float], None], event: Any, met: bool, t: float, h: float) -> None:
    """Begins a point of which the FMU says that it met an event."""
    real(t, h)
    event.value = met


@pytest.mark.parametrize("version", [2, 3])
def test_prepared_points_are_those_of_the_ordinary_calls(version: int, monkeypatch: pytest.MonkeyPatch) -> None:
    model = open_model(fmus.cached_fmu(PLANTS["locomotive"](), fmi_version=version))
    assert isinstance(model, CoSimulationModel)
    assert model._quick is not None
    points, u = np.array([[5.0, 6.0], [12.0, 13.0], [21.0, 22.0]]), np.array([4e4])
    driven = np.array([[4e4, -4e4]])
    wanted = [SealedModel.states_after(model, 0.0, 0.1, points, stated) for stated in (u, driven)]
    readings = SealedModel.outputs_at(model, 0.0, points, u, [2, 0])
    for met in (False, True):  # a step that meets an event goes the ordinary way
        monkeypatch.setattr(model._quick, "_begin", partial(begun, model._quick._begin, model._quick._flags[0], met))
        for stated, states in zip((u, driven), wanted, strict=True):
            np.testing.assert_array_equal(model.states_after(0.0, 0.1, points, stated), states)
    np.testing.assert_array_equal(model.outputs_at(0.0, points, u, [2, 0]), readings)
    assert wanted[0][1, 0] != wanted[0][1, 1] != wanted[1][1, 1]
    model.close()


def test_a_step_that_fails_is_reported_in_words() -> None:
    model = open_model(fmus.cached_fmu(PLANTS["locomotive"](), fmi_version=3))
    points = np.array([[0.0], [np.nan], [1.0]])
    with pytest.raises(FmuModelError, match=r"locomotive.*doStep was discarded.* at t = 3 s; .*not a finite number"):
        model.states_after(3.0, 0.1, points, np.array([0.0]))
    model.close()


def test_model_exchange_is_integrated() -> None:
    model = open_model(fmus.cached_fmu(PLANTS["pendulum"](), fmi_version=3), "model-exchange")
    equal = open_model(fmus.cached_fmu(PLANTS["pendulum"](), fmi_version=3), "co-simulation")
    x, u = np.full(len(model.states), 0.4), model.start_inputs
    one, other = (m.transition(0.0, 0.2, x, u)[0] for m in (model, equal))
    np.testing.assert_allclose(one, other, rtol=1e-8)  # fourth order at 1 ms, and CVODE at 1e-10
    model.close()
    equal.close()


def test_more_state_than_declared_is_found(tmp_path: Path) -> None:
    path = lying_fmus.build(tmp_path)
    model = open_model(path, states=["position"])
    with pytest.raises(FmuModelError, match=r"holds more than these states .* particle filter"):
        check_states(model, 0.01)
    model.close()


def test_a_sample_that_is_held_shows_where_inputs_move() -> None:
    """A constant input would give the sample that the restart takes the value of the one that is held."""
    slow = {"sample_period": 0.5}
    model = open_model(fmus.cached_fmu(PLANTS["odometer"](), fmi_version=3), "co-simulation", parameters=slow)
    with pytest.raises(FmuModelError, match=r"started again from its states .* reading is"):
        check_states(model, 0.2)
    model.close()


def test_states_without_start_values_are_refused(tmp_path: Path) -> None:
    path = linear_fmu(tmp_path, "mass", [[0, 1], [0, 0]], [[0], [1]], [[1, 0]], [[0]], inputs=["force"])
    with pytest.raises(FmuModelError, match="declares no continuous state"):
        open_model(path)
    with pytest.raises(FmuModelError, match=r"'x\[1\]' has no start value"):
        open_model(path, states=["x[1]"])


WITHOUT_STARTS = lying_fmus.description(model=lying_fmus.STATES).replace(' initial="exact"', ' initial="calculated"')
"""Of the small C FMU: its states have no start values, and it takes values at any time."""


def test_states_without_starts_are_set_in_step_mode_where_they_are_taken(tmp_path: Path) -> None:
    late = open_model(lying_fmus.build(tmp_path / "late", xml=WITHOUT_STARTS), "co-simulation")
    ordinary = open_model(lying_fmus.build(tmp_path / "exact"))
    assert check_states(late, 0.01).way == late.way == "step mode"
    assert ordinary.way == "restart"
    x, u = np.array([3.0, -2.0]), ordinary.start_inputs + 0.7
    for one, other in zip(late.transition(0.5, 0.01, x, u), ordinary.transition(0.5, 0.01, x, u), strict=True):
        np.testing.assert_array_equal(one, other)
    found = _linearise_model(late, 0.0, late.start, late.start_inputs, 0.01)
    assert "set in Step Mode" in found.remarks[0]
    late.close()
    ordinary.close()


class OwnSteps:
    """Decays in steps of its own of 0.1 s that begin at the restart, whatever steps are asked for."""

    path, way, states, outputs = "own.fmu", "restart", ("x",), ()
    instance = SimpleNamespace(description=SimpleNamespace(defaultExperiment=SimpleNamespace(stepSize="0.1")))
    start, start_inputs = np.ones(1), np.zeros(0)

    def restart(self, t: float, x: np.ndarray, _u: np.ndarray) -> None:
        self.begin, self.done, self.x = t, 0, x.copy()

    def set_inputs(self, _u: np.ndarray) -> None:
        """There are none."""

    def advance(self, t: float, h: float) -> None:
        while self.begin + 0.1 * (self.done + 1) < t + h + 1e-9:
            self.x, self.done = 0.9 * self.x, self.done + 1

    def read(self) -> tuple[np.ndarray, np.ndarray]:
        return self.x.copy(), np.zeros(0)

    def nominal(self, _name: str) -> float:
        return 1.0

    def values_at(self, t: float, x: np.ndarray, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return self.transition(t, 0.0, x, u)

    def transition(self, t: float, h: float, x: np.ndarray, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        self.restart(t, x, u)
        self.advance(t, h)
        return self.read()


def test_steps_of_its_own_that_do_not_fit_are_reported() -> None:
    model = cast(SealedModel, OwnSteps())
    assert check_states(model, 0.1).exact
    assert check_states(model, 0.2).exact
    for step, count in ((0.01, 20), (0.05, 4)):
        said = rf"at each of {count} steps of {step:g} s.*steps of its own.*steps of 0.1 s"
        with pytest.raises(FmuModelError, match=said):
            check_states(model, step)
    assert _objections(model, 0.1) == []
    assert _objections(model, 0.01)[0].startswith(
        "Do not rely on A and B before this is settled: started again at each"
    )


def test_events_of_model_exchange_are_handled() -> None:
    """A locomotive at rest breaks away where the effort passes its resistance; co-simulation does the same."""
    path = fmus.cached_fmu(PLANTS["locomotive"](), fmi_version=3)
    model, equal = open_model(path, "model-exchange"), open_model(path, "co-simulation")
    x = np.zeros(3)
    for t, effort in ((0.0, 0.0), (0.1, 3e4), (0.2, -3e4)):
        one, other = (m.transition(t, 0.1, x, np.array([effort]))[0] for m in (model, equal))
        np.testing.assert_allclose(one, other, rtol=1e-3, atol=3e-4)  # 0.5 ms late at 0.33 m/s2, 0.58 rad/s2
        x = other
    model.close()
    equal.close()


def test_a_state_that_chatters_is_reported(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(native_steps, "MAX_RETURNS_PER_STEP", 1)
    model = open_model(fmus.cached_fmu(PLANTS["locomotive"](), fmi_version=3), "model-exchange")
    x = np.array([0.0, 0.02, 0.02 / 0.575])  # stops within the step
    with pytest.raises(FmuModelError, match=r"t = 2\.\d+ s: 1 events .*, the last .* event indicator \d"):
        model.transition(2.0, 0.5, x, np.array([-3e4]))
    model.close()


def test_saved_states_of_model_exchange_are_measured(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = lying_fmus.build(tmp_path, xml=lying_fmus.description(model=lying_fmus.STATES))
    model = open_model(path, "model-exchange", states=())
    check_saving(model, 0.01)
    monkeypatch.setattr(model.instance, "restore", lambda _state: None)
    with pytest.raises(FmuModelError, match=r"restored and stepped again, position is .* restored honestly"):
        check_saving(model, 0.01)
    model.close()


def test_half_a_restored_state_is_found_in_co_simulation(tmp_path: Path) -> None:
    honest, forgetful = (
        open_model(lying_fmus.build(tmp_path / f"l{len(lies)}", *lies), states=()) for lies in ((), ("HALF_RESTORED",))
    )
    check_saving(honest, 0.01)
    with pytest.raises(FmuModelError, match=r"restored and stepped again, \w+ is .* restored honestly"):
        check_saving(forgetful, 0.01)
    honest.close()
    forgetful.close()


def test_states_are_counted_by_the_model_structure(tmp_path: Path) -> None:
    """An output that aliases a state has a derivative as well: it is no state of its own."""
    alias = """<ScalarVariable name="shown" valueReference="2" causality="output" variability="continuous"
      initial="calculated"><Real/></ScalarVariable>
      <ScalarVariable name="der(shown)" valueReference="3" causality="local" variability="continuous"
      initial="calculated"><Real derivative="8"/></ScalarVariable></ModelVariables>"""
    xml = lying_fmus.description(model=lying_fmus.STATES).replace("</ModelVariables>", alias)
    interfaces: tuple[Interface, Interface] = ("co-simulation", "model-exchange")
    for structure, orders in ((True, ("position", "speed")), (False, ("speed", "position"))):
        listed = xml if structure else re.sub("<Derivatives>.*</Derivatives>", "", xml)
        path = lying_fmus.build(tmp_path / str(structure), xml=listed)
        for interface in interfaces if structure else interfaces[:1]:
            model = open_model(path, interface)
            assert model.states == orders
            assert check_states(model, 0.01).exact
            model.close()


def test_a_discrete_observer_has_no_states_to_move() -> None:
    path = fmus.cached_fmu(fmu_observer.OBSERVERS["extended_kalman_filter"](), fmi_version=3)
    with pytest.raises(FmuModelError, match="declares no continuous state"):
        open_model(path)
