"""States of FMUs are measured: what serves, and what is refused in which words."""

from __future__ import annotations

from pathlib import Path

import lying_fmus
import numpy as np
import pytest
from test_fmus.build import linear_fmu

import fmu_observer
import fmus
from cosim.fmu_model.co_simulation import CoSimulationModel
from cosim.fmu_model.opening import Interface, open_model
from cosim.fmu_model.sealed import FmuModelError, SealedModel
from cosim.fmu_model.trust import check_states
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
def test_prepared_points_are_those_of_the_ordinary_calls(version: int) -> None:
    model = open_model(fmus.cached_fmu(PLANTS["locomotive"](), fmi_version=version))
    assert isinstance(model, CoSimulationModel)
    points, u = np.array([[5.0, 6.0], [12.0, 13.0], [21.0, 22.0]]), np.array([4e4])
    driven = np.array([[4e4, -4e4]])
    wanted = [SealedModel.states_after(model, 0.0, 0.1, points, given) for given in (u, driven)]
    looks = SealedModel.outputs_at(model, 0.0, points, u, [2, 0])
    for done in (model._quick_step, lambda _t, _h: False):  # a step that is discarded goes the ordinary way
        model._quick_step = done
        for given, states in zip((u, driven), wanted, strict=True):
            np.testing.assert_array_equal(model.states_after(0.0, 0.1, points, given), states)
    np.testing.assert_array_equal(model.outputs_at(0.0, points, u, [2, 0]), looks)
    assert wanted[0][1, 0] != wanted[0][1, 1] != wanted[1][1, 1]
    model.close()


def test_a_step_that_fails_is_told_in_words() -> None:
    model = open_model(fmus.cached_fmu(PLANTS["locomotive"](), fmi_version=3))
    points = np.array([[0.0], [np.nan], [1.0]])
    with pytest.raises(FmuModelError, match=r"locomotive.*doStep was discarded.* at t = 3 s; .*not a finite number"):
        model.states_after(3.0, 0.1, points, np.array([0.0]))
    model.close()


def test_model_exchange_is_integrated() -> None:
    model = open_model(fmus.cached_fmu(PLANTS["pendulum"](), fmi_version=3), "model-exchange")
    same = open_model(fmus.cached_fmu(PLANTS["pendulum"](), fmi_version=3), "co-simulation")
    x, u = np.full(len(model.states), 0.4), model.start_inputs
    one, other = (m.transition(0.0, 0.2, x, u)[0] for m in (model, same))
    np.testing.assert_allclose(one, other, rtol=1e-8)  # fourth order at 1 ms, and LSODA at 1e-10
    model.close()
    same.close()


def test_more_state_than_declared_is_found(tmp_path: Path) -> None:
    path = lying_fmus.build(tmp_path)
    model = open_model(path, states=["position"])
    with pytest.raises(FmuModelError, match=r"holds more than these states .* particle filter"):
        check_states(model, 0.01)
    model.close()


def test_states_without_start_values_are_refused(tmp_path: Path) -> None:
    path = linear_fmu(tmp_path, "mass", [[0, 1], [0, 0]], [[0], [1]], [[1, 0]], [[0]], inputs=["force"])
    with pytest.raises(FmuModelError, match="declares no continuous state"):
        open_model(path)
    with pytest.raises(FmuModelError, match=r"'x\[1\]' has no start value"):
        open_model(path, states=["x[1]"])


def test_a_discrete_observer_has_no_states_to_move() -> None:
    path = fmus.cached_fmu(fmu_observer.OBSERVERS["extended_kalman_filter"](), fmi_version=3)
    with pytest.raises(FmuModelError, match="declares no continuous state"):
        open_model(path)
