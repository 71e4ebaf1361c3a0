"""Delayed-state observer and its predictors, against Hann 2014, SciPy on the same equations, and closed forms."""

from __future__ import annotations

from itertools import pairwise
from math import pi

import numpy as np
import pytest
import scipy
from hypothesis import example, given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from fmu_observer.certificates.printed_bounds.network_bounds import NetworkBounds, _largest_gain, exact_predictor_delay
from fmu_observer.formulas.delay.finite_time_predictor import at_age, integral_weights, weighted
from fmu_observer.models.known_models import find_model
from fmu_observer.observers.generic.delayed.delayed_state_observer import DelayedStateObserver
from fmu_observer.observers.generic.sampled.dynamic_high_gain import OutputPredictor
from plant_models.exhibits.flexible_joint_arm import FlexibleJointArm
from plant_models.hybrid import Runtime, scalar_names

ARM = "flexible_joint_arm"


def started(observer: DelayedStateObserver, **values: object) -> Runtime:
    """A runtime with parameters and starts by name of the signal."""
    runtime = Runtime(observer)
    for names, array in (
        (scalar_names(observer.parameter_signals), runtime.p),
        (scalar_names(observer.states), runtime.x),
    ):
        for name, value in values.items():
            for i, element in enumerate(np.atleast_1d(np.asarray(value, dtype=float))):
                full = name if name in names else f"{name}[{i + 1}]"
                if full in names:
                    array[names.index(full)] = element
    runtime.start(0.0)
    return runtime


def output(runtime: Runtime, name: str) -> float:
    return float(runtime.update_outputs()[scalar_names(runtime.system.outputs).index(name)])


def packet(runtime: Runtime, node: int, values: np.ndarray) -> None:
    names = scalar_names(runtime.system.input_signals)
    runtime.u[names.index("packet_node")] = node
    for name, value in zip(("packet_motor_angle", "packet_link_angle"), values, strict=True):
        runtime.u[names.index(name)] = value
    runtime.trigger("packet")


# -- the memory -----------------------------------------------------------------------------------------------------


@settings(max_examples=30)
@given(length=st.floats(0.0, 6.0), values=st.lists(st.floats(-5.0, 5.0), min_size=7, max_size=7))
def test_an_integral_over_the_past_is_that_of_the_broken_line(length: float, values: list[float]) -> None:
    fine = np.linspace(0.0, length, 20001)
    expected = np.trapezoid(np.interp(fine, np.arange(7.0), values), fine)
    assert weighted(integral_weights(length, 6), values) == pytest.approx(expected, abs=1e-5)  # of the fine grid


def test_a_value_of_a_fractional_age() -> None:
    values = [3.0, 1.0, 2.0]
    assert [float(at_age(a, values)) for a in (0.0, 0.5, 1.25, 2.0, 9.0)] == [3.0, 2.0, 1.25, 2.0, 2.0]
    assert float(at_age(-0.5, values)) == 4.0  # the first line goes on


# -- the plant and the model ----------------------------------------------------------------------------------------


@pytest.mark.parametrize(("gravity", "expected"), [("motor_speed", 0.67 + 8.43j), ("link_angle", -0.43 + 8.28j)])
def test_eigenvalues_of_the_arm_at_rest(gravity: str, expected: complex) -> None:
    """Both readings, against the specification; and plant and model are the same equations."""
    plant = FlexibleJointArm(gravity)  # type: ignore[arg-type]
    model = find_model(ARM + ("_as_printed" if gravity == "motor_speed" else ""))
    values = np.linalg.eigvals(np.asarray(model.jacobian(np.zeros(4), np.zeros(1)), dtype=float))
    assert values[np.argmax(values.imag)] == pytest.approx(expected, abs=6e-3)  # two digits printed
    x, drive = np.array([0.3, -0.2, 1.1, 0.7]), 0.1 * np.sin(2.0) + 0.4
    moved = plant.state_derivative(2.0, x, np.array([0.4]), np.ones(2))
    np.testing.assert_allclose(moved, model.flow(x, np.array([drive])), rtol=1e-13)


def test_the_lipschitz_constants_of_the_specification() -> None:
    found = [max(np.linalg.norm(d, 2) for d in find_model(m).drifts) for m in (f"{ARM}_as_printed", ARM)]
    assert found == pytest.approx([74.1, 75.0], abs=0.06)


# -- the observer ---------------------------------------------------------------------------------------------------


def test_only_the_outputs_of_the_node_jump() -> None:
    runtime = started(DelayedStateObserver(ARM))
    before = runtime.x.copy()
    packet(runtime, 2, np.array([7.0, 8.0]))
    changed = np.flatnonzero(runtime.x != before)
    assert [scalar_names(runtime.system.states)[i] for i in changed] == ["predicted_output[2]"]
    packet(runtime, 0, np.array([1.0, 2.0]))
    assert runtime.x[4:6].tolist() == [1.0, 2.0]


def test_without_delay_and_nodes_it_is_the_output_predictor() -> None:
    """Identity I1 in another guise: same equations, no predictor, all measurements in each packet."""
    two = [
        started(DelayedStateObserver("pendulum", predictors=0), delay=0.0, theta=2.0, internal_step=5e-3),
        Runtime(OutputPredictor("pendulum")),
    ]
    two[1].start(0.0)
    rng = np.random.default_rng(1)
    for t in np.cumsum(rng.uniform(0.05, 0.4, 12)):
        for runtime in two:
            runtime.u[0] = 0.3
            runtime.advance(float(t))
            runtime.u[scalar_names(runtime.system.input_signals).index("sample_angle")] = np.sin(t)
            runtime.trigger("sample")
    np.testing.assert_allclose(two[0].x[:3], two[1].x[:3], atol=1e-10)  # cells cut by readings: order four of 5 ms


@pytest.mark.parametrize("m", [1, 2, 3])
def test_predictors_against_an_adaptive_solver(m: int) -> None:
    """Once reached, the prediction is ``z + int f(xi)``: here of an exact z, so of the motion itself, within the second
    order of the readings.
    """
    model, delay = find_model("pendulum"), 0.15
    motion = solve_ivp(
        lambda t, x: model.flow(x, np.array([np.sin(3.0 * t)])),
        (-1.0, 12.0),
        [1.0, 0.5],
        "DOP853",
        rtol=1e-11,
        atol=1e-12,
        dense_output=True,
    ).sol
    errors = []
    for period in (0.01, 0.005):
        observer = DelayedStateObserver("pendulum", predictors=m, memory_places=round(0.2 / m / period))
        start = motion(-delay)
        runtime = started(
            observer,
            delay=delay,
            memory_period=period,
            estimated_angle=start[0],
            estimated_rate=start[1],
            predicted_output=start[0],
        )
        largest = 0.0
        for k in range(1, 1001):
            t = 0.01 * k
            runtime.u[0] = np.sin(3.0 * (t - 0.005))
            runtime.advance(t)
            if k % 10 == 0:
                names = scalar_names(observer.input_signals)
                runtime.u[names.index("sample_angle")] = motion(t - delay)[0]
                runtime.trigger("sample")
            if t > 6.0:
                found = [output(runtime, "angle"), output(runtime, "rate")]
                largest = max(largest, float(np.abs(found - motion(t)).max()))
        errors.append(largest)
    assert max(errors) < 1e-4, errors  # with inputs held for 10 ms


@settings(max_examples=10, deadline=None)
@given(start=st.floats(-20.0, 20.0), m=st.integers(1, 3))
@example(start=0.0625, m=2)
@example(start=0.1, m=1)
def test_the_reaching_time_is_exact(start: float, m: int) -> None:
    """``2 sqrt|s(0)|``, to the reading: the root falls by half a period each."""
    observer = DelayedStateObserver("freight_train", predictors=m)
    runtime = started(observer, prediction=[start, 1.0] * m, internal_step=0.01)
    expected = output(runtime, "reaching_time")
    # Without resistance worth the name s of the first predictor is the start less the way in its share of the delay;
    # the others start where the one before them does, so that theirs is that way alone. The last to arrive counts.
    way = 0.1 / m
    furthest = max(abs(start - way), way if m > 1 else 0.0)
    # the way under resistance is 1 mm shorter; the root of a way makes 60 ms of that near nothing
    assert (0.5 * expected) ** 2 == pytest.approx(furthest, rel=1e-6, abs=2e-3)
    if expected > 0.04:
        runtime.advance(expected - 0.02)
        assert 0.0 < output(runtime, "reaching_time") == pytest.approx(0.02, abs=0.011)
    runtime.advance(expected + 0.01)
    assert output(runtime, "reaching_time") == 0.0


def test_the_reaching_time_of_the_arm() -> None:
    """Published starts, as the specification rounds it: ``s_3(0) = 2 - 0.15 * 94.7``, so 6.98 s."""
    runtime = started(DelayedStateObserver(ARM), delay=0.15, prediction=[1.0, 3.0, 2.0, 0.5])
    assert output(runtime, "reaching_time") == pytest.approx(2.0 * np.sqrt(0.15 * 94.7 - 2.0), rel=1e-12)
    assert output(runtime, "reaching_time") == pytest.approx(6.98, abs=1e-2)


def test_a_delay_beyond_the_declared_memory_is_refused() -> None:
    with pytest.raises(ValueError, match=r"delay must fit into the declared memory, 20 times memory_period"):
        started(DelayedStateObserver(ARM), delay=0.2001)
    started(DelayedStateObserver(ARM), delay=0.2)
    started(DelayedStateObserver(ARM, predictors=3), delay=0.6)


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"predictors": 9}, "predictors must be 0 to 8"),
        ({"memory_places": 0}, "memory_places must be at least 1"),
        ({"between_samples": "guess"}, "unknown between_samples 'guess'"),
        ({"nodes": (1,)}, "expected one for each of the 2 measurements"),
        ({"model": "nobody"}, "Unknown observer model"),
    ],
)
def test_options_that_cannot_be(options: dict[str, object], said: str) -> None:
    with pytest.raises(ValueError, match=said):
        DelayedStateObserver(**{"model": ARM, **options})  # type: ignore[arg-type]


def test_memory_stays_flat() -> None:
    """At rest, after 10^5 readings: nothing adds up (10^6 by the native one, see the gallery)."""
    runtime = started(DelayedStateObserver("pendulum"), internal_step=0.01)
    runtime.advance(1000.0)
    held = dict(zip(scalar_names(runtime.system.states), runtime.x, strict=True))
    assert held.pop("missed_samples") == 0.0
    assert np.abs(list(held.values())[:-2]).max() < 1e-12  # the last two are times


# -- limits ---------------------------------------------------------------------------------------------------------


def test_the_exact_limit_of_a_predictor() -> None:
    """Undamped ``pi / (2 omega)``; a damped one against a bisection of the discrete equation with a fine memory."""
    assert exact_predictor_delay(np.array([[0.0, 1.0], [-64.0, 0.0]])) == pytest.approx(pi / 16.0)
    assert exact_predictor_delay(np.array([[4.0]]), 3) == pytest.approx(0.75)
    assert exact_predictor_delay(np.array([[-4.0]])) == np.inf
    at_rest = [
        np.asarray(find_model(m).jacobian(np.zeros(4), np.zeros(1)), dtype=float) for m in (ARM, f"{ARM}_as_printed")
    ]
    assert [exact_predictor_delay(A) for A in at_rest] == pytest.approx([0.196, 0.177], abs=6e-4)


def test_constants_of_theorem_2_1() -> None:
    """Gains from noise to error, and the longest interval, of the specification."""
    found = [
        DelayedStateObserver(model).network_bounds({"theta": theta})
        for model in (f"{ARM}_as_printed", ARM)
        for theta in (1.0, 5.0)
    ]
    expected = [None, 11.9, 6.36, 8.61]  # the first is unstable at some slope, and 32.1 at rest
    for bounds, gain in zip(found, expected, strict=True):
        assert bounds.gain == pytest.approx(32.1 if gain is None else gain, rel=5e-3)
    assert [b.longest_interval for b in found] == pytest.approx([2.1e-4, 5.7e-4, 1.05e-3, 7.8e-4], rel=1e-2)
    arm = found[3]
    assert arm.predictors_needed(0.15) >= 12
    assert arm.small_gain(arm.strict_interval) == pytest.approx(1.0)
    assert arm.strict_interval < arm.longest_interval
    rate = arm.lipschitz / arm.decay * (np.exp(arm.decay * arm.longest_delay) - 1.0)
    assert rate == pytest.approx(1.0)


def test_a_gain_over_all_frequencies() -> None:
    """Of a resonance, ``1 / (2 d sqrt(1 - d^2))``."""
    d = 0.1
    A, B = np.array([[0.0, 1.0], [-1.0, -2.0 * d]]), np.array([[0.0], [1.0]])
    assert _largest_gain(A, B) >= 1.0 / (2.0 * d * np.sqrt(1.0 - d * d))


def cycle_radius(generator: np.ndarray, C: np.ndarray, order: tuple[tuple[int, ...], ...], interval: float) -> float:
    """Spectral radius over a period of a protocol: of the error of the estimate, and of the outputs kept since."""
    q, n = C.shape
    flow, whole = scipy.linalg.expm(generator * interval), np.eye(n + q)
    for received in order:
        reset = np.eye(n + q)
        for i in received:
            reset[n + i] = 0.0  # an output just received has no error
        whole = reset @ flow @ whole
    return float(np.abs(np.linalg.eigvals(whole)).max())


def test_the_exact_interval_is_where_a_run_begins_to_grow() -> None:
    observer = DelayedStateObserver(ARM)
    p = observer.unpack_parameters(observer.start_parameters())
    drift = np.asarray(observer.model.jacobian(np.zeros(4), np.zeros(1)), dtype=float)
    gain, C = observer.gain_matrices(p)[0], observer.model.C
    generator = np.block([[drift - gain @ C, gain], [C @ drift, np.zeros((2, 2))]])
    (limit,) = (f.value for f in observer.findings() if f.kind == "exact" and f.what.startswith("interval"))
    assert limit == pytest.approx(0.211, abs=1e-3)  # first failure at 0.22 s in steps of 0.01 s, by the specification
    assert (
        cycle_radius(generator, C, ((0,), (1,)), 0.99 * limit)
        < 1.0
        < cycle_radius(generator, C, ((0,), (1,)), 1.01 * limit)
    )


def test_more_of_everything_is_worse() -> None:
    bounds = [NetworkBounds(75.0, 5.0, 8.0, 1.0, n, 1) for n in (1, 2, 3)]
    assert all(a.longest_interval > b.longest_interval for a, b in pairwise(bounds))
    assert all(a.small_gain(1e-3) < b.small_gain(1e-3) for a, b in pairwise(bounds))
