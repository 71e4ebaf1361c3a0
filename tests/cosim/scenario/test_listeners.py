"""Who only listens to a loop: whether that changes the order in which it is stepped, and that this is said."""

from __future__ import annotations

import numpy as np
import pytest

from cosim import Scenario

OUTPUTS = ("train.position", "train.acceleration", "train.adhesion_force", "train.wheel_speed", "driver.effort")


def loop(*effort: str) -> Scenario:
    """A train, its odometer and its driver, and an observer that takes a signal for its effort, where one is named."""
    s = Scenario(stop=1.0, step=0.05)
    for part in ("train", "odometer", "driver"):
        s.add(part, model="locomotive" if part == "train" else part, **{"as": "block3"})
    s.connect("driver.effort -> train.effort", "train.wheel_speed -> odometer.wheel_speed")
    s.connect("odometer.reading -> driver.odometer").report(true_speed="train.speed")  # so the train comes first
    for signal in effort:
        s.add("listener", observer="discrete_uio", **{"as": "block3"})
        s.connect("odometer.reading -> listener.odometer").connect(f"{signal} -> listener.effort", units="ignore")
    return s


@pytest.mark.parametrize("output", OUTPUTS)
def test_a_listener_that_changes_the_order_is_named(output: str) -> None:
    """Exactly where another signal of the loop is held over a step than without it."""
    held, structure = [], loop().structure()
    for effort in ((), (output,)):
        structure = loop(*effort).structure()
        inside = [link for link in structure.links if link.target[0] != "listener"]
        held.append(", ".join(sorted({".".join(link.source) for link in inside if link.held})))
    said = [text for text in structure.warnings if "The order of stepping is" in text]
    assert len(said) == (held[0] != held[1]) == (output in ("train.acceleration", "train.adhesion_force"))
    if said:
        words = (
            f"because of {output} -> listener.effort: in this loop {held[1]} is held over a step, where it would be "
        )
        assert f"{words}{held[0]} if nobody outside listened" in said[0]


def test_the_run_says_it_too() -> None:
    """Where the train moves otherwise; an observer that changes nothing is not mentioned."""
    scenarios = loop(), loop("driver.effort"), loop("train.adhesion_force")
    outcomes = [scenario.run(warn=str) for scenario in scenarios]
    said = [[n for n in o.result.summary["notes"] if "order of stepping" in n] for o in outcomes]
    assert [len(notes) for notes in said] == [0, 0, 1]
    speeds = [outcome["train.speed"] for outcome in outcomes]
    assert [np.array_equal(speeds[0], speed) for speed in speeds] == [True, True, False]
