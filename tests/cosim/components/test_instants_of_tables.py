"""The law of instants: a run that is fed by a record of a run is that run. Whatever part is replaced, by every
algorithm: equal bits from a results folder, and from a table where all is held; second order where it is continuous.
"""

from __future__ import annotations

import tempfile
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fmpy import simulate_fmu
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp
from test_fmus.events import integrator_fmu

from cosim import Scenario
from cosim.baselines.recipe import Recipe
from cosim.baselines.subject import make_subject
from cosim.calibration.fitting import calibrate
from cosim.calibration.fmu_runs import FmuRuns
from cosim.calibration.recorded_signals import Selection, sort_columns
from cosim.cli import PROGRAM, calibrate_command
from cosim.errors import CosimError
from cosim.results.load_result import load_result
from cosim.run.outcome import Outcome
from cosim.structure.structure_text import when
from fmus import cached_fmu
from plant_models import PLANTS
from plant_models.hybrid import HybridSystem, PeriodicEvent, Runtime
from plant_models.hybrid.signal import input_signal, memory, output_signal, parameter, scalar_names, state

ALGORITHMS = ["gauss-seidel", "jacobi", "iterate"]


class TwoInputs(HybridSystem):
    """Two inputs in, two outputs out."""

    source = "a test"
    inputs = (input_signal("a", "1"), input_signal("b", "1"))
    outputs = (output_signal("y", "1"), output_signal("z", "1"))


class Lag(TwoInputs):
    """``dx/dt = rate * (a - x) + b``: an input that acts over the step, one that also passes through at once."""

    name = "lag"
    description = "A lag"
    states = (state("x", "1"),)
    parameters = (parameter("rate", "1/s", 0.7),)

    def flow(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"x": p.rate * (u.a - x.x) + u.b}

    def output(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"y": x.x, "z": 0.3 * u.b + x.x}


class Sampler(TwoInputs):
    """Keeps a sample of its inputs."""

    name = "sampler"
    description = "A sampler"
    states = (memory("kept", "1"),)
    outputs = tuple(replace(s, variability="discrete") for s in TwoInputs.outputs)
    parameters = (parameter("period", "s", 0.2), parameter("offset", "s", 0.0))
    events = (PeriodicEvent("sample", "period", "offset"),)

    def jump(self, event: str, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"kept": 0.4 * u.a - 0.3 * u.b + 0.2}

    def output(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"y": x.kept, "z": -x.kept}


STEP, STOP = 0.1, 1.2
BLOCK: dict[str, Any] = {"as": "block3"}
KINDS = {"lag": Lag, "sampler": Sampler}
Wiring = list[tuple[str, int, int, int, int]]


@st.composite
def wirings(draw: st.DrawFn) -> Wiring:
    """Of each component its kind, and of each of its two inputs the source and which of its outputs."""
    count = draw(st.integers(2, 4))
    one = st.tuples(st.sampled_from(sorted(KINDS)), *(st.integers(0, count - 1), st.integers(0, 1)) * 2)
    return draw(st.lists(one, min_size=count, max_size=count))


def links(wiring: Wiring) -> list[str]:
    """The connections; nothing passes through two components at once, so that every algorithm takes them."""
    found = []
    for i, (_, a, out, b, other) in enumerate(wiring):
        found.append(f"c{a}.{'yz'[out if wiring[a][0] == 'sampler' else 0]} -> c{i}.a")
        found.append(f"c{b}.{'yz'[other if wiring[b][0] == 'sampler' else 0]} -> c{i}.b")
    return found


def add(scenario: Scenario, i: int, kind: str, offset: float) -> None:
    scenario.add(f"c{i}", model=KINDS[kind], parameters={"offset": offset} if kind == "sampler" else {}, **BLOCK)


def whole(wiring: Wiring, algorithm: str, offset: float = 0.0) -> Scenario:
    scenario = Scenario(stop=STOP, step=STEP, master={"algorithm": algorithm})
    for i, (kind, *_) in enumerate(wiring):
        add(scenario, i, kind, offset)
    return scenario.connect(*links(wiring))


def played(wiring: Wiring, algorithm: str, parts: set[int], path: Path, offset: float = 0.0, **more: Any) -> Scenario:
    """The same with a record in the place of some components; a table has all columns under their full names."""
    scenario = Scenario(stop=STOP, step=STEP, master={"algorithm": algorithm})
    for i, (kind, *_) in enumerate(wiring):
        if i in parts:
            scenario.add(f"c{i}", recording=str(path), **more)
        else:
            add(scenario, i, kind, offset)
    return scenario.connect(*[link for link in links(wiring) if int(link.partition("-> c")[2][0]) not in parts])


def quietly(scenario: Scenario) -> Outcome:
    outcome = scenario.run(warn=lambda _: None)
    assert outcome.failure is None
    return outcome


def different(first: Outcome, second: Outcome) -> list[str]:
    return [n for n in second.result.table.dtype.names or () if first[n].tobytes() != second[n].tobytes()]


@settings(max_examples=20)
@given(wirings(), st.sampled_from(ALGORITHMS), st.sets(st.integers(0, 3), min_size=1))
def test_a_results_folder_in_the_place_of_any_part_gives_equal_bits(
    wiring: Wiring, algorithm: str, parts: set[int]
) -> None:
    """Values that were iterated agree within the tolerance of the iteration, 1e-9, times the few steps here."""
    parts = {part % len(wiring) for part in parts}
    if algorithm == "iterate":  # a loop through a sample has no solution that iteration finds
        wiring = [("lag", *ends) for _, *ends in wiring]
    first = quietly(whole(wiring, algorithm))
    with tempfile.TemporaryDirectory() as folder:
        Outcome(first.result, first.spec, ("npy",)).write(Path(folder) / "run", report=False)
        second = quietly(played(wiring, algorithm, parts, Path(folder) / "run"))
    if algorithm == "iterate":
        for name in second.result.table.dtype.names or ():
            np.testing.assert_allclose(second[name], first[name], rtol=1e-7, atol=1e-7)
    else:
        assert different(first, second) == []


def log(path: Path, outcome: Outcome) -> Path:
    """The run as a logger would have it: names and numbers, nothing of which instants were which."""
    names = outcome.result.table.dtype.names or ()
    rows = zip(
        *(outcome[name].tolist() if name != "time" else outcome.result.time.tolist() for name in names), strict=True
    )
    path.write_text("\n".join([",".join(names), *(",".join(map(repr, row)) for row in rows)]) + "\n", encoding="utf-8")
    return path


@settings(max_examples=20)
@given(wirings(), st.sampled_from(ALGORITHMS[:2]), st.sets(st.integers(0, 3), min_size=1))
def test_a_table_of_held_columns_in_the_place_of_any_part_gives_equal_bits(
    wiring: Wiring, algorithm: str, parts: set[int]
) -> None:
    """Where all that the others took of the part was held; nothing jumps at the start, as no row shows that.

    With fewer loops Gauss-Seidel may hold other signals between the others; a table cannot say what was held there.
    """
    parts = {part % len(wiring) for part in parts}
    first = quietly(whole(wiring, algorithm, 0.1))
    held = set(first.result.summary["master"]["algorithm"]["held"])
    out = [k for k in links(wiring) if int(k[1]) in parts and int(k.partition("-> c")[2][0]) not in parts]
    out_held = set(out) <= held
    with tempfile.TemporaryDirectory() as folder:
        table = log(Path(folder) / "log.csv", first)
        second = quietly(played(wiring, algorithm, parts, table, 0.1, interpolation="hold"))
    inside = {f"c{i}." for i in range(len(wiring))} - {f"c{i}." for i in parts}
    found = [name for name in different(first, second) if name[:3] in inside]
    kept = set(links(wiring)) - {k for k in links(wiring) if int(k[1]) in parts}
    if out_held and held & kept == set(second.result.summary["master"]["algorithm"]["held"]) & kept:
        assert found == []


# -- continuous columns
# ----------------------------------------------------------------------------------------------------------------

RATE = 0.7


def wave(t: Any, phase: float) -> Any:
    return np.sin(2.0 * t + phase) + 0.5 * t


def driven(folder: Path, step: float, algorithm: str, phase: float, cut: float, **lag: Any) -> Outcome:
    """A lag driven by a continuous column; another table jumps at `cut`, where steps are divided."""
    t = step * np.arange(round(STOP / step) + 1)
    rows = "".join(f"{a!r},{b!r}\n" for a, b in zip(t.tolist(), wave(t, phase).tolist(), strict=True))
    (folder / "wave.csv").write_text("time,u\n" + rows, encoding="utf-8")
    (folder / "jump.csv").write_text(f"time,v\n0,0\n{cut!r},0\n{cut!r},1\n{STOP},1\n", encoding="utf-8")
    scenario = Scenario(folder=folder, stop=STOP, step=step, master={"algorithm": algorithm} | lag.pop("master", {}))
    scenario.add("wave", recording="wave.csv").add("jump", recording="jump.csv", interpolation="hold")
    scenario.add("lag", model=Lag, **{"as": "block3"} | lag).add("other", model=Lag, **{"as": "block3"})
    return quietly(scenario.connect("wave.u -> lag.a, lag.b", "jump.v -> other.a"))


def exact(t: np.ndarray, phase: float) -> np.ndarray:
    """By an integrator that is not the package's."""
    found = solve_ivp(
        lambda s, x: RATE * (wave(s, phase) - x) + wave(s, phase), (0.0, STOP), [0.0], t_eval=t, rtol=1e-10, atol=1e-12
    )
    return np.asarray(found.y[0])


@settings(max_examples=10)
@given(
    st.sampled_from(ALGORITHMS),
    st.floats(0.0, 6.0),
    st.floats(0.15, 1.1),
    st.sampled_from([{}, {"as": "block2"}, {"substeps": 2}, {"master": {"inputs": "extrapolate"}}]),
)
def test_continuous_columns_are_of_second_order_where_events_cut_steps(
    algorithm: str, phase: float, cut: float, more: dict[str, Any]
) -> None:
    """|u''| is 4 at most: a line between rows errs by h^2 / 2, the state in 1.2 s by (rate + 1) times that, 1.2 h^2."""
    with tempfile.TemporaryDirectory() as folder:
        for step in (0.1, 0.05):
            outcome = driven(Path(folder), step, algorithm, phase, cut, **dict(more))
            t = outcome.result.time
            states = exact(np.clip(np.unique(t), 0.0, STOP), phase)[np.searchsorted(np.unique(t), t)]
            assert np.abs(outcome["lag.y"] - states).max() < 1.2 * step**2
            through = outcome["lag.z"] - 0.3 * wave(t, phase)
            assert np.abs(through - states).max() < 2.0 * step**2  # and an output that an input passes to at once


# -- the numbers of a command, against another tool
# ----------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("algorithm", ALGORITHMS)
@pytest.mark.parametrize("stepper", ["python", "auto"])
def test_a_command_acts_from_its_row_on(tmp_path: Path, algorithm: str, stepper: str) -> None:
    """0, then 10 from 1 s: an integral is 0 at 1 s and 30 at 4 s; fmpy, which sets inputs as a step starts, agrees."""
    fmu, t = cached_fmu(PLANTS["odometer"](), fmi_version=2), 0.5 * np.arange(9)
    command = np.where(t >= 1.0, 10.0, 0.0)
    rows = "".join(f"{a},{b}\n" for a, b in zip(t, command, strict=True))
    (tmp_path / "log.csv").write_text("time,wheel_speed\n" + rows, encoding="utf-8")
    scenario = Scenario(folder=tmp_path, stop=4.0, step=0.5, master={"algorithm": algorithm, "stepper": stepper})
    scenario.add("log", recording="log.csv", interpolation={"wheel_speed": "hold"}).add("sum", fmu=str(fmu))
    outcome = quietly(scenario.connect("log.wheel_speed -> sum.wheel_speed"))
    table = np.array(list(zip(t, command, strict=True)), dtype=[("time", float), ("wheel_speed", float)])
    other = simulate_fmu(str(fmu), stop_time=4.0, step_size=0.5, output_interval=0.5, input=table)
    np.testing.assert_allclose(outcome["sum.distance"], 10.0 * np.maximum(t - 1.0, 0.0), atol=1e-9)
    np.testing.assert_allclose(other["distance"], outcome["sum.distance"], atol=1e-9)


def test_inputs_of_one_fmu_are_reported_as_what_they_are_taken_for(tmp_path: Path) -> None:
    """Discrete inputs hold a command, 30 at 4 s; continuous ones follow lines, 32.5 as the rows say, unless told."""
    t = 0.5 * np.arange(9)
    rows = "".join(f"{a},{b},{b}\n" for a, b in zip(t, np.where(t >= 1.0, 10.0, 0.0), strict=True))
    (tmp_path / "log.csv").write_text("time,u,wheel_speed\n" + rows, encoding="utf-8")
    more: dict[str, Any] = {"stop": 4.0, "step": 0.5, "inputs": tmp_path / "log.csv"}
    held = quietly(Scenario.fmu(integrator_fmu(tmp_path), **more))
    name = next(n for n in held.result.table.dtype.names or () if n.startswith("fmu."))
    assert held[name][-1] == pytest.approx(30.0, abs=1e-12)
    assert any("held from row to row: u" in note for note in held.result.summary["notes"])
    fmu = cached_fmu(PLANTS["odometer"](), fmi_version=2)
    lines = quietly(Scenario.fmu(fmu, **more))
    assert lines["fmu.distance"][-1] == pytest.approx(32.5, abs=1e-9)
    assert any("on lines between rows: " in note for note in lines.result.summary["notes"])
    subject = make_subject(fmu, tmp_path, stop=4.0, step=0.5, inputs="log.csv", interpolation={"wheel_speed": "hold"})
    assert subject.result["fmu.distance"][-1] == pytest.approx(30.0, abs=1e-9)
    assert Recipe.from_data(subject.recipe.to_data(tmp_path), tmp_path) == subject.recipe


@pytest.mark.parametrize(
    ("interpolation", "words"),
    [
        ({"w": "hold"}, r"interpolation: there is no column 'w'"),
        ({"u": "both"}, r"interpolation"),
        (3, r"interpolation"),
    ],
)
def test_what_cannot_be_said_of_columns_is_refused(tmp_path: Path, interpolation: Any, words: str) -> None:
    (tmp_path / "log.csv").write_text("time,u\n0,1\n1,2\n", encoding="utf-8")
    with pytest.raises(CosimError, match=words):
        Scenario(folder=tmp_path, stop=1.0, step=0.1).add("log", recording="log.csv", interpolation=interpolation).run()


def test_what_was_said_of_columns_outlives_files_and_is_shown(tmp_path: Path) -> None:
    """A saved scenario, `cosim show` with Jacobi, and a record of the run: the column is what it was."""
    (tmp_path / "log.csv").write_text("time,u,v\n0,1,1\n0.5,2,3\n1,2,4\n", encoding="utf-8")
    scenario = Scenario(folder=tmp_path, stop=1.0, step=0.1, master={"algorithm": "jacobi"})
    PLANTS["lag_of_tests"] = Lag
    try:
        scenario.add("log", recording="log.csv", interpolation={"u": "hold"}).add("lag", model="lag_of_tests", **BLOCK)
        scenario.connect("log.u -> lag.a", "log.v -> lag.b")
        reported = [when(link) for link in scenario.structure().links]
        assert sorted(reported) == ["a line, its course within the step", "held, of the start of the step"]
        first = quietly(scenario)
        again = quietly(Scenario.load(scenario.save(tmp_path / "saved.toml")))
        first.write(tmp_path / "run", report=False)
        record = Scenario(folder=tmp_path, stop=1.0, step=0.1, master={"algorithm": "jacobi"})
        record.add("log", recording="run").add("lag", model="lag_of_tests", **BLOCK)
        played_again = quietly(record.connect("log.u -> lag.a", "log.v -> lag.b"))
    finally:
        del PLANTS["lag_of_tests"]
    assert different(first, again) == []
    assert first.result.summary["master"]["algorithm"]["played"] == {"log.u": "held", "log.v": "line"}
    names = ["lag.y", "lag.z"]  # a line between rows of 0.1 s is the line between rows of 0.5 s, but for its rounding
    for name in names:
        np.testing.assert_allclose(played_again[name], first[name], rtol=1e-13, atol=1e-13)


def test_a_line_goes_to_no_discrete_input(tmp_path: Path) -> None:
    (tmp_path / "log.csv").write_text("time,u\n0,1\n4,2\n", encoding="utf-8")
    scenario = Scenario(folder=tmp_path, stop=4.0, step=0.5).add("log", recording="log.csv", interpolation="linear")
    scenario.add("sum", fmu=str(integrator_fmu(tmp_path))).connect("log.u -> sum.u")
    with pytest.raises(CosimError, match=r"log\.u is said to run on lines .*sum\.u is discrete.*'hold' for 'u'"):
        scenario.run()


# -- filters and identification
# ----------------------------------------------------------------------------------------------------------------


def test_an_exact_filter_over_an_fmu_is_consistent_on_a_log(tmp_path: Path) -> None:
    """The plant's own equations as an FMU, noises as told, efforts held: the mean NIS of 400 samples is 1 within three
    standard deviations of chi-square. With the effort of the end of the step it is 1.6.
    """
    system, h, count = PLANTS["longitudinal_train"](), 0.1, 400
    speed = list(scalar_names(system.states)).index("train_speed")
    rng, runtime = np.random.default_rng(0), Runtime(system)
    runtime.x[speed] = 15.0
    runtime.start(0.0)
    u, y = 0.05 + 4.0 * rng.standard_normal(count + 1), [15.0]
    for k in range(count):
        runtime.u[0] = u[k]
        runtime.advance((k + 1) * h)
        runtime.x[speed] += 0.02 * np.sqrt(h) * rng.standard_normal()
        y.append(runtime.x[speed] + 0.05 * rng.standard_normal())
    rows = "".join(f"{k * h!r},{a!r},{float(b)!r}\n" for k, (a, b) in enumerate(zip(u.tolist(), y, strict=True)))
    (tmp_path / "log.csv").write_text("time,u [N],y [m/s]\n" + rows, encoding="utf-8")
    scenario = Scenario(folder=tmp_path, stop=count * h, step=h)
    scenario.add("log", recording="log.csv", interpolation="hold")  # the measurement is a sample all the same
    settings = {"kind": "ekf", "measurements": {"speed": 0.05}, "process_noise": {"train_speed": 0.02}}
    settings["start_deviation"] = {"train_speed": 0.05, "train_position": 0.1}
    path = cached_fmu(system, fmi_version=2)
    scenario.add("filter", fmu=str(path), parameters={"train_speed": 15.0}, filter=settings)
    outcome = quietly(scenario.connect("log.u -> filter.effort", "log.y -> filter.measured_speed"))
    assert abs(np.mean(outcome["filter.nis"][1:]) - 1.0) < 3.0 * np.sqrt(2.0 / count)


@pytest.mark.parametrize("algorithm", ["gauss-seidel", "jacobi"])
def test_parameters_are_identified_as_the_effort_acted(tmp_path: Path, algorithm: str) -> None:
    """Without noise a run tells its resistance, of whichever end of a step the effort was: to 1e-5."""
    true = {"mass": 80e3, "davis_a": 1800.0, "davis_b": 80.0, "davis_c": 7.0}
    more = {"traction_coefficient": 1.0, "brake_coefficient": 1.0, "train_speed": 8.0}
    gains = {"proportional_gain": 2e4, "integral_gain": 500.0, "effort_lag": 1.0}
    profile = {"profile_time": [0, 60, 90, 120, 121, 122, 123, 124], "profile_speed": [10, 30, 32, 20, 20, 20, 20, 20]}
    scenario = Scenario(stop=100.0, step=0.5, master={"algorithm": algorithm})
    scenario.add("train", model="longitudinal_train", parameters=true | more, **BLOCK)
    scenario.add("driver", model="driver", parameters=gains | profile, **BLOCK)
    quietly(scenario.connect("driver.effort -> train.effort", "train.speed -> driver.odometer")).write(
        tmp_path / "run", report=False
    )
    words = ["calibrate", "running_resistance", str(tmp_path / "run"), "--signals", "speed=train.speed"]
    words += ["--set", "mass=80e3"]
    found, _ = calibrate_command._calibrated(PROGRAM.parser(words).parse_args(words))
    for name in ("davis_a", "davis_b", "davis_c"):
        assert found.values[name] == pytest.approx(true[name], rel=1e-5)
    fmu = cached_fmu(PLANTS["longitudinal_train"](), fmi_version=2)
    fixed = more | {name: value for name, value in true.items() if name != "mass"}
    runs = FmuRuns(fmu, ["mass"], fixed=fixed, guesses={"mass": 70e3})
    selection = Selection(["speed=train.speed"])
    recorded = sort_columns(load_result(tmp_path / "run"), "run", dict.fromkeys(runs.outputs), runs.inputs, selection)
    mass = calibrate(runs, recorded).values["mass"]
    runs.close()
    assert mass == pytest.approx(80e3, rel=1e-9)


@pytest.mark.parametrize("algorithm", ["gauss-seidel", "jacobi"])
def test_a_record_of_the_compiled_stepper_in_the_place_of_any_part_gives_equal_bits(
    tmp_path: Path, algorithm: str
) -> None:
    """The stepper in C records what Python plays back: a closed loop of shipped FMUs, each of them replaced in turn."""
    links = {
        "driver": "driver.effort -> train.effort",
        "train": "train.speed -> odometer.wheel_speed",
        "odometer": "odometer.reading -> driver.odometer",
    }
    models = {"driver": "driver", "train": "longitudinal_train", "odometer": "odometer"}

    def scenario(replaced: str = "") -> Scenario:
        made = Scenario(stop=2.0, step=0.05, master={"algorithm": algorithm})
        for name, model in models.items():
            table = {"recording": str(tmp_path / "run")} if name == replaced else {"model": model, "as": "fmu2"}
            made.add(name, **table)
        kept = [link for link in links.values() if f"-> {replaced}." not in link]
        return made.connect(*kept)

    first = quietly(scenario().master(stepper="compiled"))
    assert first.result.summary["master"]["stepper"]["steps_compiled"] > 0
    Outcome(first.result, first.spec, ("npy",)).write(tmp_path / "run", report=False)
    for name in models:
        assert different(first, quietly(scenario(name))) == []
