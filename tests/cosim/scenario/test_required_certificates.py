"""Law: a certificate that is required is asked for whatever tells of samples, or the run is refused with the reason."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy
from hypothesis import given, settings
from hypothesis import strategies as st
from shipped import shipped

from cosim import Outcome, Scenario
from cosim.errors import CertificateError
from cosim.network.chance import Chance
from cosim.network.intervals import BY_ERROR, longest_interval, sends_in_turn
from cosim.network.settings import NetworkSettings, Node
from cosim.run import observer_findings
from cosim.run.expected_gaps import ExpectedGap
from cosim.scenario.scenario_tables import Backend
from fmu_observer import OBSERVERS
from fmu_observer.certificates.finding import Finding
from fmu_observer.certificates.gap_findings import CONSTANT_GAP, gap_finding
from fmu_observer.observers.generic.delayed import DelayedStateObserver
from plant_models.hybrid import HybridSystem, output_signal

CERTIFIED = [name for name, observer in OBSERVERS.items() if hasattr(observer, "sampled_events")]
REPORTED = [name for name in CERTIFIED if shipped(name).triggered_events]


@cache
def everything(name: str) -> tuple[type[HybridSystem], tuple[tuple[str, str], ...]]:
    """A system with an output for each measurement of an observer, and which is for which; none is told by counts."""
    system = OBSERVERS[name]()
    fields = [s for event in system.triggered_events for s in event.payload if not s.name.endswith("_node")]
    fields += [s for s in system.inputs if s.name.startswith(("measured_", "odometer"))]

    class Everything(HybridSystem):
        name = "everything"
        description = "Constants"
        source = "test"
        outputs = tuple(output_signal(f"out_{s.name}", s.unit, "A constant") for s in fields)

        def output(self, t: Any, x: Any, u: Any, p: Any) -> dict[str, Any]:
            return {s.name: 0.0 * t for s in self.outputs}

    return Everything, tuple((f"source.out_{s.name}", f"observer.{s.name}") for s in fields)


def required(name: str, reported: bool = True, **keys: Any) -> Scenario:
    """An observer of which a certificate is required, and what it may be told of."""
    made, links = everything(name)
    s = Scenario(stop=0.1, step=0.05, certificates="require")  # as long as the gap of the packets: evaluated once
    s.add("source", model=made)
    s.add("observer", observer=name, **{"as": "block3", **keys})
    events = [event.name for event in OBSERVERS[name]().triggered_events]
    for source, target in links:
        signal = target.partition(".")[2]
        if reported or not any(signal.startswith(f"{event}_") for event in events):
            s.connect(f"{source} -> {target}")
    return s


def over_a_network(name: str, **keys: Any) -> Scenario:
    owned = [
        source
        for source, target in everything(name)[1]
        if not target.startswith(("observer.odometer", "observer.measured_")) or name not in REPORTED
    ]
    network: dict[str, Any] = {"nodes": {"all": owned}, "period": 0.1} | keys
    return required(name).network(**network)


def verdict(scenario: Scenario) -> Outcome | str:
    try:
        outcome = scenario.run(warn=lambda _: None)
    except CertificateError as refused:
        return str(refused)
    assert outcome.failure is None, outcome.failure
    return outcome


def applied(scenario: Scenario) -> str:
    """What was said of the observer, which is never nothing: a certificate that holds, or why there is none."""
    found = verdict(scenario)
    if isinstance(found, str):
        assert "observer" in found or "Expected" in found
        return found
    certificate = found.result.summary["certificates"]["observer"]
    assert certificate["holds"] is True
    assert certificate["max_gap"] > 0.0
    return str(certificate["explanation"])


def evaluated_unseen(name: str, _table: Any, _system: Any, gap: ExpectedGap) -> tuple[Finding, list[str]]:
    """A finding that holds for every gap that is known."""
    known = gap.seconds is not None
    holds = gap_finding(
        gap.seconds or 1.0, np.inf, np.inf, np.inf, growth=0.5, decrease=1.0, holds=known, error_model="none"
    )
    found = replace(holds, what="mixed balise gaps", demand=gap.seconds, explanation=gap.reason)
    return found, [] if known else [f"{name}: {gap.reason}"]


@pytest.mark.parametrize("name", CERTIFIED)
def test_what_is_required_is_asked_for_every_source_or_refused(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(observer_findings, "_evaluated", evaluated_unseen)
    monkeypatch.setattr(observer_findings, "remembered", lambda _kind, _key, make: make())
    unfed = applied(required(name, reported=False))
    if name not in REPORTED:
        assert "at this period" in unfed
        return
    assert "nothing triggers its event" in unfed
    assert "from packet to packet" in applied(over_a_network(name))
    assert "lost by chance" in applied(over_a_network(name, loss_fraction=0.01))


@pytest.mark.parametrize("name", CERTIFIED)
def test_what_is_required_is_applied_to_every_source_or_refused(name: str) -> None:
    applied(required(name, reported=False))
    if name in REPORTED:
        applied(over_a_network(name))


def test_packets_too_far_apart_are_refused() -> None:
    s = Scenario(stop=1.0, step=0.01, certificates="require")
    s.add("p", model="pendulum").add("obs", observer="held_innovation", parameters={"theta": 5.0}, **{"as": "block3"})
    s.connect("p.angle -> obs.sample_angle").network(nodes={"a": ["p.angle"]}, period=0.8)
    with pytest.raises(CertificateError, match=r"UNSTABLE at a constant sample gap of 0\.8 s.*each of its packets"):
        s.run()
    outcome = s.set("network.period", 0.1).run(warn=lambda _: None)
    assert outcome.result.summary["certificates"]["obs"]["max_gap"] == pytest.approx(0.1)


def test_packets_that_were_lost_are_held_against_what_is_certified() -> None:
    s = Scenario(stop=30.0, step=0.05)
    s.add("p", model="pendulum").add("obs", observer="held_innovation", parameters={"theta": 5.0}, **{"as": "block3"})
    s.connect("p.angle -> obs.sample_angle").network(nodes={"a": ["p.angle"]}, period=0.15, loss_fraction=0.4, seed=3)
    outcome = s.run(warn=lambda _: None)
    used = [0.0, *(p.stamp for p in outcome.result.packets if p.outcomes.get("obs") == "accepted")]
    found = outcome.result.summary["certificates"]["obs"]
    assert found["largest_gap_seen"] == pytest.approx(max(b - a for a, b in pairwise(used)))
    assert found["largest_gap_seen"] > found["certified_up_to"]
    assert any(text.startswith("obs: the longest gap between packets was 0.") for text in outcome.warnings)


ARM: dict[str, Any] = {"options": {"model": "flexible_joint_arm"}, "parameters": {"delay": 0.15}}


def arm(policy: str = "late", protocol: str = "round-robin", **network: Any) -> Scenario:
    s = Scenario(stop=0.2, step=0.05, certificates="require")
    s.add("arm", model="flexible_joint_arm", **{"as": "block3"})
    s.add("observer", observer="delayed_state_observer", late_policy=policy, **{"as": "block3"}, **ARM)
    angles = ("motor_angle", "link_angle")
    s.connect(*(f"arm.{angle} -> observer.packet_{angle}" for angle in angles))
    nodes = {"motor": ["arm.motor_angle"], "link": ["arm.link_angle"]}
    return s.network(**({"nodes": nodes, "period": 0.1, "delay": 0.15, "protocol": protocol} | network))


def test_nodes_that_send_in_turn_are_certified_so() -> None:
    found = verdict(arm())
    assert not isinstance(found, str), found
    assert "2 nodes that send in turn" in found.result.summary["certificates"]["observer"]["explanation"]
    assert "UNSTABLE" in applied(arm(period=0.25))


@pytest.mark.parametrize(
    ("keys", "words"),
    [
        ({"protocol": "try-once-discard"}, "nodes that send in turn, which protocol 'try-once-discard'"),
        ({"protocol": "periodic", "order": ["motor", "motor", "link"]}, "nodes that send in turn"),
        ({"nodes": {"link": ["arm.link_angle"], "motor": ["arm.motor_angle"]}}, "is sent by node"),
        ({"delay_model": "uniform", "delay_spread": 0.2}, "overtake"),
        ({"policy": "reject"}, "rejected"),
        ({"policy": "replay", "delay_model": "correlated", "delay_spread": 0.01}, "older than 10 s is rejected"),
    ],
)
def test_what_a_certificate_is_not_about_is_refused(keys: dict[str, Any], words: str) -> None:
    assert words in applied(arm(**keys))


def test_packets_that_renew_one_measurement_of_several_are_refused() -> None:
    owned = [source for source, _ in everything("augmented_takagi_sugeno_cdo")[1]]
    balise = [name for name in owned if "balise" in name]
    others = [name for name in owned if "balise" not in name and "odometer" not in name]
    nodes = {"one": balise[:1], "two": [*balise[1:], *others]}
    assert "of which each packet renews one" in applied(over_a_network("augmented_takagi_sugeno_cdo", nodes=nodes))


def test_a_reading_that_is_held_between_packets_or_rows_is_refused(tmp_path: Path) -> None:
    stale = over_a_network("riccati_high_gain")
    assert "arrives by packets" in applied(stale)
    table = tmp_path / "angles.csv"
    table.write_text("time,angle\n0,0\n0.4,0.1\n0.8,0.2\n", encoding="utf-8")
    for interpolation, refused in (("hold", True), ("linear", False)):
        s = Scenario(stop=0.8, step=0.1, certificates="require")
        s.add("seen", recording=str(table), interpolation=interpolation)
        s.add("observer", observer="riccati_high_gain", **{"as": "block3"})
        s.connect("seen.angle -> observer.measured_angle")
        assert ("is held over the rows of seen" in applied(s)) == refused


def test_a_lossy_odometer_is_not_hidden_by_balises_of_which_the_distance_is_known() -> None:
    """The preset is certified at any gap, so the distance of its balises is no reason to refuse; its odometer is."""
    scenario = Scenario(stop=1.0, step=0.1, certificates="require")
    scenario.add("train", model="locomotive").add("observer", observer="takagi_sugeno_cdo", preset="long_gaps")
    scenario.connect("train.wheel_speed -> observer.odometer")
    scenario.balises(position="train.position", speed="train.speed", layout="spacing", spacing=100.0, track_end=500.0)
    scenario.network(nodes={"n": ["train.wheel_speed"]}, period=0.1, loss_fraction=0.3)
    with pytest.raises(CertificateError, match=r"observer\.odometer arrives by packets"):
        scenario.run(warn=lambda _: None)


def test_a_component_that_notifies_at_instants_of_its_own_is_refused() -> None:
    s = Scenario(stop=0.2, step=0.05, certificates="require")
    s.add("reader", model="balise_reader", parameters={"speed": 0.0}, **{"as": "block2"})
    s.add("observer", observer="takagi_sugeno_cdo", parameters={"odometer": 0.0}, **{"as": "block2"})
    s.connect(*(f"reader.balise_{field} -> observer.balise_{field}" for field in ("count", "time", "position")))
    assert "another component triggers its event 'balise'" in applied(s)


# -- the gap of a network, against the instants at which it sends ----------------------------------------------------


@st.composite
def networks(draw: st.DrawFn) -> tuple[NetworkSettings, frozenset[int]]:
    count = draw(st.integers(1, 4))
    order = draw(st.lists(st.integers(0, count - 1), min_size=0, max_size=7))
    order += [node for node in range(count) if order and node not in order]
    period = draw(st.floats(0.01, 1.0))
    made = NetworkSettings(
        nodes=tuple(Node(f"n{i}", (f"c.s{i}",)) for i in range(count)),
        protocol="periodic" if order else "round-robin",
        order=tuple(order),
        period=period,
        offset=draw(st.floats(0.0, 2.0)),
        jitter=draw(st.sampled_from([0.0, 0.3, 0.9])) * period,
        seed=draw(st.integers(0, 9)),
    )
    return made, draw(st.frozensets(st.integers(0, count - 1), min_size=1))


@given(networks())
@settings(max_examples=100, deadline=None)
def test_no_gap_of_a_network_is_longer_than_stated(case: tuple[NetworkSettings, frozenset[int]]) -> None:
    made, nodes = case
    chance, order = Chance(made, 0.0), made.order or tuple(range(len(made.nodes)))
    sent = [chance.instant(k) for k in range(60) if order[k % len(order)] in nodes]
    longest = max(b - a for a, b in pairwise([0.0, *sent]))
    seconds, _ = longest_interval(made, nodes)
    assert seconds is not None
    assert longest <= seconds * (1.0 + 1e-12)  # rounding
    assert longest >= seconds - 2.0 * made.jitter - 1e-12  # and it is no longer than chance can make it
    turns = [order[k % len(order)] for k in range(4 * len(order)) if order[k % len(order)] in nodes]
    alternate = all(turns[k] == turns[k + len(nodes)] for k in range(len(turns) - len(nodes)))
    once = len(set(turns[: len(nodes)])) == len(nodes)
    rising = sorted(nodes) == sorted(turns[: len(nodes)]) and any(
        turns[k : k + len(nodes)] == sorted(nodes) for k in range(len(nodes))
    )
    assert sends_in_turn(made, sorted(nodes)) == (alternate and once and rising)


@pytest.mark.parametrize("protocol", BY_ERROR)
def test_a_node_that_is_picked_by_its_error_may_be_silent(protocol: Any) -> None:
    made = NetworkSettings(nodes=(Node("a", ("c.a",)), Node("b", ("c.b",))), protocol=protocol)
    assert longest_interval(made, {0})[0] is None
    assert longest_interval(made, {0, 1})[0] == pytest.approx(made.period)
    assert not sends_in_turn(made, [0, 1])


# -- turns of nodes, against products of exponentials ------------------------------------------------------------------


def test_turns_of_nodes_against_products_of_exponentials() -> None:
    """The error of the delayed state of the arm, packet by packet, with SciPy's exponential and resets written out."""
    observer = DelayedStateObserver("flexible_joint_arm")
    certificate = next(observer.findings(0.17))
    assert certificate.holds
    p = observer.unpack_parameters(np.array([v for s in observer.parameter_signals for v in s.start_values]))
    drift = observer.model.drifts[-1]  # the steeper spring decides
    K, C = np.asarray(observer.gain_matrices(p)[0]), np.asarray(observer.model.C)
    G = np.block([[drift - K @ C, K], [C @ drift, np.zeros((2, 2))]])
    resets = [np.diag([1.0, 1, 1, 1, 0, 1]), np.diag([1.0, 1, 1, 1, 1, 0])]

    def radius(gap: float) -> float:
        flow = scipy.linalg.expm(G * gap)
        return float(np.abs(np.linalg.eigvals(resets[1] @ flow @ resets[0] @ flow)).max())

    limit = certificate.condition(CONSTANT_GAP).limit
    assert radius(limit - 1e-6) < 1.0 <= radius(limit + 1e-6)
    assert radius(0.25) > 1.0
    generator, error = np.random.default_rng(5), np.eye(6)
    for k in range(600):  # gaps of any length, mixed
        gap = certificate.limit * generator.choice([1.0, generator.uniform(0.01, 1.0)])
        error = resets[k % 2] @ scipy.linalg.expm(G * gap) @ error
    assert np.abs(error).max() < 1e-6


def test_what_never_gets_a_sample_is_not_warned_of_sequences_of_gaps() -> None:
    s = Scenario(stop=700.0, step=1.0).add("train", model="locomotive", **{"as": "block3"})
    s.add("obs", observer="discrete_measurement_observer", **{"as": "block3"})
    s.connect("train.wheel_speed -> obs.odometer")
    (reported,) = [text for text in s.run(warn=lambda _: None).warnings if text.startswith("obs: nothing triggers")]
    begin = "obs: nothing triggers its event 'balise' in this run: it is on its own for all of 700 s, and "
    assert reported.startswith(begin)
    assert "certified for gaps up to" in reported
    assert "sequences" not in reported


FMUS = [pytest.param(backend, marks=pytest.mark.slow) for backend in ("fmu2", "fmu3")]


@pytest.mark.parametrize("name", ["augmented_high_gain_cdo", "augmented_takagi_sugeno_cdo"])
@pytest.mark.parametrize("form", ["block2", "block3", *FMUS])
def test_fixes_that_are_read_at_a_period_are_certified_at_it(name: str, form: Backend) -> None:
    s = Scenario(stop=2.0, step=0.1).add("train", model="locomotive", backend="block3")
    s.add("receiver", model="gps", backend=form).connect("train.position -> receiver.position")
    s.add("obs", observer=name, preset="gps", options={"fixes": "sampled"}, backend=form)
    s.connect("train.wheel_speed -> obs.odometer").connect("receiver.reading -> obs.fix_position")
    outcome = s.run(warn=lambda _: None)
    certificate = outcome.result.summary["certificates"]["obs"]
    assert (certificate["holds"], certificate["max_gap"], certificate["event"]) == (True, 0.1, "fix")
    assert not [text for text in outcome.warnings if "trigger" in text or "gap" in text]


def test_fixes_that_arrive_by_packets_are_not_certified_at_the_period_of_reading() -> None:
    s = Scenario(stop=2.0, step=0.1).add("train", model="locomotive", backend="block3")
    s.add("receiver", model="gps", backend="block3").connect("train.position -> receiver.position")
    s.add("obs", observer="augmented_high_gain_cdo", preset="gps", options={"fixes": "sampled"}, backend="block3")
    s.connect("train.wheel_speed -> obs.odometer").connect("receiver.reading -> obs.fix_position")
    s.network(nodes={"radio": ["receiver.reading"]}, period=0.1, loss_fraction=0.5)
    (text,) = [text for text in s.run(warn=lambda _: None).warnings if "sample gaps" in text or "fix gaps" in text]
    assert "obs.fix_position arrives by packets" in text


def counted(period: float, step: float, backend: Backend) -> Outcome:
    s = Scenario(stop=6.0, step=step).add("train", model="locomotive", backend="block3")
    s.add("receiver", model="gps", parameters={"sample_period": period}, backend=backend)
    s.add("obs", observer="augmented_high_gain_cdo", preset="gps", backend=backend)
    s.connect("train.position -> receiver.position").connect("train.wheel_speed -> obs.odometer")
    for field in ("count", "time", "position"):
        s.connect(f"receiver.gps_{field} -> obs.gps_{field}")
    return s.run(warn=lambda _: None)


@pytest.mark.parametrize("period", [0.1, 0.2])
@pytest.mark.parametrize("backend", ["block2", FMUS[0]])
def test_an_event_that_a_periodic_count_triggers_is_certified_at_its_period(period: float, backend: Backend) -> None:
    certificate = counted(period, 0.1, backend).result.summary["certificates"]["obs"]
    assert (certificate["holds"], certificate["max_gap"], certificate["event"]) == (True, period, "gps")
    assert certificate["largest_gap_seen"] == pytest.approx(period)


def test_a_count_that_is_seen_more_rarely_than_its_period_is_reported_after_the_run() -> None:
    (text,) = [text for text in counted(0.1, 1.5, "block2").warnings if "longest gap" in text]
    assert text.startswith("obs: the longest gap between samples of receiver.gps_count was 1.5 s, certified are ")


def test_what_has_no_certificate_is_reported_in_words() -> None:
    s = Scenario(stop=1.0, step=0.1).add("train", model="locomotive", **{"as": "block3"})
    s.add("obs", observer="odometer_reset", **{"as": "block3"}).connect("train.wheel_speed -> obs.odometer")
    s.balises(position="train.position", speed="train.speed", layout="instants", instants=[0.5])
    (reported,) = [text for text in s.run(warn=lambda _: None).warnings if "findings" in text]
    assert reported.startswith(
        "obs: not known before the run whether it stays stable over the gaps between its samples"
    )
