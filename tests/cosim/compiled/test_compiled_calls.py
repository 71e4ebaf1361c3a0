"""The compiled stepper makes the calls that the Python stepper makes, and whichever of them fails, the run ends the
same way.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import pytest
from compiled_runs import assert_equal, both

import fmus.fmi.fmi3 as dialect
from cosim import Scenario
from cosim.master.master import Master

RECEIVER, PLANT = "takagi_sugeno_cdo", "locomotive"
FUNCTIONS = (
    "fmi3SetFloat64",
    "fmi3DoStep",
    "fmi3GetFloat64",
    "fmi3EnterEventMode",
    "fmi3SetClock",
    "fmi3UpdateDiscreteStates",
    "fmi3EnterStepMode",
    "fmi3SetFMUState",
    "fmi3GetFMUState",
    "fmi3FreeFMUState",
)
INSTANT = 0.213
ERROR = 3


@dataclass
class Call:
    """A call of a function: of which component, after how many of its steps, which one since then, with what."""

    component: str
    function: str
    steps: int
    since: int
    arguments: tuple[Any, ...]


Wrap = Callable[[Call], int | None]


@pytest.fixture
def spied(monkeypatch: pytest.MonkeyPatch) -> Iterator[Callable[[Wrap], None]]:
    """Puts a function of the test in front of those of plant and receiver, wherever the call comes from; it may answer
    itself.
    """
    kept: list[Any] = []
    real = dialect.quicken

    def install(wrap: Wrap) -> None:
        def quicken(slave: Any, *more: Any) -> None:
            counts: dict[str, int] = dict.fromkeys(FUNCTIONS, 0)
            for function in FUNCTIONS if slave.instanceName in (RECEIVER, PLANT) else ():
                slave._functions[function] = _in_front(slave, function, wrap, counts, kept)
            real(slave, *more)

        monkeypatch.setattr(dialect, "quicken", quicken)

    yield install
    kept.clear()


def _in_front(slave: Any, function: str, wrap: Wrap, counts: dict[str, int], kept: list[Any]) -> Any:
    known = slave._functions[function]
    real = getattr(known, "behind", known)  # a library that is kept for the next run keeps its table
    steps = since = 0

    def call(*arguments: Any) -> int:
        nonlocal steps, since
        since = since + 1 if counts["fmi3DoStep"] == steps else 1
        steps = counts["fmi3DoStep"]
        counts[function] += 1
        said = wrap(Call(slave.instanceName, function, steps, since, arguments))
        return int(real(*arguments)) if said is None else said

    made = ctypes.CFUNCTYPE(ctypes.c_int, *real.argtypes)(call)
    made.argnames, made.restype, made.behind = real.argnames, ctypes.c_int, real
    kept.append(made)
    return made


def scenario(latency: float) -> Scenario:
    """A plant, its odometer and one observer; two balises at known instants."""
    made = Scenario(stop=0.5, step=0.01, certificates="ignore").add(PLANT, model=PLANT, parameters={"effort": 3e4})
    made.add("odometer", model="odometer").add(RECEIVER, observer=RECEIVER, **{"as": "fmu3"})
    made.connect("locomotive.wheel_speed -> odometer.wheel_speed", f"odometer.reading -> {RECEIVER}.odometer")
    return made.balises(
        position="locomotive.position",
        speed="locomotive.speed",
        odometer="odometer.reading",
        layout="instants",
        instants=[INSTANT, 0.3, 0.304],
        latency=latency,
        method="rollback",
    )


@pytest.mark.parametrize("latency", [0.0, 0.013, 0.007])
def test_equal_calls_in_equal_order(
    spied: Callable[[Wrap], None], latency: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """From the begin of the run on: what builds and probes an FMU before it depends on the caches. With a latency of
    7 ms the first telegram is delivered at a communication point.
    """
    calls: list[tuple[Any, ...]] = []

    def note(call: Call) -> None:
        calls.append((call.component, call.function, *(call.arguments[1:3] if call.function == "fmi3DoStep" else ())))

    run = Master.run
    monkeypatch.setattr(Master, "run", lambda master: (calls.clear(), run(master))[1])
    spied(note)
    runs = []
    for stepper in ("python", "compiled"):
        outcome = scenario(latency).run(overrides={"master.stepper": stepper}, warn=lambda _: None)
        assert outcome.failure is None
        assert len(outcome.result.events) == 3
        runs.append(list(calls))
    assert len(runs[0]) > 200
    assert runs[1] == runs[0]


def _places() -> list[tuple[str, str, int, int]]:
    """Component, function, steps done, and which call since then: in an ordinary step, and all around the first
    telegram.
    """
    around = 21  # steps before the one with the telegram
    plain = [(RECEIVER, f, 9, 1) for f in FUNCTIONS[:3]]
    plant = [(PLANT, f, around + 1, 1) for f in ("fmi3DoStep", "fmi3GetFloat64", "fmi3SetFMUState", "fmi3FreeFMUState")]
    plant += [(PLANT, "fmi3GetFMUState", around, 1)]
    moves = [(RECEIVER, f, around + i, 1 + i) for f in FUNCTIONS[:3] for i in (0, 1)]
    events = [(RECEIVER, f, around + 1, 1) for f in FUNCTIONS[3:7]]
    return plain + plant + moves + events


def test_any_call_may_fail(spied: Callable[[Wrap], None]) -> None:
    """The step over the telegram is done in two parts by the receiver, and three times by the plant."""
    failures = 0
    for component, function, steps, since in _places():

        def failing(call: Call, at: tuple[Any, ...] = (component, function, steps, since)) -> int | None:
            return ERROR if (call.component, call.function, call.steps, call.since) == at else None

        spied(failing)
        python, compiled = both(scenario(0.0))
        failures += python.failure is not None
        assert_equal(python, compiled)
    assert failures > 10


def test_what_an_update_asks_for_is_done(spied: Callable[[Wrap], None]) -> None:
    """It asks for another update, or for the end of the run, or names a next event: Python goes on from there."""
    for place in (1, 2, 5):  # of the flags and the time among the arguments

        def asking(call: Call, place: int = place) -> int | None:
            if (call.component, call.function, call.steps, call.since) != (RECEIVER, "fmi3UpdateDiscreteStates", 22, 1):
                return None
            for argument in call.arguments[1:6]:
                argument[0] = False
            call.arguments[place][0], call.arguments[6][0] = True, 0.4
            return 0

        spied(asking)
        assert_equal(*both(scenario(0.0)))
