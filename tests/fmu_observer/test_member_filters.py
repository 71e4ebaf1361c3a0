"""Ensemble and particle filters against the Kalman filter where it is exact, and where it is not."""

import numpy as np
import pytest
from generic_runner import sampled_run
from scipy import stats

from fmu_observer.formulas.filtering import particles
from fmu_observer.formulas.filtering.covariance_consistency import evaluate
from fmu_observer.formulas.filtering.smoothing import extended_pass
from fmu_observer.models.discrete_model import _zero_order_hold
from fmu_observer.models.exhibits.pendulum_model import linear_pendulum
from fmu_observer.models.traced_system_model import system_model
from fmu_observer.observers.generic.discrete import EnsembleKalmanFilter, ParticleFilter
from plant_models.exhibits import Pendulum

F, H = np.array([[1.0, 0.1], [-0.2, 0.9]]), np.array([[1.0, 0.0]])
Q, R = np.diag([1e-3, 4e-3]), np.array([[0.04]])
START, P = np.array([1.0, 0.0]), np.diag([0.3, 0.2])


def kalman(samples: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    passed = extended_pass(START, P, lambda _, x: (F @ x, F), Q, lambda _, x: (H @ x, H), R, samples)
    return passed.estimates, passed.covariances


def recording(count: int) -> np.ndarray:
    random = np.random.default_rng(5)
    x, samples = random.multivariate_normal(START, P), []
    for _ in range(count):
        samples.append(H @ x + random.normal(0.0, 0.2, 1))
        x = F @ x + random.multivariate_normal(np.zeros(2), Q)
    return np.array(samples)


def test_an_ensemble_tends_to_the_kalman_filter_as_members_grow() -> None:
    """Differences over 40 seeds are unbiased and fall with the root of the members."""
    samples = recording(15)
    means, covariances = kalman(samples)
    spread = np.sqrt(covariances[-1, 0, 0])
    sizes = {}
    for count in (25, 400):
        last = []
        for seed in range(40):
            random = np.random.default_rng(seed)
            members = START[:, None] + particles.drawn(P, random.normal(size=(2, count)))
            for k, sample in enumerate(samples):
                if k > 0:
                    members = F @ members + particles.drawn(Q, random.normal(size=(2, count)))
                draws = random.normal(size=(1, count))
                members = particles.correct_members(members, H @ members, sample, R, draws).members
            last.append(particles.mean_of(members)[0] - means[-1, 0])
        low, high = stats.t.interval(0.999, 39, np.mean(last), np.std(last, ddof=1) / np.sqrt(40))
        assert low < 0.0 < high
        sizes[count] = float(np.std(last))
    assert sizes[400] < 0.5 * sizes[25]  # a quarter in the limit
    assert sizes[400] < 3.0 * spread / np.sqrt(400)
    assert particles.variances_of(members)[0] == pytest.approx(covariances[-1, 0, 0], rel=0.3)


def test_particles_tend_to_the_kalman_filter_as_they_grow() -> None:
    samples, count = recording(15), 4000
    means, covariances = kalman(samples)
    random = np.random.default_rng(0)
    points = START[:, None] + particles.drawn(P, random.normal(size=(2, count)))
    weights = np.full(count, 1.0 / count)
    for k, sample in enumerate(samples):
        if k > 0:
            points = F @ points + particles.drawn(Q, random.normal(size=(2, count)))
        weights = particles.reweighted(weights, H @ points, sample, R)
        found = particles.moments(points, weights)
        error = np.abs(found.mean - means[k]) / np.sqrt(np.diag(covariances[k]))
        assert (error < 0.2).all()  # six times the root of 1 / 1000 effective particles
        if particles.effective_size(weights) < 0.5 * count:
            index = np.searchsorted(np.cumsum(weights), (np.arange(count) + 0.5) / count)
            points, weights = points[:, np.minimum(index, count - 1)], np.full(count, 1.0 / count)
    np.testing.assert_allclose(found.covariance, covariances[-1], atol=0.2 * covariances[-1].max())


def growth(k: int, x: np.ndarray) -> np.ndarray:
    """The growth model of Gordon, Salmond and Smith (1993), whose square measurement leaves the sign open."""
    return np.asarray(0.5 * x + 25.0 * x / (1.0 + x**2) + 8.0 * np.cos(1.2 * (k + 1)))


def test_particles_know_two_peaks_where_the_extended_filter_fails() -> None:
    runs, length, count, errors = 4, 60, 100, {"ekf": 0.0, "particles": 0.0}
    nees = []
    for seed in range(runs):
        random = np.random.default_rng(seed)
        x, true = random.normal(0.0, 2.0), []
        for k in range(length):
            true.append(x)
            x = float(growth(k, np.array(x))) + random.normal(0.0, np.sqrt(10.0))
        states = np.array(true)
        samples = states[:, None] ** 2 / 20.0 + random.normal(size=(length, 1))
        passed = extended_pass(
            np.zeros(1),
            4.0 * np.eye(1),
            lambda k, x: (growth(k, x), (0.5 + 25.0 * (1.0 - x**2) / (1.0 + x**2) ** 2).reshape(1, 1)),
            10.0 * np.eye(1),
            lambda _, x: (x**2 / 20.0, (x / 10.0).reshape(1, 1)),
            np.eye(1),
            samples,
        )
        points, weights = 2.0 * random.normal(size=(1, count)), np.full(count, 1.0 / count)
        means = []
        for k, sample in enumerate(samples):
            if k > 0:
                points = growth(k - 1, points) + np.sqrt(10.0) * random.normal(size=(1, count))
            weights = particles.reweighted(weights, points**2 / 20.0, sample, np.eye(1))
            means.append(particles.moments(points, weights).mean[0])
            points, weights = particles.resampled(points, weights), np.full(count, 1.0 / count)
        errors["ekf"] += float(np.square(passed.estimates[:, 0] - states).mean()) / runs
        errors["particles"] += float(np.square(np.array(means) - states).mean()) / runs
        nees.append((passed.estimates[:, 0] - states) ** 2 / passed.covariances[:, 0, 0])
    assert errors["particles"] < 0.4 * errors["ekf"], errors
    assert evaluate(np.concatenate(nees), 1.0, white=False).verdict == "overconfident"


def test_resampling_is_systematic_and_keeps_what_has_weight() -> None:
    points = np.array([[0.0, 1.0, 2.0, 3.0]])
    weights = np.array([0.0, 0.5, 0.5, 0.0])
    assert particles.resampled(points, weights).tolist() == [[1.0, 1.0, 2.0, 2.0]]
    random = np.random.default_rng(0)
    uneven = random.dirichlet(np.full(50, 0.3))
    many = random.normal(size=(3, 50))
    index = np.searchsorted(np.cumsum(uneven), (np.arange(50) + 0.5) / 50)
    np.testing.assert_array_equal(particles.resampled(many, uneven), many[:, index])
    assert particles.effective_size(np.full(8, 0.125)) == pytest.approx(8.0)
    assert particles.effective_size(np.array([1.0, 0.0])) == pytest.approx(1.0)


def test_weights_survive_a_measurement_far_from_all_particles() -> None:
    weights = particles.reweighted(np.full(3, 1.0 / 3.0), np.array([[0.0, 1.0, 2.0]]), np.array([1e6]), np.eye(1))
    assert weights.sum() == pytest.approx(1.0)
    assert weights[2] == pytest.approx(1.0)


@pytest.mark.parametrize("filter_class", [EnsembleKalmanFilter, ParticleFilter])
def test_as_systems_they_follow_the_kalman_filter(filter_class: type) -> None:
    """Of the linear pendulum, 50 members, from the fifth sample on; errors in standard deviations of the filter,
    medians over nine seeds: of 30 the largest error of the particles was 0.6 to 4.4, above 1.5 in 8.
    """
    count, A, B = 40, *_zero_order_hold(linear_pendulum().A, linear_pendulum().B, 0.1)
    torques, random = np.sin(0.37 * np.arange(count)), np.random.default_rng(1)
    angles = 0.3 * np.cos(0.1 * np.arange(count + 1)) + 0.1 * random.normal(size=count + 1)
    noise = 1e-3 * np.eye(2)
    exact = extended_pass(
        np.zeros(2),
        np.eye(2),
        lambda k, x: (A @ x + B[:, 0] * torques[k], A),
        noise,
        lambda _, x: (x[:1], np.eye(1, 2)),
        0.01 * np.eye(1),
        angles[:, None],
    )
    reported = {f"process_covariance[{i + 1}]": float(v) for i, v in enumerate(noise.ravel())}
    reported["measurement_covariance[1]"] = 0.01
    system, deviations = filter_class("linear_pendulum", 50), np.sqrt(np.einsum("kii->ki", exact.covariances))[5:]
    found = np.array([sampled_run(system, torques, angles, 0.1, **reported, seed=seed)[5:] for seed in range(9)])
    error = np.abs(found[:, :, :2] - exact.estimates[5:]) / deviations
    assert np.median(error.max(axis=(1, 2))) < 1.5
    assert np.median(error.mean(axis=(1, 2))) < 0.6  # sampling errors of some 20 effective members, carried on
    assert np.median((found[:, :, 3:5] / deviations).mean(axis=(1, 2))) == pytest.approx(1.0, abs=0.25)


def test_too_many_members_are_refused() -> None:
    with pytest.raises(ValueError, match="expected 2 to 50"):
        ParticleFilter(members=51)


def test_a_plant_is_a_model_and_noise_may_enter_by_its_input() -> None:
    """A torque that pushes at random: members differ in speed, and in angle by a twentieth of a second times that."""
    found = EnsembleKalmanFilter("pendulum", 10, outputs=["angle"], process_noises=["torque"])
    assert [s.name for s in found.inputs] == ["measured_angle"]
    assert found.model.noise_count == 1
    p = found.unpack_parameters(found.start_parameters())
    u = found.unpack_inputs(np.concatenate([np.zeros(1), np.random.default_rng(0).normal(size=30)]))
    x = found.unpack_states(found.start_state())._replace(primed=1.0)  # members stand at zero
    members = found.jump("sampling", 0.0, x, u, p)["drawn_members"]
    assert np.ptp(members[:, 0]) == pytest.approx(0.5 * float(p.sample_period) * np.ptp(members[:, 1]), rel=0.2)
    with pytest.raises(ValueError, match="expected additive noise"):
        EnsembleKalmanFilter(system_model(Pendulum(), ["angle"], [], measurement_noises=["torque"]))
