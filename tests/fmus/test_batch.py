"""A batch computes for every member what its FMU computes alone, bit for bit, and no member changes another."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import product
from typing import Any

import numpy as np
import pytest

from fmus import Batch, BatchError
from plant_models.hybrid import HybridSystem, scalar_names

pytestmark = pytest.mark.compiler

MEMBERS, STEPS, H = 3, 12, 2.0**-5  # times are exact, so that an FMU's own end of a step is ours


class Case:
    """Members with parameters, start states, inputs, seeds and events of their own, drawn once."""

    def __init__(self, system: HybridSystem) -> None:
        self.system, self.instants = system, H * np.arange(STEPS + 1)
        draws = np.random.default_rng(1)
        self.starts: dict[str, np.ndarray] = {}
        for signal in (*system.parameter_signals, *system.states):
            for name, start in zip(scalar_names([signal]), _starts([signal]), strict=True):
                inwards = -1e-7 if start == signal.max else 1e-7
                self.starts[name] = start * (1.0 + inwards * np.arange(MEMBERS))
        if "seed" in self.starts:
            self.starts["seed"] = np.arange(MEMBERS) + 3.0
        shape = (MEMBERS, STEPS + 1)
        self.inputs = {
            name: start + draws.uniform(0.5, 1.5, shape) * (1.0 + abs(start))
            for name, start in zip(scalar_names(system.inputs), _starts(system.inputs), strict=True)
        }
        self.outputs = [*scalar_names(system.outputs), *scalar_names(system.states)]
        self.events = sorted(
            (member, stamp, event.name, {name: draws.uniform(0.5, 1.5) for name in scalar_names(event.payload)})
            for member, event, stamp in product(range(1, MEMBERS), system.triggered_events, (0.0413, 4.5 * H, 5 * H))
        )

    def batch(self, order: list[int]) -> Batch:
        """The members in another order."""
        batch = Batch(self.system, len(order))
        for name, values in self.starts.items():
            batch.set(name, np.broadcast_to(values, MEMBERS)[order])
        for place, member in enumerate(order):
            for owner, stamp, event, payload in self.events:
                if owner == member:
                    batch.notify(event, place, stamp, **payload)
        return batch

    def run(self, order: list[int]) -> np.ndarray:
        batch = self.batch(order)
        batch.start()
        inputs = {name: values[order] for name, values in self.inputs.items()}
        results = batch.run(self.instants[1:], self.outputs, inputs)
        assert not batch.failures
        return results

    def alone(self, made: Any, member: int) -> Iterator[np.ndarray]:
        """The same member as an FMU."""
        made.initialize(**{name: float(np.broadcast_to(v, MEMBERS)[member]) for name, v in self.starts.items()})
        for k in range(STEPS + 1):
            made.set_all({name: values[member, k] for name, values in self.inputs.items()})
            yield made.get(*self.outputs)
            for owner, stamp, event, payload in self.events:
                if owner == member and (k * H < stamp <= (k + 1) * H) and k < STEPS:
                    made.event(event, stamp, **payload)
            if k < STEPS:
                made.step(k * H, H)


def _starts(signals: Any) -> list[float]:
    return [float(v) for s in signals for v in (s.start if isinstance(s.start, tuple) else [s.start] * s.width)]


@pytest.mark.each_kind
def test_a_member_is_the_fmu_alone(system_name: str, system: HybridSystem, component: Callable[..., Any]) -> None:
    case = Case(system)
    together = case.run([0, 1, 2])
    for member in range(MEMBERS):
        alone = np.array(list(case.alone(component(system_name, 3), member)))
        np.testing.assert_array_equal(together[member], alone)
    np.testing.assert_array_equal(case.run([2, 0]), together[[2, 0]])  # whoever is beside it, in whatever order


def test_events_change_the_members_that_have_them(reference: Callable[[str], Any]) -> None:
    case = Case(reference("tracker").system)
    batch = case.batch([0, 1, 2])
    batch.start()
    batch.run(case.instants[1:])
    np.testing.assert_array_equal(batch.get("events.accepted"), [0, 6, 6])
    assert len(set(batch.get("position"))) == MEMBERS


def test_a_member_that_fails_leaves_the_rest_as_it_was(reference: Callable[[str], Any]) -> None:
    case = Case(reference("tracker").system)
    whole = case.run([0, 1, 2])
    batch = case.batch([0, 1, 2])
    batch.set("gain", [0.7, np.nan, 0.7 * (1.0 + 2e-7)])  # is used at the events, so member 1 begins
    batch.start()
    results = batch.run(case.instants[1:], case.outputs, case.inputs)
    np.testing.assert_array_equal(results[[0, 2]], whole[[0, 2]])
    broken = int(np.argmax(np.isnan(results[1]).any(axis=1)))
    assert 0 < broken < STEPS
    assert np.isnan(results[1, broken:]).all()
    assert list(batch.failures) == [1]
    assert "state position is not a finite number at 0.0625 s" in batch.failures[1]
    assert np.isnan(batch.get("position")[1])


def test_parameters_that_are_refused_are_reported_and_the_others_start(reference: Callable[[str], Any]) -> None:
    batch = Batch(reference("booster").system, 3)
    batch.set("stretch", [[0.25, 0.6], [0.6, 0.25], [0.1, 0.2]])
    batch.start()
    assert list(batch.failures) == [1]
    assert "the stretch has no length" in batch.failures[1]
    batch.advance(0.5)
    np.testing.assert_array_equal(np.isnan(batch.get("speed")), [False, True, False])
    batch.reset()
    batch.start()
    assert not batch.failures


def test_many_events_in_one_step_and_events_announced_on_the_way(reference: Callable[[str], Any]) -> None:
    stamps = np.linspace(0.001, 0.999, 200)
    at_once, by_and_by = Batch(reference("tracker").system, 2), Batch(reference("tracker").system, 2)
    at_once.notify("balise", 1, stamps, position=stamps)
    at_once.start()
    by_and_by.start()
    for part in np.split(stamps, 4):
        by_and_by.notify("balise", [1] * 50, part, balise_position=part)
    by_and_by.notify("telegram", 1, 0.5, speed=3.0)
    at_once.advance(0.25)
    at_once.notify("telegram", 1, 0.5, speed=3.0)
    for batch in (at_once, by_and_by):
        batch.run(np.arange(batch.time + 0.25, 1.1, 0.25) if batch is at_once else [0.25, 0.5, 0.75, 1.0])
        np.testing.assert_array_equal(batch.get("events.accepted"), [0, 201])
    np.testing.assert_array_equal(at_once.get("position"), by_and_by.get("position"))


@pytest.mark.parametrize(
    ("ask", "said"),
    [
        (lambda b: b.set("gian", 1.0), "has no variable 'gian'; did you mean 'gain'?"),
        (lambda b: b.set("gain", [1.0, 2.0, 3.0]), r"gain: expected shape \(\) or \(2,\), got \(3,\)"),
        (lambda b: b.set("position_out", 1.0), "is computed and cannot be set"),
        (lambda b: (b.start(), b.set("gain", 1.0)), "cannot be set in Step Mode"),
        (lambda b: b.advance(1.0), "Time has not begun"),
        (lambda b: (b.start(), b.start()), "begun already"),
        (lambda b: (b.start(), b.run([0.2, 0.1])), "rise from now"),
        (lambda b: (b.start(), b.run([0.1, 0.1])), "rise from now"),
        (lambda b: (b.start(), b.run([0.0, 0.1])), "rise from now"),
        (lambda b: b.notify("bell", 0, 0.1), "no triggered event 'bell'; it has: balise, telegram"),
        (lambda b: b.notify("balise", 0, 0.1, place=1.0), "no payload 'place'; it has: position"),
        (lambda b: b.notify("balise", 2, 0.1), "no member 2; the last one is 1"),
        (lambda b: b.notify("balise", 0, np.nan), "cannot come any more"),
        (lambda b: (b.start(1.0), b.notify("balise", 0, 0.5)), "the members stand at 1 s"),
        (lambda b: (b.notify("balise", 0, 0.5), b.start(1.0)), "the members stand at 1 s"),
        (lambda b: (b.start(), b.run([0.1], inputs={"odometer": [1.0]})), r"expected shape \(2,\) or \(2, 2\)"),
        (lambda b: Batch(b.system, 0), "at least one member"),
    ],
)
def test_what_cannot_be_is_refused_in_words(
    ask: Callable[[Batch], Any], said: str, reference: Callable[[str], Any]
) -> None:
    with pytest.raises(BatchError, match=said):
        ask(Batch(reference("tracker").system, 2))


def test_results_are_written_where_the_caller_says() -> None:
    """Into columns of a wider table, of which nothing else changes; what cannot take them is refused."""
    batch = Batch("odometer", 3)
    batch.set("sample_period", [0.01, 0.02, 0.05])
    batch.start()
    instants, wheel = np.arange(1, 9) / 32.0, {"wheel_speed": np.linspace(1.0, 2.0, 9)}
    expected = batch.run(instants, ["reading", "reading"], wheel)
    batch.reset()
    batch.set("sample_period", [0.01, 0.02, 0.05])
    batch.start()
    table = np.full((3, 9, 5), 7.0)
    assert batch.run(instants, ["reading", "reading"], wheel, into=table[:, :, 2:4]).base is table
    assert table[:, :, 2:4].tobytes() == expected.tobytes()
    assert (np.delete(table, [2, 3], axis=2) == 7.0).all()
    for wrong in (table[:, :, :1], table[:, :, ::2][:, :, :2], table.astype(np.float32)[:, :, 2:4]):
        with pytest.raises(BatchError, match="results go into doubles of shape"):
            batch.run(instants + 1.0, ["reading", "reading"], wheel, into=wrong)
