"""The runtime: grid, events, save and restore, all bit for bit."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from railway_runs import rolling, started
from toy_systems import Booster, Clockwork, ImplicitClockwork

from plant_models import Locomotive
from plant_models.hybrid import HybridSystem, Runtime
from plant_models.hybrid.noise import RUN_SEED, seed_of, standard_normal

CLOCKWORK = Clockwork()
SYSTEMS = [CLOCKWORK, ImplicitClockwork(), Booster()]
END_CELLS = 100


@given(cuts=st.lists(st.integers(1, END_CELLS - 1), max_size=12), which=st.sampled_from([0, 1, 2]))
def test_splitting_a_step_on_the_grid_changes_nothing(cuts: list[int], which: int) -> None:
    # The events of this system lie off the grid (period 0.07, offset 0.013): they are cut identically in both runs.
    whole, pieces = started(SYSTEMS[which]), started(SYSTEMS[which])
    whole.advance(END_CELLS * 0.01)
    for cell in sorted(cuts):
        pieces.advance(cell * 0.01)
    pieces.advance(END_CELLS * 0.01)
    np.testing.assert_array_equal(whole.x, pieces.x)
    assert whole.t == pieces.t


def test_splitting_a_step_of_the_locomotive_changes_nothing() -> None:
    whole, pieces = started(Locomotive(), x0=rolling(8.0)), started(Locomotive(), x0=rolling(8.0))
    whole.u[0] = pieces.u[0] = 6e4
    whole.advance(12.0)
    for k in range(1, 1201):
        pieces.advance(k * 0.01)
    np.testing.assert_array_equal(whole.x, pieces.x)


@pytest.mark.parametrize("t0", [0.0, 5.0, 123.456])
def test_periodic_events_hit_their_instants_exactly(t0: float) -> None:
    runtime = Runtime(CLOCKWORK)
    runtime.start(t0)
    seen = []
    for k in range(1, 60):
        runtime.advance(t0 + k * 0.017)
        if not seen or seen[-1] != runtime.x[3]:
            seen.append(float(runtime.x[3]))
    due = [t0 + 0.013 + k * 0.07 for k in range(15)]
    assert [t for t in seen if t >= t0] == [t for t in due if t <= runtime.t]
    assert runtime.x[4] == len([t for t in due if t <= runtime.t])


def test_an_event_due_at_the_start_fires_at_the_start_and_one_at_the_end_belongs_to_the_step() -> None:
    runtime = started(CLOCKWORK, offset=0.0)
    assert (runtime.x[4], runtime.x[3]) == (1.0, 0.0)
    runtime.advance(0.07)
    assert (runtime.x[4], runtime.x[3]) == (2.0, 0.07)


def test_the_value_sampled_is_the_state_at_the_instant() -> None:
    runtime, other = started(CLOCKWORK), started(CLOCKWORK)
    other.advance(0.013)
    runtime.advance(0.05)
    assert runtime.x[2] == other.x[0] + 0.1 * standard_normal(seed_of(RUN_SEED, "clockwork"), 0, 0)


@given(
    before=st.floats(0.0, 0.5), piece=st.floats(0.001, 0.4), impulse=st.floats(-2.0, 2.0), which=st.sampled_from([0, 1])
)  # any time, on the grid or off it
def test_what_follows_a_restore_is_what_followed_the_snapshot(
    before: float, piece: float, impulse: float, which: int
) -> None:
    runtime = started(SYSTEMS[which])
    runtime.advance(before)
    saved = runtime.snapshot()

    def go_on() -> np.ndarray:
        runtime.u[1] = impulse
        runtime.trigger("kick")
        runtime.advance(before + piece)
        runtime.u[0] = -1.0
        runtime.advance(before + 2.0 * piece)
        return np.concatenate([runtime.x, runtime.u, [runtime.t], runtime.update_outputs()])

    first = go_on()
    runtime.restore(saved)
    np.testing.assert_array_equal(go_on(), first)


def test_a_snapshot_is_a_value_and_moves_to_another_instance() -> None:
    one, other = started(CLOCKWORK), started(CLOCKWORK)
    one.advance(0.3)
    saved = one.snapshot()
    kept = saved.memory.copy()
    one.advance(0.9)
    np.testing.assert_array_equal(saved.memory, kept)
    other.restore(saved)
    other.advance(0.9)
    np.testing.assert_array_equal(other.x, one.x)


def test_noise_is_redrawn_equally_after_a_restore_and_differs_by_seed() -> None:
    def drawn(seed: float) -> list[float]:
        runtime = started(CLOCKWORK, seed=seed)
        values = []
        for k in range(8):
            runtime.advance(0.013 + 0.07 * k)
            values.append(float(runtime.x[5]))
        return values

    assert drawn(3.0) == [standard_normal(3, 0, k) for k in range(8)]
    assert drawn(3.0) != drawn(4.0)


def test_a_trigger_jumps_now_and_leaves_the_time() -> None:
    runtime = started(CLOCKWORK)
    runtime.advance(0.2)
    speed = float(runtime.x[1])
    runtime.u[1] = 1.5
    runtime.trigger("kick")
    assert (runtime.x[1], runtime.x[6], runtime.t) == (speed + 1.5, 1.0, 0.2)


def test_reset_gives_the_first_run_again() -> None:
    runtime = started(CLOCKWORK)
    runtime.advance(0.4)
    first = runtime.x.copy()
    runtime.u[0], runtime.p[0] = 9.0, 9.0
    runtime.advance(0.7)
    runtime.reset()
    runtime.start(0.0)
    runtime.advance(0.4)
    np.testing.assert_array_equal(runtime.x, first)


@pytest.mark.parametrize("system", SYSTEMS, ids=lambda s: s.method)
def test_advancing_to_now_does_nothing(system: HybridSystem) -> None:
    runtime = started(system)
    runtime.advance(0.25)
    before = runtime.x.copy()
    runtime.advance(0.25)
    np.testing.assert_array_equal(runtime.x, before)


@pytest.mark.parametrize("towards", [-np.inf, np.inf])
def test_a_target_that_misses_a_grid_point_by_rounding_is_the_grid_point(towards: float) -> None:
    """After a stop inside a cell: a master that adds up times arrives one unit in the last place beside the
    boundary.
    """

    def run(end: float) -> np.ndarray:
        runtime = started(Locomotive(), x0=rolling(8.0), internal_step=0.0077)
        runtime.start(100.0)
        runtime.advance(100.0 + 2.4 * 0.0077)
        runtime.advance(end)
        return runtime.x.copy()

    boundary = 100.0 + 3 * 0.0077
    np.testing.assert_array_equal(run(float(np.nextafter(boundary, towards))), run(boundary))
