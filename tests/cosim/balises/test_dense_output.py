"""Balises passed by a model exchange plant are found on the solver's polynomial: against closed forms."""

from __future__ import annotations

import math
from pathlib import Path

import pytest
import scipy.optimize
from hypothesis import given, settings
from hypothesis import strategies as st
from test_fmus.exchange import exchange_fmu

from cosim import CosimError, Outcome, Scenario
from plant_models import Locomotive

DRAG = 0.02


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("dense")


def place(t: float, effort: float) -> float:
    """Position [m] of the train of ``exchange.c`` at an instant [s] under a constant effort per mass [m/s2]."""
    return (10.0 - effort / DRAG) * (1.0 - math.exp(-DRAG * t)) / DRAG + effort / DRAG * t


def passed(plant: Path, step: float, stop: float, method: str = "auto", effort: float = 0.0, **more: object) -> Outcome:
    """A run of a plant over balises."""
    s = Scenario(stop=stop, step=step).add("train", fmu=str(plant), parameters={"input": effort}, **more)
    s = s.add("observer", observer="odometer_reset").connect("train.speed -> observer.odometer")
    positions = [0.5] if plant.stem.startswith("ball") else [3.0, 50.0, 100.0]
    s = s.balises(
        position="train.position", speed="train.speed", layout="positions", positions=positions, method=method
    )
    outcome = s.run()
    assert outcome.failure is None
    return outcome


@pytest.mark.parametrize("version", [1, 2, 3])
@settings(max_examples=8)
@given(step=st.sampled_from([0.02, 0.075, 0.5]), effort=st.floats(-0.3, 0.5))
def test_a_train_passes_at_the_instants_of_its_closed_form_within_the_bound(
    folder: Path, version: int, step: float, effort: float
) -> None:
    outcome = passed(exchange_fmu(folder, "TRAIN", version, units=True), step, 6.0, effort=effort)
    events = outcome.result.events
    assert events
    for event in events:
        assert event.method == "dense-output"
        true = scipy.optimize.brentq(lambda t, at=event.position: place(t, effort) - at, 0.0, 30.0, xtol=1e-14)
        assert abs(event.stamp - true) <= event.time_bound < 1e-5


def test_what_turns_and_bounces_within_a_step_is_found_each_time(folder: Path) -> None:
    """A ball between floor and top passes half a metre on its way down and, as long as it gets there, up and down."""
    outcome = passed(exchange_fmu(folder, "BALL", units=True), 0.4, 1.2, tolerance=1e-11)
    fall = math.sqrt(2.0 / 9.81)
    up = 0.7 * 9.81 * fall
    late = math.sqrt(1.0 / 9.81)
    true = [late, *(fall + (up + sign * math.sqrt(up * up - 9.81)) / 9.81 for sign in (-1.0, 1.0) if up * up > 9.81)]
    stamps = [event.stamp for event in outcome.result.events]
    assert stamps == pytest.approx(true, abs=1e-9)


def test_the_plant_moves_as_it_does_without_balises(folder: Path) -> None:
    plant = exchange_fmu(folder, "TRAIN", units=True)
    found = passed(plant, 0.1, 12.0)
    alone = Scenario(stop=12.0, step=0.1).add("train", fmu=str(plant)).run()
    ends = {float(t): x for t, x in zip(alone["time"], alone["train.position"], strict=True)}
    table = found.result.table
    rows = [(float(t), x) for t, x in zip(table["time"], table["train.position"], strict=True) if float(t) in ends]
    assert all(ends[t] == x for t, x in rows)
    assert len(rows) >= len(ends)


def test_a_plant_that_no_solver_moves_here_is_refused() -> None:
    s = Scenario(stop=1.0, step=0.1).add("train", model=Locomotive())
    s = s.add("observer", observer="odometer_reset").connect("train.speed -> observer.odometer")
    s = s.balises(position="train.position", speed="train.speed", layout="positions", positions=[5.0])
    s = s.balises(method="dense-output")
    with pytest.raises(CosimError, match=r"'dense-output': train is no model exchange FMU"):
        s.run()
