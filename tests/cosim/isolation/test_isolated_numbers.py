"""FMUs in processes of their own compute what they compute in this one, to the bit: runs, and calls in any order."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fmpy.fmi1 import FMICallException
from harmful_fmus import processes_of_fmus
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st
from test_fmus.build import linear_fmu
from test_fmus.events import (
    awkward_fmu,
    bouncing_pair,
    countdown_fmu,
    integrator_fmu,
    periodic_fmu,
    receiver_fmu,
    timed_fmu,
    triggered_fmu,
)
from test_fmus.exchange import exchange_fmu
from test_fmus.masses import Chain, cuts
from test_fmus.typed import typed_fmu

from cosim import Scenario
from cosim.components.component import Component
from cosim.components.loading import load_fmu
from cosim.errors import RunError
from fmus.isolation.limits import OwnProcess

pytestmark = [pytest.mark.compiler, pytest.mark.skipif(not Path("/proc/self/task").exists(), reason="Linux")]


def clocks(folder: Path) -> Scenario:
    scenario = Scenario(stop=1.0, step=0.05)
    scenario.add("source", fmu=str(triggered_fmu(folder))).add("sink", fmu=str(receiver_fmu(folder)))
    return scenario.connect("source.crossing -> sink.tick", "source.crossing_value -> sink.tick_value")


def time_events(folder: Path) -> Scenario:
    scenario = Scenario(stop=1.0, step=0.05)
    scenario.add("source", fmu=str(timed_fmu(folder))).add("sink", fmu=str(integrator_fmu(folder)))
    return scenario.connect("source.level -> sink.u")


def periodic(folder: Path) -> Scenario:
    return Scenario(stop=1.0, step=0.05).add("one", fmu=str(periodic_fmu(folder)))


def countdown(folder: Path) -> Scenario:
    return Scenario(stop=1.0, step=0.05).add("one", fmu=str(countdown_fmu(folder)))


def iteration(folder: Path) -> Scenario:
    scenario = Scenario(stop=1.0, step=0.05)
    for name, path in zip(("ping", "pong"), bouncing_pair(folder), strict=True):
        scenario.add(name, fmu=str(path))
    return scenario.connect("ping.y -> pong.u", "pong.y -> ping.u")


def loop(folder: Path) -> Scenario:
    """Iterated, so that states are saved and restored in every step; with directional derivatives."""
    cut = cuts(Chain.two())["inertial"]
    scenario = Scenario(stop=0.5, step=0.01, master={"algorithm": "iterate"})
    for name, path in cut.fmus(folder, 3, directional=True).items():
        scenario.add(name, fmu=str(path))
    return scenario.connect(*cut.connections)


def messages(folder: Path) -> Scenario:
    return Scenario(stop=0.5, step=0.05).add("one", fmu=str(awkward_fmu(folder, "chatty", version=3)), log="all")


def warnings(folder: Path) -> Scenario:
    return Scenario(stop=0.5, step=0.05).add("one", fmu=str(awkward_fmu(folder, "warns", version=2)), log="all")


def exchange(version: int) -> Callable[[Path], Scenario]:
    def made(folder: Path) -> Scenario:
        return Scenario(stop=1.0, step=0.05).add("one", fmu=str(exchange_fmu(folder, "BALL", version)))

    made.__name__ = f"exchange{version}"
    return made


RUNS = (clocks, time_events, periodic, countdown, iteration, loop, messages, warnings, *map(exchange, (1, 2, 3)))


@pytest.mark.parametrize("make", RUNS, ids=lambda make: make.__name__)
def test_a_run_is_the_same_to_the_bit(tmp_path: Path, make: Callable[[Path], Scenario]) -> None:
    runs = []
    for isolate in ("no", "component"):
        outcome = make(tmp_path).set("master.isolate", isolate).run(warn=lambda _: None)
        assert outcome.failure is None
        result = outcome.result
        runs.append((result.table.tobytes(), result.events, result.messages, outcome.warnings))
    assert len(runs[0][0]) > 0
    assert runs[1] == runs[0]


LAG: dict[str, Any] = {
    "A": [[-1.0, 0.5], [0.0, -2.0]],
    "B": [[1.0], [0.3]],
    "C": [[1.0, 0.0], [0.2, 1.0]],
    "D": [[0.0], [0.7]],
}
CALLS = ("set", "get", "get-other", "step", "save", "restore", "bytes")


class Twins:
    """The same FMU here and in a process of its own; every call goes to both."""

    def __init__(self, path: Path) -> None:
        self.both = [load_fmu(path, "lag"), load_fmu(path, "lag", isolation=OwnProcess())]
        self.states: list[list[Any]] = []
        self.time = 0.0
        self.values = [np.zeros(3), np.zeros(3)]
        self.calls: list[Any] = []
        for made, y in zip(self.both, self.values, strict=True):
            made.instantiate()
            made.enter_initialization(0.0, 1e3)
            made.exit_initialization()
            self.calls.append((made.writer(["u"]), made.reader(["y", "z"], y[:2]), made.reader(["z"], y[2:])))

    def call(self, what: str, number: float) -> None:
        if what == "save":
            self.states.append([(self.time, made.save()) for made in self.both])
        elif what in ("restore", "bytes") and not self.states:
            return
        for place, (made, (writer, reader, other)) in enumerate(zip(self.both, self.calls, strict=True)):
            if what == "set":
                writer[1][0] = number
                writer[0]()
            elif what in ("get", "get-other"):
                (reader if what == "get" else other)()
            elif what == "step":
                made.advance(self.time, self.time + 0.1)
            elif what == "restore":
                made.restore(self.states[-1][place][1])
            elif what == "bytes":
                made.restore(made.deserialize(made.serialize(self.states[-1][place][1])))
        if what == "step":
            self.time += 0.1
        elif what in ("restore", "bytes"):
            self.time = self.states[-1][0][0]

    def free(self) -> None:
        for made in self.both:
            made.terminate()
            made.free()
            assert made.failed_ends == []


@pytest.fixture(scope="module")
def lags(tmp_path_factory: pytest.TempPathFactory) -> dict[int, Path]:
    folder = tmp_path_factory.mktemp("lags")
    return {
        version: linear_fmu(folder, f"lag{version}", **LAG, inputs=["u"], outputs=["y", "z"], version=version)
        for version in (1, 2, 3)
    }


@pytest.mark.parametrize("version", [1, 2, 3])
@settings(max_examples=12, deadline=None, suppress_health_check=list(HealthCheck))
@example(calls=[("get", 0.0), ("step", 0.0), ("get", 0.0), ("step", 0.0), ("set", 5.0), ("get", 0.0)])
@given(calls=st.lists(st.tuples(st.sampled_from(CALLS), st.floats(-1e6, 1e6)), max_size=40))
def test_calls_in_any_order_answer_the_same(
    lags: dict[int, Path], version: int, calls: list[tuple[str, float]]
) -> None:
    """Sets that wait and gets that are made ahead among them; those of FMI 1 have no states."""
    twins = Twins(lags[version])
    for what, number in calls:
        if version > 1 or what in ("set", "get", "get-other", "step"):
            twins.call(what, number)
        assert twins.values[0].tobytes() == twins.values[1].tobytes()
    twins.free()


def of_any_type(component: Component) -> dict[str, Any]:
    return {
        name: component.exact_reader(name)()
        for name, variable in component.variables.items()
        if variable.causality in ("output", "input", "parameter") and variable.type != "Clock"
    }


@pytest.mark.parametrize("version", [1, 2, 3])
def test_values_of_every_type_cross(tmp_path: Path, version: Any) -> None:
    path, seen = typed_fmu(tmp_path, version=version), []
    for isolation in (None, OwnProcess()):
        made = load_fmu(path, "typed", isolation=isolation)
        made.instantiate()
        made.enter_initialization(0.0, 1.0)
        made.exit_initialization()
        before = of_any_type(made)
        for name, variable in made.variables.items():
            if variable.causality == "input" and variable.type in ("String", "Binary"):
                values = ["", "é\u4e16" * 3] if variable.type == "String" else [b"", b"\0\x01" * 7]
                made.exact_writer(name)([values[len(name) % 2]] * len(before[name]))
        made.advance(0.0, 0.1)
        seen.append((before, of_any_type(made)))
        made.terminate()
        made.free()
    assert len(seen[0][0]) > 3
    assert seen[1] == seen[0]


def test_an_error_of_a_set_is_told_with_the_call_behind_it_which_is_not_made(lags: dict[int, Path]) -> None:
    made = load_fmu(lags[2], "lag", isolation=OwnProcess())
    made.instantiate()
    made.enter_initialization(0.0, 1.0)
    write, u = made.writer(["u"])
    u[0] = 1.0
    write()
    made.exit_initialization()
    made.advance(0.0, 0.1)
    before = made.read(["y", "z"])
    made.slave.setReal([999], [1.0])  # there is no such variable, and nobody says so yet
    with pytest.raises(RunError, match=r"status 3 \(error\).*fmi2SetReal returned status 3"):
        made.advance(0.1, 0.2)
    assert made.read(["y", "z"]).tobytes() == before.tobytes()
    with pytest.raises(FMICallException):  # from then on every set says what it has to say itself
        made.slave.setReal([999], [1.0])
    made.free()


def test_a_hundred_thousand_steps_leave_memory_and_descriptors_as_they_were(lags: dict[int, Path]) -> None:
    made = load_fmu(lags[3], "lag", isolation=OwnProcess())
    made.instantiate()
    made.enter_initialization(0.0, 1e6)
    made.exit_initialization()
    (write, u), y = made.writer(["u"]), np.zeros(2)
    read, seen = made.reader(["y", "z"], y), []
    for k in range(100_000):
        u[0] = 1.0 if k % 7 else -1.0
        write()
        made.advance(0.01 * k, 0.01 * (k + 1))
        read()
        if k in (50_000, 99_999):  # the supervisor has looked around by then
            resident = [int(Path(f"/proc/{n}/statm").read_text().split()[1]) for n in processes_of_fmus()]
            seen.append((len(list(Path("/proc/self/fd").iterdir())), sum(resident)))
    made.terminate()
    made.free()
    assert len(processes_of_fmus()) == 0
    assert seen[1][0] == seen[0][0]
    assert seen[1][1] - seen[0][1] <= 8  # pages
