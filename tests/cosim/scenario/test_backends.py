"""How shipped models run: native where a compiler is found, else as blocks with the same numbers; what is said of
it.
"""

from __future__ import annotations

import sys
from pathlib import Path
from threading import Barrier
from typing import Any

import numpy as np
import pytest

import fmu_observer
from cosim import Outcome, Scenario
from cosim.cli import main
from cosim.errors import FmuLoadError, ScenarioError
from fmus.build import BuildDraft
from plant_models.hybrid import HybridSystem, TriggeredEvent, input_signal, output_signal, state

pytestmark = pytest.mark.compiler


class Reckoning(HybridSystem):
    """Integrates a speed and takes the position of each balise."""

    name = "reckoning"
    description = "Integrated speed, reset at balises"
    states = (state("place", "m"),)
    inputs = (input_signal("odometer", "m/s"),)
    outputs = (output_signal("position", "m"),)
    events = (TriggeredEvent("balise", (input_signal("balise_position", "m", variability="discrete"),)),)

    def flow(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"place": u.odometer}

    def jump(self, event: str, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"place": u.balise_position}

    def output(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"position": x.place}


class Opaque(Reckoning):
    """The same, of which nothing can be traced."""

    name = "opaque"
    traceable = False


class Rolling(HybridSystem):
    """What is watched: a body that rolls on."""

    name = "rolling"
    states = (state("place", "m"), state("rate", "m/s", 12.0))
    outputs = (output_signal("position", "m"), output_signal("speed", "m/s"))

    def flow(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"place": x.rate, "rate": -0.3 * x.rate}

    def output(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"position": x.place, "speed": x.rate}


@pytest.fixture(autouse=True)
def registered(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """The systems of this file ship, and no FMU was ever built."""
    for system in (Reckoning, Opaque, Rolling):
        monkeypatch.setitem(fmu_observer.OBSERVERS, system.name, system)
    monkeypatch.setenv("FMU_OBSERVER_CACHE", str(tmp_path / "cache"))


@pytest.fixture
def no_compiler(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.delenv("CC", raising=False)
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.setitem(sys.modules, "ziglang", None)


def scenario(*observers: str) -> Scenario:
    made = Scenario(stop=2.0, step=0.1, certificates="ignore").add("plant", observer="rolling")
    for name in observers:
        made.add(name, observer=name.rstrip("2")).connect(f"plant.speed -> {name}.odometer")
    return made.balises(
        position="plant.position",
        speed="plant.speed",
        layout="positions",
        positions=[3.0, 9.0],
        receivers=list(observers),
    )


def kinds(outcome: Outcome) -> dict[str, str]:
    return {part["name"]: part["kind"] for part in outcome.result.summary["components"]}


def notes(outcome: Outcome) -> str:
    return "\n".join(note for note in outcome.result.summary["notes"] if "Python block" in note)


def run(made: Scenario, **overrides: Any) -> tuple[Outcome, list[str]]:
    """The outcome, and what was said of building."""
    said: list[str] = []
    outcome = made.run(overrides=overrides, building=said.append, warn=lambda _: None)
    assert outcome.failure is None
    return outcome, said


def assert_equal(one: Outcome, other: Outcome) -> None:
    np.testing.assert_array_equal(one.result.table, other.result.table)
    assert [e.outcomes for e in one.result.events] == [e.outcomes for e in other.result.events]
    assert len(one.result.events) == 2
    assert all(set(e.outcomes.values()) == {"accepted"} for e in one.result.events)


def test_native_where_not_said_otherwise_built_once_and_reported(tmp_path: Path) -> None:
    made = scenario("reckoning", "reckoning2", "opaque").set("reckoning.record", ["events.accepted"])
    shown = {part.name: part.kind for part in made.structure().parts}
    assert not (tmp_path / "cache").exists()
    outcome, said = run(made)
    assert kinds(outcome) == shown == {"plant": "FMU", "reckoning": "FMU", "reckoning2": "FMU", "opaque": "block"}
    assert said[0] == "building FMUs of shipped models, kept for later runs"
    assert sorted(line.split(" ... ")[0] for line in said[1:]) == ["building reckoning", "building rolling"]
    assert all(line.endswith(" s") for line in said[1:])
    assert notes(outcome) == "Cannot be traced, so they run as Python blocks: opaque."
    counts = outcome["reckoning.events.accepted"]
    assert counts.tolist() == sorted(counts)
    assert (counts[0], counts[-1]) == (0, 2)
    assert [s.name for s in outcome.result.signals if "events." in s.name] == ["reckoning.events.accepted"]
    again, said = run(made)
    assert said == []
    assert_equal(again, outcome)
    for backend in ("block3", "block2", "fmu2"):
        equal, _ = run(made, **{f"{name}.as": backend for name in ("reckoning", "reckoning2")})
        assert_equal(equal, outcome)


@pytest.mark.usefixtures("no_compiler")
def test_blocks_without_a_compiler(tmp_path: Path) -> None:
    made = scenario("reckoning")
    assert {part.kind for part in made.structure().parts} == {"block"}
    outcome, said = run(made)
    assert set(kinds(outcome).values()) == {"block"}
    assert said == []
    assert notes(outcome).startswith("Run as Python blocks, which is slower: plant, reckoning. No C compiler was found")
    with pytest.raises(FmuLoadError, match=r"components\.reckoning: cannot build the FMU of reckoning: No C compiler"):
        made.run(overrides={"reckoning.as": "fmu3"})
    assert not (tmp_path / "cache").exists()


def test_a_compiler_that_does_not_exist_or_refuses(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    made = scenario("reckoning")
    monkeypatch.setenv("CC", "no-such-compiler")
    outcome, _ = run(made)
    assert set(kinds(outcome).values()) == {"block"}
    assert "'no-such-compiler', which does not exist" in notes(outcome)
    script = tmp_path / "refuses.py"
    script.write_text("import sys\nsys.exit(0 if '--version' in sys.argv else 'out of ink')\n")
    monkeypatch.setenv("CC", f"{sys.executable} {script}")
    outcome, said = run(made)
    assert set(kinds(outcome).values()) == {"block"}
    assert "reckoning runs as a Python block, as its FMU cannot be built" in notes(outcome)
    assert "out of ink" in notes(outcome)
    assert len(said) == 1  # nothing was built
    with pytest.raises(FmuLoadError, match="out of ink"):
        made.run(overrides={"plant.as": "fmu2"}, building=said.append)


def test_what_cannot_be_traced_can_be_asked_for_in_vain() -> None:
    with pytest.raises(FmuLoadError, match=r"cannot build the FMU of opaque: .*traced"):
        scenario("opaque").run(overrides={"opaque.as": "fmu3"}, building=lambda _: None)


def test_the_command_says_what_it_builds(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "one.toml"
    file.write_text('stop = 0.2\nstep = 0.1\n[components.plant]\nobserver = "rolling"\n', encoding="utf-8")
    command = ["run", str(file), "--no-report", "--out", str(tmp_path / "out")]
    assert main(command) == 0
    lines = capsys.readouterr().err.splitlines()
    assert lines[0] == "building FMUs of shipped models, kept for later runs"
    assert lines[1].startswith("building rolling ... ")
    assert len(lines) == 2
    assert main(command) == 0
    assert capsys.readouterr().err == ""


def test_two_are_compiled_at_a_time(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each of the two waits for the other one to begin."""
    compile_one, both = BuildDraft.compile, Barrier(2, timeout=20.0)

    def compile_together(draft: BuildDraft) -> Any:
        both.wait()
        return compile_one(draft)

    monkeypatch.setattr(BuildDraft, "compile", compile_together)
    outcome, said = run(scenario("reckoning"))
    assert len(said) == 3
    assert set(kinds(outcome).values()) == {"FMU"}


@pytest.mark.parametrize("backend", ["fmu3", "block3"])
def test_a_late_policy_for_a_model_without_events_is_refused(backend: str) -> None:
    """Whether it is native or not, which may depend on the machine."""
    made = Scenario(stop=0.2, step=0.1).add("plant", observer="rolling", late_policy="reject", **{"as": backend})
    with pytest.raises(
        ScenarioError, match=r"components\.plant: this (FMU|block) has no parameter late_policy; it receives no events"
    ):
        run(made)


class Branching(Reckoning):
    """An `if` on a value, which cannot be traced and may be meant."""

    name = "branching"

    def flow(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"place": u.odometer if u.odometer > 0.0 else 0.0}


class Misspelt(Reckoning):
    """A signal that there is not."""

    name = "misspelt"

    def flow(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"place": u.odometr}


def test_only_what_may_be_meant_is_advised_to_run_in_python() -> None:
    refused = {}
    for model in (Branching, Misspelt):
        with pytest.raises(ScenarioError) as raised:
            Scenario(stop=0.1, step=0.01).add("reckoning", model=model).run()
        refused[model] = str(raised.value)
    assert "declare traceable = False" in refused[Branching]
    assert "did you mean 'odometer'?" in refused[Misspelt]
    assert "traceable" not in refused[Misspelt]
