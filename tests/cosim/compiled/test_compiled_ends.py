"""The compiled stepper and everything that is out of the ordinary: Python finishes the step, with the same result."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from compiled_runs import assert_equal, both, chain, random_linear, steps_compiled
from test_fmus.build import linear_fmu
from test_fmus.events import awkward_fmu, periodic_fmu, timed_fmu, triggered_fmu

from cosim import Scenario
from cosim.compiled import compiled_stepper, library
from cosim.errors import CouplingError
from fmus.toolchain.compile import CompilerMissing

ENDS = [
    ("quit", 1),
    ("quit", 2),
    ("quit", 3),
    ("quit-in-event", 3),
    ("discard", 1),
    ("discard", 2),
    ("discard", 3),
    ("discard-silently", 2),
    ("short", 3),
    ("halves", 3),
    ("own-steps", 3),
    ("warns", 2),
    ("warns", 3),
    ("fails", 1),
    ("fails", 2),
    ("fails", 3),
    ("dies", 2),
    ("dies", 3),
    ("waits", 2),
    ("chatty", 2),
    ("chatty", 3),
]


def around(folder: Path, fmu: Path, **tables: Any) -> Scenario:
    """One linear FMU that feeds `fmu`, and one that it feeds."""
    rng = np.random.default_rng(11)
    before, after = (random_linear(folder, name, rng, version) for name, version in (("before", 2), ("after", 3)))
    scenario = Scenario(folder=folder, **({"stop": 1.0, "step": 0.1} | tables))
    scenario.add("before", fmu=str(before)).add("odd", fmu=str(fmu)).add("after", fmu=str(after))
    return scenario.connect("before.y1 -> odd.u", "odd.y -> after.u1")


@pytest.mark.parametrize(("behaviour", "version"), ENDS)
@pytest.mark.parametrize("algorithm", ["gauss-seidel", "jacobi"])
def test_awkward_fmus(tmp_path: Path, behaviour: Any, version: Any, algorithm: str) -> None:
    scenario = around(tmp_path, awkward_fmu(tmp_path, behaviour, version=version))
    overrides = {"master.algorithm": algorithm, "master.events": "local"}
    python, compiled = both(scenario, **overrides)
    assert_equal(python, compiled)
    if behaviour != "short":  # that is trouble in every step
        assert steps_compiled(compiled) >= 2  # up to the trouble, which begins in the third step
    assert len(compiled.result.table) > 2


def test_early_returns_and_time_events_are_finished_in_python(tmp_path: Path) -> None:
    scenario = Scenario(folder=tmp_path, stop=3.0, step=0.1)
    for name, fmu in (("t", triggered_fmu(tmp_path)), ("j", timed_fmu(tmp_path)), ("p", periodic_fmu(tmp_path))):
        scenario.add(name, fmu=str(fmu))
    scenario.add("z", fmu=str(linear_fmu(tmp_path, "z", [[0.0]], [[1.0]], [[1.0]], [[0.0]], version=2)))
    scenario.connect("j.level -> z.u1").master(events="local")
    python, compiled = both(scenario)
    assert python.failure is None
    assert_equal(python, compiled)


@pytest.mark.parametrize("version", [2, 3])
def test_values_that_are_not_finite(tmp_path: Path, version: Any) -> None:
    """It grows by e^100 in each step until it overflows; the row with the infinity is kept."""
    grows = linear_fmu(tmp_path, "grows", [[100.0]], [[0.0]], [[1.0]], [[0.0]], version=version, x0=[1.0])
    scenario = chain(
        tmp_path, [grows, random_linear(tmp_path, "next", np.random.default_rng(1), 3)], stop=20.0, step=1.0
    )
    python, compiled = both(scenario)
    assert python.failure is not None
    assert "grows" not in python.failure  # by the names of the components
    assert "c0.y1 is inf" in python.failure
    assert_equal(python, compiled)
    assert len(compiled.result.table) == 9  # e^709 is the largest double: the eighth step


def test_an_interrupt_keeps_the_rows(tmp_path: Path) -> None:
    scenario = chain(tmp_path, [random_linear(tmp_path, "a", np.random.default_rng(1), 2)], stop=1000.0, step=0.01)
    reported: list[float] = []

    def interrupt(t: float, _stop: float) -> None:
        reported.append(t)
        if t > 50.0:
            raise KeyboardInterrupt

    outcome = scenario.run(progress=interrupt, overrides={"master.stepper": "compiled"}, warn=lambda _: None)
    assert outcome.failure is not None
    assert "interrupted" in outcome.failure
    assert outcome.result.table["time"][-1] == reported[-1] > 50.0
    assert len(outcome.result.table) < 100_001
    assert len(reported) > 3  # again and again on the way, not once at the end


def test_without_a_compiler_python_does_it_and_says_so(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    scenario = chain(tmp_path, [random_linear(tmp_path, "a", np.random.default_rng(1), 2)], stop=1.0, step=0.1)
    reference = scenario.run(overrides={"master.stepper": "python"}, warn=lambda _: None)

    def none() -> Any:
        raise CompilerMissing("No C compiler was found.")

    monkeypatch.setattr(library, "find_compiler", none)
    outcome = scenario.run(warn=lambda _: None)
    stepper = outcome.result.summary["master"]["stepper"]
    assert stepper["name"] == "python"
    assert "No C compiler was found" in stepper["reason"]
    assert outcome.result.table.tobytes() == reference.result.table.tobytes()
    assert any("No C compiler was found" in note for note in outcome.result.summary["notes"])
    assert reference.result.summary["notes"] == []  # somebody wanted it so
    with pytest.raises(CouplingError, match=r"master\.stepper = 'compiled' cannot be: .*No C compiler was found"):
        scenario.run(overrides={"master.stepper": "compiled"}, warn=lambda _: None)


def test_a_block_alone_stays_with_python(tmp_path: Path) -> None:
    alone = {"wheel_speed": 0.0}
    scenario = Scenario(folder=tmp_path, stop=1.0, step=0.1)
    scenario.add("odometer", model="odometer", parameters=alone, **{"as": "block3"})
    stepper = scenario.run(warn=lambda _: None).result.summary["master"]["stepper"]
    assert (stepper["name"], stepper["steps_compiled"]) == ("python", 0)
    assert "odometer runs in Python" in stepper["reason"]


def test_the_library_is_compiled_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    compiler = library.find_compiler()
    path = library._stepper_library(compiler, tmp_path)
    before = path.stat().st_mtime_ns

    def never(*_: Any) -> Any:
        raise AssertionError("compiled again")

    monkeypatch.setattr("fmus.toolchain.cached_library.compile_library", never)
    assert library._stepper_library(compiler, tmp_path) == path
    assert path.stat().st_mtime_ns == before
    assert sorted(p.name for p in path.parent.iterdir()) == [f"{path.stem}.sha256", path.name]


def test_progress_is_reported_up_to_the_end(tmp_path: Path) -> None:
    scenario = chain(tmp_path, [random_linear(tmp_path, "a", np.random.default_rng(1), 3)], stop=100.0, step=0.01)
    reported: list[float] = []
    outcome = scenario.run(progress=lambda t, _: reported.append(t), warn=lambda _: None)
    assert steps_compiled(outcome) == 10_000
    assert reported == sorted(reported)
    assert reported[-1] == 100.0
    assert max(np.diff(reported)) <= 4096 * 0.01 + 1e-9


def test_the_loop_of_the_master_may_stop_inside(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Steps done in Python between chunks do not disturb them: every 13th step is taken away from the stepper."""
    rng = np.random.default_rng(5)
    scenario = chain(
        tmp_path, [random_linear(tmp_path, f"m{i}", rng, v) for i, v in enumerate((2, 3, 2))], stop=5.0, step=0.01
    )
    reference = scenario.run(overrides={"master.stepper": "python"}, warn=lambda _: None)
    real = compiled_stepper.CompiledStepper._free_steps
    monkeypatch.setattr(compiled_stepper.CompiledStepper, "_free_steps", lambda self, k: min(real(self, k), (-k) % 13))
    outcome = scenario.run(overrides={"master.stepper": "compiled"}, warn=lambda _: None)
    assert 0 < steps_compiled(outcome) < 500
    assert outcome.result.table.tobytes() == reference.result.table.tobytes()


def test_a_chunk_ends_when_its_time_is_up(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """With no time at all the routine comes back as soon as it looks at the clock, and does single steps from then
    on.
    """
    scenario = chain(tmp_path, [random_linear(tmp_path, "a", np.random.default_rng(1), 3)], stop=5.0, step=0.01)
    real = compiled_stepper.CompiledStepper.__init__

    def hurried(self: Any, *arguments: Any) -> None:
        real(self, *arguments)
        self._longest = 400

    monkeypatch.setattr(compiled_stepper, "SECONDS", 0.0)
    monkeypatch.setattr(compiled_stepper.CompiledStepper, "__init__", hurried)
    reported: list[float] = []
    outcome = scenario.run(progress=lambda t, _: reported.append(t), warn=lambda _: None)
    assert steps_compiled(outcome) == 500
    assert reported[0] == pytest.approx(0.17, rel=1e-12)
    assert max(np.diff(reported[:-1])) == pytest.approx(0.01, rel=1e-9)
