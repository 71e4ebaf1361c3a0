"""Certificates against the observers themselves: the true nonlinear observer never contradicts them."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from observer_runner import DAVIS_A, DAVIS_B, DAVIS_C, SteadyMotion, SystemRunner, in_step

from fmu_observer.certificates.gap_findings import CONSTANT_GAP, GROWTH
from fmu_observer.observers.train import DifferentiatorCdo, DiscreteUio, MultirateCdo, TakagiSugenoCdo, TrainObserver

MOTION = SteadyMotion(speed=25.0)
INTEGRATION = 1e-6  # relative: RK4 at 1 ms, and what the differentiator's chatter leaves in the speed

CONTINUOUS_DISCRETE = {
    "differentiator_cdo": DifferentiatorCdo(),
    "takagi_sugeno_cdo": TakagiSugenoCdo(),
    "takagi_sugeno_cdo estimated": TakagiSugenoCdo(premise="estimated"),
    "multirate_cdo": MultirateCdo(),
}
relative_gaps = st.lists(st.floats(0.02, 1.0), min_size=10, max_size=60)
start_errors = st.tuples(st.floats(-2.0, 2.0), st.floats(-10.0, 10.0)).filter(lambda e: abs(e[0]) + abs(e[1]) > 0.1)


def errors_at_balises(observer: TrainObserver, gaps: list[float], start: tuple[float, float]) -> list[np.ndarray]:
    runner = in_step(observer, MOTION)
    runner.runtime.x[:2] += start
    runner.runtime.start(0.0)
    runner.balise(0.0)
    errors = [np.array(start)]
    for gap in gaps:
        runner.runtime.advance(runner.runtime.t + gap)
        errors.append(runner.runtime.x[:2] - [MOTION.position(runner.runtime.t), MOTION.speed])
        runner.balise(MOTION.position(runner.runtime.t))
    return errors


@pytest.mark.parametrize("observer", CONTINUOUS_DISCRETE.values(), ids=CONTINUOUS_DISCRETE)
@settings(max_examples=25, deadline=None)
@given(relative=relative_gaps, start=start_errors)
def test_the_certified_function_falls_from_balise_to_balise(
    observer: TrainObserver, relative: list[float], start: tuple[float, float]
) -> None:
    limit = 0.999 * next(observer.findings(0.1)).limit  # the tolerance of the search for the limit, twice
    certificate = next(observer.findings(limit))
    assert certificate.holds
    P = np.array(certificate.lyapunov_matrix)
    errors = errors_at_balises(observer, [limit * gap for gap in relative], start)
    levels = [float(np.sqrt(e @ P @ e)) for e in errors]
    for before, after in pairwise(levels):
        assert after <= before * (1.0 + INTEGRATION) + 1e-6 * levels[0]


@pytest.mark.parametrize("observer", CONTINUOUS_DISCRETE.values(), ids=CONTINUOUS_DISCRETE)
def test_beyond_the_constant_limit_the_error_grows(observer: TrainObserver) -> None:
    limit = next(observer.findings(0.1)).condition(CONSTANT_GAP).limit
    start = (0.1, 0.1)
    beyond = errors_at_balises(observer, [1.05 * limit] * 60, start)
    within = errors_at_balises(observer, [0.95 * limit] * 60, start)
    assert np.abs(beyond[-1]).max() > 1.0
    assert np.abs(within[-1]).max() < 0.1


def test_mixed_gaps_between_the_limits_grow_although_each_alone_is_stable() -> None:
    """Why there are two limits: theta tau of 4.9 and 0.54, either of them stable alone, grow in turns by 15 % a
    balise.
    """
    observer = DifferentiatorCdo()
    long, short = 4.9 / 8.0, 0.54 / 8.0
    start = (0.01, 0.01)
    assert max(next(observer.findings(gap)).numbers[GROWTH] for gap in (long, short)) < 1.0
    assert not next(observer.findings(long)).holds
    assert np.abs(errors_at_balises(observer, [long, short] * 25, start)[-1]).max() > 1.0
    assert np.abs(errors_at_balises(observer, [long] * 50, start)[-1]).max() < 0.01
    assert np.abs(errors_at_balises(observer, [short] * 50, start)[-1]).max() < 0.01


def uio_in_equilibrium() -> SystemRunner:
    """At a speed where the linear drag of the observer is met by the effort, so that only the errors put in remain."""
    observer = DiscreteUio()
    runner = SystemRunner(observer, gate=0.0)  # what is certified is the error while every telegram is used
    runner.set("u", {"effort": DAVIS_A + (DAVIS_B + DAVIS_C * 50.0 / 3.6) * MOTION.speed, "odometer": MOTION.speed})
    runner.runtime.x[1] = MOTION.speed
    return runner


def uio_errors(runner: SystemRunner, stamps: list[float], start: np.ndarray) -> list[np.ndarray]:
    """Errors just after the first odometer sample behind each balise."""
    runner.runtime.x[:6] += start
    runner.runtime.start(0.0)
    errors = []
    for stamp in stamps:
        runner.runtime.advance(stamp)
        runner.balise(MOTION.position(runner.runtime.t))
        sample = np.floor(stamp / 0.1 + 1e-9) * 0.1 + 0.1
        runner.runtime.advance(sample)
        reference = np.array([MOTION.position(runner.runtime.t), MOTION.speed, 0.0, 0.0, 0.0, 0.0])
        errors.append(runner.runtime.x[:6] - reference)
    return errors


@settings(max_examples=25, deadline=None)
@given(relative=st.lists(st.floats(0.0, 1.0), min_size=10, max_size=40), seed=st.integers(0, 1000))
def test_the_unknown_input_observer_obeys_its_certificate(relative: list[float], seed: int) -> None:
    runner = uio_in_equilibrium()
    limit = next(DiscreteUio().findings(0.1)).limit
    P = np.array(next(DiscreteUio().findings(limit)).lyapunov_matrix)
    stamps = [0.05]
    for gap in relative:  # at most one balise in an odometer period, as the certificate demands
        stamps.append(max(stamps[-1] + gap * limit, np.floor(stamps[-1] / 0.1 + 1e-9) * 0.1 + 0.1 + 1e-6))
    errors = uio_errors(runner, stamps, np.random.default_rng(seed).normal(size=6))
    levels = [float(np.sqrt(e @ P @ e)) for e in errors]
    for before, after in pairwise(levels):
        assert after <= before * (1.0 + INTEGRATION) + 1e-9


def test_the_unknown_input_observer_diverges_beyond_its_constant_limit() -> None:
    limit = next(DiscreteUio().findings(0.1)).condition(CONSTANT_GAP).limit
    start = np.array([0.1, 0.0, 0.1, 0.0, 0.0, 0.0])
    ends = {}
    for name, gap in (("beyond", limit + 0.2), ("within", limit - 0.2)):
        errors = uio_errors(uio_in_equilibrium(), [0.05 + gap * k for k in range(1, 60)], start)
        ends[name] = np.abs(errors[-1]).max()
    assert ends["beyond"] > 1.0
    assert ends["within"] < 0.01
