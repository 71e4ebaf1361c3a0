"""Diagnosis of the wind turbine: on readings made here from the drive train's exact solution, faults put into them."""

import numpy as np
import pytest

import fmus
from fmu_observer.formulas.diagnosis.finite_window_observer import sampled
from fmu_observer.observers.exhibits.drive_train_residuals import torsion_gains
from fmu_observer.observers.exhibits.efficiency_inversion import BLOCKS, _simulated_speed
from fmu_observer.observers.exhibits.wind_turbine_diagnosis import ALARM_NAMES, WindTurbineDiagnosis
from fmu_observer.observers.exhibits.wind_turbine_limits import WARNINGS
from plant_models.exhibits.wind_turbine.drive_train import DriveTrain
from plant_models.exhibits.wind_turbine.rotor import Rotor
from plant_models.hybrid import scalar_names

PERIOD = 0.01  # [s]
WIND, TURNING, PITCH = 12.5, 1.7, 4.0  # m/s, rad/s, deg


def matrices(efficiency: float = 0.97) -> tuple[np.ndarray, np.ndarray]:
    """A and B of the drive train."""
    drive = DriveTrain(efficiency=efficiency)
    B = np.array([[1.0 / drive.rotor_inertia, 0.0], [0.0, -1.0 / drive.generator_inertia], [0.0, 0.0]])
    return np.array(drive.matrix()), B


def steady(noise: float, seconds: float, seed: int = 0) -> dict[str, np.ndarray]:
    """Readings of a turbine that turns steadily, with the noise of its sensors times `noise`."""
    count = round(seconds / PERIOD) + 1
    driving = Rotor().torque(WIND, TURNING, [PITCH] * 3)
    A, B = matrices()
    # The generator speed, torsion and generator torque at which the rotor stays as it is.
    generator, _, braking = np.linalg.solve(
        np.column_stack([A[:, 1], A[:, 2], B[:, 1]]), -A[:, 0] * TURNING - B[:, 0] * driving
    )
    rng = np.random.default_rng(seed)
    means = {"wind_speed": WIND + 1.5, "torque": braking, "torque_reference": braking, "pitch_reference": PITCH}
    readings = {name: np.full(count, value) for name, value in means.items()}
    readings["torque"] = readings["torque"] + 90.0 * noise * rng.normal(size=count)
    readings["wind_speed"] = readings["wind_speed"] + 0.5 * noise * rng.normal(size=count)
    for name, value, deviation, sensors in (
        ("rotor_speed", TURNING, 0.0251, 2),
        ("generator_speed", generator, 0.05, 2),
        ("pitch", PITCH, 0.2, 6),
    ):
        for i in range(sensors):
            readings[f"{name}[{i + 1}]"] = value + deviation * noise * rng.normal(size=count)
    return readings


MEMBERS = 7
CENTRING = scalar_names(WindTurbineDiagnosis().parameter_signals).index("centring")


@pytest.fixture(scope="module")
def batch() -> fmus.Batch:
    """One compiled diagnosis for all tests."""
    return fmus.Batch("wind_turbine_diagnosis", MEMBERS)


def diagnosed(
    batch: fmus.Batch, members: list[dict[str, np.ndarray]], results: list[str], period: float = PERIOD, **values: float
) -> np.ndarray:
    """Outputs at all samples, shape (members, samples, results)."""
    batch.reset()
    for name, value in {"sample_period": period, "centring": 1.0, "torque_limit": 1.2e5, **values}.items():
        batch.set(name, value)
    all_members = [*members, *members[-1:] * (MEMBERS - len(members))]
    inputs = {name: np.stack([m[name] for m in all_members]) for name in members[0]}
    count = inputs["torque"].shape[1]
    for name, rows in inputs.items():
        batch.set(name, rows[:, 0])
    batch.start()
    found = batch.run(period * np.arange(1, count), results=results, inputs=inputs)
    return np.asarray(found[: len(members)])


ONSET, END = 15.0, 17.0  # [s]
FAULTS = {
    "pitch_sensor_fault[5]": ("pitch[5]", 0.0, 10.0),
    "rotor_sensor_fault[1]": ("rotor_speed[1]", 0.0, 3.5),
    "rotor_sensor_fault[2]": ("rotor_speed[2]", 5.0, 0.0),
    "generator_sensor_fault[1]": ("generator_speed[1]", 0.0, 50.0),
    "generator_sensor_fault[2]": ("generator_speed[2]", 5.0, 0.0),
    "torque_fault": ("torque", 1.0, 1000.0),
}


@pytest.fixture(scope="module")
def sensor_faults(batch: fmus.Batch) -> np.ndarray:
    """Alarms in seven runs: each of `FAULTS`, and no fault; shape (members, samples, alarms)."""
    members = []
    for seed, fault in enumerate([*FAULTS.values(), None]):
        readings = steady(1.0, 18.0, seed)
        if fault is not None:
            name, gain, offset = fault
            acts = slice(round(ONSET / PERIOD), round(END / PERIOD))
            readings[name][acts] = gain * readings[name][acts] + offset
        members.append(readings)
    return diagnosed(batch, members, list(ALARM_NAMES))


@pytest.mark.parametrize("name", list(FAULTS))
def test_a_fault_is_found_at_once_and_no_other_is(name: str, sensor_faults: np.ndarray) -> None:
    alarms = sensor_faults[list(FAULTS).index(name)] > 0.0
    own = np.flatnonzero(alarms[:, ALARM_NAMES.index(name)])
    # Acceptance (h): onset within 4 samples, clearing within 10. An input is held from its instant on, so that a sample
    # sees it one later.
    assert 0 <= own[0] - round(ONSET / PERIOD) <= 4
    assert own[-1] - round(END / PERIOD) <= 10
    assert not np.delete(alarms, ALARM_NAMES.index(name), axis=1).any()


PAIRS = {
    **{f"pitch[{i}]": ("pitch_difference_limit", f"ratio_pitch_sensors[{(i + 1) // 2}]") for i in range(1, 7)},
    **{f"rotor_speed[{i}]": ("rotor_difference_limit", "ratio_rotor_sensors") for i in (1, 2)},
    **{f"generator_speed[{i}]": ("generator_difference_limit", "ratio_generator_sensors") for i in (1, 2)},
}


@pytest.mark.parametrize("first", [0, 5])
def test_a_sensor_that_is_off_by_more_than_its_limit_is_reported_although_it_is_not_isolated(
    batch: fmus.Batch, first: int
) -> None:
    """Detected is told: offsets of 1.2 to 12 times the limit, both signs, of each sensor that has a second one, without
    noise; and while the ratio of any pair is above 1 in noise. A run without a fault stays silent."""
    rng, limits = np.random.default_rng(first), WindTurbineDiagnosis().start_parameters()
    names = scalar_names(WindTurbineDiagnosis().parameter_signals)
    chosen = list(PAIRS)[first : first + 5]
    for noise in (0.0, 1.0):
        members = []
        for seed, name in enumerate([*chosen, None]):
            readings = steady(noise, 14.0, seed)
            if name is not None:
                limit = limits[names.index(PAIRS[name][0])]
                readings[name][round(12.0 / PERIOD) :] += rng.choice([-1.0, 1.0]) * rng.uniform(1.2, 12.0) * limit
            members.append(readings)
        results = ["fault", *dict.fromkeys(ratio for _, ratio in PAIRS.values())]
        found = diagnosed(batch, members, results)
        assert not found[-1, :, 0].any()
        above = found[:, :, 1:].max(axis=2) > 1.0
        assert (found[:, :, 0] >= above).all()
        assert noise > 0.0 or above[:-1, round(12.0 / PERIOD) + 2 :].all()


@pytest.mark.parametrize("speed", ["rotor_speed", "generator_speed"])
def test_sensors_that_agree_and_are_both_off_are_reported_although_they_are_not_isolated(
    batch: fmus.Batch, speed: str
) -> None:
    """Detected is told: both sensors of a speed read 0.5 to 10 % too much or too little, in noise: five seconds of it
    turn the shaft by 0.04 rad and more, and it twists by 1e-3. All four off alike turn nothing, and are not told."""
    members = []
    for seed, share in enumerate([0.005, -0.01, 0.02, -0.03, 0.1, 0.0]):
        readings = steady(1.0, 22.0, seed)
        for i in (1, 2):
            readings[f"{speed}[{i}]"][round(15.0 / PERIOD) :] *= 1.0 + share
        members.append(readings)
    members.append({n: v * (1.03 if "_speed[" in n else 1.0) for n, v in steady(1.0, 22.0, 9).items()})
    found = diagnosed(batch, members, ["fault", "undecided", *ALARM_NAMES]) > 0.0
    late = found[:, round(20.5 / PERIOD) :]  # five seconds, and the block of half a second that was running
    assert late[1:5, :, :2].all()
    assert found[0, :, :2].any(axis=0).all()  # twice its limit, which noise may hide for a block
    assert not found[5:].any()
    assert not found[:, :, 2:].any()


def test_without_a_fault_there_is_no_alarm(sensor_faults: np.ndarray) -> None:
    assert not sensor_faults[-1].any()


def test_an_offset_of_ten_newton_metres_is_not_seen(batch: fmus.Batch) -> None:
    readings = steady(1.0, 20.0)
    readings["torque"][1200:] += 10.0  # noise has 90
    assert not diagnosed(batch, [readings], ["torque_fault"]).any()


def test_the_torsion_is_exact_without_noise() -> None:
    gains = torsion_gains(DriveTrain(), PERIOD)
    A, B = sampled(*matrices(), PERIOD)
    rng = np.random.default_rng(1)
    x, states, inputs = np.array([1.7, 161.0, 1e-3]), [], rng.normal(size=(5, 2)) * [3e6, 3e4]
    for u in inputs:
        states.append(x)
        x = A @ x + B @ u
    window = np.hstack([np.array(states)[:, :2], inputs])
    # Speeds of 161 rad/s become torsions of 1e-3 rad: seven digits are lost.
    assert np.sum(gains * window.T) == pytest.approx(states[-1][2], abs=1e-11)
    with pytest.raises(ValueError, match="do not show"):
        torsion_gains(DriveTrain(), PERIOD, 1)


def test_a_held_reference_needs_readings_half_a_sample_late(batch: fmus.Batch) -> None:
    """Without noise and without a fault: what is left in the residual of a step of the torque is the rule's."""
    readings = steady(0.0, 14.0)
    kept = np.exp(-PERIOD / 0.02)
    reference = readings["torque_reference"]
    reference[1250:] += 5e3
    for k in range(1, len(reference)):
        readings["torque"][k] = kept * readings["torque"][k - 1] + (1.0 - kept) * reference[k - 1]
    readings["torque_reference"] = np.concatenate([reference[:1], reference[:-1]])  # that held up to the sample
    centrings = [WindTurbineDiagnosis().start_parameters(preset)[CENTRING] for preset in ("repaired", "as_published")]
    late, printed = (diagnosed(batch, [readings], ["torque_residual"], centring=c)[0].max() for c in centrings)
    # Of the step of 5000 N.m, squared and filtered, 5 % and 0.2 % are left, in the sum of three samples.
    assert late < 0.05 * printed


def test_the_slow_mode_is_that_of_the_drive_train() -> None:
    p = WindTurbineDiagnosis().unpack_parameters(WindTurbineDiagnosis().start_parameters())
    rng = np.random.default_rng(2)
    driving, braking = 3e6 * (1.0 + 0.1 * rng.normal(size=BLOCKS)), 2.6e4 * (1.0 + 0.1 * rng.normal(size=BLOCKS))
    for efficiency in (0.25, 0.97):
        A, B = sampled(*matrices(efficiency), 10.0)
        x = np.array([1.6, 1.6 * 95.0, 1e-3])
        for u in zip(driving, braking, strict=True):
            x = A @ x + B @ np.array(u)
        # The shaft still swings after the last block, by its torsion of 1e-3 rad times 15 to 28 rad/s, times Ng.
        found = _simulated_speed(np.array([efficiency]), 1.6 * 95.0, driving, braking, 10.0, p)
        assert found == pytest.approx(x[1], abs=1e-4 * 28.0 * 95.0)


def test_a_lost_efficiency_is_found_within_its_window(batch: fmus.Batch) -> None:
    """Acceptance (i): 0.25 within 0.01 after 300 s, from readings of the whole drive train at 1 s, without noise."""
    period, switch, count = 1.0, 500, 900
    t = period * np.arange(count)
    wind = 11.0 + 1.5 * np.sin(0.02 * t)
    x = np.array([1.5, 142.5, 1e-3])
    rows = []
    for k in range(count):
        # The torque of the generator falls with the efficiency, as a controller would have it.
        driving, braking = Rotor().torque(wind[k], x[0], [0.0] * 3), 1.2171 * x[1] ** 2 * (1.0 if k < switch else 0.25)
        rows.append([wind[k] + 1.5, x[0], x[1], braking])
        A, B = sampled(*matrices(0.97 if k < switch else 0.25), period)
        x = A @ x + B @ np.array([driving, braking])
    wind_read, rotor, generator, braking_read = np.array(rows).T
    zero = np.zeros(count)
    readings = {"wind_speed": wind_read, "torque": braking_read, "torque_reference": braking_read}
    readings |= {"pitch_reference": zero, **{f"pitch[{i + 1}]": zero for i in range(6)}}
    readings |= {f"rotor_speed[{i}]": rotor for i in (1, 2)} | {f"generator_speed[{i}]": generator for i in (1, 2)}
    gains = dict(
        zip(
            ("rotor_speed", "generator_speed", "rotor_torque", "generator_torque"),
            torsion_gains(DriveTrain(), period),
            strict=True,
        )
    )
    values = {f"{name}_gain[{i + 1}]": float(value) for name, row in gains.items() for i, value in enumerate(row)}
    results = ["efficiency_estimate", "efficiency_fault", "efficiency_crossings", "efficiency_unknown"]
    found = diagnosed(batch, [readings], results, period, **values)[0]
    np.testing.assert_array_equal(found[[299, -1], 3], [1.0, 0.0])  # the window is full after 310 s
    assert found[switch - 1, 0] == pytest.approx(0.97, abs=0.01)
    assert not found[:switch, 1].any()
    assert found[switch + 330 :, 0] == pytest.approx(0.25, abs=0.01)
    assert found[-1, 1] == 1.0
    assert found[-1, 2] == 1.0


@pytest.mark.parametrize(
    ("name", "value", "text"),
    [
        ("torque_limit", 0.0, "torque_limit must be above zero"),
        ("grid_highest", 0.5, "grid_highest must be above grid_lowest"),
        ("most_efficiency", 0.01, "most_efficiency must be above least_efficiency"),
        ("sample_period", 0.02, "sample_period must be 0.01 s"),
    ],
)
def test_settings_that_mean_nothing_are_refused(batch: fmus.Batch, name: str, value: float, text: str) -> None:
    batch.reset()
    batch.set(name, value)
    batch.start()
    batch.run([PERIOD])
    assert text in batch.failures[0]


def test_an_efficiency_that_is_not_known_is_warned_of(batch: fmus.Batch) -> None:
    """Sensors read half as often, wind believed too weak, a grid above the efficiency, a window not yet full."""
    results = [warning.name for warning in WARNINGS]
    halved = {name: np.repeat(values[::2], 2) for name, values in steady(1.0, 2.0).items()}
    assert diagnosed(batch, [halved], results)[0, -1].tolist() == [1.0, 0.0, 0.0, 1.0]
    assert diagnosed(batch, [steady(1.0, 2.0)], results)[0, -1].tolist() == [1.0, 0.0, 0.0, 0.0]
    still, fast = steady(0.0, 25.0), {"update_period": 0.5, "smoothing": 0.0}
    assert diagnosed(batch, [still], results, wind_bias=3.0, **fast)[0, -1, :3].tolist() == [0.0, 0.0, 1.0]
    above = diagnosed(batch, [still], results, grid_lowest=1.2, least_efficiency=1.05, most_efficiency=1.09, **fast)
    assert above[0, -1, :3].tolist() == [0.0, 1.0, 0.0]
