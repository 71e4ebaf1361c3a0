"""Signals that can be missing: declared they travel as NaN to whoever leaves them out, undeclared they end the run."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fmpy.validation import validate_fmu

import cosim
import fmus
from cosim.errors import CosimError, CouplingError
from cosim.results.results_folder import write_results
from fmu_observer.annotated_variable import can_be_missing
from fmu_observer.observers.generic.discrete.extended_kalman_filter import KalmanFilter
from fmus import cached_fmu
from fmus.check.run import check_fmu
from fmus.fmi.description import read_description
from plant_models.hybrid import HybridSystem, Runtime, Signal, output_signal, state
from plant_models.hybrid.missing import MISSED_SAMPLES

TIMES = np.arange(0, 31) / 10.0
GONE = np.isin(np.arange(31), (4, 5, 11, 12, 13, 14, 15, 22))


class Gauge(HybridSystem):
    """An angle that decays, and is not read where a sine is high."""

    name = "gauge"
    description = "Gauge with gaps"
    source = "test"
    internal_step = 0.01
    states = (state("x", "rad", 1.0, "Angle"),)
    outputs: tuple[Signal, ...] = (output_signal("angle", "rad", "Reading", can_be_missing=True),)

    def flow(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"x": -0.5 * x.x}

    def output(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"angle": np.where(np.sin(7.0 * t) > 0.5, np.nan, x.x)}


class Undeclared(Gauge):
    """The same, without a word of it."""

    outputs = (output_signal("angle", "rad", "Reading"),)


class Sensor:
    """Plain Python that gives NaN for one second."""

    outputs = ["y"]  # noqa: RUF012
    y = 1.0

    def step(self, t: float, inputs: Any, dt: float) -> None:
        self.y = np.nan if 1.0 < t + dt < 2.0 else 1.0


def filtered(backend: str = "block3", gauge: type[HybridSystem] = Gauge, **master: Any) -> cosim.Scenario:
    scenario = cosim.Scenario(stop=3.0, step=0.1, certificates="ignore")
    scenario.add("gauge", model=gauge, **{"as": backend})
    scenario.add("filter", observer="kalman_filter", **{"as": backend})
    scenario.connect("gauge.angle -> filter.measured_angle")
    if master:
        scenario.master(**master)
    return scenario


def missed(outcome: Any, name: str = "filter") -> int:
    return int(next(c for c in outcome.result.summary["components"] if c["name"] == name)["events"]["missed_samples"])


@pytest.mark.parametrize(
    ("backend", "stepper"),
    [(backend, "python") for backend in ("block3", "block2", "fmu3", "fmu2")]
    + [("fmu3", "compiled"), ("fmu2", "compiled")],
)
def test_equal_numbers_come_from_blocks_and_fmus_by_both_steppers(backend: str, stepper: str) -> None:
    reference = filtered(stepper="python").run(warn=lambda _: None)
    outcome = filtered(backend, stepper=stepper).run(warn=lambda _: None)
    assert outcome.failure is None
    assert outcome.result.summary["master"]["stepper"]["name"] == stepper
    for name in ("gauge.angle", "filter.angle", "filter.nis"):
        np.testing.assert_allclose(outcome[name], reference[name], rtol=1e-12, atol=1e-15)
    assert (count := missed(outcome)) == np.isnan(outcome["gauge.angle"]).sum() > 5
    assert f"filter: {count} measurements were missing at its samples, and left out." in outcome.result.summary["notes"]
    assert np.isfinite(outcome["filter.angle"]).all()


@pytest.mark.parametrize("version", [2, 3])
def test_the_mark_stands_in_the_description_of_an_fmu(version: Any) -> None:
    """A valid file says of the output that it can be missing, and of the filter's input that it leaves that out."""
    for system, marked in ((Gauge(), ["angle"]), (KalmanFilter(), ["measured_angle"])):
        file = cached_fmu(system, version)
        assert not validate_fmu(str(file))
        assert [v.name for v in read_description(file).modelVariables if can_be_missing(v)] == marked


@pytest.mark.parametrize(
    "master",
    [{"control": "doubling"}, {"inputs": "interpolate"}, {"inputs": "extrapolate"}, {"algorithm": "iterate"}],
    ids=lambda master: " ".join(master.values()),
)
def test_it_is_held_whatever_follows_lines_and_errors(master: dict[str, Any]) -> None:
    """No line leads to NaN, and no error is measured by it: the numbers are those of held inputs and fixed steps."""
    reference, outcome = (filtered(**table).run(warn=lambda _: None) for table in ({}, master))
    assert outcome.failure is None
    assert missed(outcome) == missed(reference)
    # step doubling moves the plant in halves of a communication step, which are multiples of its internal step
    np.testing.assert_allclose(outcome["filter.angle"], reference["filter.angle"], rtol=1e-12)


@pytest.mark.compiler
@pytest.mark.parametrize("version", [2, 3])
def test_the_check_of_an_fmu_takes_nan_for_a_value_where_it_is_declared(version: Any) -> None:
    """Honest: a gauge with gaps. The same FMU without the declaration is found out."""
    honest = check_fmu(cached_fmu(Gauge(), version))
    assert not [f for f in honest.findings if "not finite" in f.detail]
    silent = check_fmu(cached_fmu(Undeclared(), version))
    assert [f for f in silent.findings if "not finite" in f.detail and "angle" in f.detail]


@pytest.mark.compiler
def test_members_of_a_batch_leave_it_out_one_by_one() -> None:
    """The member whose measurement is missing predicts; the others are as ever, and nobody stops."""
    batch = fmus.Batch(KalmanFilter(), members=3)
    batch.start()
    values = np.tile([[0.2], [np.nan], [-0.1]], (1, 4))
    values[1, 0] = 0.2
    batch.run([0.1, 0.2, 0.3], ["angle"], {"measured_angle": values})
    assert not batch.failures
    assert batch.get(MISSED_SAMPLES).tolist() == [0.0, 2.0, 0.0]  # inputs are held over the step that they begin
    alone = Runtime(KalmanFilter())
    alone.start(0.0)
    for value, until in ((0.2, 0.1), (np.nan, 0.3)):
        alone.u[1] = value
        alone.advance(until)
    place = [s.name for s in alone.system.outputs].index("angle")
    assert batch.get("angle")[1] == pytest.approx(float(alone.update_outputs()[place]), rel=1e-12)


def test_what_is_not_declared_ends_the_run_and_says_how_to_declare_it() -> None:
    scenario = filtered(gauge=Undeclared)
    outcome = scenario.run(warn=lambda _: None)
    assert outcome.failure is not None
    assert "can_be_missing = ['angle'] in [components.gauge]" in outcome.failure
    declared = filtered(gauge=Undeclared).set("gauge.can_be_missing", ["angle"])
    outcome = declared.run(warn=lambda _: None)
    assert outcome.failure is None
    assert missed(outcome) > 5


def test_plain_python_declares_it_in_the_scenario() -> None:
    for declared in (False, True):
        scenario = cosim.Scenario(stop=3.0, step=0.1)
        scenario.add("sensor", model=Sensor, **({"can_be_missing": ["y"]} if declared else {}))
        outcome = scenario.run(warn=lambda _: None)
        assert (outcome.failure is None) == declared
    assert np.isnan(outcome["sensor.y"]).sum() == 9


def test_a_target_that_cannot_leave_it_out_is_refused_before_the_run() -> None:
    scenario = cosim.Scenario(stop=3.0, step=0.1)
    scenario.add("gauge", model=Gauge)
    scenario.add("observer", observer="luenberger")
    with pytest.raises(
        CouplingError, match=r"gauge\.angle can be missing .* observer\.measured_angle does not leave out"
    ):
        scenario.connect("gauge.angle -> observer.measured_angle")


@pytest.mark.parametrize("key", ["position", "odometer"])
def test_balises_are_found_and_delivered_by_what_is_always_there(key: str) -> None:
    scenario = cosim.Scenario(stop=1.0, step=0.1)
    scenario.add(
        "train", model="longitudinal_train", can_be_missing=["position" if key == "position" else "acceleration"]
    )
    scenario.add("observer", observer="takagi_sugeno_cdo", parameters={"odometer": 0.0})
    sources = {"position": "train.position", "speed": "train.speed", "odometer": "train.acceleration"}
    scenario.balises(layout="spacing", spacing=10.0, track_end=100.0, **sources)
    with pytest.raises(CosimError, match=rf"balises\.{key}: train\.\w+ can be missing"):
        scenario.run(warn=lambda _: None)


@pytest.mark.parametrize(
    ("names", "said"), [(["angel"], "no variable 'angel'"), (["gate_count"], "no variable")], ids=["unknown", "none"]
)
def test_only_what_exists_can_be_missing(names: list[str], said: str) -> None:
    scenario = cosim.Scenario(stop=1.0, step=0.1)
    with pytest.raises(CosimError, match=said):
        scenario.add("gauge", model=Gauge, can_be_missing=names)


@pytest.fixture
def recorded(tmp_path: Path) -> Path:
    """A logger's table with empty cells."""
    path = tmp_path / "log.csv"
    rows = (f"{t:.1f},{'' if gone else f'{np.exp(-t):.9f}'},{t:.1f}" for t, gone in zip(TIMES, GONE, strict=True))
    path.write_text("time,angle,way\n" + "\n".join(rows) + "\n")
    return path


def played(path: Path, **more: Any) -> cosim.Scenario:
    scenario = cosim.Scenario(stop=3.0, step=0.1, certificates="ignore")
    scenario.add("log", recording=str(path), **more)
    scenario.add("filter", observer="kalman_filter")
    scenario.connect("log.angle -> filter.measured_angle")
    return scenario


@pytest.mark.parametrize("interpolation", ["linear", "hold"])
def test_a_column_with_gaps_is_played_back_with_its_gaps(recorded: Path, interpolation: str) -> None:
    outcome = played(recorded, interpolation=interpolation, can_be_missing=["angle"]).run(warn=lambda _: None)
    np.testing.assert_array_equal(np.isnan(outcome["log.angle"]), GONE)
    assert missed(outcome) == GONE.sum()
    assert np.isfinite(outcome["filter.angle"]).all()


def test_a_column_with_gaps_that_is_not_declared_is_refused_with_the_way_out(recorded: Path) -> None:
    with pytest.raises(CosimError, match="can_be_missing"):
        played(recorded).run(warn=lambda _: None)


def test_results_keep_it_and_a_replay_knows_it(recorded: Path, tmp_path: Path) -> None:
    """Rows of the folder hold NaN, a comparison takes NaN for NaN, and a replay needs no declaration again."""
    outcome = played(recorded, can_be_missing=["angle"]).run(warn=lambda _: None)
    folder = tmp_path / "results"
    write_results(outcome.result, folder)
    loaded = cosim.load_result(folder)
    np.testing.assert_array_equal(loaded["log.angle"], outcome["log.angle"])
    again = cosim.Scenario(stop=3.0, step=0.1, certificates="ignore")
    again.add("log", recording=str(folder))
    again.add("filter", observer="kalman_filter")
    again.connect("log.angle -> filter.measured_angle")
    replayed = again.run(warn=lambda _: None)
    np.testing.assert_array_equal(replayed["filter.angle"], outcome["filter.angle"])
    assert cosim.compare(loaded, outcome.result).equal


@pytest.mark.parametrize("ending", ["csv", "npy", "mat", "parquet", "h5"])
def test_every_format_keeps_the_gaps(recorded: Path, tmp_path: Path, ending: str) -> None:
    outcome = played(recorded, can_be_missing=["angle"]).run(warn=lambda _: None)
    cosim.save_result(outcome.result, tmp_path / f"run.{ending}")
    found = cosim.load_result(tmp_path / f"run.{ending}")
    np.testing.assert_array_equal(np.isnan(found["log.angle"]), GONE)


@pytest.mark.parametrize("arrival", ["event", "held"])
def test_a_packet_may_carry_nothing(arrival: str) -> None:
    """The one measurement of a packet is missing: its event changes nothing, an input that holds it is missing too."""
    scenario = cosim.Scenario(stop=3.0, step=0.1, certificates="ignore")
    scenario.add("gauge", model=Gauge)
    options = {"arrival": "packet"} if arrival == "event" else {}
    scenario.add("filter", observer="kalman_filter", options=options)
    scenario.network(nodes={"gauge": ["gauge.angle"]}, period=0.1)
    scenario.connect("gauge.angle -> filter." + ("packet_angle" if arrival == "event" else "measured_angle"))
    outcome = scenario.run(warn=lambda _: None)
    assert outcome.failure is None
    empty = sum(np.isnan(packet.values["gauge.angle"]) for packet in outcome.result.packets)
    assert empty > 5
    assert abs(missed(outcome) - empty) <= 1  # the last packet comes with the end
    assert np.isfinite(outcome["filter.angle"]).all()
