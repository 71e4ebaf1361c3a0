"""The balise reader against closed forms: instants, order, loss, and what belongs to which instant."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import inf
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from railway_runs import outputs, parameters

from cosim.balises.hermite import HermiteStep
from cosim.balises.layout import by_positions, by_spacing
from plant_models import BaliseReader
from plant_models.hybrid import NumpyKernel, Runtime
from plant_models.railway.sensors.balise_reader import _HermiteCubic
from plant_models.railway.track.balise_layout import Spacing

Motion = Callable[[float], tuple[float, float]]  # time [s] -> position [m], speed [m/s]

SPACING = BaliseReader()
POSITIONS = BaliseReader(layout="positions", balise_capacity=12, positions=[])
# Positions to 1e3 m are known to 1e-13 m, the cubic adds a few of these; at 1 m/s and more that is a time.
ROUNDING = 1e-11


@dataclass
class Heard:
    """One announcement: the communication point at which it was made, stamp, place."""

    at: float
    stamp: float
    place: float


def reader(system: BaliseReader = SPACING, **values: float) -> Runtime:
    runtime = Runtime(system)
    runtime.p[:] = parameters(system, None, **values)
    return runtime


def ride(
    runtime: Runtime, motion: Motion, times: Sequence[float], *, lag: bool = False, exchanged: bool = True
) -> list[Heard]:
    """Drive a reader along a motion as a sequential master does; with `lag` as a parallel one, whose inputs are a step
    old.
    """
    heard: list[Heard] = []
    count = 0.0
    runtime.u[:] = motion(times[0]) if exchanged else (0.0, 0.0)
    runtime.start(times[0])
    for before, t in pairwise(times):
        runtime.u[:] = motion(before if lag else t)
        runtime.advance(t)
        runtime.communicate()
        y = outputs(runtime)
        assert y["balise_count"] in (count, count + 1.0)
        if y["balise_count"] > count:
            heard.append(Heard(t, y["balise_time"], y["balise_position"]))
        count = y["balise_count"]
    return heard


def accelerated(p0: float, v0: float, a: float) -> Motion:
    return lambda t: (p0 + v0 * t + 0.5 * a * t * t, v0 + a * t)


def instant(p0: float, v0: float, a: float, place: float) -> float:
    """When an accelerated train that starts at p0 is first at a place ahead."""
    return float(2.0 * (place - p0) / (v0 + np.sqrt(v0 * v0 + 2.0 * a * (place - p0))))


def grid(h: float, count: int, start: float = 0.0) -> list[float]:
    return [start + h * k for k in range(count + 1)]


def stamps(heard: Iterable[Heard]) -> list[float]:
    return [h.stamp for h in heard]


def places(heard: Iterable[Heard]) -> list[float]:
    return [h.place for h in heard]


@pytest.mark.parametrize("h", [0.01, 0.1, 0.7])
def test_constant_acceleration_is_exact(h: float) -> None:
    runtime = reader(**{"first_balise": 20.0, "balise_spacing": 15.0, "balise_total": 9.0})
    heard = ride(runtime, accelerated(3.0, 5.0, 0.8), grid(h, int(15.0 / h)))
    expected = [20.0 + 15.0 * k for k in range(9)]
    assert places(heard) == expected
    np.testing.assert_allclose(stamps(heard), [instant(3.0, 5.0, 0.8, p) for p in expected], rtol=0.0, atol=ROUNDING)
    assert all(h_.at - h <= h_.stamp <= h_.at for h_ in heard)


def test_a_start_from_rest_is_exact_where_the_cubic_has_a_double_root() -> None:
    runtime = reader(first_balise=1e-4, balise_spacing=0.5)
    heard = ride(runtime, accelerated(0.0, 0.0, 1.0), grid(0.5, 4))
    # The slope at the first balise is 0.014 m/s, so the rounding of a position of 1e-4 m is not enlarged beyond 1e-15
    # s.
    np.testing.assert_allclose(stamps(heard[:2]), [np.sqrt(2e-4), np.sqrt(2.0 * 0.5001)], rtol=0.0, atol=1e-14)


ROOT = 4e-13  # [m] rounding of a position of some hundred metres


def _spread(step: HermiteStep, t: float) -> float:
    """How far apart two roots near `t` may lie [s]: where the cubic's position, slope or curvature alone leaves the
    rounding.
    """
    jerk = (step.acceleration(step.h) - step.acceleration(0.0)) / step.h
    slopes = ((1.0, step.speed(t)), (2.0, step.acceleration(t)), (3.0, jerk))
    factorials = (1.0, 2.0, 6.0)
    spreads = ((f * ROOT / max(abs(d), 1e-30)) ** (1.0 / n) for (n, d), f in zip(slopes, factorials, strict=True))
    return float(min(spreads)) + 1e-12


@given(
    p0=st.floats(-500.0, 500.0),
    v0=st.floats(-40.0, 40.0),
    a=st.floats(-3.0, 3.0),
    b=st.floats(-3.0, 3.0),
    h=st.floats(0.01, 1.0),
    spacing=st.floats(5.0, 60.0),
)
@example(p0=-1e-278, v0=0.0, a=0.0, b=1.0, h=1.0, spacing=5.0)  # a saddle on a balise
@example(p0=0.0, v0=1.0, a=-3.0, b=0.0, h=1.0, spacing=0.12)  # turns after a third of the step; passes some twice
def test_one_step_finds_what_the_master_finds(
    p0: float, v0: float, a: float, b: float, h: float, spacing: float
) -> None:
    """Against `HermiteStep` and `TrackLayout` of the package's own master, which share no code with the reader."""
    p1, v1 = p0 + v0 * h + a * h * h / 2.0 + b * h**3 / 6.0, v0 + a * h + b * h * h / 2.0
    step, layout = HermiteStep(h, p0, v0, p1, v1), by_spacing(spacing, -700.0, 700.0)
    expected = [
        (t, b_.position)
        for s in step.segments()
        for b_ in layout.crossed(s.before, s.after)
        for t in (step.crossing(b_.position, s),)
    ]
    runtime = reader(first_balise=-700.0, balise_spacing=spacing, balise_total=float(len(layout.balises)))
    runtime.u[:] = p0, v0
    runtime.start(0.0)
    runtime.u[:] = p1, v1
    heard = []
    for k in range(1, len(expected) + 1):
        runtime.advance(h * k)
        runtime.communicate()
        if k == 1:
            runtime.u[1] = 0.0  # it stands from then on, and the queue empties
            y = outputs(runtime)
            assert y["lost_count"] == max(0, len(expected) - SPACING.pending_capacity)
        y = outputs(runtime)
        heard.append((y["balise_time"], y["balise_position"]))
    room = min(len(expected), SPACING.pending_capacity)
    assert [p for _, p in heard[:room]] == [p for _, p in expected[:room]]
    for (t, place), (wanted, _) in zip(heard[:room], expected[:room], strict=True):
        assert abs(step.position(t) - place) < ROOT
        assert abs(t - wanted) < _spread(step, wanted)


def test_backwards_and_forwards_again() -> None:
    def motion(t: float) -> tuple[float, float]:
        return 50.0 * np.cos(0.2 * t), -10.0 * np.sin(0.2 * t)

    runtime = reader(first_balise=-30.0, balise_spacing=30.0, balise_total=3.0)
    heard = ride(runtime, motion, grid(0.01, 3200))
    down = [np.arccos(p / 50.0) / 0.2 for p in (30.0, 0.0, -30.0)]
    up = [2.0 * np.pi / 0.2 - t for t in reversed(down)]
    assert places(heard) == [30.0, 0.0, -30.0, -30.0, 0.0, 30.0]
    # Hermite: h^4/384 times the fourth derivative of the position, 50 * 0.2^4, over the speed, 8 m/s and more: 2.6e-13
    # s.
    np.testing.assert_allclose(stamps(heard), [*down, *up], rtol=0.0, atol=2.6e-13 + ROUNDING)


def test_several_in_a_step_are_announced_one_a_step_oldest_first_none_lost() -> None:
    runtime = reader(first_balise=0.5, balise_spacing=1.0, balise_total=8.0)
    heard = ride(runtime, accelerated(0.0, 10.0, 0.0), grid(0.9, 10))
    assert places(heard) == [0.5 + k for k in range(8)]
    np.testing.assert_allclose(stamps(heard), [(0.5 + k) / 10.0 for k in range(8)], rtol=0.0, atol=ROUNDING)
    assert [h.at for h in heard] == grid(0.9, 8)[1:]
    assert outputs(runtime)["lost_count"] == 0.0


def test_what_finds_no_room_is_counted() -> None:
    runtime = reader(first_balise=0.5, balise_spacing=1.0, balise_total=20.0)
    heard = ride(runtime, accelerated(0.0, 10.0, 0.0), grid(1.0, 12))
    # Ten in the first step and ten in the second: 8 are kept, 1 goes; 7 wait, so 1 of the second ten finds room.
    assert outputs(runtime)["lost_count"] == 2.0 + 9.0
    assert places(heard) == [*(0.5 + k for k in range(8)), 10.5]


@pytest.mark.parametrize("direction", [1.0, -1.0])
def test_a_train_on_a_balise_passes_it_once(direction: float) -> None:
    """It comes, stops on it, stands, and moves on; and the next starts on it."""
    times = grid(0.5, 60)

    def motion(t: float) -> tuple[float, float]:  # stops after 10 s at 0, stands for 5 s, moves on
        if t <= 10.0:
            return -direction * 0.5 * (t - 10.0) ** 2, -direction * (t - 10.0)
        s = max(t - 15.0, 0.0)
        return direction * 0.5 * s * s, direction * s

    values = {"first_balise": 0.0, "balise_spacing": 1000.0, "balise_total": 1.0}
    heard = ride(reader(**values), motion, times)
    assert places(heard) == [0.0]
    # A double zero: a rounding of 1e-14 m of the position is 1.4e-7 s.
    assert abs(heard[0].stamp - 10.0) < 1.4e-7
    assert ride(reader(**values), lambda t: motion(t + 10.0), times) == []


def test_standing_on_one_and_going_back_is_no_passing_but_coming_back_is() -> None:
    values = {"first_balise": 0.0, "balise_spacing": 1000.0, "balise_total": 1.0}
    assert ride(reader(**values), accelerated(0.0, 0.0, -1.0), grid(0.5, 10)) == []
    there_and_back = ride(reader(**values), lambda t: (4.0 - 0.5 * (t - 3.0) ** 2, 3.0 - t), grid(0.5, 16))
    np.testing.assert_allclose(stamps(there_and_back), [3.0 - 8.0**0.5, 3.0 + 8.0**0.5], rtol=0.0, atol=ROUNDING)


def test_a_turn_inside_a_step_passes_a_balise_twice() -> None:
    runtime = reader(first_balise=3.0, balise_spacing=1000.0, balise_total=1.0)
    heard = ride(runtime, accelerated(0.0, 5.0, -3.0), grid(3.0, 2))
    root = np.sqrt(25.0 - 18.0)
    np.testing.assert_allclose(stamps(heard), [(5.0 - root) / 3.0, (5.0 + root) / 3.0], rtol=0.0, atol=ROUNDING)


def _wave(t: float) -> tuple[float, float]:
    return 12.0 * t + 4.0 * (1.0 - np.cos(0.9 * t)), 12.0 + 3.6 * np.sin(0.9 * t)


def _wave_instant(place: float) -> float:
    low, high = 0.0, 100.0
    for _ in range(100):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if _wave(middle)[0] >= place else (middle, high)
    return high


def test_stamps_depend_on_the_step_by_the_fourth_order_of_hermite_only() -> None:
    expected = np.array([_wave_instant(20.0 + 17.0 * k) for k in range(13)])
    errors = []
    for h in (0.8, 0.4, 0.2, 0.1):
        runtime = reader(first_balise=20.0, balise_spacing=17.0, balise_total=13.0)
        found = stamps(ride(runtime, _wave, grid(h, int(20.0 / h))))
        errors.append(np.abs(found - expected).max())
    bound = np.array([h**4 / 384.0 * 4.0 * 0.9**4 / 8.4 for h in (0.8, 0.4, 0.2, 0.1)])
    assert (errors <= bound + ROUNDING).all()
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert (orders > 3.4).all(), orders  # 4 but for where in its step each balise happens to lie
    assert errors[-1] > 1e-9  # there is an error whose order can be seen


def test_steps_may_vary() -> None:
    rng = np.random.default_rng(2)
    times = [0.0, *np.cumsum(rng.uniform(1e-3, 0.9, 60)).tolist()]
    values = {"first_balise": 20.0, "balise_spacing": 15.0, "balise_total": 12.0}
    expected = [instant(3.0, 5.0, 0.3, 20.0 + 15.0 * k) for k in range(12)]
    for lag in (False, True):
        heard = ride(reader(**values, input_instant=float(not lag)), accelerated(3.0, 5.0, 0.3), times, lag=lag)
        np.testing.assert_allclose(stamps(heard), expected, rtol=0.0, atol=ROUNDING)


def test_inputs_of_the_start_of_a_step_give_equal_stamps_one_step_later() -> None:
    values = {"first_balise": 0.3, "balise_spacing": 15.0, "balise_total": 9.0}
    motion, times = accelerated(0.0, 5.0, 0.8), grid(0.1, 150)
    sequential = ride(reader(**values), motion, times)
    for exchanged in (True, False):  # a parallel master brings the start in its first step, exchanged or not
        parallel = ride(reader(**values, input_instant=0.0), motion, times, lag=True, exchanged=exchanged)
        assert [(h.stamp, h.place) for h in parallel] == [(h.stamp, h.place) for h in sequential]
        assert np.array([h.at for h in parallel]) == pytest.approx(np.array([h.at for h in sequential]) + 0.1)


def test_the_wrong_input_instant_is_off_by_one_step() -> None:
    values = {"first_balise": 20.0, "balise_spacing": 15.0, "balise_total": 5.0}
    motion, times = accelerated(0.0, 12.0, 0.0), grid(0.1, 100)
    right = np.array(stamps(ride(reader(**values), motion, times)))
    early = np.array(stamps(ride(reader(**values, input_instant=0.0), motion, times)))
    late = np.array(stamps(ride(reader(**values), motion, times, lag=True)))
    np.testing.assert_allclose(early, right - 0.1, rtol=0.0, atol=ROUNDING)
    np.testing.assert_allclose(late, right + 0.1, rtol=0.0, atol=ROUNDING)


def test_a_list_of_positions_finds_what_the_layout_of_the_master_finds() -> None:
    places_ = [12.0, 12.5, 40.0, 41.0, 90.0, 155.5]
    system = BaliseReader(layout="positions", balise_capacity=12, positions=places_)
    heard = ride(Runtime(system), accelerated(0.0, 20.0, 0.0), grid(0.5, 30))
    assert places(heard) == [b.position for b in by_positions(places_).crossed(0.0, 300.0)]
    np.testing.assert_allclose(stamps(heard), np.array(places_) / 20.0, rtol=0.0, atol=ROUNDING)
    backwards = ride(Runtime(system), accelerated(200.0, -20.0, 0.0), grid(0.5, 30))
    assert places(backwards) == places_[::-1]


@given(
    first=st.floats(-1e4, 1e4), spacing=st.floats(0.3, 3e3), i=st.integers(0, 60), j=st.integers(0, 60), data=st.data()
)
@example(first=0.1, spacing=0.7, i=3, j=20, data=None)
def test_equal_spacing_counts_to_the_last_bit(
    first: float, spacing: float, i: int, j: int, data: st.DataObject | None
) -> None:
    """From one balise to another, and from just before or behind it: the quotient that numbers them may round either
    way.
    """
    layout, oracle = Spacing(), by_spacing(spacing, first, first + 60.5 * spacing)
    p = SimpleNamespace(first_balise=first, balise_spacing=spacing, balise_total=float(len(oracle.balises)))
    sides = (-inf, None, inf)
    ends = []
    for k in (i, j):
        side = None if data is None else data.draw(st.sampled_from(sides))
        ends.append(oracle.positions[k] if side is None else np.nextafter(oracle.positions[k], side))
    before, after = ends
    direction = 1.0 if after >= before else -1.0
    expected = [b.position for b in oracle.crossed(before, after)]
    assert layout.count(before, after, direction, p) == len(expected)
    found, place = [], before
    for _ in expected:
        place = float(layout.next(place, direction, p))
        found.append(place)
    assert found == expected


@pytest.mark.parametrize("spacing", [0.0, -0.0, -5.0, -1e-300, float("nan")])
@pytest.mark.parametrize("kernel", [NumpyKernel, None], ids=["numpy", "traced"])
def test_without_a_positive_spacing_there_are_no_balises(spacing: float, kernel: Any) -> None:
    """A tool need not enforce the declared minimum; nothing is announced, nothing becomes NaN, in either direction."""
    (declared,) = (s for s in SPACING.parameters if s.name == "balise_spacing")
    assert declared.min is not None
    assert declared.min > 0.0
    runtime = Runtime(SPACING, kernel and kernel(SPACING))
    runtime.p[:] = parameters(SPACING, None, first_balise=3.0, balise_spacing=spacing)
    assert ride(runtime, accelerated(0.0, 5.0, -1.0), grid(0.7, 20)) == []
    assert outputs(runtime) == {"balise_count": 0.0, "balise_time": 0.0, "balise_position": 0.0, "lost_count": 0.0}
    assert np.isfinite(runtime.x).all()


def test_positions_that_are_set_later_need_no_order() -> None:
    values = {f"positions[{i + 1}]": p for i, p in enumerate((40.0, 12.0, 90.0))}
    heard = ride(reader(POSITIONS, **values), accelerated(0.0, 20.0, 0.0), grid(0.5, 12))
    assert places(heard) == [12.0, 40.0, 90.0]


@pytest.mark.parametrize("entries", [(10.0, 10.0, 20.0), (10.0, 10.0, 10.0), (20.0, 10.0, 10.0), (10.0, 20.0, 10.0)])
@pytest.mark.parametrize("step", [0.1, 2.0])
@pytest.mark.parametrize("sense", [1.0, -1.0])
def test_entries_at_one_place_are_one_balise(entries: tuple[float, ...], step: float, sense: float) -> None:
    """Parameters can be set to anything in an FMU; counted twice, such a place announced the next balise before its
    time.
    """
    values = {f"positions[{i + 1}]": sense * p for i, p in enumerate(entries)} | {
        "positions[4]": 1e30,
        "positions[5]": 1e30,
    }
    heard = ride(
        reader(POSITIONS, **values), accelerated(sense * 5.0, sense * 10.0, 0.0), grid(step, round(6.0 / step))
    )
    assert places(heard) == [sense * p for p in sorted(set(entries))]
    assert stamps(heard) == pytest.approx([(p - 5.0) / 10.0 for p in sorted(set(entries))])


@pytest.mark.parametrize("system", [SPACING, POSITIONS], ids=["spacing", "positions"])
def test_traced_and_numpy_kernels_agree(system: BaliseReader) -> None:
    values = (
        {"positions[1]": 7.0, "positions[2]": 3.0}
        if system is POSITIONS
        else {"first_balise": 3.0, "balise_spacing": 4.0}
    )
    runs = []
    for kernel in (None, NumpyKernel(system)):
        runtime = Runtime(system, kernel)
        runtime.p[:] = parameters(system, None, **values)
        ride(runtime, accelerated(0.0, 5.0, -1.0), grid(0.7, 12))
        runs.append(runtime.x.copy())
    np.testing.assert_allclose(runs[0], runs[1], rtol=1e-12, atol=1e-12)  # the same operations in another order


@pytest.mark.parametrize("system", [SPACING, POSITIONS], ids=["spacing", "positions"])
def test_a_batch_is_its_members(system: BaliseReader) -> None:
    rng = np.random.default_rng(7)
    x = np.stack([system.start_state()] * 5, axis=1)
    x[4] = 1.0  # primed
    u = np.stack([rng.uniform(-3.0, 3.0, 5), rng.uniform(-9.0, 9.0, 5)])
    p = np.stack([system.start_parameters()] * 5, axis=1)
    p[1:4] = np.array([[-2.0], [1.0], [7.0]])
    after = system.jump_vector("reading", 1.0, x, u, p)
    alone = [system.jump_vector("reading", 1.0, x[:, i], u[:, i], p[:, i]) for i in range(5)]
    np.testing.assert_array_equal(after, np.stack(alone, axis=1))
    assert (after[5] > 0.0).any()  # something was found


def test_a_restored_reader_continues_as_it_did() -> None:
    runtime = reader(first_balise=0.5, balise_spacing=1.0, balise_total=50.0)
    ride(runtime, accelerated(0.0, 20.0, 0.0), grid(0.3, 5))
    kept, rows = runtime.snapshot(), []
    for _ in range(2):
        runtime.restore(kept)
        for k in range(6, 12):
            runtime.u[:] = 6.0 * k, 20.0
            runtime.advance(0.3 * k)
            runtime.communicate()
        rows.append(runtime.x.copy())
    np.testing.assert_array_equal(rows[0], rows[1])


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"layout": "circle"}, "unknown layout 'circle'; choose one of: spacing, positions"),
        ({"pending_capacity": 0}, "pending_capacity must be at least 1, got 0"),
        ({"layout": "positions", "balise_capacity": 0}, "balise_capacity must be at least 1, got 0"),
        (
            {"layout": "positions", "balise_capacity": 2, "positions": [1.0, 2.0, 3.0]},
            "3 positions were given, but .* is 2",
        ),
        ({"layout": "positions", "positions": [1.0, 1.0]}, "increasing position, one at a place"),
        ({"layout": "positions", "positions": [1.0, float("nan")]}, "not a finite number"),
    ],
)
def test_a_wrong_option_is_refused(options: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        BaliseReader(**options)


def test_the_cubic_takes_the_values_and_slopes_it_was_made_of() -> None:
    cubic = _HermiteCubic.of(0.5, 3.0, 4.0, 7.0, -2.0)
    assert (cubic.rise(0.0), cubic.rise(1.0)) == (0.0, 4.0)
    assert (cubic.rate(0.0), cubic.rate(1.0)) == (4.0 * 0.5, -2.0 * 0.5)
    assert 0.0 < cubic.turn() < 1.0
    assert abs(cubic.rate(cubic.turn())) < 1e-14
