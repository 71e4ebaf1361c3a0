"""Kalman filters as systems: against filterpy and pykalman, against each other, and measurements by events."""

import re
from collections.abc import Callable, Sequence
from typing import Any

import filterpy.kalman
import numpy as np
import pykalman
import pytest
from block_systems import Driven
from own_condition import own_condition

from fmu_observer.models.exhibits.cart_pendulum_model import cart_pendulum
from fmu_observer.models.exhibits.pendulum_model import linear_pendulum
from fmu_observer.models.filter_models import FilterModel, Known
from fmu_observer.models.moving_system import Steps
from fmu_observer.models.traced_system_model import find_filter_model, system_model
from fmu_observer.observers.generic.discrete.extended_kalman_filter import ExtendedKalmanFilter, KalmanFilter
from fmu_observer.observers.generic.discrete.gaussian_filter import GaussianFilter
from fmu_observer.observers.generic.discrete.unscented_kalman_filter import UnscentedKalmanFilter
from fmu_observer.observers.motors.motor_ekf import MotorEkf
from fmu_observer.observers.train.balise_odometer_ekf import BaliseOdometerEkf
from plant_models import PLANTS
from plant_models.hybrid import HybridSystem, PeriodicEvent, Runtime
from plant_models.hybrid.runtime import Runtime as Moving
from plant_models.hybrid.signal import input_signal, memory, output_signal, parameter, scalar_names, state

COUNT, T = 40, 0.1
ANGLES = np.sin(0.3 * np.arange(COUNT)) + 0.01 * np.random.default_rng(1).normal(size=COUNT)
TORQUES = 0.5 * np.cos(0.2 * np.arange(COUNT))
PENDULUM = ExtendedKalmanFilter("pendulum")
MOVED: Callable[[np.ndarray, float], np.ndarray] = lambda x, u: np.asarray(  # noqa: E731
    PENDULUM.model.moved(x, np.zeros(0), Known(0.0, np.array([u]), np.zeros(0)), T)
)


def started(system: GaussianFilter, **values: float) -> Moving:
    runtime = Runtime(system)
    give(runtime, values)
    return runtime


def give(runtime: Moving, values: dict[str, float]) -> None:
    system = runtime.system
    for signals, array in ((system.input_signals, runtime.u), (system.parameter_signals, runtime.p)):
        for i, name in enumerate(scalar_names(signals)):
            if name in values:
                array[i] = values[name]


def sampled(system: GaussianFilter, torques: np.ndarray = TORQUES, **values: float) -> np.ndarray:
    """Estimates and covariance of a pendulum's filter after each sample, shape (COUNT, n + n n)."""
    runtime = started(system, measured_angle=ANGLES[0], **values)
    runtime.start(0.0)
    n = system.model.order
    rows = [runtime.x[: n + n * n].copy()]
    for k in range(1, COUNT):
        give(runtime, {"torque": torques[k - 1], "measured_angle": ANGLES[k]})
        runtime.advance(k * T)
        rows.append(runtime.x[: n + n * n].copy())
    return np.array(rows)


def noise_of(system: GaussianFilter) -> tuple[np.ndarray, np.ndarray]:
    p = system.unpack_parameters(system.start_parameters())
    return p.process_covariance.reshape(2, 2), p.measurement_covariance.reshape(1, 1)


# -- other packages
# ---------------------------------------------------------------------------------------------------


def linear_matrices() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    model = KalmanFilter().model
    known = Known(0.0, np.zeros(1), np.zeros(0))
    F, _ = model.transition_jacobians(np.zeros(2), known, T)
    B = np.asarray(model.moved(np.zeros(2), np.zeros(0), known._replace(u=np.ones(1)), T))
    return np.asarray(F), B[:, None], linear_pendulum().C


@pytest.mark.parametrize("form", KalmanFilter.forms)
def test_the_kalman_filter_is_that_of_two_packages(form: Any) -> None:
    found = sampled(KalmanFilter(form=form))
    if form == "square_root":
        roots = found[:, 2:].reshape(-1, 2, 2)
        found = np.hstack([found[:, :2], (roots @ roots.transpose(0, 2, 1)).reshape(-1, 4)])
    F, B, H = linear_matrices()
    Q, R = noise_of(KalmanFilter())
    theirs = filterpy.kalman.KalmanFilter(2, 1)
    theirs.F, theirs.B, theirs.H, theirs.Q, theirs.R, theirs.x = F, B, H, Q, R, np.zeros((2, 1))
    for k, angle in enumerate(ANGLES):
        if k:
            theirs.predict(u=np.array([[TORQUES[k - 1]]]))
        theirs.update(np.array([[angle]]))
        np.testing.assert_allclose(found[k], np.hstack([theirs.x[:, 0], theirs.P.ravel()]), atol=1e-9)
    other = pykalman.KalmanFilter(F, H, Q, R, (B @ TORQUES[None, :-1]).T, np.zeros(1), np.zeros(2), np.eye(2))
    means, covariances = other.filter(ANGLES[:, None])
    np.testing.assert_allclose(found, np.hstack([means, covariances.reshape(-1, 4)]), atol=1e-9)


def test_the_extended_filter_is_that_of_two_packages() -> None:
    """filterpy is given our Jacobians; pykalman the transition linearised about our estimates, which varies in time.
    That the Jacobians are right is seen in `test_generic_discrete_filters`, by differences."""
    found, (Q, R) = sampled(PENDULUM), noise_of(PENDULUM)
    theirs = filterpy.kalman.ExtendedKalmanFilter(2, 1)
    theirs.Q, theirs.R, theirs.x = Q, R, np.zeros((2, 1))
    H = np.array([[1.0, 0.0]])
    jacobians, offsets = [], []
    for k, angle in enumerate(ANGLES):
        if k:
            at, u = theirs.x[:, 0], TORQUES[k - 1]
            F = np.asarray(PENDULUM.model.transition_jacobians(at, Known(0.0, np.array([u]), np.zeros(0)), T)[0])
            jacobians.append(F)
            offsets.append(MOVED(at, u) - F @ at)
            theirs.F, theirs.x = F, MOVED(at, u)[:, None]
            theirs.P = F @ theirs.P @ F.T + Q
        theirs.update(np.array([[angle]]), lambda _x: H, lambda x: H @ x)
        np.testing.assert_allclose(found[k], np.hstack([theirs.x[:, 0], theirs.P.ravel()]), atol=1e-9)
    other = pykalman.KalmanFilter(np.array(jacobians), H, Q, R, np.array(offsets), np.zeros(1), np.zeros(2), np.eye(2))
    means, covariances = other.filter(ANGLES[:, None])
    np.testing.assert_allclose(found, np.hstack([means, covariances.reshape(-1, 4)]), atol=1e-9)


def test_the_unscented_filter_is_that_of_two_packages() -> None:
    """Both draw anew from the prediction. pykalman has alpha = 1, beta = 0, kappa = 3 - n, and one transition."""
    system, values = UnscentedKalmanFilter(), {"alpha": 1.0, "beta": 0.0, "kappa": 1.0}
    found, (Q, R) = sampled(system, torques=np.full(COUNT, 0.3), **values), noise_of(system)
    theirs = pykalman.AdditiveUnscentedKalmanFilter(
        lambda x: MOVED(x, 0.3), lambda x: x[:1], Q, R, np.zeros(2), np.eye(2)
    )
    means, covariances = theirs.filter(ANGLES[:, None])
    np.testing.assert_allclose(found, np.hstack([means, covariances.reshape(-1, 4)]), atol=1e-9)
    points = filterpy.kalman.MerweScaledSigmaPoints(2, **values)
    other = filterpy.kalman.UnscentedKalmanFilter(2, 1, T, lambda x: x[:1], lambda x, _dt: MOVED(x, 0.3), points)
    other.Q, other.R, other.x, other.P = Q, R, found[0, :2], found[0, 2:].reshape(2, 2)
    for k in range(1, COUNT):
        other.predict()
        other.update(ANGLES[k : k + 1])
        np.testing.assert_allclose(found[k], np.hstack([other.x, other.P.ravel()]), atol=1e-9)


def test_the_unscented_filter_without_redrawing_is_the_boxed_algorithm() -> None:
    """Allaoui 2024, section II.6.3, with its own sums."""
    values = {"alpha": 0.5, "beta": 2.0, "kappa": 1.0}
    system = UnscentedKalmanFilter(redraw=False)
    found, (Q, R) = sampled(system, **values), noise_of(system)
    lam = 0.25 * 3.0 - 2.0
    means = np.array([lam, *[0.5] * 4]) / (2.0 + lam)
    weights = np.diag(means + np.array([1.0 - 0.25 + 2.0, *[0.0] * 4]))
    x, P = found[0, :2], found[0, 2:].reshape(2, 2)
    for k in range(1, COUNT):
        root = np.sqrt(2.0 + lam) * np.linalg.cholesky(P)
        chi = np.array([MOVED(at, TORQUES[k - 1]) for at in (x, *(x + root.T), *(x - root.T))])
        x, y = means @ chi, means @ chi[:, :1]
        off, seen = chi - x, chi[:, :1] - y
        P, Py, Pxy = off.T @ weights @ off + Q, seen.T @ weights @ seen + R, off.T @ weights @ seen
        K = Pxy @ np.linalg.inv(Py)
        x, P = x + K @ (ANGLES[k : k + 1] - y), P - K @ Pxy.T
        np.testing.assert_allclose(found[k], np.hstack([x, P.ravel()]), atol=1e-9)


# -- each other
# -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("options", [{}, {"form": "square_root"}])
def test_on_a_linear_model_the_unscented_filter_is_the_kalman_filter(options: dict[str, Any]) -> None:
    """alpha = 1e-3 as it stands: values of the model lose three digits in the differences."""
    linear = sampled(KalmanFilter(**options))
    np.testing.assert_allclose(sampled(UnscentedKalmanFilter("linear_pendulum", **options)), linear, atol=1e-9)


@pytest.mark.parametrize("kind", [ExtendedKalmanFilter, UnscentedKalmanFilter])
def test_forms_agree(kind: type[GaussianFilter]) -> None:
    first, *others = kind.forms
    expected = sampled(kind(form=first))
    for form in others:
        found = sampled(kind(form=form))
        np.testing.assert_allclose(found[:, :2], expected[:, :2], atol=1e-10)


def test_redrawing_matters_little_where_the_noise_of_the_process_is_small() -> None:
    quiet = {f"process_covariance[{i}]": 1e-8 * (i in (1, 4)) for i in range(1, 5)}
    drawn, kept = (sampled(UnscentedKalmanFilter(redraw=r), **quiet)[:, :2] for r in (True, False))
    assert 0.0 < np.abs(drawn - kept).max() < 5e-3


# -- models
# -------------------------------------------------------------------------------------------------------


def test_a_plant_is_a_model_by_its_own_flow() -> None:
    model = system_model(PLANTS["pendulum"](), ["angle"])
    runtime = Runtime(PLANTS["pendulum"]())
    runtime.u[0] = 0.3
    runtime.start(0.0)
    runtime.advance(model.sample_period)
    known = Known(0.0, np.array([0.3]), runtime.p[:2])
    np.testing.assert_array_equal(model.moved(model.start, np.zeros(0), known, model.sample_period), runtime.x)
    assert [s.name for s in model.parameters] == ["stiffness", "damping"]


def test_a_filter_of_a_plant_is_that_of_the_equal_observer_model() -> None:
    values = {"sample_period": T, "measurement_covariance[1]": 1e-4}
    values |= {f"process_covariance[{i}]": 1e-3 * (i in (1, 4)) for i in range(1, 5)}
    plant = system_model(PLANTS["pendulum"](), ["angle"], preset="rest", steps=Steps(substeps=4))
    np.testing.assert_allclose(
        sampled(ExtendedKalmanFilter(plant), **values), sampled(PENDULUM, **values), rtol=1e-12, atol=1e-15
    )


def test_parameters_of_the_plant_are_those_of_the_filter() -> None:
    system = ExtendedKalmanFilter(PLANTS["pendulum"](), outputs=["angle"])
    soft, hard = sampled(system, stiffness=0.5), sampled(system, stiffness=2.0)
    assert np.abs(soft[-1] - hard[-1]).max() > 1e-3


def test_noise_through_an_input_by_hand() -> None:
    """``P- = F P F' + W q W'`` after one period from P = P(0|0), W the Jacobian by the torque."""
    system = ExtendedKalmanFilter("pendulum", outputs=["angle"], inputs=[], process_noises=["torque"], covariances=True)
    runtime = started(
        system, **{"measured_angle": 0.2, "process_covariance[1]": 0.09, "measurement_covariance[1]": 4.0}
    )
    runtime.start(0.0)
    x, P = runtime.x[:2].copy(), runtime.x[2:6].reshape(2, 2).copy()
    known = Known(0.0, np.zeros(0), np.array([1.0, 0.2]))
    F, W = (np.asarray(J) for J in system.model.transition_jacobians(x, known, system.model.sample_period))
    runtime.advance(system.model.sample_period)
    ahead = F @ P @ F.T + 0.09 * W @ W.T
    K = ahead[:, :1] / (ahead[0, 0] + 4.0)
    np.testing.assert_allclose(runtime.x[2:6].reshape(2, 2), ahead - K @ ahead[:1], rtol=1e-12)
    names = scalar_names(system.outputs)
    covariance = runtime.update_outputs()[names.index("covariance[1]") :][:4]
    np.testing.assert_array_equal(covariance, runtime.x[2:6])


class Scaled(HybridSystem):
    """A mass whose sensor has a noise that grows with the speed, ``y = x + (1 + rate) disturbance``."""

    name = "scaled"
    states = (state("place", "m"), state("rate", "m/s", 2.0))
    inputs = (input_signal("push", "m/s2"), input_signal("disturbance", "m"))
    outputs = (output_signal("seen", "m"),)

    def flow(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"place": x.rate, "rate": u.push}

    def output(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"seen": x.place + (1.0 + x.rate) * u.disturbance}


@pytest.mark.parametrize("kind", [ExtendedKalmanFilter, UnscentedKalmanFilter])
def test_measurement_noise_through_an_input_by_hand(kind: type[GaussianFilter]) -> None:
    """At the start ``S = P11 + 3^2 r = 10`` with r = 1."""
    system = kind(Scaled(), outputs=["seen"], measurement_noises=["disturbance"])
    runtime = started(system, **{"measured_seen": 1.0, "measurement_covariance[1]": 1.0})
    runtime.start(0.0)
    names = scalar_names(system.outputs)
    S = runtime.update_outputs()[names.index("innovation_covariance[1]")]
    assert abs(S - 10.0) < (1e-5 if kind is UnscentedKalmanFilter else 1e-12)
    assert runtime.x[0] == pytest.approx(0.1, abs=1e-5)


class Read(HybridSystem):
    """A decay that a periodic event reads with noise; with `resets` the event sets it back too."""

    name = "read"
    states = (state("level", "1", 1.0), memory("reading", "1"))
    outputs = (output_signal("now", "1"), output_signal("read", "1"))
    parameters = (parameter("period", "s", 0.1), parameter("noise", "1", 0.1))
    events = (PeriodicEvent("look", "period", noises=(input_signal("jitter", "1", variability="discrete"),)),)

    def __init__(self, resets: bool = False) -> None:
        self.resets = resets
        super().__init__(resets=resets)

    def flow(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"level": -x.level}

    def output(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"now": x.level, "read": x.reading}

    def jump(self, event: str, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"level": 1.0 if self.resets else x.level + p.noise * u.jitter, "reading": x.level}


def test_events_of_a_plant_that_only_read_or_disturb_do_no_harm() -> None:
    assert [s.name for s in system_model(Read(), ["now"]).parameters] == ["noise"]
    with pytest.raises(ValueError, match=r"read: output 'read' follows its own sampling"):
        system_model(Read(), ["read"])
    with pytest.raises(ValueError, match=r"moves by its own events \(periodic 'look'\)"):
        system_model(Read(resets=True), ["now"])


def test_what_is_no_model_of_a_filter_is_refused() -> None:
    for name, words in {
        "train": "moves by its own events \\(periodic 'brake_reading'\\)",
        "drive_cycle": "has no states",
        "nothing": "Unknown model 'nothing'",
    }.items():
        with pytest.raises(ValueError, match=words):
            find_filter_model(name, ["speed"])
    with pytest.raises(ValueError, match=r"pendulum: outputs = \(\); expected a list .* angle, rate"):
        find_filter_model(PLANTS["pendulum"]())
    with pytest.raises(ValueError, match=r"output 'angel' is unknown; did you mean angle"):
        find_filter_model("pendulum", ["angel"])
    with pytest.raises(ValueError, match="inputs: what an observer model"):
        find_filter_model("pendulum", inputs=["torque"])


# -- events
# -------------------------------------------------------------------------------------------------------


def reported(system: GaussianFilter, readings: Sequence[tuple[float, str, dict[str, float]]], until: float) -> Moving:
    runtime = Runtime(system)
    runtime.start(0.0)
    for stamp, event, payload in readings:
        runtime.advance(stamp)
        give(runtime, payload)
        runtime.trigger(event)
    runtime.advance(until)
    return runtime


@pytest.mark.parametrize("kind", [ExtendedKalmanFilter, UnscentedKalmanFilter])
def test_measurements_that_arrive_apart_at_one_instant_are_one(kind: type[GaussianFilter]) -> None:
    """With independent noises and a linear measurement."""
    model = system_model(PLANTS["pendulum"](), ["angle", "rate"])
    together = reported(
        kind(model, arrival="sample"), [(0.0123, "sample", {"sample_angle": 0.1, "sample_rate": 0.2})], 0.02
    )
    apart = reported(
        kind(model, arrival=["place", "turn"]),
        [(0.0123, "place", {"place_angle": 0.1}), (0.0123, "turn", {"turn_rate": 0.2})],
        0.02,
    )
    np.testing.assert_allclose(apart.x[:6], together.x[:6], rtol=1e-7, atol=1e-9)
    y = dict(zip(scalar_names(apart.system.outputs), apart.update_outputs(), strict=True))
    assert y["nis_degrees"] == 1.0
    likelihood = scalar_names(together.system.outputs).index("innovation_likelihood")
    assert y["innovation_likelihood"] == pytest.approx(together.update_outputs()[likelihood], rel=1e-6)


def test_a_measurement_that_is_missing_leaves_the_prediction() -> None:
    """Between events the covariance of a linear model is that of the exact transition and noise."""
    system = KalmanFilter(arrival="sample")
    runtime = reported(system, [], 1.0)
    model: FilterModel = system.model
    known = Known(0.0, np.zeros(1), np.zeros(0))
    F, _ = model.transition_jacobians(np.zeros(2), known, 1.0)
    density, steps = 1e-2 * np.eye(2), np.linspace(0.0, 1.0, 2001)
    rows = np.array(
        [f @ density @ f.T for f in (np.asarray(model.transition_jacobians(np.zeros(2), known, s)[0]) for s in steps)]
    )
    Q = np.trapezoid(rows, steps, axis=0)
    expected = np.asarray(F) @ np.asarray(F).T + Q
    # Simpson's rule ten times in the second leaves 1e-9 of the noise, the trapezoidal reference 1e-9 too
    np.testing.assert_allclose(runtime.x[2:6].reshape(2, 2), expected, rtol=1e-8, atol=1e-9)
    assert runtime.update_outputs()[scalar_names(system.outputs).index("nis")] == 0.0


def test_a_late_measurement_that_is_replayed_is_as_one_in_time() -> None:
    readings = [(0.137, 0.2), (0.31, 0.25), (0.58, 0.1)]

    def run(delay: int) -> np.ndarray:
        driven = Driven(ExtendedKalmanFilter("pendulum", arrival="sample"), 3)
        driven.start(0.0)
        for k in range(10):
            driven.set(torque=float(np.sin(k)))
            for stamp, angle in readings:
                if int(stamp / 0.1) + delay == k:
                    driven.event("sample", stamp, {"sample_angle": angle})
            driven.step(0.1 * k, 0.1)
        return driven.get("angle", "rate", "angle_std", "rate_std", "nis", "innovation_likelihood")

    np.testing.assert_array_equal(run(2), run(0))


class Vehicle(HybridSystem):
    """A train as a point with an acceleration that is told."""

    name = "vehicle"
    states = (state("way", "m"), state("pace", "m/s", 10.0))
    inputs = (input_signal("drive", "m/s2"),)
    outputs = (output_signal("position", "m"), output_signal("speed", "m/s"))

    def flow(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"way": x.pace, "pace": u.drive}

    def output(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"position": x.way, "speed": x.pace}


def test_balises_are_gated_and_the_odometer_is_sampled() -> None:
    """The tenth balise tells a position 300 m off: it is doubted and kept out."""
    system = KalmanFilter(Vehicle(), outputs=["position", "speed"], arrival=["balise", "periodic"])
    assert [e.name for e in system.events] == ["sampling", "balise"]
    runtime = started(system, measured_speed=10.0)
    runtime.start(0.0)
    verdicts = []
    for k in range(1, 15):
        runtime.advance(3.0 * k)
        give(runtime, {"balise_position": 30.0 * k + (300.0 if k == 10 else 0.0)})
        verdicts.append(runtime.trigger("balise"))
    assert verdicts == [0] * 9 + [2] + [0] * 4
    assert runtime.x[0] == pytest.approx(420.0, abs=0.1)


def test_arrivals_that_make_no_sense_are_refused() -> None:
    with pytest.raises(ValueError, match=r"arrival = \['a'\]; expected one name for each of position, angle"):
        ExtendedKalmanFilter(cart_pendulum(), arrival=["a"])
    with pytest.raises(ValueError, match=r"arrival 'my event' is no legal name"):
        ExtendedKalmanFilter("pendulum", arrival="my event")
    with pytest.raises(ValueError, match="moves at its own period"):
        ExtendedKalmanFilter("synchronous_motor_euler", outputs=["current_d"], arrival="packet")


# -- covariances
# ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"measurement_covariance[1]": 0.0}, r"measurement_covariance\[1\] must be positive: it is a variance"),
        ({"process_covariance[4]": -1.0}, r"process_covariance\[4\] must be zero or more"),
        ({"process_covariance[2]": 1e-3}, r"process_covariance\[3\] and process_covariance\[2\] must be equal"),
        (
            {"process_covariance[2]": 1.0, "process_covariance[3]": 1.0},
            r"process_covariance\[4\] is too small beside the covariances of its row",
        ),
    ],
)
def test_covariances_that_are_none_are_refused(values: dict[str, float], words: str) -> None:
    with pytest.raises(ValueError, match=words):
        started(PENDULUM, **values).start(0.0)


NO_START = [
    ([-1.0, 0.0, 0.0, 1.0], r"estimate_covariance[1] must be zero or more"),
    ([1.0, 2.0, 2.0, 1.0], r"estimate_covariance[4] is too small beside the covariances of its row"),
    ([1.0, 0.0, 0.5, 1.0], r"estimate_covariance[3] and estimate_covariance[2] must be equal"),
]


@pytest.mark.parametrize(("start", "words"), NO_START)
def test_a_start_covariance_that_is_none_is_refused(start: list[float], words: str) -> None:
    runtime = Runtime(ExtendedKalmanFilter("pendulum"))
    place = scalar_names(runtime.system.states).index("estimate_covariance[1]")
    runtime.x[place : place + 4] = start
    with pytest.raises(ValueError, match=re.escape(words)):
        runtime.start(0.0)
    with pytest.raises(ValueError, match=r"estimate_covariance\[\d\] = "):
        runtime.start(0.0)


@pytest.mark.parametrize("system", [MotorEkf(), BaliseOdometerEkf()], ids=lambda s: str(s.name))
def test_other_filters_refuse_it_too(system: HybridSystem) -> None:
    runtime = Runtime(system)
    runtime.x[scalar_names(system.states).index("estimate_covariance[1]")] = -1.0
    with pytest.raises(ValueError, match=r"estimate_covariance\[1\] must be zero or more.* = -1\.0"):
        runtime.start(0.0)


@pytest.mark.parametrize(("P", "reported"), [([1.0, 1.0, 1.0, 1.0], 0.0), ([1.0, 2.0, 2.0, 1.0], 1.0)])
def test_a_covariance_that_becomes_none_later_is_reported(P: list[float], reported: float) -> None:
    runtime = Runtime(ExtendedKalmanFilter("pendulum"))
    place = scalar_names(runtime.system.states).index("estimate_covariance[1]")
    runtime.start(0.0)
    runtime.x[place : place + 4] = P
    outputs = dict(zip(scalar_names(runtime.system.outputs), runtime.update_outputs(), strict=True))
    assert outputs["covariance_not_positive"] == reported
    (warned,) = [s for s in runtime.system.outputs if s.warning is not None]
    assert warned.name == "covariance_not_positive"


def test_the_square_root_form_needs_positive_weights() -> None:
    system = UnscentedKalmanFilter(form="square_root")
    with pytest.raises(ValueError, match="beta must be at least alpha squared"):
        started(system, alpha=1.0, beta=0.5).start(0.0)
    with pytest.raises(ValueError, match="kappa must be above minus the number of states"):
        started(system, kappa=-2.0).start(0.0)


def test_what_is_not_seen_is_reported_by_the_condition() -> None:
    """The angle of the motor: rank 3 of 4, Allaoui 2024, section IV.2.3.7."""
    motor = ExtendedKalmanFilter("synchronous_motor", outputs=["current_d", "current_q"])
    condition = own_condition(motor)
    assert not condition.holds
    assert condition.numbers["rank"] == 3
    assert own_condition(PENDULUM).holds
    assert own_condition(PENDULUM, {"process_covariance": 0.0}).numbers["driven"] == 0
