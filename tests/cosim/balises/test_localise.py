"""Crossing times at communication steps of 100 ms against closed-form motion, for every method.

Promised: `rollback` 1e-9 s, `predict` 1e-6 s, `interpolate` its own reported bound, `early-return` what the plant says.
"""

from __future__ import annotations

from itertools import pairwise
from typing import Any, ClassVar

import numpy as np
import pytest
from coupled_runs import Balises, Motion, Pushed, Ran, Staircase, block, positions, prepare, ran, run
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st
from mock_slaves import EventMode, Train, component, variable
from scipy.optimize import brentq

from cosim.balises.layout import InstantLayout, TrackLayout
from cosim.balises.localise import choose
from cosim.errors import CouplingError
from plant_models.hybrid import HybridSystem, output_signal, parameter, state

H = 0.1
PROMISED = {"rollback": 1e-9, "predict": 1e-6}
METHODS = ("rollback", "predict", "interpolate")


class Slippery(HybridSystem):
    """A train whose traction falls while it is on degraded rails, from 20 m to 40 m; the acceleration jumps at their
    ends.
    """

    name = "slippery"
    states = (state("p", "m"), state("v", "m/s", 5.0))
    outputs = (output_signal("position", "m"), output_signal("speed", "m/s"))
    parameters = (parameter("good", "m/s2", 1.2), parameter("bad", "m/s2", 0.3))
    internal_step = 1e-3

    def flow(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"p": x.v, "v": np.where(x.p < 20.0, p.good, np.where(x.p < 40.0, p.bad, p.good))}

    def output(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        return {"position": x.p, "speed": x.v}


def watched(
    plant: Any, layout: Any, method: str, seconds: float, starts: dict[str, float] | None = None, **more: Any
) -> Ran:
    return run(
        [plant], [], H, round(seconds / H), Balises(layout, method=method, **more), starts={"plant": starts or {}}
    )


def errors(ran: Ran, true_times: dict[str, float]) -> np.ndarray:
    assert [e.identity for e in ran.events] == list(true_times)
    return np.array([abs(e.stamp - true_times[e.identity]) for e in ran.events])


def assert_kept(ran: Ran, method: str, true_times: dict[str, float]) -> None:
    off = errors(ran, true_times)
    rounding = 1e-12  # of the closed form itself
    if method == "interpolate":
        assert np.all(off <= np.array([e.time_bound for e in ran.events]) + rounding)
    else:
        assert np.max(off) <= PROMISED[method]
    assert {e.method for e in ran.events} == {method}


def line(count: int, first: float, spacing: float) -> TrackLayout:
    return positions(*(first + spacing * i for i in range(count)))  # type: ignore[return-value]


def closed_form(parameters: dict[str, float], layout: TrackLayout, seconds: float) -> dict[str, float]:
    """Crossing times by bisection on the closed form of `Motion`, for a motion that never turns."""
    full = {"p0": 0.0, "v0": 13.9, "a": 0.0, "A": 0.0, "w": 1.0} | parameters

    def place(t: float) -> float:
        swing = full["A"] / full["w"] * (1.0 - np.cos(full["w"] * t))
        return float(full["p0"] + full["v0"] * t + 0.5 * full["a"] * t * t + swing)

    return {
        b.identity: brentq(lambda t, p=b.position: place(t) - p, 0.0, seconds, xtol=1e-13, rtol=1e-15)
        for b in layout.balises
    }


MOTIONS = {
    "constant speed": {"v0": 13.9},
    "constant acceleration": {"v0": 1.0, "a": 0.8},
    "braking": {"v0": 12.0, "a": -1.0},
    "swinging speed": {"v0": 10.0, "A": 3.0, "w": 2.5},
    "very slow": {"v0": 0.02},
    "far away": {"v0": 30.0, "p0": 9e4},
}


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("name", MOTIONS)
def test_crossing_times_of_closed_form_motions(name: str, method: str) -> None:
    parameters, seconds = MOTIONS[name], 10.0
    origin = parameters.get("p0", 0.0)
    reach = parameters["v0"] * seconds + 0.5 * parameters.get("a", 0.0) * seconds**2
    layout = line(15, origin + 0.0371 * reach, 0.0613 * reach)
    ran = watched(block(Motion(), "plant"), layout, method, seconds, parameters)
    assert_kept(ran, method, closed_form(parameters, layout, seconds))


@pytest.mark.parametrize("method", METHODS)
def test_crossing_times_over_changes_of_adhesion(method: str) -> None:
    """The truth is a dense run of the same plant at 1 ms, inverted between its own points by their parabola."""
    # in the very steps in which they happen
    near_the_changes = [19.6, 19.9, 20.05, 20.2, 20.5, 39.5, 39.9, 40.06, 40.4]
    layout = positions(*sorted([*near_the_changes, *(3.3 + 3.17 * i for i in range(20))]))
    truth = run([block(Slippery(), "plant")], [], 1e-3, 9000)
    p, v, t = truth["plant.position"], truth["plant.speed"], truth.time
    true_times = {}
    for balise in layout.balises:
        k = int(np.searchsorted(p, balise.position, side="left")) - 1
        a = (v[k + 1] - v[k]) / 1e-3
        rest = balise.position - p[k]
        true_times[balise.identity] = t[k] + 2.0 * rest / (v[k] + np.sqrt(v[k] ** 2 + 2.0 * a * rest))
    assert_kept(watched(block(Slippery(), "plant"), layout, method, 9.0), method, true_times)


def test_predict_cuts_and_rollback_redoes_but_interpolate_does_neither() -> None:
    layout = line(5, 3.3, 7.7)
    calls = {}
    for method in METHODS:
        plant = block(Motion(), "plant")
        watched(plant, layout, method, 3.0)
        calls[method] = plant.calls
    assert calls["interpolate"] == 30
    assert 30 < calls["predict"] <= 30 + 5 * 8
    assert 30 < calls["rollback"] <= 30 + 5 * 8


@pytest.mark.parametrize("method", METHODS)
def test_several_balises_in_one_step(method: str) -> None:
    layout = positions(1.40, 1.45, 2.0, 2.2, 2.5)
    ran = watched(block(Motion(), "plant"), layout, method, 1.0)
    assert_kept(ran, method, {b.identity: b.position / 13.9 for b in layout.balises})


@pytest.mark.parametrize("method", METHODS)
def test_balise_exactly_at_a_communication_point_is_found_once(method: str) -> None:
    """The position at t_k is computed, so it may fall on either side of the balise by a rounding, but never on both."""
    places = [0.1 * k * 10.0 for k in range(1, 20)]
    ran = watched(block(Motion(), "plant"), positions(*places), method, 2.0, {"v0": 10.0})
    assert [e.position for e in ran.events] == places
    assert np.allclose([e.stamp for e in ran.events], 0.1 * np.arange(1, 20), rtol=0.0, atol=1e-9)


@pytest.mark.parametrize("method", METHODS)
def test_standing_exactly_on_a_balise_passes_nothing(method: str) -> None:
    assert not watched(block(Motion(), "plant"), positions(5.0), method, 1.0, {"v0": 0.0, "p0": 5.0}).events
    leaving = watched(block(Motion(), "plant"), positions(5.0, 6.0), method, 1.0, {"v0": 2.0, "p0": 5.0})
    assert [e.identity for e in leaving.events] == ["B2"]


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("turn", [1.0, 1.05])
def test_reversing_over_balises(method: str, turn: float) -> None:
    """v = turn - t: out to turn^2/2 and back over the same balises, in the same step too (turn at 1.05 s)."""
    top = 0.5 * turn**2
    places = (0.2, 0.4, top - 1e-4, top + 1e-4)
    ran = watched(block(Motion(), "plant"), positions(*places), method, 2.0 * turn, {"v0": turn, "a": -1.0})
    assert [e.identity for e in ran.events] == ["B1", "B2", "B3", "B3", "B2", "B1"]
    expected = [
        turn + sign * np.sqrt(2.0 * (top - p)) for sign, order in ((-1, 1), (1, -1)) for p in places[:3][::order]
    ]
    off = np.abs(np.array([e.stamp for e in ran.events]) - expected)
    bounds = np.array([e.time_bound for e in ran.events])
    promised = {"rollback": 1e-9, "predict": 1e-6}.get(method, np.inf)
    assert np.all(off <= np.minimum(promised, np.maximum(bounds, 1e-9)))


def test_rollback_finds_where_the_plant_itself_turns() -> None:
    """v = 2 cos(4 t): within steps of 0.25 s the cubic turns elsewhere than the train, at 0.5 m."""
    offsets = (-3e-5, -1e-7, 1e-7, 3e-5)
    layout = positions(*(0.5 + d for d in offsets))
    motion = {"v0": 0.0, "A": 2.0, "w": 4.0, "p0": -0.5}  # p = -0.5 cos(4 t)
    seen = run([block(Motion(), "plant")], [], 0.25, 4, Balises(layout), starts={"plant": motion})
    assert [e.identity for e in seen.events] == ["B1", "B2", "B2", "B1"]
    half = [(np.pi - np.arccos((0.5 + d) / 0.5)) / 4.0 for d in offsets[:2]]
    expected = [*half, *(np.pi / 2.0 - t for t in reversed(half))]
    np.testing.assert_allclose([e.stamp for e in seen.events], expected, rtol=0.0, atol=1e-9)


def passings(motion: dict[str, float], places: list[float], until: float) -> list[tuple[float, str]]:
    """When a swinging train passes which balise, by bisection between the instants at which it stands."""

    def place(t: float) -> float:
        return motion["p0"] + motion["A"] / motion["w"] * (1.0 - np.cos(motion["w"] * t))

    stands = [k * np.pi / motion["w"] for k in range(int(until * motion["w"] / np.pi) + 1)]
    found = []
    for begin, end in pairwise([*stands, until]):
        for i, position in enumerate(places, start=1):
            if (place(begin) - position) * (place(end) - position) < 0.0:
                found.append((brentq(lambda t, p=position: place(t) - p, begin, end, xtol=1e-13), f"B{i}"))
    return sorted(found)


@settings(max_examples=25)
@given(
    step=st.floats(0.3, 6.0),
    swing=st.floats(0.3, 3.0),
    hardest=st.floats(0.5, 5.0),
    shares=st.lists(st.floats(0.02, 0.98), min_size=1, max_size=3, unique=True),
    origin=st.sampled_from([-1.0, 0.0, 500.0]),
)
@example(step=4.0 * np.pi, swing=1.0, hardest=1.0, shares=[0.5, 0.9], origin=0.0)  # stands where it began at both ends
@example(step=6.0, swing=np.pi / 3.0, hardest=2.0, shares=[0.5], origin=-1.0)  # there and back within each step
@pytest.mark.parametrize("method", PROMISED)
def test_a_train_that_turns_within_a_step_passes_no_balise_in_silence(
    method: str, step: float, swing: float, hardest: float, shares: list[float], origin: float
) -> None:
    """v = A sin(w t), to and fro over 2 A / w, as often within a step as it likes."""
    motion = {"v0": 0.0, "a": 0.0, "A": hardest / swing, "w": swing, "p0": origin}
    width = 2.0 * motion["A"] / swing
    assume(min(shares) * width > 0.01 and (1.0 - max(shares)) * width > 0.01)  # it passes them, and does not just touch
    places = sorted(origin + share * width for share in shares)
    assume(np.all(np.diff(places) > 1e-6))
    seen = run(
        [block(Motion(), "plant")], [], step, 3, Balises(positions(*places), method=method), starts={"plant": motion}
    )
    expected = passings(motion, places, 3.0 * step)
    certain = [(t, name) for t, name in expected if t < 3.0 * step - 1e-3]
    assert [e.identity for e in seen.events][: len(certain)] == [name for _, name in certain]
    off = np.abs(np.array([e.stamp for e in seen.events[: len(certain)]]) - [t for t, _ in certain])
    assert np.all(off <= PROMISED[method])


class Arriving(HybridSystem):
    """Brakes backwards to a stand at 0 m after 10 s: ``p = 10 (1 - t / 10)^2``."""

    name = "arriving"
    outputs = (output_signal("position", "m"), output_signal("speed", "m/s"))

    def output(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
        rest = np.maximum(1.0 - 0.1 * t, 0.0)
        return {"position": 10.0 * rest**2, "speed": -2.0 * rest}


@pytest.mark.parametrize("step", [0.1, 4.0, 30.0])
def test_a_train_that_arrives_at_a_balise_and_stands_there_passes_it_when_it_arrives(step: float) -> None:
    seen = run([block(Arriving(), "plant")], [], step, round(60.0 / step), Balises(positions(0.0)))
    assert [e.stamp for e in seen.events] == pytest.approx([10.0], abs=1e-6)
    assert abs(seen.events[0].stamp - 10.0) <= seen.events[0].time_bound


def test_a_step_that_may_hide_a_balise_is_named_where_only_its_ends_are_known() -> None:
    """There and back within 6 s over a balise at 1 m; steps of 0.1 s show it, and a balise far off does not count."""
    motion = {"v0": 0.0, "A": np.pi / 3.0, "w": np.pi / 3.0, "p0": 0.0}
    for step, place, hidden in ((6.0, 1.0, 0.0), (0.1, 1.0, np.inf), (6.0, 500.0, np.inf)):
        parts = [block(Motion(), "plant")]
        seen = run(
            parts,
            [],
            step,
            round(6.0 / step),
            Balises(positions(place), method="interpolate"),
            starts={"plant": motion},
        )
        assert seen.master.balises.localiser.hidden_from == hidden


def test_the_row_of_an_interpolated_balise_shows_the_plant_on_it() -> None:
    seen = watched(block(Motion(), "plant"), positions(3.3), "interpolate", 1.0, {"v0": 3.0, "a": 4.0})
    at = np.flatnonzero(seen.time == seen.events[0].stamp)
    np.testing.assert_allclose(seen["plant.position"][at], [3.3, 3.3], rtol=1e-15)


def test_standstill_takes_no_time_of_the_prediction() -> None:
    """A train parked a metre before a balise is not cut at all."""
    plant = block(Motion(), "plant")
    assert not watched(plant, positions(6.0), "predict", 5.0, {"v0": 0.0, "p0": 5.0}).events
    assert plant.calls == 50


@pytest.mark.parametrize("method", METHODS)
def test_a_jump_beyond_all_trains_is_still_found(method: str) -> None:
    """A plant that accelerates with 200 m/s2: no method stays silent about the balise, and each says how little it
    knows.
    """
    ran = watched(block(Motion(), "plant"), positions(0.9), method, 0.3, {"v0": 0.0, "a": 200.0})
    assert [e.identity for e in ran.events] == ["B1"]
    assert abs(ran.events[0].stamp - np.sqrt(2 * 0.9 / 200.0)) <= max(ran.events[0].time_bound, 1e-9)


@pytest.mark.parametrize("method", ["rollback", "interpolate"])
def test_trajectory_is_bit_identical_with_and_without_balises(method: str) -> None:
    def go(balises: Balises | None) -> Ran:
        parts = [block(Staircase(), "steps"), block(Pushed(), "plant")]
        return run(parts, [("steps.push", "plant.push")], H, 30, balises)

    alone = go(None)
    for layout in (line(9, 0.7, 3.1), InstantLayout(np.array([0.05, 0.1, 0.31, 0.32, 1.0, 2.999999]))):
        with_balises = go(Balises(layout, method=method))
        assert len(with_balises.events) >= 6
        last = np.append(np.diff(with_balises.time) > 0.0, True) & np.isin(with_balises.time, alone.time)
        for name in ("plant.position", "plant.speed"):
            np.testing.assert_array_equal(with_balises[name][last], alone[name])
        assert with_balises.master.balises.localiser.watch.redo_differences == 0


def test_an_input_fed_by_the_plants_own_output_is_equal_when_a_step_is_redone() -> None:
    """The connected value belongs to the start of the step; after looking ahead it must be put back."""

    class Runaway(Train):
        inputs: ClassVar[dict[str, Any]] = {"effort": 0.0}

    def go(balises: Balises | None) -> Ran:
        plant = component(Runaway(), "plant")
        return run([plant], [("plant.speed", "plant.effort")], H, 20, balises)

    watched_run, alone = go(Balises(positions(0.55, 0.56, 1.23))), go(None)
    last = np.append(np.diff(watched_run.time) > 0.0, True) & np.isin(watched_run.time, alone.time)
    np.testing.assert_array_equal(watched_run["plant.position"][last], alone["plant.position"])
    assert watched_run.master.balises.localiser.watch.redo_differences == 0


def test_a_plant_that_restores_badly_is_noticed() -> None:
    class Forgetful(Train):
        def setFMUstate(self, state: Any) -> None:
            super().setFMUstate(state)
            self.x["v"] += 1e-6

        setFMUState = setFMUstate

    ran = run([component(Forgetful(), "plant")], [], H, 20, Balises(positions(0.55)))
    assert ran.master.balises.localiser.watch.redo_differences == 1


def test_positions_in_other_units_are_scaled() -> None:
    """The plant counts in km and km/s (scale 1000); the telegrams speak of metres."""

    class Kilometres(Motion):
        name = "kilometres"

        def output(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
            return {name: 1e-3 * value for name, value in super().output(t, x, u, p).items()}

    for method in METHODS:
        ran = watched(block(Kilometres(), "plant"), positions(10.0), method, 1.0, scale=1000.0)
        assert ran.events[0].stamp == pytest.approx(10.0 / 13.9, abs=1e-9)
        assert ran.events[0].position == 10.0
        at = np.flatnonzero(ran.time == ran.events[0].stamp)
        assert ran["plant.position"][at] == pytest.approx([0.01, 0.01], abs=1e-11)


class Reporting(EventMode):
    """A plant that knows where the balises lie: it returns early there and its clock ticks. Constant 13.9 m/s."""

    outputs: ClassVar[dict[str, Any]] = {"position": 0.0, "speed": 13.9}
    places = (1.0, 1.1, 2.78, 5.0)
    lazy_flag = False  # ends the step at its own announced event time, without the flag

    def more_variables(self) -> list[Any]:
        return [variable("passed", "output", 90, "Clock"), variable("other", "output", 91, "Clock")]

    def begin(self) -> None:
        super().begin()
        self.x = {"p": 0.0, "events": 0.0}
        self.ticks = {90: False, 91: False}

    def compute(self) -> None:
        self.v["position"], self.v["speed"] = 13.9 * self.time, 13.9

    def doStep(self, t: float, h: float) -> tuple[bool, bool, bool, float]:
        ahead = [p / 13.9 for p in (*self.places, 3.3) if p / 13.9 > t + 1e-12]
        stop = min([*ahead, t + h])
        event = stop < t + h - 1e-12 or any(abs(stop - a) < 1e-12 for a in ahead)
        super().doStep(t, stop - t)
        if event:
            self.ticks = {90: abs(stop - 3.3 / 13.9) > 1e-9, 91: abs(stop - 3.3 / 13.9) <= 1e-9}
        return event, False, stop < t + h, stop

    def getClock(self, references: list[int]) -> list[bool]:
        assert self.in_event_mode
        return [self.ticks[r] for r in references]


def test_early_return_takes_the_plants_own_report() -> None:
    """Four ticks of the balise clock; a tick of another clock in between (at 3.3 m) is handled and is no crossing."""
    plant = component(Reporting(), "plant")
    layout = positions(*Reporting.places)
    seen = run([plant], [], H, 6, Balises(layout, method="early-return", clock="passed"))
    assert [e.stamp for e in seen.events] == pytest.approx([p / 13.9 for p in Reporting.places], abs=1e-12)
    assert [e.identity for e in seen.events] == ["B1", "B2", "B3", "B4"]
    assert plant.slave.x["events"] == 5.0
    grid = seen.time[np.append(np.diff(seen.time) > 0.0, True)]
    assert np.all(np.isin([H * k for k in range(7)], grid))


def test_early_return_needs_a_clock_and_event_mode() -> None:
    with pytest.raises(CouplingError, match="needs an FMI 3 plant with event mode"):
        prepare([component(Train(), "plant")], [], H, 1, Balises(positions(1.0), method="early-return", clock="passed"))
    with pytest.raises(CouplingError, match=r"needs balises\.clock"):
        prepare([component(Reporting(), "plant")], [], H, 1, Balises(positions(1.0), method="early-return"))
    with pytest.raises(CouplingError, match="no variable 'pased'; did you mean 'passed'"):
        prepare(
            [component(Reporting(), "plant")], [], H, 1, Balises(positions(1.0), method="early-return", clock="pased")
        )


def test_choice_of_the_method() -> None:
    assert choose(True, "exact", None)[0] == "rollback"
    assert choose(True, "within_tolerance", None)[0] == choose(True, "no", None)[0] == "predict"
    assert choose(False, "exact", None)[0] == "interpolate"
    assert choose(False, "no", "clock")[0] == "early-return"


def test_methods_that_a_plant_cannot_serve_are_refused() -> None:
    class Stateless(Train):
        capabilities: ClassVar[dict[str, Any]] = {"canGetAndSetFMUstate": False}

    with pytest.raises(CouplingError, match="plant cannot save its state"):
        prepare([component(Stateless(), "plant")], [], H, 1, Balises(positions(1.0), method="rollback"))
    with pytest.raises(CouplingError, match="'guess' is unknown; use 'auto' or one of early-return"):
        prepare([component(Train(), "plant")], [], H, 1, Balises(positions(1.0), method="guess"))  # type: ignore[arg-type]


def test_a_plant_that_fails_while_it_is_stepped_ahead_frees_its_saved_state() -> None:
    class Breaking(Train):
        def move(self, t: float, h: float) -> None:
            if t >= 0.45:
                raise ValueError("the wheel came off")
            super().move(t, h)

    master = prepare([component(Breaking(), "plant")], [], H, 20, Balises(positions(0.55)))
    with pytest.raises(Exception, match="the wheel came off"):
        master.run()
    assert master.plan.steps[0].component.slave.calls.count("freeFMUstate") >= 1
    assert ran(master).time[-1] == 0.5
