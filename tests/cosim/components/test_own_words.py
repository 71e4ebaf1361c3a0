"""Law: an exception inside a component reaches the user in its own words, with component and time, wherever it is run.

General advice (a smaller step, look at the measurements) stands only where nothing better is known.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import failing_models
import pytest
from failing_models import WORDS

from cosim import Scenario, benchmark_observers
from cosim.diagnostics.messages import MessageLog
from cosim.errors import CosimError
from fmu_observer.formulas.moving_horizon.full_solution import WindowError
from fmu_observer.formulas.moving_horizon.full_solver import FullSolver
from fmus.hosted import build_hosted_fmu

FILE = failing_models.__file__
SYSTEMS = ("InFlow", "InOutput", "InSample", "InPacket")
KINDS = [(name, backend) for name in SYSTEMS for backend in ("block2", "block3")]
KINDS += [("PlainStep", None), ("PlainStart", None), ("Worn", "block3")]
ADVICE = ("smaller communication step", "can_be_missing")


def scenario(name: str, backend: str | None = None) -> Scenario:
    s = Scenario(stop=0.6, step=0.1, title="Boiler")
    s.add("source", model=f"{FILE}:Sine", **{"as": "block3"})
    s.add("boiler", model=f"{FILE}:{name}", **({} if backend is None else {"as": backend}))
    s.connect("source.y -> boiler.measured")
    if name == "InPacket":
        s.connect("source.y -> boiler.packet_z").network(nodes={"all": ["source.y"]}, period=0.1)
    return s


def failure(s: Scenario) -> str:
    """What a user is told, however it is told."""
    try:
        return s.run(warn=lambda _: None).failure or "nothing"
    except CosimError as error:
        return str(error)


def in_own_words(text: str, component: str = "boiler") -> None:
    assert WORDS in text
    assert component in text
    assert "t = 0" in text
    assert not any(advice in text for advice in ADVICE), text


@pytest.mark.parametrize(("name", "backend"), KINDS)
def test_of_every_kind_of_component(name: str, backend: str | None) -> None:
    in_own_words(failure(scenario(name, backend)))


@pytest.mark.parametrize("algorithm", ["jacobi", "iterate"])
def test_by_every_algorithm(algorithm: str) -> None:
    in_own_words(failure(scenario("InFlow", "block3").master(algorithm=algorithm)))


@pytest.fixture(scope="module")
def hosted(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    folder = tmp_path_factory.mktemp("hosted")
    return {name: build_hosted_fmu(f"{FILE}:{name}", folder / name) for name in ("InFlow", "InOutput")}


@pytest.mark.compiler
@pytest.mark.parametrize("name", ["InFlow", "InOutput"])
def test_of_a_hosted_fmu(name: str, hosted: dict[str, Path]) -> None:
    in_own_words(failure(Scenario(stop=0.6, step=0.1).add("boiler", fmu=str(hosted[name]))))


@pytest.mark.compiler
@pytest.mark.parametrize("kind", ["ekf", "ukf", "ensemble", "particle"])
def test_of_an_fmu_in_a_filter(kind: str, hosted: dict[str, Path]) -> None:
    moved: dict[str, Any] = {} if kind == "particle" else {"states": ["x"], "process_noise": {"x": 0.1}}
    s = Scenario(stop=0.6, step=0.1).add("source", model=f"{FILE}:Sine", **{"as": "block3"})
    keys = {"kind": kind, "measurements": {"y": 0.1}, "start_deviation": {"x": 0.1}} | moved
    s.add("boiler", fmu=str(hosted["InFlow"]), filter=keys).connect("source.y -> boiler.measured_y")
    in_own_words(failure(s))


def test_of_a_window_that_is_solved_to_convergence(monkeypatch: pytest.MonkeyPatch) -> None:
    def solve(*_: Any, **__: Any) -> Any:
        raise WindowError(WORDS)

    monkeypatch.setattr(FullSolver, "solve", solve)
    s = Scenario(stop=1.0, step=0.1, certificates="ignore").add("train", model="locomotive", **{"as": "block3"})
    full = "fmu_observer.observers.full_convergence:FullBaliseMovingHorizon"
    s.add("boiler", observer=full, **{"as": "block3"}).connect("train.wheel_speed -> boiler.odometer")
    in_own_words(failure(s))


@pytest.mark.parametrize("workers", [1, 2])
def test_in_a_sweep(workers: int) -> None:
    runs = scenario("InFlow", "block3").vary({"step": [0.1, 0.05]}).run(workers=workers).runs
    for run in runs:
        in_own_words(run.failure or "nothing")


def test_in_a_benchmark() -> None:
    s = Scenario.load("freight_profile_d").set("stop", 1.0).set("expect", []).set("report", {})
    score = benchmark_observers(s, [f"{FILE}:PlainSpeed"]).scores[-1]
    in_own_words(score.failure or "nothing", score.name)


@pytest.mark.parametrize("backend", [None, "block3", "block2", "fmu3"])
def test_of_what_cannot_be_traced(backend: str | None) -> None:
    """No time, since none is known; and nobody can trace what its author refuses."""
    with pytest.raises(CosimError) as refused:  # when it is added: its description follows from its equations
        scenario("Traced", backend)
    text = str(refused.value)
    assert WORDS in text
    assert "boiler" in text
    assert "np.where" not in text


def test_advice_stands_where_nothing_better_is_known() -> None:
    log = MessageLog("boiler")
    log.add(0.0, "hello", 0)
    log.add(0.0, "mind the gap", 1)
    assert not log.said_fault  # neither a greeting nor a warning says why
    log.add(0.0, WORDS, 3)
    assert log.said_fault
