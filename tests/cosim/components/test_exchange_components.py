"""Model exchange FMUs behave as slaves: against closed forms, in FMI 1, 2 and 3, through components of the master."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from test_fmus.exchange import exchange_fmu
from test_fmus.stepped import Stepped

from cosim.components.loading import load_fmu
from cosim.errors import FmuLoadError, RunError
from fmus.exchange.model_calls import ModelCalls

VERSIONS = (1, 2, 3)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("exchange")


@pytest.fixture
def stepped() -> Iterator[list[Stepped]]:
    made: list[Stepped] = []
    yield made
    for one in made:
        one.free()


def for_three_seconds(fmu: Stepped, value: float) -> None:
    """Steps of 0.1 s, from the second one on under an input."""
    for k in range(1, 31):
        fmu.to(0.1 * k, value if k > 1 else 0.0)


def bounces(end: float) -> list[float]:
    """Instants [s] before an end at which a ball dropped from 1 m meets the floor, with 0.7 of its speed kept."""
    fall = math.sqrt(2.0 / 9.81)
    found, speed = [fall], 0.7 * 9.81 * fall
    while found[-1] + 2.0 * speed / 9.81 < end:
        found.append(found[-1] + 2.0 * speed / 9.81)
        speed *= 0.7
    return found


@pytest.mark.parametrize("version", VERSIONS)
def test_a_linear_model_follows_its_closed_form_whatever_the_steps_and_inputs(
    folder: Path, stepped: list[Stepped], version: int
) -> None:
    fmu = Stepped(exchange_fmu(folder, "DECAY", version))
    stepped.append(fmu)
    x, t = 1.0, 0.0
    for h, u in [(0.1, 0.0), (0.25, 0.0), (1e-3, 2.0), (0.7, 2.0), (0.02, -3.0), (1.3, -3.0)]:
        x = u + (x - u) * math.exp(-h)
        t += h
        assert fmu.to(t, u)[0] == pytest.approx(x, abs=3e-9)


@pytest.mark.parametrize("version", VERSIONS)
def test_a_ball_bounces_at_the_instants_of_its_closed_form(folder: Path, stepped: list[Stepped], version: int) -> None:
    fmu = Stepped(exchange_fmu(folder, "BALL", version), 1e-12)
    stepped.append(fmu)
    for number, instant in enumerate(bounces(2.2)[:6]):
        assert fmu.to(instant - 1e-9)[-1] == number
        assert fmu.to(instant + 1e-9)[-1] == number + 1


@pytest.mark.parametrize("version", VERSIONS)
def test_time_events_are_hit_exactly_and_an_end_that_is_asked_for_is_the_end(
    folder: Path, stepped: list[Stepped], version: int
) -> None:
    fmu = Stepped(exchange_fmu(folder, "STAIR", version))
    stepped.append(fmu)
    for k in range(1, 10):
        assert fmu.to(0.3 * k - 1e-9)[0] == k - 1
        assert fmu.to(0.3 * k)[0] == k
    assert not fmu.component.terminated
    fmu.to(4.0)
    assert fmu.component.terminated
    assert fmu.component.time == pytest.approx(3.0, abs=1e-12)


@pytest.mark.parametrize("version", VERSIONS)
def test_an_event_after_a_step_of_the_solver_is_handled(folder: Path, stepped: list[Stepped], version: int) -> None:
    fmu = Stepped(exchange_fmu(folder, "STEPS", version))
    stepped.append(fmu)
    assert fmu.to(0.5).tolist() == pytest.approx([math.exp(-0.5), 0.0], abs=1e-8)
    position, count = fmu.to(1.5)
    assert count == 1.0
    assert 2.0 * math.exp(-1.0) - 1e-8 < position < 2.0 * math.exp(-1.0) * 1.1  # it jumped within a step


@pytest.mark.parametrize("version", [2, 3])
@given(
    cut=st.floats(0.01, 0.09),
    steps=st.lists(st.floats(0.02, 0.3), min_size=1, max_size=4),
    u=st.floats(-3.0, 3.0),
)
def test_what_follows_a_restored_state_is_identical(
    folder: Path, version: int, cut: float, steps: list[float], u: float
) -> None:
    fmu = Stepped(exchange_fmu(folder, "BALL", version), 1e-8)
    try:
        fmu.to(cut, u)
        state = fmu.component.save()
        runs = []
        for other in (u, 0.5 * u):  # on from the save, then back from elsewhere, where another input was
            if runs:
                fmu.component.restore(state)
            fmu.time = cut
            runs.append([fmu.to(cut + sum(steps[: k + 1]), u).tolist() for k in range(len(steps))])
            fmu.to(fmu.time + 0.1, other + 1.0)
        assert runs[0] == runs[1]
        fmu.component.release(state)
    finally:
        fmu.free()


def test_a_solver_goes_on_with_what_it_knows_where_nothing_jumps(folder: Path, stepped: list[Stepped]) -> None:
    still, jumping = (Stepped(exchange_fmu(folder, "DECAY")) for _ in range(2))
    stepped += [still, jumping]
    for k in range(1, 51):
        still.to(0.1 * k, 0.0)
        jumping.to(0.1 * k, float(k % 2))
    steps = [one.component.slave.solved.motion.solver.steps for one in (still, jumping)]
    assert 3 * steps[0] < steps[1]


@pytest.mark.parametrize("version", VERSIONS)
def test_starts_of_the_solver_do_not_add_their_errors_up(folder: Path, stepped: list[Stepped], version: int) -> None:
    """The input jumps at each of a thousand communication points; the train of ``exchange.c`` runs a hundred metres."""
    fmu, drag, h = Stepped(exchange_fmu(folder, "TRAIN", version), 1e-8), 0.02, 0.01
    stepped.append(fmu)
    position, speed, fall = 0.0, 10.0, math.exp(-drag * h)
    for k in range(1000):
        effort = 0.3 + 1e-6 * k
        left = speed - effort / drag
        position, speed = position + left * (1.0 - fall) / drag + effort / drag * h, effort / drag + left * fall
        fmu.to(h * (k + 1), effort)
    assert fmu.outputs[0] == pytest.approx(position, abs=10.0 * 1e-8 * position)  # what bounds of instants allow


@pytest.mark.parametrize("version", VERSIONS)
@pytest.mark.parametrize(
    ("model", "value", "words"),
    [
        ("BALL", 0.0, r"t = 2\.5.*events do not settle at t = 2\.558\d* s: 101 of them"),
        ("CHATTERS", 0.0, r"events do not settle at t = 0\.25 s: 101 of them"),
        ("UNSETTLED", 2.0, r"t = 0\.1 s: .*discrete states do not settle in 100 updates"),
        ("ESCAPES", 0.0, r"CVODE\) gives up at t = 0\.99999\d* s: however small its step.*worst for state ('speed'|2)"),
        ("REFUSES", 0.0, r"gives up at t = 0\.5\d* s: the derivatives cannot be had \(fmi\d\w* failed with status 3"),
    ],
    ids=["accumulates", "chatters", "unsettled", "escapes", "refuses"],
)
def test_what_does_not_settle_and_solvers_that_fail_are_reported_with_component_time_and_state(
    folder: Path, stepped: list[Stepped], version: int, model: str, value: float, words: str
) -> None:
    fmu = Stepped(exchange_fmu(folder, model, version))
    stepped.append(fmu)
    with pytest.raises(RunError, match=rf"(?s)Component 'plant' .*{words}"):
        for_three_seconds(fmu, value)


@pytest.mark.parametrize("method", ["bdf", "adams"])
def test_the_tolerance_is_that_of_the_solver(folder: Path, method: str) -> None:
    errors = []
    for tolerance in (1e-4, 1e-7, 1e-10):
        fmu = Stepped(exchange_fmu(folder, "DECAY"), tolerance)
        fmu.component.slave.solved._method = method
        errors.append(abs(fmu.to(3.0)[0] - math.exp(-3.0)))
        fmu.free()
    assert errors[0] > errors[1] > errors[2]
    assert errors[2] < 1e-9


@pytest.mark.parametrize("version", VERSIONS)
@pytest.mark.parametrize(
    "model", ["DECAY", "BALL", "STAIR", "STEPS", "TRAIN", "ESCAPES", "REFUSES", "OSCILLATES", "REACTION"]
)
def test_steps_of_the_solver_in_c_give_the_bits_and_words_of_those_in_python(
    folder: Path, monkeypatch: pytest.MonkeyPatch, model: str, version: int
) -> None:
    seen = []
    for native in (True, False):
        if not native:
            monkeypatch.setattr(ModelCalls, "native", lambda *_: None)
        fmu, rows = Stepped(exchange_fmu(folder, model, version), 1e-7), list[object]()
        assert (fmu.component.slave.solved.motion.solver.native is not None) == native
        try:
            rows.extend(fmu.to(0.1 * k, 0.1 * (k // 3)).tobytes() for k in range(1, 23))
        except RunError as error:
            rows.append(str(error))
        rows.append(fmu.component.slave.solved.motion.solver.steps)
        seen.append(rows)
        fmu.free()
    assert seen[0] == seen[1]


def test_an_interface_that_an_fmu_does_not_offer_is_refused(folder: Path) -> None:
    with pytest.raises(FmuLoadError, match=r"offers model exchange only; co-simulation is asked for"):
        load_fmu(exchange_fmu(folder, "DECAY"), "plant", interface="co-simulation")


def test_a_state_that_the_fmu_cannot_save_cannot_be_had(folder: Path, stepped: list[Stepped]) -> None:
    fmu = Stepped(exchange_fmu(folder / "without", "DECAY", saves=False))
    stepped.append(fmu)
    assert not fmu.component.can_save
