"""The exported loop in somebody else's master: how exact its events are, in sequence, in parallel, and with a wrong
setting.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict

import numpy as np
import pytest
from balise_loop import balise_loop
from foreign_loops import (
    MASTERS,
    SPACING,
    STEP,
    STEPS,
    Crossings,
    accuracy,
    exact_observer,
    fine_crossings,
    in_time,
    run_master,
)

pytestmark = [pytest.mark.compiler, pytest.mark.foreign]

# The cubic against the plant's own crossing: 3e-10 s at this step and train, see test_c_host.py.
STAMP = 1e-9
# What that is in the observer: 14 m/s of it in the position, at each balise anew, and 20 1/s of that in the speed.
POSITION, SPEED = 3e-8, 1e-7


@pytest.fixture(scope="module")
def ran(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str, int], np.ndarray]:
    """``ran(master, input_instant)``: the result, each run once; skipped where the package is absent."""
    tables: dict[tuple[str, int], np.ndarray] = {}

    def run(master: str, input_instant: int) -> np.ndarray:
        pytest.importorskip(MASTERS[master].package)
        key = (master, input_instant)
        if key not in tables:
            tables[key] = run_master(master, input_instant, tmp_path_factory.mktemp(master))
        return tables[key]

    return run


@pytest.mark.parametrize("master", MASTERS)
def test_events_are_exact_in_a_foreign_master(
    master: str, ran: Callable[[str, int], np.ndarray], record_property: Callable[[str, object], None]
) -> None:
    lag = MASTERS[master].lag
    table = ran(master, 1 - lag)
    crossings = Crossings.of(table)
    instants, positions = fine_crossings(table)
    assert len(instants) > 80
    assert table["reader.lost_count"].max() == 0.0
    # libcosim sets the plant's clock in nanoseconds, the container adds times up: the plant's own grid is the same.
    np.testing.assert_allclose(table["train.position"], positions, rtol=0.0, atol=1e-10)
    np.testing.assert_array_equal(crossings.places, SPACING * (1.0 + np.arange(len(crossings.places))))
    assert len(crossings.stamps) == len(instants)
    found = accuracy(table, lag)
    for name, value in asdict(found).items():
        record_property(name, value)  # into the report, with --junit-xml; the benchmark native_fmu.py prints them
    assert found.stamps <= STAMP
    assert found.position <= POSITION
    assert found.speed <= SPEED

    exact, reported = exact_observer(table, instants, lag), in_time(table, instants, lag)
    assert reported.mean() > 0.9
    if lag == 0:
        assert reported[1:].all()  # nothing is ever told late
    else:
        late = np.abs(table["observer.speed"] - exact["speed"])[1:][~reported[1:]]
        assert late.max() > 1e-3  # for a step or two it does not know


@pytest.mark.parametrize("master", MASTERS)
def test_the_wrong_input_instant_shifts_the_train_by_a_step(master: str, ran: Callable[[str, int], np.ndarray]) -> None:
    lag = MASTERS[master].lag
    table = ran(master, lag)
    crossings = Crossings.of(table)
    instants, _ = fine_crossings(table)
    shift = STEP if lag else -STEP
    np.testing.assert_allclose(crossings.stamps, instants + shift, rtol=0.0, atol=STAMP)
    # Where the train holds its speed, a constant delay is a constant error of the position: speed times step.
    hold = table["time"] > 30.0
    error = (table["observer.position"] - table["train.position"])[hold]
    right = ran(master, 1 - lag)
    ours = (right["observer.position"] - right["train.position"])[hold]
    assert np.median(error) - np.median(ours) == pytest.approx(-shift * 50.0 / 3.6, rel=0.01)


def test_two_masters_of_equal_order_agree(ran: Callable[[str, int], np.ndarray]) -> None:
    ours, theirs = ran("container-parallel", 0), ran("libcosim-parallel", 0)
    for name in ("train.position", "reader.balise_time", "observer.position", "observer.speed"):
        # Two ways to add up 4000 times of 10 ms differ by up to 1e-11 s.
        np.testing.assert_allclose(ours[name][1:], theirs[name][1:], rtol=1e-9, atol=1e-9)


def test_in_sequence_it_is_the_run_of_the_package_own_master(ran: Callable[[str, int], np.ndarray]) -> None:
    table = ran("container-sequential", 1)
    outcome = balise_loop(STEPS * STEP, STEP, SPACING, "rollback").run()
    np.testing.assert_allclose(
        Crossings.of(table).stamps, [e.stamp for e in outcome.result.events], rtol=0.0, atol=STAMP
    )
    rows = np.searchsorted(np.asarray(outcome["time"]), table["time"] + 1e-6) - 1
    for name, atol in (("train.position", 1e-10), ("observer.position", POSITION), ("observer.speed", SPEED)):
        np.testing.assert_allclose(table[name], np.asarray(outcome[name])[rows], rtol=0.0, atol=atol)
