"""The innovation gate: what every observer of balises does with telegrams that cannot be true, and with its own
mistakes.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache, partial
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from observer_runner import MASS, SteadyMotion, SystemRunner

from fmu_observer import OBSERVERS
from fmu_observer.formulas.filtering.kalman import correct
from fmu_observer.observers.gated_observer import GatedObserver
from fmu_observer.observers.generic.sampled import ExponentialGain, HeldInnovation, HybridImpulsive, OutputPredictor
from fmu_observer.observers.innovation_gate import (
    GATE_MEMORY,
    OFF,
    REJECT,
    WARN,
    GateMemory,
    ReportedPlace,
    _gate_limit,
    _GateVerdict,
    evaluate,
)
from plant_models.hybrid import NumpyKernel, Runtime, scalar_names
from plant_models.hybrid.event import DOUBTED, IGNORED, USED

MOTION, GAP = SteadyMotion(speed=14.0), 0.3
NOTIFIED_BY_PACKETS = "predicted_output[2]"  # a speed of which no packet comes here
GENERIC = (ExponentialGain, HeldInnovation, HybridImpulsive, OutputPredictor)
# one of each is traced once; an observer of this room may do without a gate
TRAIN = [OBSERVERS[name] for name in OBSERVERS if OBSERVERS.room(name).endswith(".train")]
SYSTEMS = [system for system in TRAIN if issubclass(system, GatedObserver)]
MAKERS: dict[str, Callable[[], GatedObserver]] = {system.name: cache(system) for system in SYSTEMS}
MAKERS |= {f"{g.name} of freight_train": cache(partial(g, model="freight_train")) for g in GENERIC}
MAKERS["general_takagi_sugeno_cdo"] = cache(OBSERVERS["general_takagi_sugeno_cdo"])  # type: ignore[arg-type]
PRESETS = {"augmented_high_gain_cdo": "balises", "augmented_takagi_sugeno_cdo": "balises"}
GATES = {"off": OFF, "warn": WARN, "reject": REJECT}
every = pytest.mark.parametrize("make", MAKERS.values(), ids=MAKERS)


def own_count(system: GatedObserver) -> int:
    """Number of states before those of the gate."""
    return scalar_names(system.states).index(GATE_MEMORY[0].name)


def gated_of(make: Callable[[], GatedObserver], gate: float = REJECT, **parameters: float) -> SystemRunner:
    """An observer that believes the steady motion, and whose gate has settled."""
    system = make()
    runner = SystemRunner(system, preset=PRESETS.get(system.name), gate=gate, **parameters)
    names = scalar_names(system.states)
    v, inputs = MOTION.speed, scalar_names(system.input_signals)
    exact = {"estimated_speed": v, "wheel_rate": v / 0.575, "wheel_speed_estimate": v, "odometer_speed": v}
    exact |= {NOTIFIED_BY_PACKETS: v}
    exact |= {"adhesion_deceleration": -(0.575**2) / 225.0 * MOTION.effort(0.0)}
    runner.set("x", {name: value for name, value in exact.items() if name in names})
    fed = {
        "effort": effort_for(system),
        "odometer": v,
        "measured_odometer": v,
        "net_effort": MOTION.effort(0.0) - 900.0,
    }
    runner.set("u", {name: value for name, value in fed.items() if name in inputs})
    runner.runtime.start(0.0)
    run(runner, 5)
    return runner


def effort_for(system: GatedObserver) -> float:
    """Effort of the steady motion [N], for the mass that the observer believes in."""
    masses = [s.start_values[0] for s in system.parameters if s.name == "mass"]
    return MOTION.effort(0.0) * (masses[0] / MASS if masses else 1.0)


def run(runner: SystemRunner, count: int, offsets: dict[int, float] | None = None) -> list[int]:
    """Pass balises, some of them off by so much [m]; the verdicts."""
    verdicts = []
    for k in range(count):
        runner.runtime.advance(runner.runtime.t + GAP)
        runner.set("u", {"balise_position": MOTION.position(runner.runtime.t) + (offsets or {}).get(k, 0.0)})
        verdicts.append(runner.runtime.trigger("balise"))
    return verdicts


def error(runner: SystemRunner, off: float = 0.0) -> float:
    return abs(float(runner.runtime.x[0]) - MOTION.position(runner.runtime.t) - off)


# -- the judgement alone
# ------------------------------------------------------------------------------------------------

GATE = SimpleNamespace(
    gate=REJECT,
    gate_floor=0.5,
    gate_drift=0.05,
    gate_creep=0.01,
    gate_spread=3.0,
    gate_acceleration=1.5,
    gate_recover=2.0,
)
BLANK = GateMemory(*np.zeros(len(GATE_MEMORY)))
SETTLED = BLANK._replace(settled=2.0, recent=0.4, share=0.005, reference=60.0, left=0.8)
SINCE = float(np.hypot(0.8, 3.0 * 0.005 * 40.0))
"""What the balise at 60 m left, and three times the recent share of the way since [m]."""
LIMIT = 0.5 + 0.2 + SINCE + 3.0 * 0.4
"""Of `SETTLED` and `evaluated`: floor, accuracy, the way since 60 m, and of the recent innovation [m]."""


def evaluated(innovation: float, before: GateMemory = SETTLED, **reported: Any) -> _GateVerdict:
    """The judgement on a position so far from an estimate of 100 m."""
    return evaluate(before, ReportedPlace(100.0 - innovation, 0.2, 100.0, 0.3, 0.0, 10.0)._replace(**reported), GATE)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_the_limit_is_the_sum_of_its_terms(sign: float) -> None:
    cases: list[tuple[float, dict[str, float]]] = [
        (LIMIT, {}),
        (LIMIT - 0.2, {"accuracy": -1.0}),
        (LIMIT - 0.2, {"accuracy": float("nan")}),
        (LIMIT - SINCE + 7.0, {"bound": 7.0}),  # the larger of both
    ]
    for limit, reported in cases:
        assert [float(evaluated(sign * (limit + beyond), **reported).used) for beyond in (-1e-9, 1e-9)] == [1.0, 0.0]


@pytest.mark.parametrize(("share", "granted"), [(0.0, 0.01), (0.005, 0.015), (0.1, 0.05)])
def test_the_share_of_the_way_is_learnt_within_creep_and_drift(share: float, granted: float) -> None:
    before = SETTLED._replace(share=share, left=0.0, recent=0.0)
    reported = ReportedPlace(0.0, 0.0, 100.0, 0.0, 10.0, 10.0)
    for change, floor in ((0.0, 0.01), (0.15, 0.03), (-0.15, 0.03), (1.0, 0.05)):  # of the speed [m/s2]
        limit = float(_gate_limit(before._replace(last_odometer=10.0 + 10.0 * change), reported, GATE))
        assert limit == pytest.approx(0.5 + max(granted, floor) * 40.0)
    assert float(_gate_limit(before, reported._replace(odometer=None), GATE)) == pytest.approx(0.5 + 0.05 * 40.0)


def test_what_is_remembered_of_a_telegram() -> None:
    """One within the limit, a larger one within it, one that is refused, one beyond it before the gate has settled."""
    unsettled = SETTLED._replace(settled=1.0)
    kept = [evaluated(0.1), evaluated(1.0), evaluated(50.0), evaluated(50.0, unsettled)]
    assert [float(j.used) for j in kept] == [1.0, 1.0, 0.0, 1.0]
    assert [float(j.memory.settled) for j in kept] == [3.0, 3.0, 2.0, 0.0]
    # halved, unless what this one is off beyond its accuracy is larger
    assert [float(j.memory.recent) for j in kept] == pytest.approx([0.2, 0.8, 0.4, 49.8])
    way = 40.0 + 0.5 / 0.05
    assert [float(j.memory.share) for j in kept] == pytest.approx([0.0025, 0.8 / way, 0.005, 49.8 / way])
    assert [float(j.memory.reference) for j in kept] == [99.9, 99.0, 60.0, 50.0]
    assert [float(j.memory.left) for j in kept] == pytest.approx([0.2, 0.2, 0.8, 0.2])  # an accuracy below the floor
    assert [float(j.memory.doubted) for j in kept] == [0.0, 0.0, 1.0, 0.0]
    assert [float(j.memory.verdict) for j in kept] == [USED, USED, IGNORED, USED]


@settings(deadline=None)
@given(accuracies=st.lists(st.floats(0.0, 63.0), min_size=2, max_size=2), bound=st.floats(0.0, 100.0))
def test_the_weight_is_the_ratio_of_two_kalman_gains(accuracies: list[float], bound: float) -> None:
    """One at the floor and below it, then falling: against gains of ``correct`` with variances of rectangles."""
    a, b = sorted(accuracies)
    before = SETTLED._replace(left=0.0, share=0.0, recent=0.0, reference=100.0)
    weights = [float(evaluated(0.0, before, accuracy=q, bound=bound).weight) for q in (0.0, a, b)]
    assert weights == sorted(weights, reverse=True)
    assert weights[0] == 1.0

    def gain(accuracy: float) -> float:
        variance = np.array([[max(accuracy, GATE.gate_floor) ** 2 / 3.0]])
        after = correct(np.zeros(1), np.array([[bound**2 / 3.0]]), np.zeros(1), np.eye(1), variance)
        return float(np.asarray(after.gain)[0, 0])

    if bound > 1e-3:
        assert weights[2] == pytest.approx(gain(b) / gain(0.0), rel=1e-9)


@pytest.mark.parametrize(
    ("reported", "count"),
    [
        # the way of the odometer, its mean of 10 and 30 m/s
        ({"estimate": 100.0, "position": 220.0, "odometer": 30.0, "t": 11.0}, 2.0),
        ({"estimate": 100.0, "position": 290.0, "odometer": 10.0, "t": 11.0}, 1.0),
        ({"estimate": 120.0, "position": 220.0, "odometer": 90.0, "t": 11.0}, 2.0),  # the way of the estimate
        ({"estimate": 100.0, "position": 200.0, "odometer": 90.0, "t": 11.0}, 1.0),  # told twice
        # 14 m/s to the one before and 15 m/s since, for 10 and 4 s: 1.5 m/s2 change them by 10.5 m/s at most
        ({"estimate": 100.0, "position": 260.0, "odometer": 90.0, "t": 14.0}, 1.5),
        ({"estimate": 100.0, "position": 310.0, "odometer": 90.0, "t": 14.0}, 1.0),
    ],
)
def test_doubted_telegrams_agree_by_ways_or_speeds(reported: dict[str, float], count: float) -> None:
    before = SETTLED._replace(last_position=60.0, last_odometer=90.0)
    first = evaluated(-100.0, before, odometer=10.0).memory
    assert (float(first.doubted), float(first.last_speed)) == (1.0, 14.0)
    second = evaluate(first, ReportedPlace(accuracy=0.2, bound=0.3, **reported), GATE)
    believed = count == 2.0
    assert (float(second.restart), float(second.used)) == (believed, believed)
    assert float(second.memory.doubted) == (0.0 if believed else count)


def test_the_way_of_the_odometer_since_the_last_one_speaks_for_a_telegram_at_once() -> None:
    """Mean of 12 and 16 m/s for 10 s from 60 m on: 200 m, while the estimate has stayed behind at 100 m."""
    before = SETTLED._replace(last_position=60.0, last_odometer=12.0)
    for odometer, used in ((16.0, 1.0), (60.0, 0.0)):
        assert float(evaluated(-100.0, before, odometer=odometer).restart) == used


def test_an_odometer_that_agrees_with_both_says_nothing_against_the_estimate() -> None:
    """4 m/s for 10 s from 60 m on: 100 m as estimated; 104 m are told, within 5 % of the way and the places."""
    before = SETTLED._replace(last_position=60.0, last_odometer=4.0, recent=0.0)
    found = evaluated(-2.6, before, odometer=4.0)
    assert (float(found.used), float(found.memory.doubted)) == (0.0, 1.0)


@settings(deadline=None)
@given(seed=st.integers(0, 2**32 - 1), accuracy=st.sampled_from([0.0, 5.0, 63.0]))
def test_no_gate_stays_shut(seed: int, accuracy: float) -> None:
    """Of three true telegrams in a row one is used, whatever estimate and odometer say; of four where what is
    remembered of the one before is no truth.
    """
    rng = np.random.default_rng(seed)
    anything = ("last_position", "last_innovation", "reference", "last_odometer", "last_speed")
    memory = BLANK._replace(
        settled=2.0, doubted=float(rng.choice([0.0, 1.0, 1.5])), **{n: float(rng.normal() * 1e3) for n in anything}
    )
    speed, t, place, shut = float(rng.uniform(0.0, 40.0)), 1.0, 0.0, 0
    for number in range(20):
        passed = 10.0 ** float(rng.uniform(-0.3, 2.0))
        new = float(np.clip(speed + rng.uniform(-1.5, 1.5) * passed, 0.5, 60.0))
        # told places are further apart than the floor, or they would count as one that is told twice
        spacing = max(0.5 * (speed + new) * passed, 2.0 + 2.0 * accuracy)
        place, t, speed = place + spacing, t + spacing / (0.5 * (speed + new)), new
        off = float(rng.uniform(-1.0, 1.0)) * (accuracy + 0.5)
        estimate, odometer = float(rng.normal() * 1e4), float(rng.uniform(0.0, 60.0))
        found = evaluate(memory, ReportedPlace(place + off, accuracy, estimate, 0.0, odometer, t), GATE)
        memory, shut = found.memory, 0 if float(found.used) > 0.0 else shut + 1
        assert shut <= 2 or number == shut - 1 == 2


# -- in every observer
# --------------------------------------------------------------------------------------------------


def test_every_observer_of_balises_has_the_gate() -> None:
    reported = {name: OBSERVERS[name]() for name in OBSERVERS}
    reported = {n: s for n, s in reported.items() if any(e.name == "balise" for e in s.triggered_events)}
    # a detector judges telegrams by its own residuals
    reported = {n: s for n, s in reported.items() if not type(s).__module__.startswith("fmu_observer.detection.")}
    assert len(reported) >= len(SYSTEMS)
    for name, system in reported.items():
        assert isinstance(system, GatedObserver), name
        assert system.gated


@every
def test_false_telegrams_are_ignored_and_change_nothing(make: Callable[[], GatedObserver]) -> None:
    false, alone = gated_of(make), gated_of(make)
    own = own_count(make())
    for offset in (2.0, -2.0, 100.0, -1000.0):
        assert run(false, 1, {0: offset}) == [IGNORED]
        assert run(false, 3) == [USED] * 3
        alone.runtime.advance(alone.runtime.t + GAP)  # nothing is told there
        run(alone, 3)
        np.testing.assert_array_equal(false.runtime.x[:own], alone.runtime.x[:own])


@every
def test_warned_of_false_telegrams_are_used_as_with_the_gate_off(make: Callable[[], GatedObserver]) -> None:
    runners = {name: gated_of(make, gate) for name, gate in GATES.items() if name != "reject"}
    verdicts = {name: run(runner, 1, {0: 30.0}) for name, runner in runners.items()}
    assert verdicts == {"off": [USED], "warn": [DOUBTED]}
    own = own_count(make())
    np.testing.assert_array_equal(*(b.runtime.x[:own] for b in runners.values()))


@every
@settings(max_examples=5, deadline=None)
@given(seed=st.integers(0, 1000))
def test_without_false_telegrams_the_gate_changes_no_bit(make: Callable[[], GatedObserver], seed: int) -> None:
    own = own_count(make())
    noise = dict(enumerate(np.random.default_rng(seed).uniform(-0.05, 0.05, 12).tolist()))
    ends = []
    for gate in GATES.values():
        runner = gated_of(make, gate)
        assert run(runner, 12, noise) == [USED] * 12
        ends.append(runner.runtime.x[:own].copy())
    np.testing.assert_array_equal(ends[0], ends[1])
    np.testing.assert_array_equal(ends[0], ends[2])


@every
def test_a_wrong_estimate_recovers_from_telegrams_that_agree(make: Callable[[], GatedObserver]) -> None:
    runner = gated_of(make)
    off = dict.fromkeys(range(12), 50.0)  # the train is 50 m further than believed
    assert run(runner, 2, off) == [IGNORED, DOUBTED]  # the second is believed, and the estimate restarts there
    assert error(runner, 50.0) < 0.5
    assert run(runner, 12, off) == [USED] * 12
    assert error(runner, 50.0) < 0.2


@every
def test_false_telegrams_that_do_not_agree_are_never_believed(make: Callable[[], GatedObserver]) -> None:
    runner = gated_of(make)
    assert run(runner, 6, {k: 40.0 * (-1) ** k * (k + 1) for k in range(6)}) == [IGNORED] * 6


@every
def test_a_false_telegram_delivered_twice_is_one(make: Callable[[], GatedObserver]) -> None:
    runner = gated_of(make)
    run(runner, 1, {0: 40.0})
    assert [runner.runtime.trigger("balise") for _ in range(5)] == [IGNORED] * 5


@pytest.mark.parametrize("name", [s.name for s in SYSTEMS])
def test_a_start_50_m_off_is_no_reason_to_doubt(name: str) -> None:
    ends = []
    for gate in (OFF, REJECT):
        system = MAKERS[name]()
        runner = SystemRunner(system, preset=PRESETS.get(name), gate=gate)
        fed = {"effort": effort_for(system), "odometer": MOTION.speed}
        runner.set("u", {n: value for n, value in fed.items() if n in scalar_names(system.input_signals)})
        runner.set("x", dict.fromkeys({NOTIFIED_BY_PACKETS} & set(scalar_names(system.states)), MOTION.speed))
        runner.runtime.x[:2] = -50.0, MOTION.speed
        runner.runtime.start(0.0)
        assert run(runner, 30) == [USED] * 30
        ends.append(error(runner))
    assert ends[0] == ends[1] < 1.0


def test_the_location_accuracy_widens_the_gate() -> None:
    for accuracy, expected in ((0.0, IGNORED), (10.0, USED)):
        runner = gated_of(MAKERS["differentiator_cdo"])
        runner.set("u", {"balise_location_accuracy": accuracy})
        assert run(runner, 1, {0: 8.0}) == [expected]


def test_a_balise_that_does_not_act_is_not_evaluated() -> None:
    """Satellite fixes alone correct this one: what balises say neither restarts it nor counts."""
    system = OBSERVERS["augmented_high_gain_cdo"]()
    runner = SystemRunner(system, preset="gps", gate=REJECT)
    runner.set("u", {"effort": MOTION.effort(0.0), "odometer": MOTION.speed})
    runner.set("x", {"gate_settled": 3.0})
    runner.runtime.start(0.0)
    before = float(runner.runtime.x[0])
    assert run(runner, 8, dict.fromkeys(range(8), 500.0)) == [USED] * 8
    assert (runner.state("gate_settled"), runner.state("gate_doubted"), runner.state("gate_recent")) == (3.0, 0.0, 0.0)
    assert abs(float(runner.runtime.x[0]) - before) < 100.0


@every
def test_python_and_traced_code_evaluate_alike(make: Callable[[], GatedObserver]) -> None:
    offsets = {1: 3.0, 3: -200.0, 5: 60.0, 6: 60.0, 7: 60.0, 9: 0.3}
    traced, python = (gated_of(make, internal_step=0.03) for _ in range(2))  # few steps: NumPy is slow
    python.runtime = _in_python(python)
    assert run(traced, 12, offsets) == run(python, 12, offsets)
    assert np.isfinite(traced.runtime.x).all()
    np.testing.assert_allclose(traced.runtime.x, python.runtime.x, rtol=1e-10, atol=1e-10)


def _in_python(runner: SystemRunner) -> Runtime:
    """The same runtime, evaluated by NumPy."""
    other = Runtime(runner.system, NumpyKernel(runner.system))
    other.restore(runner.runtime.snapshot())
    return other


@pytest.mark.parametrize(
    ("name", "value", "expected"),
    [
        ("gate_floor", 0.0, "at least 0.001 m"),
        ("gate_floor", -1.0, "at least 0.001 m"),
        ("gate_floor", float("inf"), "finite"),
        ("gate_drift", -0.1, "at least 0"),
        ("gate_spread", float("nan"), "finite"),
        ("gate_recover", 0.0, "at least 1"),
        ("gate", 3.0, "at most 2"),
    ],
)
def test_a_gate_that_cannot_be_is_refused(name: str, value: float, expected: str) -> None:
    runner = SystemRunner(OBSERVERS["differentiator_cdo"](), **{name: value})
    said = (
        rf"differentiator_cdo: time cannot run with these values: {name} must be .*{expected}.* \({name} = "
        rf"{value}\)"
    )
    with pytest.raises(ValueError, match=said):
        runner.runtime.start(0.0)
