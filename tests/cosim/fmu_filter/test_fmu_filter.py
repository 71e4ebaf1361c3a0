"""Filters over sealed FMUs against filters over our own equations, and what they do with late and missing values."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from test_fmus.build import linear_fmu

import cosim
import fmus
from cosim.components.loading import describe_fmu
from cosim.errors import ScenarioError
from cosim.fmu_filter import component
from cosim.fmu_filter.component import FmuFilterModel, _legal_names
from cosim.fmu_filter.settings import FilterTable
from cosim.fmu_filter.stated_deviations import taken_as
from cosim.fmu_model.sealed import FmuModelError
from fmu_observer.formulas.filtering import kalman, unscented
from fmu_observer.formulas.filtering.square_root import factor
from plant_models import PLANTS
from plant_models.hybrid import Runtime

H, STEPS = 0.02, 25
NOISE = 0.05  # [m/s]
START = {"train_speed": 11.0, "wheel_rate": 11.0 / 0.575, "effort": 5e4}
TABLE = {
    "measurements": {"wheel_speed": NOISE},
    "process_noise": {"train_position": 0.01, "train_speed": 0.05, "wheel_rate": 0.1},
    "start_deviation": {"train_position": 1.0, "train_speed": 0.5, "wheel_rate": 0.8},
}
Q = H * np.diag([0.01, 0.05, 0.1]) ** 2
P0 = np.diag([1.0, 0.5, 0.8]) ** 2


@pytest.fixture(scope="module")
def path() -> Path:
    return fmus.cached_fmu(PLANTS["locomotive"](), fmi_version=3)


@pytest.fixture(scope="module")
def readings() -> np.ndarray:
    rng = np.random.default_rng(5)
    return 12.0 + 0.011 * np.arange(1, STEPS + 1) + NOISE * rng.standard_normal(STEPS)


class OwnEquations:
    """The locomotive in Python, started from any state."""

    def __init__(self) -> None:
        self.runtime = Runtime(PLANTS["locomotive"]())
        self.runtime.u[0] = START["effort"]

    def moved(self, t: float, x: np.ndarray) -> np.ndarray:
        self.runtime.x[:3] = x
        self.runtime.start(t)
        self.runtime.advance(t + H)
        return np.array(self.runtime.x[:3])


def own_filter(kind: str, readings: np.ndarray) -> np.ndarray:
    """Estimates and deviations of a filter over our own equations, by the formulas of the package."""
    own, x, P = OwnEquations(), np.array([0.0, START["train_speed"], START["wheel_rate"]]), P0
    C, R, w, rows = np.array([[0.0, 0.0, 0.575]]), np.array([[NOISE**2]]), unscented.weights(3, 1.0), []
    for k, y in enumerate(readings):
        if kind == "ukf":
            found = unscented.scattered(
                lambda at, k=k: own.moved(k * H, at), unscented.sigma_points(x, factor(P), w.spread)
            )
            x, P = unscented.mean(found, w), unscented.covariance(found, found, w) + Q
        else:
            steps = 1e-4 * np.sqrt(np.diagonal(P))
            F = np.array(
                [
                    (own.moved(k * H, x + d) - own.moved(k * H, x - d)) / (2 * s)
                    for s, d in zip(steps, np.diag(steps), strict=True)
                ]
            ).T
            x, P = own.moved(k * H, x), F @ P @ F.T + Q
        x, P, *_ = kalman.correct(x, P, np.array([y]) - C @ x, C, R)
        rows.append([*x, *np.sqrt(np.diagonal(P))])
    return np.array(rows)


def made(path: Path, kind: str, **more: Any) -> FmuFilterModel:
    return FmuFilterModel(path, FilterTable.model_validate({"kind": kind} | TABLE | more), START)


def driven(filter_: FmuFilterModel, readings: np.ndarray) -> np.ndarray:
    names = ("train_position", "train_speed", "wheel_rate")
    rows = []
    for k, y in enumerate(readings):
        out = filter_.step(k * H, {"effort": START["effort"], "measured_wheel_speed": float(y)}, H)
        rows.append([*(out[n] for n in names), *(out[f"{n}_std"] for n in names)])
    return np.array(rows)


@pytest.mark.parametrize("kind", ["ekf", "ukf"])
def test_filter_over_fmu_is_filter_over_own_equations(path: Path, readings: np.ndarray, kind: str) -> None:
    found = driven(made(path, kind), readings)
    np.testing.assert_allclose(found, own_filter(kind, readings), rtol=1e-6, atol=1e-6)  # as demanded


def test_directional_derivatives_give_an_equal_filter(path: Path, readings: np.ndarray) -> None:
    one = driven(made(path, "ekf", interface="model-exchange"), readings[:4])
    # two integrators of one equation: the Rosenbrock step of 5e-4 s is off by its second order
    np.testing.assert_allclose(one, driven(made(path, "ekf"), readings[:4]), rtol=2e-5, atol=2e-5)


def test_missing_value_is_left_out(path: Path, readings: np.ndarray) -> None:
    gaps = readings.copy()
    gaps[3] = np.nan
    found, whole = driven(made(path, "ukf"), gaps[:6]), driven(made(path, "ukf"), readings[:6])
    np.testing.assert_array_equal(found[:3], whole[:3])
    assert found[3, 4] > whole[3, 4]


def test_late_telegram_is_put_where_it_belongs(path: Path, readings: np.ndarray) -> None:
    at = 2.5 * H
    late, timely = made(path, "ukf", balise="position"), made(path, "ukf", balise="position")

    def inputs(k: int) -> dict[str, float]:
        return {"effort": START["effort"], "measured_wheel_speed": float(readings[k])}

    for k in range(5):
        if k == 2:  # the step in two parts, as the master makes it; the first ends with a missing sample
            timely.step(2 * H, inputs(2) | {"measured_wheel_speed": np.nan}, at - 2 * H)
            timely.balise(at, 0.55)
            expected = timely.step(at, inputs(2), 3 * H - at)
        else:
            expected = timely.step(k * H, inputs(k), H)
        late.step(k * H, inputs(k), H)
    found = late.balise(at, 0.55)
    assert isinstance(found, dict)
    for name, value in expected.items():
        if not name.startswith(("nis", "missed")):
            assert found[name] == pytest.approx(value, rel=1e-12, abs=1e-12)
    assert late.balise(-20.0, 0.0) is False


def test_restored_state_goes_on_identically(path: Path, readings: np.ndarray) -> None:
    filter_ = made(path, "ekf")
    driven(filter_, readings[:3])
    state = filter_.get_state()
    inputs = {"effort": START["effort"], "measured_wheel_speed": 12.0}
    first = filter_.step(3 * H, inputs, H)
    filter_.step(4 * H, inputs, H)
    filter_.set_state(state)
    assert filter_.step(3 * H, inputs, H) == first


SCENARIO = """
stop = 6.0
step = 0.1
connections = ["plant.wheel_speed -> filter.measured_wheel_speed"]
[components.plant]
model = "locomotive"
parameters = {{ train_speed = 12.0, wheel_rate = 20.869565217391305, effort = 50e3 }}
[components.filter]
fmu = {path!r}
parameters = {{ train_speed = 10.0, wheel_rate = 17.391304347826086, effort = 50e3 }}
[components.filter.filter]
kind = "ekf"
measurements = {{ wheel_speed = 0.05 }}
process_noise = {{ train_speed = 0.05, train_position = 0.01, wheel_rate = 0.1 }}
start_deviation = {{ train_position = 5.0, train_speed = 2.0, wheel_rate = 3.0 }}
balise = "position"
sample_period = 0.2
[balises]
position = "plant.position"
speed = "plant.speed"
layout = "positions"
positions = [10.0, 30.0]
latency = 0.23
"""


def test_in_a_scenario(path: Path, tmp_path: Path) -> None:
    file = tmp_path / "filtered.toml"
    file.write_text(SCENARIO.format(path=str(path)))
    scenario = cosim.Scenario.load(file)
    outcome = scenario.run()
    assert outcome.failure is None
    assert [e.outcomes["filter"] for e in outcome.result.events] == ["accepted", "accepted"]
    error = abs(outcome["filter.speed"] - outcome["plant.speed"])
    assert error[0] == 2.0
    assert error[-1] < 1e-3  # the readings are exact, the model is the plant
    assert outcome["filter.train_position_std"][-1] < outcome["filter.train_position_std"][1]
    assert any(part.name == "filter" for part in scenario.structure().parts)
    assert outcome.spec.observers == ["filter"]
    assert [entry["observer"] for entry in outcome.result.summary["consistency"]] == ["filter"]  # judged as documented
    scenario.save(tmp_path / "saved.toml")
    again = cosim.Scenario.load(tmp_path / "saved.toml").run()
    np.testing.assert_array_equal(again["filter.speed"], outcome["filter.speed"])
    scenario.set("connections", [])
    with pytest.raises(ScenarioError, match="a filter over an FMU is no FMU itself"):
        scenario.export_ssp(tmp_path / "filtered.ssp")


@pytest.mark.parametrize(
    ("more", "reported"),
    [
        ({"measurements": {"wheelspeed": 0.1}}, "did you mean 'wheel_speed'"),
        ({"process_noise": {"speeed": 0.1}}, "no state 'speeed'"),
        ({"states": ["train_speed"]}, "holds more than these states"),
        ({"states": ["rain_speed"]}, "did you mean 'train_speed'"),
    ],
)
def test_mistakes_are_reported(path: Path, more: dict[str, Any], reported: str) -> None:
    with pytest.raises(FmuModelError, match=reported):
        FmuFilterModel(
            path, FilterTable.model_validate({"kind": "ukf", "measurements": {"wheel_speed": 0.1}} | more), START
        )


@pytest.mark.parametrize(
    ("table", "reported"),
    [
        ({"kind": "ukf"}, "needs 'measurements'"),
        ({"kind": "ukf", "measurements": {"speed": 0.0}}, "greater than 0"),
        ({"kind": "kf", "measurements": {"speed": 1.0}}, "'ekf', 'ukf', 'ensemble' or"),
    ],
)
def test_tables_that_cannot_be(table: dict[str, Any], reported: str) -> None:
    with pytest.raises(ValueError, match=reported):
        FilterTable.model_validate(table)


def test_ensemble_comes_near_the_unscented_filter(path: Path, readings: np.ndarray) -> None:
    found = driven(made(path, "ensemble", members=60), readings[:8])
    near = driven(made(path, "ukf"), readings[:8])
    # what 60 members leave to chance: the mean to sigma / sqrt(60), here with five of it to spare
    assert abs(found[-1, 1] - near[-1, 1]) < 5.0 * near[-1, 4] / np.sqrt(60)


def test_particles_of_saved_states_find_start_and_input(path: Path) -> None:
    table = {
        "kind": "particle",
        "measurements": {"wheel_speed": 0.1},
        "input_noise": {"effort": 2e3},
        "start_deviation": {"train_speed": 1.0},
        "outputs": ["speed", "wheel_speed"],
        "members": 60,
    }
    filter_ = FmuFilterModel(path, FilterTable.model_validate(table), START)
    for k in range(6):
        out = filter_.step(k * 0.1, {"effort": START["effort"], "measured_wheel_speed": 12.0 + 0.055 * (k + 1)}, 0.1)
    assert out["speed"] == pytest.approx(12.3, abs=0.15)  # started at 11 +- 1; noise of 0.1 over six readings
    assert 0.0 < out["speed_std"] < 0.15
    state = filter_.get_state()
    inputs = {"effort": START["effort"], "measured_wheel_speed": 12.4}
    first = filter_.step(0.6, inputs, 0.1)
    filter_.set_state(state)
    assert filter_.step(0.6, inputs, 0.1) == first


def test_particles_need_honest_states(tmp_path: Path) -> None:
    path = linear_fmu(tmp_path, "mass", [[0, 1], [0, 0]], [[0], [1]], [[1, 0]], [[0]], inputs=["force"], state=False)
    table = FilterTable.model_validate({"kind": "particle", "measurements": {"y1": 0.1}})
    with pytest.raises(FmuModelError, match="does not declare that its state can be saved and restored"):
        FmuFilterModel(path, table)


def test_particles_serve_an_fmu_that_allows_one_instance_in_a_process(tmp_path: Path) -> None:
    """Nothing else is said against it: what is saved and restored is seen on the instance itself."""
    masses = [[0, 1], [0, 0]], [[0], [1]], [[1, 0]], [[0]]
    path = linear_fmu(tmp_path, "mass", *masses, inputs=["force"], once_per_process=True)
    noises = {"start_deviation": {"x0[1]": 1.0}, "members": 5}
    FmuFilterModel(path, FilterTable.model_validate({"kind": "particle", "measurements": {"y1": 0.1}, **noises}))


def test_particles_need_something_that_moves_them_apart(tmp_path: Path) -> None:
    path = linear_fmu(tmp_path, "mass", [[0, 1], [0, 0]], [[0], [1]], [[1, 0]], [[0]], inputs=["force"])
    table = FilterTable.model_validate({"kind": "particle", "measurements": {"y1": 0.1}})
    with pytest.raises(FmuModelError, match="nothing moves the particles apart"):
        FmuFilterModel(path, table)


def _lorry(folder: Path, units: dict[str, str]) -> Path:
    """Force to position and speed, with a mass of one."""
    states = [[0, 1], [0, 0]], [[0], [1]], [[1, 0], [0, 1]], [[0], [0]]
    return linear_fmu(folder, "lorry", *states, inputs=["force"], outputs=["place", "v"], units=units)


def test_deviations_in_other_units_than_si_are_noted_in_both(tmp_path: Path) -> None:
    _lorry(tmp_path, {"v": "km/h", "force": "kN", "place": "m"})
    scenario = cosim.Scenario(folder=tmp_path, stop=0.2, step=0.1).add("plant", fmu="lorry.fmu")
    noises = {"measurements": {"v": 0.5, "place": 2.0}, "input_noise": {"force": 0.25}}
    scenario.add("f", fmu="lorry.fmu", filter={"kind": "particle", "members": 5, **noises})
    scenario.connect("plant.v -> f.measured_v", "plant.place -> f.measured_place")
    notes = [note for note in scenario.run(warn=lambda _: None).result.summary["notes"] if "deviations" in note]
    assert notes == [
        "f: filter: standard deviations are in the FMU's own units, results in SI; taken as "
        "measurements.v = 0.5 km/h (0.139 m/s), input_noise.force = 0.25 kN (250 N)."
    ]
    fmu = describe_fmu(tmp_path / "lorry.fmu", "f")
    assert taken_as(FilterTable.model_validate({"kind": "ukf", "measurements": {"place": 1.0}}), fmu) == []


def test_a_telegram_in_metres_measures_a_position_in_kilometres(tmp_path: Path) -> None:
    """The same numbers of another unit: the particles of 1 m and of 0.001 km have the same weights."""
    found = []
    for unit, metre in (("m", 1.0), ("km", 1e-3)):
        folder = tmp_path / unit
        folder.mkdir()
        noises = {"start_deviation": {"x0[1]": 2.0 * metre}, "balise": "place", "members": 30}
        table = FilterTable.model_validate({"kind": "particle", "measurements": {"v": 1.0}, **noises})
        filter_ = FmuFilterModel(_lorry(folder, {"place": unit}), table)
        filter_.step(0.0, {"force": 0.0, "measured_v": 0.0}, 0.1)
        out = filter_.balise(0.1, 1.5)
        assert isinstance(out, dict)
        found.append([out["place"] / metre, out["place_std"] / metre, out["nis"]])
    assert 0.0 < found[0][0] < 1.5
    np.testing.assert_allclose(found[0], found[1], rtol=1e-9)
    wrong = FilterTable.model_validate({"kind": "particle", "start_deviation": {"x0[1]": 1.0}, "balise": "v"})
    with pytest.raises(FmuModelError, match=r"balise = 'v': it is in km/h; a telegram measures a position \[m\]"):
        FmuFilterModel(_lorry(tmp_path, {"v": "km/h"}), wrong)


def test_particles_of_model_exchange_find_what_those_of_co_simulation_do() -> None:
    """The same draws, two integrators: the same weights to the error of the steps."""
    path, found = fmus.cached_fmu(PLANTS["pendulum"](), fmi_version=3), []
    for interface in ("co-simulation", "model-exchange"):
        table = {"kind": "particle", "interface": interface, "measurements": {"angle": 0.05}, "members": 20}
        table |= {"start_deviation": {"pendulum_angle": 0.2}}
        filter_ = FmuFilterModel(path, FilterTable.model_validate(table), {"pendulum_angle": 0.3})
        inputs = {signal.name: 0.0 for signal in filter_.inputs}
        for k in range(3):
            out = filter_.step(k * 0.05, inputs | {"measured_angle": 0.4}, 0.05)
        found.append([out["angle"], out["angle_std"]])
    np.testing.assert_allclose(found[0], found[1], rtol=1e-4)


def test_a_step_at_which_states_were_not_read_is(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The default experiment has steps of 10 ms: multiples of it need no second look."""
    read: list[float] = []
    monkeypatch.setattr(component, "check_states", lambda _model, h: read.append(h))
    inputs = {"effort": 5e4, "measured_wheel_speed": 12.0}
    for dt, expected in ((0.02, [0.01]), (0.004, [0.01, 0.004]), (0.015, [0.01, 0.015])):
        read.clear()
        made(path, "ekf").step(0.0, inputs, dt)
        assert read == expected


def test_names_of_an_fmu_become_names_of_signals() -> None:
    names = ["u[1]", "body.v", "der(x)", "body_v", "2nd", "body.v"]
    assert list(_legal_names(names).values()) == ["u_1", "body_v", "der_x", "body_v_2", "_2nd"]


def test_particles_over_an_fmu_without_states_to_write(tmp_path: Path) -> None:
    path = linear_fmu(tmp_path, "mass", [[0, 1], [0, 0]], [[0], [1]], [[1, 0]], [[0]], inputs=["force"])
    table = {"kind": "particle", "measurements": {"y1": 0.1}, "input_noise": {"force": 1.0}, "members": 40}
    filter_ = FmuFilterModel(path, FilterTable.model_validate(table))
    for k in range(10):
        out = filter_.step(0.1 * k, {"force": 1.0, "measured_y1": 0.5 * (0.1 * (k + 1)) ** 2}, 0.1)
    assert out["y1"] == pytest.approx(0.5, abs=0.1)
