"""Laws of missing samples: over every system that takes samples, and against Kalman filters of plain NumPy."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import casadi as ca
import numpy as np
import pytest
from filterpy.kalman import KalmanFilter as TheirFilter
from hypothesis import given, settings
from hypothesis import strategies as st
from shipped import shipped

from fmu_observer import OBSERVERS
from fmu_observer.models.filter_models import FilterModel, Known
from fmu_observer.observers.generic.discrete.extended_kalman_filter import KalmanFilter
from fmu_observer.observers.generic.discrete.gaussian_filter import GaussianFilter
from fmu_observer.observers.generic.discrete.member_filter import MemberFilter
from fmus import Batch
from plant_models.hybrid import Runtime, TracedSystem, input_signal, scalar_names, state
from plant_models.hybrid.missing import MISSED_SAMPLES, is_there, or_else

NAMES = list(OBSERVERS)
MISSED_PLACE = -1  # of the count in a state
PERIOD, COUNT = 0.1, 40


def sampling_events(name: str) -> list[Any]:
    return [e for e in shipped(name).events if getattr(e, "samples", ())]


SAMPLING = [(name, event.name) for name in NAMES for event in sampling_events(name)]
SAMPLED = sorted({name for name, _ in SAMPLING})


def test_what_is_known_of_a_number_traces_and_poisons_nothing() -> None:
    y = ca.SX.sym("y", 3)
    traced = ca.ArrayInterface.SX(y, shape=(3,))
    what = [ca.SX(is_there(traced)), ca.SX(or_else(traced, 7.0)), ca.SX(0.0 * or_else(traced, 1.0))]
    found = ca.Function("f", [y], what)
    there, kept, zero = (np.asarray(part).ravel() for part in found(np.array([2.0, np.nan, -1e308])))
    np.testing.assert_array_equal(there, [1.0, 0.0, 1.0])
    np.testing.assert_array_equal(kept, [2.0, 7.0, -1e308])
    np.testing.assert_array_equal(zero, [0.0, 0.0, 0.0])


@pytest.mark.parametrize("name", NAMES)
def test_an_input_that_can_be_missing_is_read_at_its_samples_only(name: str) -> None:
    """Whoever reads it while time passes would compute with NaN: no derivative and no output depends on it."""
    system = OBSERVERS[name]()
    able = [i for i, s in enumerate(system.input_signals) if s.can_be_missing for _ in range(s.width)]
    if not able:
        return
    traced, names = TracedSystem(system), [s.name for s in system.input_signals for _ in s.scalar_names]
    places = [i for i, n in enumerate(names) if n in {s.name for s in system.input_signals if s.can_be_missing}]
    for what in ("derivative", "output") if system.continuous_count else ("output",):
        assert not np.asarray(traced.dependencies(what, "u"))[:, places].any(), what


def jumped(system: Any, event: str, x: np.ndarray, u: np.ndarray, t: float) -> np.ndarray:
    return np.asarray(system.jump_vector(event, t, x, u, system.start_parameters()))


@pytest.mark.parametrize(("name", "event"), SAMPLING)
def test_a_missing_sample_is_counted_and_hands_nothing_on(name: str, event: str) -> None:
    """Whatever state the sample finds, what comes out is finite, and the same whatever stood in its place before."""
    system = OBSERVERS[name]()
    declared = next(e for e in system.events if e.name == event)
    names = scalar_names(system.input_signals)
    places = [i for i, n in enumerate(names) if n.partition("[")[0] in declared.samples]
    random = np.random.default_rng(3)
    u = system.start_inputs() + 0.1 * random.normal(size=len(names))
    x = system.start_state()
    for k in range(3):  # a sample first, so that what is done at the first one only does not stand for all
        x = jumped(system, event, x, u, 0.1 * k)
    missing = u.copy()
    missing[places] = np.nan
    after = jumped(system, event, x, missing, 0.3)
    assert np.isfinite(after).all()
    assert after[MISSED_PLACE] - x[MISSED_PLACE] == len(places)
    if not declared.leaves_out or system.continuous_count:  # where estimates flow, prediction is not the jump's
        np.testing.assert_array_equal(after[:MISSED_PLACE], x[:MISSED_PLACE])
    traced = TracedSystem(system).jump(event)(0.3, x, missing, system.start_parameters())
    np.testing.assert_allclose(np.asarray(traced).ravel(), after, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("name", SAMPLED)
@settings(max_examples=3, deadline=None)
@given(pattern=st.lists(st.booleans(), min_size=COUNT, max_size=COUNT), seed=st.integers(0, 10**6))
def test_any_samples_may_be_missing(name: str, pattern: list[bool], seed: int) -> None:
    """A run in which any of the samples are missing stays finite, and outputs are numbers."""
    system, random = OBSERVERS[name](), np.random.default_rng(seed)
    runtime = Runtime(system)
    names = scalar_names(system.input_signals)
    able = {s.name for s in system.input_signals if s.can_be_missing}
    places = [i for i, n in enumerate(names) if n.partition("[")[0] in able]
    runtime.start(0.0)
    reported = 0
    for k, lacks in enumerate(pattern):
        gone = lacks & (random.random(len(places)) < 0.8)
        runtime.u[places] = np.where(gone, np.nan, 0.1 * random.normal(size=len(places)))
        runtime.advance(0.05 * (k + 1))
        for event in system.triggered_events:
            if event.samples:
                runtime.trigger(event.name)
                reported += int(np.isnan(runtime.u[places]).sum())
        assert np.isfinite(runtime.x).all()
        runtime.update_outputs()
        assert np.isfinite(runtime.y).all()
    assert runtime.x[MISSED_PLACE] >= reported * (len(system.triggered_events) == 1)


# -- against filters that are not ours --------------------------------------------------------------------------------


def model() -> FilterModel:
    """Three states, two measurements, an input: nothing of it is special."""
    A = np.array([[0.9, 0.1, 0.0], [-0.2, 0.8, 0.1], [0.0, 0.05, 0.95]])
    B, C = np.array([0.0, 0.1, 0.2]), np.array([[1.0, 0.0, 0.5], [0.0, 1.0, -0.3]])
    return FilterModel(
        "three",
        "Three states",
        "test",
        states=tuple(state(f"x{i}", "1", 0.3) for i in range(3)),
        inputs=(input_signal("drive", "1"),),
        measurements=(input_signal("y1", "1"), input_signal("y2", "1")),
        moved=lambda x, _w, known, _period: A @ x + B * known.u[0],
        measured=lambda x, _v, _known: C @ x,
        any_period=False,
        sample_period=PERIOD,
    )


def reference(readings: np.ndarray, drive: np.ndarray, Q: np.ndarray, R: np.ndarray) -> np.ndarray:
    """Estimates, covariances and likelihood by filterpy, whose updates take the rows that are there."""
    m = model()
    known = Known(0.0, np.zeros(1), np.zeros(0))
    F = np.asarray(m.transition_jacobians(m.start, known, PERIOD)[0])
    H = np.asarray(m.measurement_jacobians(m.start, known)[0])
    theirs = TheirFilter(3, 2)
    theirs.F, theirs.Q, theirs.x, theirs.P = F, Q, m.start.copy(), np.eye(3)
    B = np.asarray(m.moved(np.zeros(3), np.zeros(0), known._replace(u=np.ones(1)), PERIOD))
    rows, reported = [], 0.0
    for k, y in enumerate(readings):
        if k:
            theirs.x, theirs.P = F @ theirs.x + B * drive[k - 1], F @ theirs.P @ F.T + Q
        there = np.flatnonzero(~np.isnan(y))
        if len(there):
            theirs.update(y[there], R=R[np.ix_(there, there)], H=H[there])
            reported += theirs.log_likelihood
        rows.append(np.hstack([theirs.x.ravel(), theirs.P.ravel(), reported]))
    return np.array(rows)


FORMS = [("kalman_filter", form) for form in KalmanFilter.forms]
FORMS += [("extended_kalman_filter", "joseph"), ("moving_horizon_observer", "joseph")]
FORMS += [("unscented_kalman_filter", form) for form in ("short", "square_root")]


@pytest.mark.parametrize(("name", "form"), FORMS)
@pytest.mark.parametrize("seed", [0, 1, 2])
def test_the_filters_are_that_of_another_package_with_updates_left_out(name: str, form: str, seed: int) -> None:
    random = np.random.default_rng(seed)
    readings, drive = random.normal(size=(COUNT, 2)), random.normal(size=COUNT)
    readings[random.random((COUNT, 2)) < 0.4] = np.nan
    system: GaussianFilter = OBSERVERS[name](model(), form=form)
    runtime = Runtime(system)
    places = [i for i, n in enumerate(scalar_names(system.parameter_signals)) if n.startswith("measurement_covariance")]
    runtime.p[places] = [1e-2, 8e-3, 8e-3, 2e-2]  # what is missing takes its correlation along
    p = system.unpack_parameters(runtime.p)
    Q, R = p.process_covariance.reshape(3, 3), p.measurement_covariance.reshape(2, 2)
    expected = reference(readings, drive, Q, R)
    likelihood_place = scalar_names(system.states).index("log_likelihood")
    for k in range(COUNT):
        runtime.u[:] = [drive[k - 1] if k else 0.0, *readings[k]]
        runtime.start(0.0) if k == 0 else runtime.advance(k * PERIOD)
        P = system.covariance_of(runtime.x[3:12].reshape(3, 3))
        likelihood = runtime.x[likelihood_place]
        # 1e-9: sigma points of alpha = 1e-3 and square roots lose about half of the digits of a covariance of 1e-5
        np.testing.assert_allclose(np.hstack([runtime.x[:3], P.ravel(), likelihood]), expected[k], rtol=1e-7, atol=1e-9)
    assert runtime.x[MISSED_PLACE] == np.isnan(readings).sum()


@pytest.mark.parametrize("name", ["ensemble_kalman_filter", "particle_filter"])
def test_members_that_measure_nothing_only_move(name: str) -> None:
    """Bit by bit: the state after a missing sample is that of the model over the period, with its noise."""
    system: MemberFilter = OBSERVERS[name](model(), 10)
    random = np.random.default_rng(5)
    names = scalar_names(system.input_signals)
    u = random.normal(size=len(names))
    values, resampling = system.start_parameters(), "resampling_threshold" if name == "particle_filter" else "inflation"
    place = scalar_names(system.parameter_signals).index(resampling)
    values[place] = {"inflation": 1.0, "resampling_threshold": 0.0}[resampling]  # so that weights differ
    x = np.asarray(system.jump_vector("sampling", 0.0, system.start_state(), u, values))
    values[place] = {"inflation": 1.5, "resampling_threshold": 1.0}[resampling]  # what a correction would do first
    lacking = u.copy()
    lacking[[names.index("measured_y1"), names.index("measured_y2")]] = np.nan
    after = np.asarray(system.jump_vector("sampling", PERIOD, x, lacking, values))
    before = np.reshape(x[7:37], (10, 3))
    p, stated_u = system.unpack_parameters(system.start_parameters()), system.unpack_inputs(lacking)
    moved = system._moved(before, PERIOD, stated_u, p)  # the one thing that is to happen
    np.testing.assert_array_equal(np.reshape(after[7:37], (10, 3)).T, moved)
    assert after[3] == x[3]  # the NIS is that of the last sample


@pytest.mark.parametrize("name", ["ensemble_kalman_filter", "particle_filter"])
def test_members_take_the_measurements_that_are_there(name: str) -> None:
    """One of two that is missing: as a filter that has the other one only, which draws the same numbers."""
    both = model()
    one = replace(both, measurements=both.measurements[:1], measured=lambda x, v, known: both.measured(x, v, known)[:1])
    two, single = OBSERVERS[name](both, 10), OBSERVERS[name](one, 10)
    parameters = two.start_parameters()
    places = [i for i, n in enumerate(scalar_names(two.parameter_signals)) if n.startswith("measurement_covariance")]
    parameters[places] = [1e-4, 9e-5, 9e-5, 2e-4]
    random = np.random.default_rng(7)
    given = {n: random.normal() for n in scalar_names(two.input_signals)}
    x, z = two.start_state(), single.start_state()
    for k in range(4):
        given["measured_y1"], given["measured_y2"] = random.normal(), np.nan
        u = np.array([given[n] for n in scalar_names(two.input_signals)])
        x = np.asarray(two.jump_vector("sampling", k * PERIOD, x, u, parameters))
        z = jumped(single, "sampling", z, np.array([given[n] for n in scalar_names(single.input_signals)]), k * PERIOD)
        np.testing.assert_allclose(x[:37], z[:37], rtol=1e-12, atol=1e-12)


def test_counts_and_degrees_are_reported() -> None:
    system = KalmanFilter(model())
    runtime = Runtime(system)
    runtime.u[:] = [0.0, 1.0, np.nan]
    runtime.start(0.0)
    runtime.update_outputs()
    y = dict(zip(scalar_names(system.outputs), runtime.y, strict=True))
    assert y["nis_degrees"] == 1.0
    assert [s.name for s in system.states][-1] == MISSED_SAMPLES
    assert {s.name for s in system.inputs if s.can_be_missing} == {"measured_y1", "measured_y2"}


# -- in C -------------------------------------------------------------------------------------------------------------


@pytest.mark.compiler
@pytest.mark.parametrize("name", SAMPLED)
def test_compiled_it_leaves_out_equal_samples(name: str) -> None:
    """C and Python to the last digits, through samples and events any of which bring NaN."""
    system, random = OBSERVERS[name](), np.random.default_rng(11)
    batch, runtime = Batch(system, members=2), Runtime(system)
    names = scalar_names(system.input_signals)
    read = [s.name for s in system.inputs if s.can_be_missing]
    if system.noises:
        batch.set("seed", 3)
        runtime.p[scalar_names(system.parameter_signals).index("seed")] = 3.0
    batch.start()
    runtime.start(0.0)
    for k in range(12):
        for n in read:
            runtime.u[names.index(n)] = np.nan if random.random() < 0.4 else 0.1 * random.normal()
            batch.set(n, float(runtime.u[names.index(n)]))
        stamp, until = 0.05 * k + 0.02, 0.05 * (k + 1)
        for event in system.triggered_events:
            if event.samples:
                reported = [s.name for s in event.payload if s.can_be_missing]
                payload = {n: np.nan if random.random() < 0.4 else 0.1 * random.normal() for n in reported}
                runtime.advance(stamp)
                for n, value in payload.items():
                    runtime.u[names.index(n)] = value
                runtime.trigger(event.name)
                batch.notify(event.name, 0, stamp, **payload)
                batch.notify(event.name, 1, stamp, **payload)
        runtime.advance(until)
        batch.advance(until)
    assert not batch.failures
    runtime.update_outputs()
    expected = dict(zip(scalar_names(system.outputs), runtime.y, strict=True))
    expected[MISSED_SAMPLES] = runtime.x[MISSED_PLACE]
    for output, value in expected.items():
        np.testing.assert_allclose(batch.get(output), value, rtol=1e-11, atol=1e-12)
