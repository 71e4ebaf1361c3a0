"""The augmented observers beside a coupled train: convergence, the unknown force, two kinds of positions, noise."""

from collections.abc import Callable

import numpy as np
import pytest
from coupled_train import MASSES, ROWS, Journey, trip
from observer_runner import INERTIA, MASS, RADIUS, SteadyMotion, SystemRunner, random_gaps

from fmu_observer.observers.train import AugmentedHighGainCdo, AugmentedTakagiSugenoCdo
from fmu_observer.observers.train.augmented_observer import AugmentedTrainObserver
from plant_models.railway.sensors.gps import Gps

MAKES: dict[str, Callable[[], AugmentedTrainObserver]] = {
    "high gain": AugmentedHighGainCdo,
    "high gain, differentiator": lambda: AugmentedHighGainCdo("differentiator"),
    "Takagi-Sugeno": AugmentedTakagiSugenoCdo,
}
every = pytest.mark.parametrize("make", MAKES.values(), ids=MAKES)
both = pytest.mark.parametrize("make", [AugmentedHighGainCdo, AugmentedTakagiSugenoCdo])
PULL = 15e3  # [N], held by couplers and gradient in the tests at constant speed


def binomial(theta: float) -> dict[str, float]:
    """Gains theta^i (4, 6, 4, 1) of the Takagi-Sugeno family: the high-gain observer on a known force."""
    gains = [4.0 * theta, 6.0 * theta**2, 4.0 * theta**3, theta**4]
    return {f"gps_gain[{i + 1}]": gain for i, gain in enumerate(gains)} | {"gps_decay": gains[0]}


def pulling(
    make: Callable[[], AugmentedTrainObserver], preset: str, motion: SteadyMotion, **parameters: float
) -> SystemRunner:
    """A runner at time zero whose locomotive holds its speed against `PULL`, wheels without slip."""
    runner = SystemRunner(make(), preset=preset, **parameters)
    runner.set("u", {"effort": motion.effort(0.0) + PULL, "odometer": motion.odometer(0.0)})
    runner.runtime.start(0.0)
    return runner


def sample(runner: SystemRunner, kind: str, position: float) -> None:
    runner.set("u", {f"{kind}_position": position})
    runner.runtime.trigger(kind)


def observe(
    observer: AugmentedTrainObserver,
    journey: Journey,
    noise: float = 0.0,
    rotating_mass: float = 0.0,
    **parameters: float,
) -> np.ndarray:
    """Speed and coupler force of the observer at the rows of a journey, fixes at 10 Hz, shape (rows, 2)."""
    runner, generator = SystemRunner(observer, **parameters), np.random.default_rng(0)
    effort = journey.force + rotating_mass * np.gradient(journey.speed, journey.time)
    rows = np.empty((len(journey.time), 2))
    for k, t in enumerate(journey.time):
        runner.runtime.advance(t)
        runner.set("u", {"effort": effort[k], "odometer": journey.speed[k]})
        if k == 0:
            runner.runtime.start(0.0)
        if k % round(0.1 / ROWS) == 0:
            sample(runner, "gps", journey.position[k] + noise * generator.standard_normal())
        out = runner.outputs()
        rows[k] = out["speed"], out["coupler_force"]
    return rows


@pytest.fixture(scope="module")
def uphill() -> Journey:
    """35 km/h on 8 per mille, the numbers behind the 14.92 kN of the spec."""
    return trip()


# -- laws
# -----------------------------------------------------------------------------------------------------------------


@every
def test_signals_and_events(make: Callable[[], AugmentedTrainObserver]) -> None:
    observer = make()
    assert [s.name for s in observer.inputs] == ["effort", "odometer", "gradient"]
    assert {e.name: [s.name for s in e.payload] for e in observer.triggered_events} == {
        "balise": ["balise_position", "balise_location_accuracy"],
        "gps": ["gps_position"],
    }
    units = {s.name: s.unit for s in observer.outputs}
    assert units == {
        "position": "m",
        "speed": "m/s",
        "slip": "1",
        "slip_indicator": "1",
        "rolls_back": "1",
        "adhesion_force": "N",
        "innovation": "m",
        "coupler_force": "N",
        "disturbance": "m/s2",
    }


@every
def test_traced_and_plain_numpy_agree_and_a_redo_is_identical(make: Callable[[], AugmentedTrainObserver]) -> None:
    motion, ends = SteadyMotion(speed=12.0, acceleration=0.1, slip_speed=0.2), []
    for python in (False, True):
        runner = SystemRunner(make(), python=python, internal_step=5e-3)
        runner.runtime.start(0.0)

        def ride(kinds: str, runner: SystemRunner = runner) -> None:
            for kind in kinds:
                stop = runner.runtime.t + 0.1
                runner.set("u", {"effort": motion.effort(stop), "odometer": motion.odometer(stop), "gradient": 0.002})
                runner.runtime.advance(stop)
                sample(runner, "gps" if kind == "g" else "balise", motion.position(stop))

        ride("gbg")
        snapshot = runner.runtime.snapshot()
        ride("bg")
        after = runner.runtime.x.copy()
        runner.runtime.restore(snapshot)
        ride("bg")
        np.testing.assert_array_equal(runner.runtime.x, after)
        ends.append(np.append(after, runner.runtime.update_outputs()))
    # The same operations in another order: rounding only, which the differentiator's sign may amplify by its chatter.
    np.testing.assert_allclose(ends[0], ends[1], rtol=1e-9, atol=1e-6)


@every
def test_a_batch_flows_and_jumps_like_its_members(make: Callable[[], AugmentedTrainObserver]) -> None:
    observer, generator = make(), np.random.default_rng(1)
    x = generator.normal(size=(observer.state_count, 3))
    x[-1] = [0.0, 1.0, 2.0]  # no sample yet, a balise last, a fix last
    u = generator.normal(10.0, 1.0, size=(len(observer.start_inputs()), 3))
    p = np.tile(observer.start_parameters()[:, None], 3)
    flows = observer.state_derivative(0.0, x, u, p)
    for k in range(3):
        np.testing.assert_allclose(flows[:, k], observer.state_derivative(0.0, x[:, k], u[:, k], p[:, k]), rtol=1e-12)
        for event in ("balise", "gps"):
            together = observer.jump_vector(event, 0.0, x, u, p)[:, k]
            np.testing.assert_allclose(
                together, observer.jump_vector(event, 0.0, x[:, k], u[:, k], p[:, k]), rtol=1e-12
            )


@both
def test_sampled_fixes_are_events_at_their_period(make: type[AugmentedHighGainCdo]) -> None:
    motion, ends = SteadyMotion(speed=12.0), []
    for fixes in ("sampled", "event"):
        runner = SystemRunner(make(fixes=fixes))  # type: ignore[arg-type]
        runner.set("u", {"effort": motion.effort(0.0), "odometer": 12.0})
        runner.runtime.start(0.0)
        if fixes == "event":
            sample(runner, "gps", 0.0)
        for k in range(1, 21):
            if fixes == "sampled":
                runner.set("u", {"fix_position": motion.position(0.1 * k)})
                runner.runtime.advance(0.1 * k)
            else:
                runner.runtime.advance(0.1 * k)
                sample(runner, "gps", motion.position(0.1 * k))
        ends.append(runner.runtime.x.copy())
    np.testing.assert_array_equal(*ends)
    with pytest.raises(ValueError, match="unknown fixes 'both'"):
        make(fixes="both")  # type: ignore[arg-type]


# -- convergence
# ------------------------------------------------------------------------------------------------------------


@both
@pytest.mark.parametrize("preset", ["balises", "gps", "gps_and_balises"])
def test_the_unknown_force_is_found_at_random_gaps(make: Callable[[], AugmentedTrainObserver], preset: str) -> None:
    """Constant speed, constant unknown force, gaps up to 0.5 s (fixes and balises together up to 0.1 s)."""
    motion, generator = SteadyMotion(speed=10.0), np.random.default_rng(2)
    runner = pulling(make, preset, motion)
    mixed = preset == "gps_and_balises"
    for gap in random_gaps(3, 0.1 if mixed else 0.5, 500 if mixed else 120):
        runner.runtime.advance(runner.runtime.t + gap)
        kind = preset.removesuffix("s") if not mixed else ("gps", "balise")[int(generator.random() < 0.2)]
        sample(runner, "gps" if preset == "gps" else kind, motion.position(runner.runtime.t))
    out = runner.outputs()
    # The slowest pole of any preset, 0.35 1/s over 30 s, leaves 3e-5 of start errors of up to 9 m/s and 15 kN, times
    # the size of the transient: less than one per mille of both.
    assert out["coupler_force"] == pytest.approx(PULL, rel=5e-3)
    assert out["speed"] == pytest.approx(10.0, abs=5e-3)
    assert out["position"] == pytest.approx(motion.position(runner.runtime.t), abs=5e-3)
    assert out["disturbance"] == pytest.approx(-PULL / MASS, rel=5e-3)


@pytest.mark.parametrize(("make", "lag"), [(AugmentedHighGainCdo, 2.0 / 8.0), (AugmentedTakagiSugenoCdo, 0.0)])
def test_a_force_that_grows_steadily_is_followed(make: Callable[[], AugmentedTrainObserver], lag: float) -> None:
    """Without lag by the augmented observer; a wheel observer with a double pole at theta_1 = 8 lags by 2 / theta_1
    itself.
    """
    motion = SteadyMotion(speed=10.0)
    runner = pulling(make, "gps", motion)
    for k in range(1, 4001):
        # 500 N/s, by its mean in the step
        runner.set("u", {"effort": motion.effort(0.0) + PULL + 500.0 * (0.01 * k - 0.005)})
        runner.runtime.advance(0.01 * k)
        if k % 10 == 0:
            sample(runner, "gps", motion.position(0.01 * k))
    # A chain that ends with a constant acceleration would lag by some seconds of the ramp, over 1 kN.
    assert runner.outputs()["coupler_force"] == pytest.approx(PULL + 500.0 * (40.0 - lag), abs=20.0)


@both
def test_a_known_gradient_is_taken_out_of_the_coupler_force(make: Callable[[], AugmentedTrainObserver]) -> None:
    runner = pulling(make, "gps", SteadyMotion(speed=10.0))
    runner.set("x", {"unknown_acceleration": -PULL / MASS})
    runner.set("u", {"gradient": 0.008})
    assert runner.outputs()["coupler_force"] == pytest.approx(PULL - MASS * 9.81 * 0.008, abs=1e-6)


@every
@pytest.mark.parametrize(
    ("effort", "odometer"), [(0.0, 0.0), (-350e3, 0.0), (350e3, 60.0)], ids=["rest", "lock", "spin"]
)
def test_outputs_stay_finite_without_any_sample(
    make: Callable[[], AugmentedTrainObserver], effort: float, odometer: float
) -> None:
    runner = SystemRunner(make())
    runner.set("x", {"estimated_speed": 15.0})
    runner.set("u", {"effort": effort, "odometer": odometer})
    runner.runtime.start(0.0)
    runner.runtime.advance(30.0)
    assert np.all(np.isfinite(list(runner.outputs().values())))


@every
def test_a_braked_train_is_held_at_rest(make: Callable[[], AugmentedTrainObserver]) -> None:
    runner = SystemRunner(make())
    runner.set("u", {"effort": -60e3, "odometer": 0.0})
    runner.runtime.start(0.0)
    for k in range(1, 201):
        runner.runtime.advance(0.1 * k)
        sample(runner, "gps", 0.0)
    # a minute without samples: the brake holds against what is left of the unknown acceleration
    runner.runtime.advance(80.0)
    assert abs(runner.outputs()["speed"]) < 1e-3  # [m/s], against 40 m/s backwards if the brake pushed
    assert abs(runner.outputs()["position"]) < 0.1


@both
def test_a_sensor_without_gain_is_not_used(make: Callable[[], AugmentedTrainObserver]) -> None:
    for preset, unused in (("balises", "gps"), ("gps", "balise")):
        runner = pulling(make, preset, SteadyMotion(speed=10.0))
        sample(runner, "balise" if unused == "gps" else "gps", 1.0)
        before = runner.runtime.x.copy()
        sample(runner, unused, 50.0)
        np.testing.assert_array_equal(runner.runtime.x, before)


@both
def test_the_latest_sample_and_its_gain_are_in_force(make: Callable[[], AugmentedTrainObserver]) -> None:
    runner = pulling(make, "gps_and_balises", SteadyMotion(speed=10.0))
    observer = runner.system
    corrections = {}
    for kind in ("balise", "gps"):
        sample(runner, kind, runner.state("estimated_position") - 1.0)
        assert runner.outputs()["innovation"] == 1.0
        slope = runner.runtime.derivatives()
        corrections[kind] = runner.state("estimated_speed") - slope[0]
        named = observer.unpack_parameters(runner.runtime.p)
        gains, decay = observer.gains_of(kind, named)  # type: ignore[attr-defined]
        assert corrections[kind] == pytest.approx(gains[0], rel=1e-12)
        assert slope[4] == pytest.approx(-decay, rel=1e-12)
    assert corrections["balise"] > 2.0 * corrections["gps"]


def test_slip_goes_into_the_speed_only_where_the_odometer_is_trusted() -> None:
    errors = {}
    for preset in ("gps_and_balises", "odometer_trusted"):
        motion = SteadyMotion(speed=10.0, slip_speed=1.0)
        runner = pulling(AugmentedTakagiSugenoCdo, preset, motion)
        runner.set("x", {"estimated_speed": 10.0, "unknown_acceleration": -PULL / MASS})
        for k in range(1, 301):
            runner.runtime.advance(0.1 * k)
            sample(runner, "gps", motion.position(0.1 * k))
        errors[preset] = runner.outputs()["speed"] - 10.0
    assert abs(errors["gps_and_balises"]) < 1e-6
    assert errors["odometer_trusted"] == pytest.approx(1.0, abs=0.02)


def test_wheel_inertia_biases_the_force_of_the_family_on_the_applied_effort(uphill: Journey) -> None:
    """4 J / r^2 = 2722 kg times 0.5 m/s2 counts as 1.36 kN of coupler force; the wheel observer does not have that."""
    rotating, window = 4.0 * INERTIA / RADIUS**2, (uphill.time > 12.0) & (uphill.time < 18.0)

    def shift(make: Callable[[], AugmentedTrainObserver]) -> float:
        with_inertia, without = (observe(make(), uphill, rotating_mass=m, n_axles=4.0)[:, 1] for m in (rotating, 0.0))
        return float((with_inertia - without)[window].mean())

    # a slow tail of the step at the start
    assert shift(AugmentedTakagiSugenoCdo) == pytest.approx(0.5 * rotating, rel=0.05)
    right, biased = (
        observe(AugmentedHighGainCdo(), uphill, rotating_mass=m, n_axles=4.0)[window, 1].mean() for m in (rotating, 0.0)
    )
    true = (uphill.coupler_force + uphill.gradient_force)[window].mean()
    assert abs(right - true) < 1e3  # of 52 kN, the ringing coupler's mean over the window
    # Told of an inertia that is not there, the wheel observer subtracts it.
    assert biased - right == pytest.approx(-0.5 * rotating, rel=0.05)


# -- the numbers of the spec, 5.7
# ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("theta", "mean", "largest"), [(1.0, 0.082, 0.98), (3.0, 0.019, 0.41)])
def test_speed_error_without_noise(uphill: Journey, theta: float, mean: float, largest: float) -> None:
    """The run behind the numbers is not described; ours holds the same 14.92 kN, and its errors are of that size."""
    error = 3.6 * np.abs(observe(AugmentedTakagiSugenoCdo(), uphill, **binomial(theta))[:, 0] - uphill.speed)
    settled = uphill.time > 5.0  # the start is from another speed
    assert (
        error.mean() == pytest.approx(mean, rel=0.35)
        if theta == 1.0
        else error[settled].mean() == pytest.approx(mean, rel=0.35)
    )
    assert error[settled].max() == pytest.approx(largest, rel=0.35)


def test_coupler_and_grade_force(uphill: Journey) -> None:
    assert MASSES.sum() == 166000.0
    force = observe(AugmentedTakagiSugenoCdo(), uphill, **binomial(1.0))[:, 1]
    true = uphill.coupler_force + uphill.gradient_force
    hold = uphill.time > 40.0
    assert true[hold].mean() == pytest.approx(14.92e3, abs=20.0)
    assert force[hold].mean() == pytest.approx(true[hold].mean(), abs=20.0)
    moving = uphill.time > 10.0
    # The coupler rings at 0.82 Hz, far above theta: the estimate follows its mean, and the ringing is the error, ~8 kN
    # rms.
    assert np.sqrt(np.mean((force - true)[moving] ** 2)) == pytest.approx(8e3, rel=0.25)


@pytest.mark.parametrize(("noise", "theta", "published"), [(0.5, 0.5, 0.56), (0.5, 1.0, 1.06), (0.15, 0.7, 0.29)])
def test_speed_error_with_white_noise(uphill: Journey, noise: float, theta: float, published: float) -> None:
    error = 3.6 * np.abs(observe(AugmentedTakagiSugenoCdo(), uphill, noise, **binomial(theta))[:, 0] - uphill.speed)
    # One noise seed of 80 s with a correlation time of about 1/theta: 20 % of the mean.
    assert error.mean() == pytest.approx(published, rel=0.2)


def test_drift_costs_less_speed_than_white_noise_of_equal_size(uphill: Journey) -> None:
    """Half a metre that wanders over ten minutes gives a third of the speed error of half a metre of white noise, or
    less.
    """
    receiver, means = SystemRunner(Gps()), {}
    for preset, drift_time in (("half_metre", 600.0), ("white", 60.0)):
        receiver.runtime.reset()
        receiver.runtime.p[:] = receiver.system.start_parameters(preset)
        receiver.set("p", {"drift_time": drift_time})
        receiver.runtime.start(0.0)
        runner, error = SystemRunner(AugmentedTakagiSugenoCdo()), []
        runner.runtime.start(0.0)
        for k in range(0, len(uphill.time), 10):
            receiver.set("u", {"position": uphill.position[k]})
            receiver.runtime.advance(uphill.time[k])
            runner.runtime.advance(uphill.time[k])
            runner.set("u", {"effort": uphill.force[k], "odometer": uphill.speed[k]})
            sample(runner, "gps", receiver.outputs()["gps_position"])
            error.append(3.6 * abs(runner.outputs()["speed"] - uphill.speed[k]))
        means[preset] = np.mean(error[150:])
    assert means["half_metre"] < means["white"] / 3.0
