"""A recording as a component: what it gives between its rows, at jumps and over gaps, and what it refuses."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from test_fmus.events import INSTANTS, integrator_fmu, timed_fmu, triggered_fmu

from cosim import Scenario
from cosim.components.recording import RecordingComponent
from cosim.components.recording_data import Recording, make_recording
from cosim.errors import CosimError, CouplingError, ScenarioError
from cosim.results.result import BaliseRecord, Result, SignalInfo
from fmus.check.probe import probe
from fmus.fmi.standard import NEVER


def result_of(time: Any, **columns: Any) -> Result:
    """A result of columns; a name that ends in ``_held`` is discrete. Points in names are written as two
    underscores.
    """
    names = {key: key.replace("__", ".") for key in columns}
    table = np.empty(len(time), dtype=[("time", float), *((name, float) for name in names.values())])
    table["time"] = time
    for key, name in names.items():
        table[name] = columns[key]
    kinds = {name: "discrete" if name.endswith("_held") else "continuous" for name in names.values()}
    return Result(table, [SignalInfo(name, "m/s", variability=kinds[name]) for name in names.values()])  # type: ignore[arg-type]


def play(time: Any, interpolation: Any = "linear", span: Any = None, **columns: Any) -> Recording:
    return make_recording(result_of(time, **columns), "run.csv", None, "rec", interpolation, span)


def write(folder: Path, text: str, name: str = "log.csv") -> Path:
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


def listening(folder: Path, path: Path, stop: float = 1.0, step: float = 0.05, **table: Any) -> Scenario:
    """A recording alone, so that its outputs are recorded again."""
    return Scenario(folder=folder, stop=stop, step=step).add("rec", recording=str(path), **table)


# -- values
# ---------------------------------------------------------------------------------------------------------------

ROWS = st.lists(st.tuples(st.integers(0, 12), st.integers(-9, 9)), min_size=1, max_size=20)


@given(ROWS, st.integers(0, 10**6).map(lambda i: 1e-6 * i))  # not as near to a row as to be taken for it
def test_values_are_those_of_a_naive_look_up(rows: list[tuple[int, int]], share: float) -> None:
    """Exactly the row where there is one, first or last of several; between rows `numpy.interp`, or what was before."""
    rows = sorted(rows, key=lambda row: row[0])
    time, values = (np.array(column, dtype=float) for column in zip(*rows, strict=True))
    recording = play(time, line=values, step_held=values)
    for t in sorted({*time.tolist(), float(time[0] + share * (time[-1] - time[0]))}):
        equal = [v for at, v in rows if abs(at - t) <= 1e-9]
        before, after = recording.at(t, before=True), recording.at(t)
        if equal:
            assert before.tolist() == [equal[0]] * 2
            assert after.tolist() == [equal[-1]] * 2
        else:
            earlier = [v for at, v in rows if at < t][-1]
            last, first = np.flatnonzero(time < t)[-1], np.flatnonzero(time > t)[0]
            line = np.interp(t, time[[last, first]], values[[last, first]])
            # a few roundings of numbers below 10
            np.testing.assert_allclose(after, [line, earlier], rtol=1e-12, atol=1e-12)
    assert recording.events.tolist() == [t for t in sorted(set(time.tolist())) if time.tolist().count(t) > 1]


def test_the_next_event_is_the_next_jump_and_then_none() -> None:
    result = result_of([0.0, 0.2, 0.2, 0.5, 0.5, 1.0], v=[1, 1, 2, 2, 2, 2])
    reported = replace(
        result, events=[BaliseRecord(stamp=0.4, delivered_at=0.5, identity="B1", position=1.0, true_position=1.0)]
    )
    recording = make_recording(reported, "run.csv", None, "rec", "linear", None)
    assert recording.events.tolist() == [0.2]  # at 0.5 a telegram was told to somebody, and nothing jumped here
    assert recording.next_event(0.0) == 0.2
    assert recording.next_event(0.2) == NEVER


def test_it_goes_to_any_time_and_back() -> None:
    time = np.linspace(0.0, 2.0, 21)
    recording = play(time, v=np.sin(time), p=time**2)
    report = probe(lambda: RecordingComponent("rec", recording), {}, 0.0, 0.05)
    assert report.honest_step
    assert report.exact_state
    assert report.repeatable
    slave = RecordingComponent("rec", recording).slave
    slave.enterInitializationMode(startTime=0.3)
    state, there = slave.getFMUState(), slave.getFloat64([1, 2])
    slave.doStep(0.3, 0.77)
    assert slave.getFloat64([1, 2]) != there
    slave.setFMUState(state)
    assert slave.getFloat64([1, 2]) == there
    np.testing.assert_allclose(there, [np.sin(0.3), 0.09], rtol=1e-9)  # 0.3 s is a row of the recording


def test_modes_are_integers_so_that_they_fit_integer_inputs() -> None:
    table = result_of([0.0, 1.0], mode_held=[1.0, 2.0], speed_held=[1.0, 2.0])
    signals = [
        SignalInfo("mode_held", "1", variability="discrete"),
        SignalInfo("speed_held", "m/s", variability="discrete"),
    ]
    component = RecordingComponent(
        "rec", make_recording(Result(table.table, signals), "run.csv", None, "rec", "linear", None)
    )
    assert [component.variables[n].type for n in ("mode_held", "speed_held")] == ["Int32", "Float64"]


# -- jumps
# ----------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("step", [0.1, 0.04])
@pytest.mark.parametrize("early", [False, True])
def test_who_listens_to_jumps_gets_what_it_got_beside_the_plant(tmp_path: Path, step: float, early: bool) -> None:
    """A plant with time events, or one that returns early: inside steps, and at communication points. Bit for bit."""
    plant = triggered_fmu(tmp_path) if early else timed_fmu(tmp_path)
    signal = "count" if early else "level"
    joint = Scenario(stop=0.8, step=step).add("plant", fmu=str(plant)).add("sum", fmu=str(integrator_fmu(tmp_path)))
    outcome = joint.connect(f"plant.{signal} -> sum.u").run()
    outcome.write(tmp_path / "run", report=False)
    alone = Scenario(stop=0.8, step=step).add("plant", recording=str(tmp_path / "run"))
    alone.add("sum", fmu=str(tmp_path / "integrator.fmu")).connect(f"plant.{signal} -> sum.u")
    played = alone.run()
    assert played.result.table.tobytes() == outcome.result.table[list(played.result.table.dtype.names or ())].tobytes()
    if not early:
        doubled = played.result.time[1:][np.diff(played.result.time) == 0.0]
        assert set(INSTANTS) <= set(np.round(doubled, 12)) | set(np.round(np.arange(0.0, 0.8, step), 12))


def test_a_jump_in_a_log_reaches_an_integral_at_its_instant(tmp_path: Path) -> None:
    """1 until 0.25 s, then 5: the integral at 1 s is 0.25 + 0.75 * 5, whatever the step."""
    write(tmp_path, "time,u\n0,1\n0.25,1\n0.25,5\n1,5\n")
    scenario = Scenario(folder=tmp_path, stop=1.0, step=0.1).add("log", recording="log.csv")
    outcome = scenario.add("sum", fmu=str(integrator_fmu(tmp_path))).connect("log.u -> sum.u").run()
    integral = next(
        name for name in outcome.result.table.dtype.names or () if name.startswith("sum.") and name != "sum.u"
    )
    assert outcome[integral][-1] == pytest.approx(4.0, abs=1e-12)


# -- measured data
# --------------------------------------------------------------------------------------------------------


def test_a_log_of_50_ms_drives_steps_of_10_ms(tmp_path: Path) -> None:
    """Speed in km/h on a ramp: linear between the rows, in m/s, to rounding."""
    time = 0.05 * np.arange(21)
    rows = "\n".join(f"{t:.17g},{3.6 * 2.0 * t:.17g}" for t in time)
    outcome = listening(tmp_path, write(tmp_path, f"time,speed [km/h]\n{rows}\n"), step=0.01).run()
    assert len(outcome.result.time) == 101
    np.testing.assert_allclose(outcome["rec.speed"], 2.0 * outcome.result.time, rtol=1e-13, atol=1e-13)
    assert outcome.result.info("rec.speed").unit == "m/s"


def test_a_gap_is_refused_with_time_and_column_only_where_it_is_used(tmp_path: Path) -> None:
    path = write(tmp_path, "time,speed,temperature\n0,1,20\n0.5,2,nan\n1,3,21\n")
    outcome = listening(tmp_path, path, step=0.25).run()
    assert outcome["rec.speed"].tolist() == [1.0, 1.5, 2.0, 2.5, 3.0]
    assert "rec.temperature" not in (outcome.result.table.dtype.names or ())
    assert any("temperature" in note and "0.5 s" in note for note in outcome.result.summary["notes"])
    wanted = listening(tmp_path, path, step=0.25).report(true_speed="rec.temperature")
    with pytest.raises(
        CouplingError, match=r"rec\.temperature cannot be played back: its value at 0\.5 s is nan .*'hold'"
    ):
        wanted.run()


def test_a_gap_is_held_where_that_is_asked_for(tmp_path: Path) -> None:
    path = write(tmp_path, "time,speed\n0,1\n0.25,nan\n0.5,nan\n0.75,4\n1,5\n")
    outcome = listening(tmp_path, path, step=0.125, interpolation="hold").run()
    assert outcome["rec.speed"].tolist() == [1.0] * 6 + [4.0] * 2 + [5.0]


def test_a_gap_outside_of_the_run_does_not_matter(tmp_path: Path) -> None:
    path = write(tmp_path, "time,speed\n0,nan\n1,1\n2,2\n3,3\n4,nan\n")
    scenario = Scenario(folder=tmp_path, start=1.5, stop=2.5, step=0.5).add("rec", recording=str(path))
    assert scenario.run()["rec.speed"].tolist() == [1.5, 2.0, 2.5]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("time,v\n0,1\n0.75,2\n", r"ends at 0\.75 s, the run at 1 s"),
        ("time,v\n0.5,1\n2,2\n", r"begins at 0\.5 s, the run at 0 s"),
        ("time,v\n", "no rows"),
        ("time\n0\n1\n", "no columns|at least"),
        ("time,v\n0,nan\n1,2\n", r"no column can be played back; v: its value at 0 s"),
    ],
)
def test_what_cannot_be_played_back_is_said_before_the_run(tmp_path: Path, text: str, words: str) -> None:
    with pytest.raises(CosimError, match=words) as caught:
        listening(tmp_path, write(tmp_path, text)).run()
    assert "components.rec" in str(caught.value)
    assert "log.csv" in str(caught.value)


def test_time_that_goes_back_is_refused_with_its_row() -> None:
    with pytest.raises(ScenarioError, match=r"goes back from 2 s to 1 s in row 3"):
        play([0.0, 2.0, 1.0], v=[1, 2, 3])


def test_a_missing_file_is_named_with_its_place(tmp_path: Path) -> None:
    with pytest.raises(ScenarioError, match=r"components\.rec: there is no .*nowhere\.csv"):
        listening(tmp_path, tmp_path / "nowhere.csv").run()


# -- whose columns
# --------------------------------------------------------------------------------------------------------


def test_a_component_is_taken_by_name_by_its_own_name_or_with_all_others() -> None:
    result = result_of([0.0, 1.0], train__v=[1.0, 2.0], driver__v=[3.0, 4.0])

    def names(component: str | None, name: str) -> list[str]:
        return [s.name for s in make_recording(result, "run", component, name, "linear", None).signals]

    assert names("driver", "rec") == ["v"]
    assert names(None, "train") == ["v"]
    assert names(None, "rec") == ["train.v", "driver.v"]
    with pytest.raises(ScenarioError, match="'drivr' was not recorded there; did you mean 'driver'"):
        names("drivr", "rec")


def test_all_columns_of_a_run_can_be_connected_by_their_full_names(tmp_path: Path) -> None:
    path = write(tmp_path, '"time","train.v","train.u"\n0,1,1\n1,1,1\n')
    scenario = listening(tmp_path, path, step=0.25).add("sum", fmu=str(integrator_fmu(tmp_path)))
    outcome = scenario.connect("rec.train.u -> sum.u").run()
    assert outcome.failure is None


# -- the rest of the house
# ------------------------------------------------------------------------------------------------


def test_it_is_shown_and_not_exported(tmp_path: Path) -> None:
    scenario = listening(tmp_path, write(tmp_path, "time,speed\n0,1\n1,2\n"))
    assert "rec" in scenario.structure().text()
    with pytest.raises(ScenarioError, match="a recording is no FMU"):
        scenario.export_ssp(tmp_path / "x.ssp")
