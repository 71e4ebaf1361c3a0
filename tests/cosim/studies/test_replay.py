"""Replay: the run again to the bit, many members, and what cannot be replayed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import cosim
from cosim.run.outcome import Outcome
from cosim.studies.replay import Replay, ReplayError
from fmu_observer.observers.motors.motor_ekf import ROWS

pytestmark = pytest.mark.compiler

STATES = ("current_d", "current_q")


def drive(stop: float = 0.05, **changes: object) -> cosim.Scenario:
    scenario = cosim.Scenario.load("traction_drive").set("stop", stop).set("expect", [])
    for name, value in changes.items():
        scenario.set(name.replace("__", "."), value)
    return scenario


@pytest.fixture(scope="module")
def run() -> Outcome:
    return drive().run()


@pytest.fixture(scope="module")
def replay(run: Outcome) -> Replay:
    return Replay(run, "filter")


def test_members_are_runs_of_their_own(replay: Replay) -> None:
    """Each to the bit what a run with these parameters gives: control has sensors, so the drive is the same."""
    rows = np.array([ROWS["hand"], ROWS["pso_20"]])
    got = replay.run(STATES, {"process_variance": rows[:, :4], "measurement_variance": rows[:, 4:]})
    for member, preset in enumerate(("hand", "pso_20")):
        alone = drive(filter__preset=preset).run()
        for i, state in enumerate(STATES):
            np.testing.assert_array_equal(got[member, :, i], alone[f"filter.{state}"])


def test_a_batch_serves_again(replay: Replay, run: Outcome) -> None:
    other = replay.run(STATES, {"measurement_variance": [0.1, 0.1]})
    again = replay.run(STATES)
    np.testing.assert_array_equal(again[0, :, 0], run["filter.current_d"])
    assert (other[0] != again[0]).any()
    assert replay.run(STATES, members=3).shape == (3, len(run.result.time), 2)


def test_late_inputs_change_the_errors(replay: Replay, run: Outcome) -> None:
    reported = replay.run(STATES, late={"voltage_d": 1, "voltage_q": 1})[0]
    assert (reported[:, 0] != run["filter.current_d"]).any()
    with pytest.raises(ReplayError, match=r"no connected input 'voltage'.*voltage_d"):
        replay.run(STATES, late={"voltage": 1})


@pytest.mark.parametrize("change", [{"filter__as": "block3"}, {"filter__as": "fmu2"}])
def test_other_forms(change: dict[str, object]) -> None:
    """The check at the start compares with the run, to the bit."""
    Replay(drive(0.01, **change).run(), "filter")


def test_connections_that_change_numbers() -> None:
    lines = [line for line in drive().table().connections if "measured_current_d" not in str(line)]
    scaled = {"from": "motor.measured_current_d", "to": "filter.measured_current_d", "factor": 1.1, "offset": 0.2}
    Replay(drive(0.01, connections=[*lines, scaled]).run(), "filter")


def test_costs_of_printed_rows() -> None:
    """The order of the final rows, and the floor 0.0147 +- 0.002, on one second; ten seeds in the gallery."""
    outcome = drive(1.0).run()
    rows = np.array([ROWS[name] for name in ("hand", "ga_20", "pso_20", "bbo_20", "true_noise")])
    parameters = {"process_variance": rows[:, :4], "measurement_variance": rows[:, 4:]}
    reported = Replay(outcome, "filter").run(STATES, parameters)
    true = np.stack([outcome[f"motor.{state}"] for state in STATES], axis=1)
    costs = np.mean((reported - true)[:, 1:] ** 2, axis=1).sum(axis=1)
    assert (np.diff(costs) < 0.0).all()
    assert costs[-1] == pytest.approx(0.0147, abs=0.002)
    assert costs[:4] == pytest.approx([0.0882, 0.0155, 0.0148, 0.0138], rel=0.2)  # one seed, and two likely misprints


def test_what_cannot_be_replayed(run: Outcome) -> None:
    with pytest.raises(ReplayError, match=r"no component 'filtre'.*filter"):
        Replay(run, "filtre")
    with pytest.raises(ReplayError, match="The run failed"):
        Replay(replace(run, result=replace(run.result, failure="it broke")), "filter")
    with pytest.raises(ReplayError, match="Only the outcome of a scenario"):
        Replay(replace(run, origin=None), "filter")
    with pytest.raises(ReplayError, match="record_every = 1"):
        Replay(drive(0.01, master__record_every=10).run(), "filter")
    with pytest.raises(ReplayError, match="rate of its own"):
        Replay(drive(0.01, filter__every=2).run(), "filter")
    changed = run.result.table.copy()
    changed["filter.speed"][70] += 1e-9
    with pytest.raises(ReplayError, match=r"differs from the run: speed is .* at 0\.007 s"):
        Replay(replace(run, result=replace(run.result, table=changed)), "filter")
    reported = cosim.Scenario(stop=0.1, step=0.1, certificates="ignore").add(
        "it", observer="discrete_uio", parameters={"odometer": 0.0}, **{"as": "block3"}
    )
    with pytest.raises(ReplayError, match="receives events"):
        Replay(reported.run(), "it")
    with pytest.raises(
        ReplayError, match="differs from the run"
    ):  # what it held before the first sample is not recorded
        Replay(drive(0.01, master__algorithm="jacobi").run(), "filter")
