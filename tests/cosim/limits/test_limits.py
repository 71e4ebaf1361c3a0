"""The command and the search for practical limits, against limits that are known exactly."""

from __future__ import annotations

import json

import numpy as np
import pytest

from cosim.cli import main
from cosim.limits import limit_rows, limit_text, practical_limit, survives
from fmu_observer import OBSERVERS
from fmu_observer.certificates.observer_limits import Trial
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


def trial(**changes: object) -> Trial:
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
    return Trial(**{**usual, **changes})  # type: ignore[arg-type]


def test_a_limit_is_found_by_runs() -> None:
    """With the period told by the trial's delay: the limit is where ``gain period`` is 2, 0.5 s."""
    told = trial(varied="delay", delay_parameter="period", low=0.05, high=0.9, period=0.2)
    assert practical_limit(told) == pytest.approx(0.5, abs=0.85 / 15**2 + 0.01)  # a slow end within 30 s
    assert survives(told, [0.1, 0.45, 0.55]).tolist() == [True, True, False]


def test_the_step_in_which_the_first_failure_lies_is_tried_anew() -> None:
    """Of four values 0.333 s is kept and 0.617 s lost; of four between them 0.428 s is, and 0.522 s not."""
    told = trial(varied="delay", delay_parameter="period", low=0.05, high=0.9, period=0.2)
    assert practical_limit(told, 4) == pytest.approx(0.05 + 5.0 * 0.85 / 9.0, rel=1e-12)


def test_ends_of_the_range() -> None:
    told = trial(varied="delay", delay_parameter="period", period=0.2)
    assert practical_limit(trial(varied="delay", delay_parameter="period", period=0.2, high=0.4)) == np.inf
    assert practical_limit(trial(varied="delay", delay_parameter="period", period=0.2, low=0.6)) < 0.6
    assert not survives(told, 40.0)[0]  # what grows beyond all numbers is lost, and no error


def test_every_sampled_observer_has_limits() -> None:
    """Exact and practical agree, where the model is nearly linear; the printed bound is far below."""
    rows = limit_rows(OutputPredictor("pendulum").limits({"theta": 4.0}))
    assert rows[0].practical == pytest.approx(rows[0].exact, rel=0.1)  # at rest against the worst slope
    assert rows[0].printed[0][0] < 0.1 * rows[0].practical
    assert "period of the samples" in limit_text("output_predictor", rows)


class Told(Relaxation):
    """`x` and `y` from two nodes, each with an event of its own: what came last, and how often."""

    name = "told"
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
    told = trial(
        system=Told(),
        node_events=("one", "other"),
        payload=lambda t: {"x": 1.0 + 0.0 * t, "y": 2.0 + 0.0 * t},
        truth=lambda t: {"first": 1.0 + 0.0 * np.asarray(t), "second": 2.0 + 0.0 * np.asarray(t)},
    )
    assert survives(told, [0.1, 0.2]).tolist() == [True, True]


def test_the_train_behind_a_network_keeps_its_plant_far_beyond_the_printed_bounds() -> None:
    packets, delay = limit_rows(DelayedTrainObserver(memory_places=5).limits(), members=4)
    assert [packets.exact, packets.practical, delay.exact, delay.practical] == [np.inf] * 4
    assert (packets.printed[0][0], delay.printed[0][0]) == pytest.approx((0.39, 0.549), rel=0.01)


@pytest.mark.parametrize("name", [n for n in OBSERVERS if n not in {"odometer_reset", "train_diagnosis"}])
def test_every_observer_has_limits_or_says_why_not(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    observer = OBSERVERS[name]()
    if not hasattr(observer, "limits"):
        assert main(["limits", name, "--no-runs"]) == 2
        assert "no measurement comes to it as an event" in capsys.readouterr().err
        return
    limits = observer.limits()
    assert limits
    for limit in limits:
        assert limit.exact is not None
        assert limit.exact > 0.0
        assert limit.exact_test


def test_limits_of_a_certificate_are_its_own() -> None:
    constant, mixed = MultirateCdo().limits()
    found = MultirateCdo().certify(0.3)
    assert (constant.exact, mixed.exact) == pytest.approx((found.constant_limit, found.aperiodic_limit), rel=1e-2)


def test_the_command(capsys: pytest.CaptureFixture[str]) -> None:
    words = ["limits", "delayed_state_observer", "--option", "model=flexible_joint_arm", "--option", "predictors=3"]
    assert main([*words, "--no-runs"]) == 0
    assert "delay, 3 predictors" in capsys.readouterr().out
    assert main([*words, "--no-runs", "--json", "--set", "theta=1"]) == 0
    rows = json.loads(capsys.readouterr().out)
    assert rows[1]["exact"] == pytest.approx(3 * 0.19595, rel=1e-3)
    assert [row["practical"] for row in rows] == [None, None]


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["nobody"], "There is no observer 'nobody'"),
        (["jam_detector"], "tells no limits: no measurement comes to it as an event"),
        (["odometer_reset"], "tells no limits: it declares no error equations"),
        (["output_predictor", "--set", "speed=3"], "unknown parameter 'speed'"),
        (["output_predictor", "--members", "1"], "expected 4 values or more"),
        (["delayed_state_observer", "--option", "predictors=12"], "choose from 1, 0, 2, 3"),
    ],
)
def test_mistakes_are_explained(words: list[str], said: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["limits", *words]) == 2
    assert said in capsys.readouterr().err
