"""Components that need Python cost the others nothing: C steps these, and nobody can tell from the result."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from compiled_runs import assert_equal, both, random_linear, steps_compiled
from hypothesis import given, settings
from hypothesis import strategies as st
from test_fmus.build import linear_fmu
from test_fmus.events import awkward_fmu, integrator_fmu, receiver_fmu, timed_fmu, triggered_fmu

from cosim import Scenario
from cosim.run.outcome import Outcome
from cosim.scenario.shipped import shipped_scenarios
from fmus.fmi.fmi3 import FMI3Slave

pytestmark = pytest.mark.compiler
COUNT, STEP = 120, 0.05


def in_python(outcome: Outcome) -> dict[str, str]:
    return dict(outcome.result.summary["master"]["stepper"]["in_python"])


def share(outcome: Outcome) -> float:
    return float(outcome.result.summary["master"]["stepper"]["share"]["steps"])


def train(**odometer: Any) -> Scenario:
    """A driver, a locomotive and an odometer in a ring, the latter as the table says."""
    made = Scenario(stop=COUNT * STEP, step=STEP, certificates="ignore")
    made.add("driver", model="driver").add("locomotive", model="locomotive").add(
        "odometer", model="odometer", **odometer
    )
    made.connect("driver.effort -> locomotive.effort", "locomotive.wheel_speed -> odometer.wheel_speed")
    return made.connect("odometer.reading -> driver.odometer")


WAYS: dict[str, dict[str, Any]] = {
    "a block of FMI 2": {"as": "block2"},
    "a block of FMI 3": {"as": "block3"},
    "substeps": {"as": "fmu3", "substeps": 3},
}


@pytest.mark.parametrize("algorithm", ["gauss-seidel", "jacobi"])
@pytest.mark.parametrize("way", WAYS)
def test_python_takes_its_turns_between_those_of_c(way: str, algorithm: str) -> None:
    python, compiled = both(train(**WAYS[way]).master(algorithm=algorithm))
    assert_equal(python, compiled)
    assert steps_compiled(compiled) == COUNT
    assert set(in_python(compiled)) == {"odometer"}
    assert 0.2 < share(compiled) < 0.8


@pytest.mark.parametrize("inputs", ["extrapolate", "interpolate"])
@pytest.mark.parametrize("every", [1, 3])
def test_lines_follow_their_sources_in_turns_too(inputs: str, every: int, tmp_path: Path) -> None:
    """The sources are stepped in C, one at a rate of its own; the lines know when each of their values was true."""
    rng = np.random.default_rng(5)
    made = Scenario(folder=tmp_path, stop=COUNT * STEP, step=STEP, master={"inputs": inputs})
    made.add("free", fmu=str(random_linear(tmp_path, "free", rng, 2)), every=every)
    made.add("next", fmu=str(random_linear(tmp_path, "next", rng, 3, inputs=2)))
    made.add("still", fmu=str(random_linear(tmp_path, "still", rng, 3)))
    made.connect("free.y1 -> next.u1", "still.y1 -> next.u2")
    python, compiled = both(made)
    assert_equal(python, compiled)
    assert set(in_python(compiled)) == {"next"}


@given(rates=st.lists(st.integers(1, 5), min_size=3, max_size=3), rest=st.integers(0, 4), seed=st.integers(0, 99))
@settings(max_examples=10, deadline=None)
def test_own_rates_are_steps_in_c(
    rates: list[int], rest: int, seed: int, tmp_path_factory: pytest.TempPathFactory
) -> None:
    """Also where the last step of a component is shorter than the others."""
    folder, rng = tmp_path_factory.mktemp("rates"), np.random.default_rng(seed)
    made = Scenario(folder=folder, stop=(20 + rest) * STEP, step=STEP)
    for i, every in enumerate(rates):
        made.add(f"c{i}", fmu=str(random_linear(folder, f"c{i}", rng, [1, 2, 3][i])), every=every)
    made.connect("c0.y1 -> c1.u1", "c1.y1 -> c2.u1", "c2.y1 -> c0.u1")
    python, compiled = both(made)
    assert_equal(python, compiled)
    assert steps_compiled(compiled) == 20 + rest
    assert share(compiled) == 1.0


@pytest.mark.parametrize(("behaviour", "version"), [("quit", 1), ("quit", 2), ("quit", 3), ("fails", 2), ("dies", 3)])
def test_the_end_of_a_run_in_a_turn(behaviour: str, version: Any, tmp_path: Path) -> None:
    """It fails or asks for the end between two that C steps, with the words and rows of a run in Python."""
    made = Scenario(folder=tmp_path, stop=20 * STEP, step=STEP)
    made.add("first", fmu=str(linear_fmu(tmp_path, "a", [[-1.0]], [[1.0]], [[1.0]], [[0.0]], version=2, x0=[1.0])))
    made.add("awkward", fmu=str(awkward_fmu(tmp_path, behaviour, version=version, at=0.42)), substeps=2)
    made.add("last", fmu=str(linear_fmu(tmp_path, "b", [[-1.0]], [[1.0]], [[1.0]], [[0.0]], version=3, x0=[1.0])))
    made.connect("first.y1 -> last.u1")
    python, compiled = both(made)
    assert_equal(python, compiled)
    assert set(in_python(compiled)) == {"awkward"}
    assert python.result.table["time"][-1] < 20 * STEP - 0.5 * STEP


def test_an_interrupt_in_a_turn_ends_the_run(monkeypatch: pytest.MonkeyPatch) -> None:
    """What is raised in a turn passes through the stepper, which is C, and is not lost there."""
    made = train(**{"as": "block3"})
    move = FMI3Slave.advance

    def interrupted(self: FMI3Slave, t: float, until: float) -> None:
        if self.name == "odometer" and t > 2.0:
            raise KeyboardInterrupt
        move(self, t, until)

    monkeypatch.setattr(FMI3Slave, "advance", interrupted)
    python, compiled = both(made)
    assert "interrupted" in str(python.failure)
    assert_equal(python, compiled)


@pytest.mark.parametrize("step", [0.1, 0.04, 0.01])
@pytest.mark.parametrize("block", [False, True])
def test_events_of_others_are_met_at_the_same_instants(step: float, block: bool, tmp_path: Path) -> None:
    """Time events are known beforehand; the triggered clock takes everybody back who has gone past it."""
    made = Scenario(folder=tmp_path, stop=1.0, step=step)
    made.add("t", fmu=str(timed_fmu(tmp_path))).add("i", fmu=str(integrator_fmu(tmp_path)))
    made.add("z", fmu=str(linear_fmu(tmp_path, "z", [[0.0]], [[1.0]], [[1.0]], [[0.0]], version=2)))
    made.connect("t.level -> z.u1, i.u")
    if block:
        made.add("odometer", model="odometer", parameters={"wheel_speed": 1.0}, **{"as": "block3"})
    python, compiled = both(made)
    assert_equal(python, compiled)
    assert share(compiled) > (0.0 if block else 0.5)
    assert python.result.summary["master"]["events"] == compiled.result.summary["master"]["events"]


@pytest.mark.parametrize("step", [0.1, 0.04, 0.01])
def test_who_meets_an_event_takes_the_others_back(step: float, tmp_path: Path) -> None:
    made = Scenario(folder=tmp_path, stop=1.0, step=step)
    made.add("s", fmu=str(triggered_fmu(tmp_path))).add("r", fmu=str(receiver_fmu(tmp_path)))
    made.add("z", fmu=str(linear_fmu(tmp_path, "z", [[0.0]], [[1.0]], [[1.0]], [[0.0]], version=2)))
    made.connect("s.crossing -> r.tick", "s.crossing_value -> r.tick_value, z.u1")
    python, compiled = both(made)
    assert_equal(python, compiled)
    assert python.result.summary["master"]["events"]["redone"] > 0
    assert python.result.summary["master"]["events"] == compiled.result.summary["master"]["events"]


@pytest.mark.parametrize("every", [1, 4])
def test_what_others_change_is_told_where_it_changes(every: int, tmp_path: Path) -> None:
    """A discrete input behind a component without events of its own, which moves in each step or every fourth."""
    made = Scenario(folder=tmp_path, stop=1.2, step=0.05)
    grows = linear_fmu(tmp_path, "z", [[1.0]], [[1.0]], [[1.0]], [[0.0]], version=2, x0=[1.0])
    made.add("z", fmu=str(grows), every=every).add("i", fmu=str(integrator_fmu(tmp_path)))
    made.connect("z.y1 -> i.u")
    python, compiled = both(made)
    assert_equal(python, compiled)
    assert python.result.summary["master"]["events"]["instants"] >= 24 // every
    assert python.result.summary["master"]["events"] == compiled.result.summary["master"]["events"]
    assert share(compiled) > 0.9


@pytest.mark.slow
@pytest.mark.parametrize("name", [name for name in shipped_scenarios() if name != "own_fmu"])
def test_shipped_scenarios_are_stepped_in_c(name: str) -> None:
    python, compiled = both(Scenario.load(name))
    assert_equal(python, compiled)
    assert share(compiled) >= 0.95
