"""The search for limits by simulation, against limits that are known exactly."""

from __future__ import annotations

import numpy as np
import pytest

from cosim.certify import keeps_plant, simulated, simulated_limit
from fmu_observer import OBSERVERS
from fmu_observer.certificates.gap_findings import CONSTANT_GAP
from fmu_observer.certificates.limit_search import LimitSearch
from fmu_observer.observers.generic.sampled import OutputPredictor
from fmu_observer.observers.train import DelayedTrainObserver, MultirateCdo
from plant_models.hybrid import HybridSystem, TriggeredEvent, input_signal, memory, output_signal, parameter


class Relaxation(HybridSystem):
    """``x -> x - gain * period * (x - y)`` at a packet: lost from ``gain period = 2`` on."""

    name = "relaxation"
    description = "One state that is corrected by its own gain times the period"
    states = (memory("x", "1", 1.0, "Estimate"),)
    outputs = (output_signal("value", "1", "Estimate"),)
    parameters = (parameter("period", "s", 0.1, "Period"), parameter("gain", "1/s", 4.0, "Gain"))
    events = (TriggeredEvent("packet", (input_signal("packet_y", "1", 0.0, "Measured", variability="discrete"),)),)

    def jump(self, event, t, x, u, p):  # type: ignore[no-untyped-def]
        return {"x": x.x - p.gain * p.period * (x.x - u.packet_y)}

    def output(self, t, x, u, p):  # type: ignore[no-untyped-def]
        return {"value": x.x}


def search(**changes: object) -> LimitSearch:
    zero = lambda t: {"y": 0.0 * np.asarray(t)}  # noqa: E731
    usual = {
        "system": Relaxation(),
        "varied": "period",
        "low": 0.05,
        "high": 0.9,
        "event": "packet",
        "payload": zero,
        "inputs": lambda _t: {},
        "truth": lambda t: {"value": 0.0 * np.asarray(t)},
        "delay_parameter": "",
        "stop": 30.0,
    }
    return LimitSearch(**{**usual, **changes})  # type: ignore[arg-type]


def test_a_limit_is_found_by_runs() -> None:
    """With the period given by the delay of the search: the limit is where ``gain period`` is 2, 0.5 s."""
    reported = search(varied="delay", delay_parameter="period", low=0.05, high=0.9, period=0.2)
    assert simulated_limit(reported) == pytest.approx(0.5, abs=0.85 / 15**2 + 0.01)  # a slow end within 30 s
    assert keeps_plant(reported, [0.1, 0.45, 0.55]).tolist() == [True, True, False]


def test_the_step_in_which_the_first_failure_lies_is_tried_anew() -> None:
    """Of four values 0.333 s is kept and 0.617 s lost; of four between them 0.428 s is, and 0.522 s not."""
    reported = search(varied="delay", delay_parameter="period", low=0.05, high=0.9, period=0.2)
    assert simulated_limit(reported, 4) == pytest.approx(0.05 + 5.0 * 0.85 / 9.0, rel=1e-12)


def test_ends_of_the_range() -> None:
    reported = search(varied="delay", delay_parameter="period", period=0.2)
    assert simulated_limit(search(varied="delay", delay_parameter="period", period=0.2, high=0.4)) == np.inf
    assert simulated_limit(search(varied="delay", delay_parameter="period", period=0.2, low=0.6)) < 0.6
    assert not keeps_plant(reported, 40.0)[0]  # what grows beyond all numbers is lost, and no error


def test_every_sampled_observer_has_limits() -> None:
    """Exact and simulated agree, where the model is nearly linear; the printed bound is far below."""
    found = {
        f.kind: simulated(f).value
        for f in OutputPredictor("pendulum").findings(parameters={"theta": 4.0})
        if f.what == "period of the samples"
    }
    assert found["simulated"] == pytest.approx(found["exact"], rel=0.1)  # at rest against the worst slope
    assert found["as printed"] < 0.1 * found["simulated"]


class Notified(Relaxation):
    """`x` and `y` from two nodes, each with an event of its own: what came last, and how often."""

    name = "reported"
    states = (memory("x", "1", 9.0, "First"), memory("y", "1", 9.0, "Second"))
    outputs = (output_signal("first", "1", "First"), output_signal("second", "1", "Second"))
    parameters = (parameter("period", "s", 0.1, "Period"),)
    events = tuple(
        TriggeredEvent(name, (input_signal(f"{name}_{field}", "1", 0.0, "Measured", variability="discrete"),))
        for name, field in (("one", "x"), ("other", "y"))
    )

    def jump(self, event, t, x, u, p):  # type: ignore[no-untyped-def]
        return {"x": u.one_x} if event == "one" else {"y": u.other_y}

    def output(self, t, x, u, p):  # type: ignore[no-untyped-def]
        return {"first": x.x, "second": x.y}


def test_nodes_may_have_events_of_their_own() -> None:
    reported = search(
        system=Notified(),
        node_events=("one", "other"),
        payload=lambda t: {"x": 1.0 + 0.0 * t, "y": 2.0 + 0.0 * t},
        truth=lambda t: {"first": 1.0 + 0.0 * np.asarray(t), "second": 2.0 + 0.0 * np.asarray(t)},
    )
    assert keeps_plant(reported, [0.1, 0.2]).tolist() == [True, True]


def test_the_train_behind_a_network_keeps_its_plant_far_beyond_the_printed_bounds() -> None:
    found = [simulated(f, 4) for f in DelayedTrainObserver(memory_places=5).findings()]
    about = [f for f in found if f.what.startswith(("interval", "delay"))]
    assert {f.limit for f in about if f.kind != "as printed"} == {np.inf}
    printed = [f.value for f in about if f.kind == "as printed"]
    assert (printed[0], printed[-1]) == pytest.approx((0.39, 0.549), rel=0.01)


@pytest.mark.parametrize("name", [name for name, made in OBSERVERS.items() if hasattr(made, "sampled_events")])
def test_every_observer_that_waits_for_samples_says_for_how_long(name: str) -> None:
    found = [limit for limit in OBSERVERS[name]().findings() if limit.unit == "s"]
    assert found
    assert any(limit.kind in ("exact", "not found up to") and limit.value > 0.0 for limit in found[1:])
    assert all(limit.source for limit in found)


def test_limits_of_gaps_are_those_of_the_finding_that_decides() -> None:
    mixed, constant = MultirateCdo().findings()
    found = next(MultirateCdo().findings(0.3))
    assert (mixed.limit, constant.limit) == pytest.approx((found.limit, found.condition(CONSTANT_GAP).limit), rel=1e-2)
    assert (mixed.holds, mixed.demand) == (None, None)
