"""Delivery of telegrams to receivers of every kind, on time, late, out of order, and to receivers that cannot be
stopped.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, ClassVar

import numpy as np
import pytest
from coupled_runs import Balises, Listener, Motion, Pushed, Ran, Staircase, block, positions, run
from hypothesis import given, settings
from hypothesis import strategies as st
from mock_slaves import FMI2, EventMode, Mock, component, variable

import fmu_observer
from cosim.balises.layout import InstantLayout
from cosim.balises.telegram import Channel
from cosim.components.component import Component
from fmus.fmi.capabilities import read_capabilities

H = 0.1
PERFECT = Channel()


def without(made: Component, *abilities: str) -> Component:
    """The component with capability flags taken away."""
    for ability in abilities:
        setattr(made.description.coSimulation, ability, False)
    made.capabilities = read_capabilities(made.description)
    return made


def observer(version: Any = 3, **arguments: Any) -> Component:
    return block(fmu_observer.OBSERVERS["takagi_sugeno_cdo"](), "observer", version, **arguments)


def driven(
    receiver: Component, instants: Sequence[float], channel: Channel = PERFECT, h: float = H, seconds: float = 3.0
) -> Ran:
    parts = [block(Staircase(), "steps"), block(Pushed(), "plant"), receiver]
    pairs = [("steps.push", "plant.push"), ("steps.effort", "observer.effort"), ("steps.odometer", "observer.odometer")]
    layout = InstantLayout(np.array(instants))
    return run(parts, pairs, h, round(seconds / h), Balises(layout, receivers=["observer"], channel=channel))


INSTANTS = [0.31, 0.55, 0.93, 1.18, 1.5, 1.77, 2.04]
FINAL = ("observer.position", "observer.speed", "observer.innovation")


def final(ran: Ran) -> np.ndarray:
    return np.array([ran[name][-1] for name in FINAL])


def outcomes(ran: Ran) -> list[str]:
    return [e.outcomes["observer"] for e in ran.events if e.kind == "true"]


@pytest.fixture(scope="module")
def on_time() -> np.ndarray:
    return final(driven(observer(), INSTANTS))


def assert_equal(seen: np.ndarray, reference: np.ndarray) -> None:
    """Replayed telegrams act at their stamps; the grid is the same, so only roundings of a divided cell differ."""
    np.testing.assert_allclose(seen, reference, rtol=1e-9, atol=1e-9)


def milliseconds(most: int) -> st.SearchStrategy[float]:
    """Whole ones: a latency below 1e-9 s is none, by the tolerance of all communication times."""
    return st.integers(0, most).map(lambda n: 1e-3 * n)


@given(
    latency=milliseconds(900),
    jitter=milliseconds(600),
    seed=st.integers(0, 50),
    h=st.sampled_from([0.01, 0.05, 0.1]),
    version=st.sampled_from([2, 3]),
    stoppable=st.booleans(),
)
@settings(max_examples=40, deadline=None)
def test_replay_makes_order_and_latency_irrelevant(
    on_time: np.ndarray, latency: float, jitter: float, seed: int, h: float, version: int, stoppable: bool
) -> None:
    """Any latency and any overtaking that ends before the run does: the final state is that of delivery on time."""
    receiver = observer(version)
    if not stoppable:
        receiver = without(receiver, "canHandleVariableCommunicationStepSize")
    channel = Channel(latency=latency, latency_jitter=jitter, seed=seed)
    ran = driven(receiver, [t for t in INSTANTS if t < 1.3], channel, h, 3.0)
    reference = final(driven(observer(), [t for t in INSTANTS if t < 1.3], h=h))
    assert_equal(final(ran), reference)
    assert np.max(np.abs(reference - on_time)) > 1e-6  # the later balises do matter


def test_late_telegrams_are_replayed_rejected_or_used_late() -> None:
    channel = Channel(latency=0.25)
    replayed, rejected, late = (
        driven(observer(late_policy=p), INSTANTS, channel) for p in ("replay", "reject", "late")
    )
    assert set(outcomes(replayed)) == {"replayed"}
    assert set(outcomes(rejected)) == {"rejected"}
    assert set(outcomes(late)) == {"late"}
    nothing = driven(observer(), INSTANTS, Channel(missed_fraction=1.0))
    np.testing.assert_array_equal(final(rejected), final(nothing))
    assert np.max(np.abs(final(late) - final(replayed))) > 1e-3
    assert [e.kind for e in nothing.events] == ["missed"] * len(INSTANTS)


@pytest.mark.parametrize("version", [2, 3])
def test_rows_of_a_late_telegram_stand_at_its_delivery(version: int) -> None:
    ran = driven(observer(version), [0.55], Channel(latency=0.17), seconds=1.0)
    at = np.flatnonzero(np.isclose(ran.time, 0.72, atol=1e-12))
    assert len(at) == 2
    before, after = ran["observer.innovation"][at]
    assert before == 0.0
    assert (after != 0.0) == (version == 3)  # FMI 2 acts on it in the step that follows
    assert ran["observer.innovation"][ran.time > 0.75][0] != 0.0


def test_the_observer_before_a_balise_is_shown_before_it_and_after_it_after_it() -> None:
    """The same rows for both interfaces: FMI 2 is told beforehand, so the row before is looked up ahead and taken
    back.
    """
    first, second = (driven(observer(version), INSTANTS) for version in (3, 2))
    for name in FINAL:
        np.testing.assert_allclose(first[name], second[name], rtol=1e-12, atol=1e-12)
    assert outcomes(first) == outcomes(second) == ["accepted"] * len(INSTANTS)


def test_an_fmi2_receiver_of_unknown_make_is_not_sent_back_and_forth() -> None:
    """Its row before the balise is interpolated; what it does is the same."""
    receiver = observer(2)
    receiver.kind, receiver.description.generationTool = "FMU", "vendor"
    saved: list[str] = []
    receiver.slave.getFMUstate = lambda: saved.append("saved")
    ran = driven(receiver, INSTANTS)
    assert saved == []
    assert_equal(final(ran), final(driven(observer(), INSTANTS)))


def test_two_telegrams_for_an_fmi2_receiver_in_one_step_are_both_used() -> None:
    close = [0.51, 0.53, 0.56, 0.59, 1.02, 1.02 + 5e-10, 1.3]
    for abilities in ((), ("canHandleVariableCommunicationStepSize",)):
        receiver = without(observer(2), *abilities)
        ran = driven(receiver, close)
        assert receiver.outcomes()["lost"] == 0  # type: ignore[index]
        assert receiver.outcomes()["accepted"] == len(close)  # type: ignore[index]
        assert_equal(final(ran), final(driven(observer(), close)))


def test_telegrams_that_arrive_at_one_instant_are_all_used_by_fmi2() -> None:
    """Delivered together, though passed apart: one is announced, the others wait for the next step."""
    receiver = observer(2)
    parts = [block(Motion(), "plant"), receiver]
    master_channel = Channel(latency=0.0)
    layout = InstantLayout(np.array([0.5, 0.5 + 1e-10, 0.5 + 2e-10]))
    run(parts, [], H, 10, Balises(layout, receivers=["observer"], channel=master_channel))
    assert receiver.outcomes()["accepted"] == 3  # type: ignore[index]
    assert receiver.outcomes()["lost"] == 0  # type: ignore[index]


@pytest.mark.parametrize("timing", ["exact", "stale"])
@pytest.mark.parametrize("abilities", [(), ("canHandleVariableCommunicationStepSize",)])
@pytest.mark.parametrize("version", [2, 3])
@given(
    points=st.lists(st.integers(1, 10), min_size=1, max_size=8, unique=True),
    between=st.sampled_from([0.0, 0.03]),
    late=st.sampled_from([0.0, H, 2.0 * H, 0.5 * H]),
)
@settings(max_examples=8, deadline=None)
def test_what_became_of_a_telegram_is_known_by_the_end(
    version: int, abilities: tuple[str, ...], timing: Any, points: list[int], between: float, late: float
) -> None:
    """An FMI 2 receiver says it after the step that follows, and knows one for each step: the run is long enough."""
    receiver, end = without(observer(version), *abilities), 2.5
    layout = InstantLayout(np.array(sorted([H * k for k in points] + [H * k + between for k in points if between])))
    balises = Balises(layout, receivers=["observer"], channel=Channel(latency=late), timing=timing)
    ran = run([block(Motion(), "plant"), receiver], [], H, round(end / H), balises)
    assert len(ran.events) == len(layout.instants)
    assert "notified" not in {e.outcomes["observer"] for e in ran.events}


class Logging(EventMode):
    """An FMI 3 receiver that writes down what it is told; without a stamp, as a vendor might build it."""

    inputs: ClassVar[dict[str, Any]] = {"odometer": 0.0}
    outputs: ClassVar[dict[str, Any]] = {"heard": 0.0}
    capabilities: ClassVar[dict[str, Any]] = EventMode.capabilities | {"canGetAndSetFMUstate": False}
    stamped = False

    def more_variables(self) -> list[Any]:
        payload = {"position": 71, "location_accuracy": 72, "odometer_reading": 73, "delivered_at": 74}
        fields = [
            variable(f"balise_{n}", "input", r, "Float64", clocks=[70], variability="discrete")
            for n, r in payload.items()
        ]
        if self.stamped:
            fields.append(variable("balise_time", "input", 75, "Float64", clocks=[70], variability="discrete"))
        identity = variable("balise_identity", "input", 76, "String", clocks=[70])
        return [variable("balise", "input", 70, "Clock", intervalVariability="triggered"), *fields, identity]

    def begin(self) -> None:
        super().begin()
        self.log: list[dict[str, float]] = []

    def compute(self) -> None:
        self.v["heard"] = float(len(self.log))

    def setClock(self, references: Sequence[int], values: Sequence[bool]) -> None:
        assert self.in_event_mode
        assert list(references) == [70]
        self.log.append({"at": self.time})

    def setFloat64(self, references: Sequence[int], values: Sequence[float]) -> None:
        super()._set(references, values)
        names = {r: n for n, r in self.references.items()}
        if self.in_event_mode and self.log:
            self.log[-1] |= {names[r].removeprefix("balise_"): x for r, x in zip(references, values, strict=True)}


class StampedLogging(Logging):
    stamped = True


def logged(slave: Mock, channel: Channel = PERFECT, places: tuple[float, ...] = (5.0, 6.0)) -> Ran:
    made = component(slave, "observer")
    return run(
        [block(Motion(), "plant"), made],
        [],
        H,
        10,
        Balises(positions(*places), receivers=["observer"], channel=channel, odometer="plant.speed"),
    )


def test_an_fmi3_receiver_gets_all_the_fields_it_declares() -> None:
    slave = StampedLogging()
    seen = logged(slave, Channel(latency=0.05))
    first = slave.log[0]
    assert first["at"] == pytest.approx(5.0 / 13.9 + 0.05, abs=1e-9)
    assert first["time"] == pytest.approx(5.0 / 13.9, abs=1e-9)
    assert first["position"] == 5.0
    assert first["odometer_reading"] == pytest.approx(13.9, rel=1e-12)
    assert first["delivered_at"] == pytest.approx(first["at"], abs=1e-9)
    assert first["location_accuracy"] == 0.0
    assert seen["observer.heard"][-1] == 2.0


@pytest.mark.parametrize("off", [-5e-10, 5e-10])
def test_no_receiver_is_asked_for_a_step_of_less_than_a_nanosecond(off: float) -> None:
    """A balise as good as at a communication point is told there."""

    class Coarse(StampedLogging):
        def move(self, t: float, h: float) -> None:
            assert h > 1e-6

    slave = Coarse()
    made = component(slave, "observer")
    layout = InstantLayout(np.array([0.5 + off]))
    seen = run([block(Motion(), "plant"), made], [], H, 10, Balises(layout, receivers=["observer"]))
    assert [entry["at"] for entry in slave.log] == [0.5]
    assert np.count_nonzero(np.abs(seen.time - 0.5) < 1e-6) == 2 + (off > 0.0)


def test_a_receiver_that_can_neither_be_stopped_nor_stamped_is_notified_late_never_early() -> None:
    class Rigid(Logging):
        capabilities: ClassVar[dict[str, Any]] = Logging.capabilities | {
            "canHandleVariableCommunicationStepSize": False
        }

        def move(self, t: float, h: float) -> None:
            assert abs(h - H) < 1e-12

    slave = Rigid()
    seen = logged(slave)
    assert [entry["at"] for entry in slave.log] == pytest.approx([0.4, 0.5], abs=1e-12)
    assert [e.delivered_at for e in seen.events] == pytest.approx([0.4, 0.5], abs=1e-12)


def test_a_receiver_that_cannot_be_stopped_gets_the_stamp_beforehand() -> None:
    class Rigid(StampedLogging):
        capabilities: ClassVar[dict[str, Any]] = Logging.capabilities | {
            "canHandleVariableCommunicationStepSize": False
        }

    slave = Rigid()
    logged(slave)
    assert [entry["at"] for entry in slave.log] == pytest.approx([0.3, 0.4], abs=1e-12)
    assert [entry["time"] for entry in slave.log] == pytest.approx([5.0 / 13.9, 6.0 / 13.9], abs=1e-9)


class Counting(FMI2, Mock):
    """An FMI 2 receiver by count, time and payload."""

    outputs: ClassVar[dict[str, Any]] = {"heard": 0.0}

    def more_variables(self) -> list[Any]:
        return [
            variable("balise_count", "input", 60, "Integer"),
            variable("balise_time", "input", 61, "Real"),
            variable("balise_position", "input", 62, "Real"),
        ]

    def begin(self) -> None:
        self.x = {}
        self.log: list[tuple[float, float, float]] = []
        self.last = 0.0

    def compute(self) -> None:
        self.v["heard"] = float(len(self.log))

    def move(self, t: float, h: float) -> None:
        if self.v["balise_count"] > self.last:
            assert self.v["balise_count"] == self.last + 1.0
            assert t - 1e-9 <= self.v["balise_time"] <= t + h + 1e-9
            self.last = self.v["balise_count"]
            self.log.append((t + h, self.v["balise_time"], self.v["balise_position"]))


@pytest.mark.parametrize("abilities", [(), ("canHandleVariableCommunicationStepSize",)])
def test_a_plain_fmi2_receiver_is_notified_by_count_time_and_payload(abilities: tuple[str, ...]) -> None:
    slave = Counting()
    receiver = without(component(slave, "observer"), *abilities)
    run([block(Motion(), "plant"), receiver], [], H, 10, Balises(positions(5.0, 9.0), receivers=["observer"]))
    assert [entry[2] for entry in slave.log] == [5.0, 9.0]
    assert [entry[1] for entry in slave.log] == pytest.approx([5.0 / 13.9, 9.0 / 13.9], abs=1e-9)
    ends = [0.4, 0.7] if abilities else [5.0 / 13.9, 9.0 / 13.9]
    assert [entry[0] for entry in slave.log] == pytest.approx(ends, abs=1e-9)


def test_stale_never_notifies_before_the_crossing() -> None:
    """Also where the receiver cannot be stopped: it is told at the end of the step, stamped with that instant."""
    slave = StampedLogging()
    made = without(component(slave, "observer"), "canHandleVariableCommunicationStepSize")
    run(
        [block(Motion(), "plant"), made],
        [],
        H,
        10,
        Balises(positions(5.0, 6.0), receivers=["observer"], timing="stale"),
    )
    assert [entry["at"] for entry in slave.log] == pytest.approx([0.4, 0.5], abs=1e-12)
    assert [entry["time"] for entry in slave.log] == pytest.approx([0.4, 0.5], abs=1e-12)


def test_of_several_stale_telegrams_an_fmi2_receiver_knows_the_last() -> None:
    receiver = block(Listener(), "observer", 2)
    ran = run(
        [block(Motion(), "plant"), receiver],
        [],
        H,
        10,
        Balises(positions(5.0, 5.2), receivers=["observer"], timing="stale"),
    )
    assert ran["observer.last"][-1] == 5.2
    assert ran["observer.heard"][-1] == 1.0
    assert [e.outcomes["observer"] for e in ran.events] == ["rejected", "accepted"]
