"""What runs beside recordings is stepped in C: rows, telegrams and counters of the Python stepper, to the last bit."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from compiled_runs import assert_equal, both, steps_compiled
from hypothesis import given, settings
from hypothesis import strategies as st

from cosim import Scenario
from cosim.results.result import BaliseRecord, Result, SignalInfo
from cosim.results.results_folder import write_results
from fmus.build import build_fmu
from plant_models.hybrid import HybridSystem, PeriodicEvent, TriggeredEvent
from plant_models.hybrid.signal import input_signal, memory, output_signal, parameter, state

STEP, COUNT = 0.1, 12
STOP = STEP * COUNT
FIELDS = ("position", "location_accuracy", "odometer_reading", "delivered_at")
NEXT_TO = (0.0, 0.0, 0.5e-9, -0.5e-9, 1.5e-9, -1.5e-9, 0.013, 0.05, 0.077)
"""On a communication point, next to it on either side of what counts as the same time, and well within a step [s]."""


class Follower(HybridSystem):
    """Integrates an input that its output shows as well, samples another one within the step, where it returns early,
    shows a third one, and keeps what a telegram says.
    """

    name = "follower"
    states = (state("travelled", "1"), memory("reported", "1"), memory("reading", "1"), memory("sum", "1"))
    parameters = (parameter("period", "s", 0.03),)
    inputs = (input_signal("effort", "1"), input_signal("speed", "1"), input_signal("number", "1"))
    outputs = (output_signal("shown", "1"), output_signal("kept", "1"), output_signal("distance", "1"))
    events = (
        PeriodicEvent("sample", "period"),
        TriggeredEvent("balise", tuple(input_signal(f"balise_{f}", "1", variability="discrete") for f in FIELDS)),
    )
    internal_step = 0.1

    def flow(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"travelled": u.effort - 0.5 * x.travelled}

    def jump(self, event: str, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        if event == "sample":
            return {"sum": x.sum + u.number}
        return {
            "reported": u.balise_position + u.balise_location_accuracy,
            "reading": u.balise_odometer_reading + u.speed,
        }

    def output(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {
            "shown": u.effort + u.speed - u.number,
            "kept": x.reported - x.reading + 1e-3 * x.sum,
            "distance": x.travelled,
        }


@dataclass(frozen=True)
class Table:
    """A recorded table: times of its rows [s], columns with how each runs, and whether it is of a run."""

    time: Sequence[float]
    columns: Mapping[str, tuple[str, Sequence[float]]]
    of_run: bool
    telegrams: Sequence[BaliseRecord] = field(default_factory=tuple)

    def write(self, folder: Path) -> None:
        table = np.empty(len(self.time), dtype=[("time", float), *((name, float) for name in self.columns)])
        table["time"] = self.time
        signals = []
        for name, (course, values) in self.columns.items():
            table[name] = values
            discrete = name == "number" and course == "held"
            signals.append(SignalInfo(name, variability="discrete" if discrete else "continuous"))
        courses = {name: course for name, (course, _) in self.columns.items()}
        algorithm = {
            "fresh": [],
            "held": [f"{name} -> other.u" for name, course in courses.items() if course == "held"],
            "played": {name: course for name, course in courses.items() if course == "line"},
        }
        summary = {"master": {"algorithm": algorithm}, "components": []} if self.of_run else {}
        write_results(Result(table, signals, list(self.telegrams), summary), folder, ("npy",))

    @property
    def settings(self) -> dict[str, Any]:
        """What a scenario says of the columns of a logger's table; a run says it itself."""
        if self.of_run:
            return {}
        return {"interpolation": {n: "hold" if c == "held" else "linear" for n, (c, _) in self.columns.items()}}


VALUES = st.sampled_from([0.0, -0.0, 1.0, -3.0, 0.1, 1.0 / 3.0, 1e-300, -7.3e5, 2.0**31])
TIMES = st.lists(
    st.builds(lambda k, more: min(max(k * STEP + more, 0.0), STOP), st.integers(0, COUNT), st.sampled_from(NEXT_TO)),
    max_size=18,
).map(lambda times: sorted([-0.03, 0.0, *times, STOP, STOP + 0.02]))
"""Rows of one time are a time event."""


@st.composite
def tables(draw: st.DrawFn, names: Sequence[str], *, whole: bool = False) -> Table:
    time = draw(TIMES)
    of_run = draw(st.booleans())
    columns = {}
    for name in names:
        course = draw(st.sampled_from(["held", "line", "fresh"] if of_run else ["held", "line"]))
        values = st.integers(-5, 5).map(float) if whole and name == "number" else VALUES
        columns[name] = course, draw(st.lists(values, min_size=len(time), max_size=len(time)))
    return Table(time, columns, of_run)


def telegram(number: int, stamp: float, late: float, kind: Any) -> BaliseRecord:
    delivered = float("nan") if kind == "missed" else stamp + late
    return BaliseRecord(
        stamp, delivered, f"B{number}", 10.0 * number, 10.0 * number + 0.1, 0.4, 5.0 + number, kind, "rollback", 1e-9
    )


TELEGRAMS = st.lists(
    st.tuples(
        st.builds(lambda k, more: k * STEP + more, st.integers(1, COUNT - 1), st.sampled_from(NEXT_TO)),
        st.sampled_from([0.0, 0.0, 0.0, 0.03, 0.2]),
        st.sampled_from(["true", "true", "true", "missed", "false"]),
    ),
    max_size=6,
).map(lambda several: [telegram(i, *one) for i, one in enumerate(sorted(several), 1)])


@pytest.fixture(scope="module")
def follower(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return build_fmu(Follower(), tmp_path_factory.mktemp("follower"), 3)


def beside(folder: Path, follower: Path, plant: Table, odometer: Table, algorithm: str = "gauss-seidel") -> Scenario:
    """A receiver of recorded telegrams beside two recordings with rows of their own."""
    made = Scenario(folder=folder, stop=STOP, step=STEP, certificates="ignore")
    for name, table in (("plant", plant), ("odometer", odometer)):
        table.write(folder / name)
        made.add(name, recording=str(folder / name), **table.settings)
    made.add("follower", fmu=str(follower)).master(algorithm=algorithm)
    made._data["connections"] = [
        {"from": "plant.effort", "to": "follower.effort", "factor": 0.7, "offset": 0.1},
        {"from": "odometer.speed", "to": "follower.speed"},
        {"from": "odometer.number", "to": "follower.number"},
    ]
    return made.balises(layout="recorded", file=str(folder / "plant"), odometer="odometer.speed")


@settings(max_examples=15)
@given(
    plant=tables(("position", "effort")),
    odometer=tables(("speed", "number"), whole=True),
    telegrams=TELEGRAMS,
    algorithm=st.sampled_from(["gauss-seidel", "jacobi"]),
    every=st.sampled_from([1, 1, 3]),
)
def test_random_tables(
    tmp_path_factory: pytest.TempPathFactory,
    follower: Path,
    plant: Table,
    odometer: Table,
    telegrams: list[BaliseRecord],
    algorithm: str,
    every: int,
) -> None:
    folder = tmp_path_factory.mktemp("recorded")
    played = Table(plant.time, plant.columns, plant.of_run, telegrams)
    scenario = beside(folder, follower, played, odometer, algorithm)
    python, compiled = both(scenario, **{"master.record_every": every})
    assert python.failure is None
    assert_equal(python, compiled)


def smooth(*, of_run: bool, course: str, telegrams: Sequence[BaliseRecord] = ()) -> tuple[Table, Table]:
    """Rows every 0.07 s, no event."""
    time = [0.07 * i for i in range(19)]
    wave = [0.1 * i * i for i in range(19)]
    return tuple(
        Table(time, dict.fromkeys(names, (course, wave)), of_run, telegrams)
        for names in (("position", "effort"), ("speed", "number"))
    )  # type: ignore[return-value]


@pytest.mark.parametrize("course", ["held", "line", "fresh"])
def test_all_steps_without_events_are_done_in_c(follower: Path, tmp_path: Path, course: str) -> None:
    """Telegrams that were delivered at once included; of one that was late Python does the step in which it arrives."""
    stamps = (0.234, 0.55, 0.971)
    at_once = [telegram(i, stamp, 0.0, "true") for i, stamp in enumerate(stamps, 1)]
    python, compiled = both(beside(tmp_path, follower, *smooth(of_run=True, course=course, telegrams=at_once)))
    assert python.failure is None
    assert_equal(python, compiled)
    assert [event.outcomes for event in compiled.result.events] == [event.outcomes for event in python.result.events]
    assert compiled.result["follower.kept"][-1] != 0.0
    assert steps_compiled(compiled) == COUNT
    late = [*at_once[:2], telegram(3, stamps[2], 0.1, "true")]
    _, compiled = both(beside(tmp_path, follower, *smooth(of_run=True, course=course, telegrams=late)))
    assert steps_compiled(compiled) == COUNT - 2


def test_only_steps_with_a_jump_are_done_in_python(follower: Path, tmp_path: Path) -> None:
    plant, odometer = smooth(of_run=True, course="fresh")
    time = sorted([*odometer.time, odometer.time[5], odometer.time[10]])  # within a step, and on a communication point
    jumping = Table(time, {n: ("fresh", np.arange(21.0).tolist()) for n in odometer.columns}, of_run=True)
    python, compiled = both(beside(tmp_path, follower, plant, jumping))
    assert_equal(python, compiled)
    assert steps_compiled(compiled) == COUNT - 2


def test_missing_samples_do_not_end_a_chunk(follower: Path, tmp_path: Path) -> None:
    plant, odometer = smooth(of_run=False, course="held")
    gaps = [float("nan") if i % 3 else float(i) for i in range(19)]
    missing = Table(odometer.time, {**odometer.columns, "sample": ("held", gaps)}, of_run=False)
    scenario = beside(tmp_path, follower, plant, missing).set("odometer.can_be_missing", ["sample"])
    python, compiled = both(scenario)
    assert python.failure is None
    assert_equal(python, compiled)
    chunks: list[float] = []
    scenario.run(progress=lambda t, _: chunks.append(t), warn=lambda _: None)
    assert len(chunks) <= 4  # of 1, 8 and the other 3 steps, and the end
