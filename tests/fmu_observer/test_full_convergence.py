"""Observers whose windows are solved to convergence: as the filter, as many passes, cut short, and restored."""

from __future__ import annotations

import numpy as np
import pytest

from fmu_observer.block import make_block
from fmu_observer.observers.full_convergence import FullBaliseMovingHorizon, FullMovingHorizonObserver
from fmu_observer.observers.generic.discrete.moving_horizon_observer import MovingHorizonObserver
from fmu_observer.observers.train.balise_moving_horizon import BaliseMovingHorizon
from fmu_observer.observers.train.balise_odometer_ekf import BaliseOdometerEkf
from plant_models.hybrid import Runtime, scalar_names

SOLVED = 1e-7  # as in test_full_solver


class _Passes(MovingHorizonObserver):
    traceable = False  # fewer seconds than tracing it


class _BalisePasses(BaliseMovingHorizon):
    traceable = False


def _followed(system, **parameters):
    """States after 3 s of readings and two balises, one of them 40 m off."""
    runtime, names = Runtime(system), scalar_names(system.input_signals)
    for name, value in {"odometer_period": 0.25, "internal_step": 0.25, **parameters}.items():
        runtime.p[scalar_names(system.parameter_signals).index(name)] = value
    runtime.x[:2], runtime.u[names.index("odometer")] = (0.0, 10.0), 10.0
    runtime.start(0.0)
    rng = np.random.default_rng(4)
    for k in range(6):
        runtime.u[names.index("odometer")] = 10.0 + 0.1 * rng.normal()
        if k in (2, 4):
            runtime.u[names.index("balise_position")] = 10.0 * runtime.t + (40.0 if k == 4 else 0.3)
            runtime.trigger("balise")
        runtime.advance(0.5 * (k + 1) + 0.01)
    return runtime


def _reported(runtime, *names):
    values = dict(zip(scalar_names(runtime.system.outputs), runtime.update_outputs(), strict=True))
    return [values[name] for name in names]


def test_by_least_squares_it_is_the_filter():
    wide = {"speed_limit": 1e3, "disturbance_limit": 1e3}
    full = _followed(FullBaliseMovingHorizon(window=4, loss="squares"), odometer_gate=1e3, **wide)
    filtered = _followed(BaliseOdometerEkf(), odometer_gate=1e3, gate=0.0)
    assert full.x[:4] == pytest.approx(filtered.x[:4], abs=SOLVED)
    assert _reported(full, "position_std") == pytest.approx(_reported(filtered, "position_std"), abs=1e-12)
    assert _reported(full, "converged", "feasible", "deadline_missed") == [1.0, 1.0, 0.0]


def test_with_a_robust_loss_it_is_many_passes():
    full = _followed(FullBaliseMovingHorizon(window=3, tolerance=1e-9))
    passes = _followed(_BalisePasses(window=3, passes=8))
    assert full.x[:4] == pytest.approx(passes.x[:4], abs=1e-6)  # 8 passes are not yet at the end
    assert abs(full.x[0] - 10.0 * full.t) < 5.0, "the false balise does not pull by 40 m"


@pytest.mark.parametrize("options", [{}, {"noise_bounds": {"angle": [-1e-3, 1e-3]}}])
def test_of_any_model_it_is_many_passes(options):
    found = []
    for make, more in ((FullMovingHorizonObserver, {"tolerance": 1e-9}), (_Passes, {"passes": 8})):
        system = make("pendulum", window=3, **options, **more)
        runtime, rng = Runtime(system), np.random.default_rng(2)
        runtime.start(0.0)
        for k in range(6):
            runtime.u[:] = rng.normal(size=len(runtime.u))
            runtime.advance(0.1 * (k + 1))
        found.append(runtime.x[: system.model.order].copy())
    assert found[0] == pytest.approx(found[1], abs=SOLVED)
    assert _reported(runtime, "bounds_active") == [1.0 if options else 0.0]


def test_a_deadline_that_is_missed_is_reported_and_bounds_are_kept():
    full = _followed(FullBaliseMovingHorizon(window=5, deadline=0.0), speed_limit=10.0)
    converged, missed, feasible, speed = _reported(full, "converged", "deadline_missed", "feasible", "speed")
    assert (converged, missed, feasible) == (0.0, 1.0, 1.0)
    assert 0.0 <= speed <= 10.0


@pytest.mark.parametrize("window", [5, 12, 40])
def test_what_a_missed_deadline_leaves_keeps_transitions_and_bounds_before_the_window_is_full(window: int):
    full = _followed(FullBaliseMovingHorizon(window=window, deadline=0.0))
    assert _reported(full, "deadline_missed", "feasible") == [1.0, 1.0]


def test_a_deadline_before_the_first_row_gives_the_prediction():
    system = FullBaliseMovingHorizon(window=3, deadline=0.0)
    full = _followed(system)
    assert np.isfinite(full.update_outputs()).all()
    assert _reported(full, "last_step", "passes_used", "deadline_missed", "stopped_early") == [0.0, 0.0, 1.0, 0.0]
    warned = {s.name for s in system.outputs if s.warning}
    assert warned == {
        "bounds_contradicted",
        "rows_in_window",
        "deadline_missed",
        "stopped_early",
        "unsettled",
        "restarts",
    }


def test_a_search_that_ends_before_its_tolerance_is_reported():
    full = _followed(FullBaliseMovingHorizon(window=4, tolerance=1e-300, max_iterations=1))
    assert _reported(full, "converged", "deadline_missed", "stopped_early") == [0.0, 0.0, 1.0]


def test_a_restored_block_repeats_its_steps():
    block = make_block(FullBaliseMovingHorizon(window=3), fmi_version=2)
    block.instantiate()
    block.setupExperiment(startTime=0.0)
    block.enterInitializationMode()
    block.exitInitializationMode()
    block.doStep(0.0, 0.5)
    state, found = block.getFMUState(), []
    for _ in range(2):
        block.setFMUState(state)
        block.doStep(0.5, 0.5)
        found.append(
            block.getReal([v.valueReference for v in block.model_description.modelVariables if v.causality == "output"])
        )
    assert found[0] == found[1]


def test_options_are_refused_in_words():
    with pytest.raises(ValueError, match="tolerance must be above 0 standard deviations, got 0"):
        FullBaliseMovingHorizon(tolerance=0.0)
    with pytest.raises(ValueError, match=r"deadline must be at least 0 s, got -1\.0"):
        FullMovingHorizonObserver("pendulum", deadline=-1.0)
    with pytest.raises(ValueError, match="deadline must be at least 0 s, got 'soon'"):
        FullBaliseMovingHorizon(deadline="soon")
    with pytest.raises(ValueError, match="tolerance must be above 0 standard deviations, got 'x'"):
        FullBaliseMovingHorizon(tolerance="x")
    assert FullBaliseMovingHorizon(window=7, deadline=0.5).options["deadline"] == 0.5
