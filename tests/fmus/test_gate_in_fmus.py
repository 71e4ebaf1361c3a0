"""The innovation gate in FMUs: the block and both FMI versions judge alike, on time, late, split and restored."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from fmpy.fmi1 import FMICallException

from fmu_observer.block import make_block
from fmu_observer.event_protocol import OUTCOME_TEXTS, OUTCOME_VARIABLES
from plant_models.hybrid import scalar_names

pytestmark = pytest.mark.compiler

H, STEPS, SPEED, NAME = 0.05, 60, 14.0, "takagi_sugeno_cdo"
# [m], by number of the telegram: one every fifth of a second
OFFSETS = {4: 100.0, 5: 1.0, 6: -30.0, 9: 50.0, 10: 50.0, 11: 50.0}
KINDS = {"fmi2": (2, False), "fmi3": (3, False), "fmi3 counts": (3, True)}


@pytest.fixture(params=KINDS)
def pair(request: pytest.FixtureRequest, component: Callable[..., Any], reference: Callable[[str], Any]) -> list[Any]:
    """An FMU and a block behind the same handle."""
    version, counts = KINDS[request.param]
    sealed, borrowed = (component(NAME, version, counts=counts) for _ in range(2))
    borrowed.slave.freeInstance()
    borrowed.slave = make_block(reference(NAME).system, version, announcement="counts" if counts else None)  # type: ignore[arg-type]
    borrowed.instantiate()
    return [sealed, borrowed]


def telegrams(delay: int = 0) -> list[tuple[int, float, float]]:
    """Step before which each is told, stamp [s] and position [m]; a delay of some steps makes them late."""
    stamps = [0.23 + 0.2 * k for k in range(12)]
    return [(int(s / H) + delay, s, SPEED * s + OFFSETS.get(k, 0.0)) for k, s in enumerate(stamps)]


def outcomes(one: Any) -> dict[str, int]:
    return dict(zip(OUTCOME_TEXTS, one.get(*OUTCOME_VARIABLES).astype(int).tolist(), strict=True))


def begin(one: Any, **starts: float) -> None:
    one.slave.reset()
    own = [f"{name}" for name in ("estimated_position", "estimated_speed")]
    one.initialize(**dict(zip(own, (0.0, SPEED), strict=True)), effort=1400.0, odometer=SPEED, **starts)


def drive(
    one: Any, reported: list[tuple[int, float, float]], first: int = 0, last: int = STEPS, parts: int = 1
) -> None:
    """Steps `first` up to `last`, each in so many parts; of telegrams of one step the one announced by a count comes
    alone.
    """
    for k in range(first, last):
        for step, stamp, position in reported:
            if step == k:
                one.event("balise", stamp, balise_position=position)
        for part in range(parts):
            one.step(k * H + part * H / parts, H / parts)


def test_block_and_fmu_evaluate_alike(pair: list[Any]) -> None:
    """Three false ones ignored; of three that agree, the second is believed."""
    for one in pair:
        begin(one)
        drive(one, telegrams())
    np.testing.assert_allclose(pair[0].values(), pair[1].values(), rtol=1e-12, atol=1e-12)
    assert outcomes(pair[0]) == outcomes(pair[1])
    assert {k: outcomes(pair[0])[k] for k in ("accepted", "doubted", "ignored")} == {
        "accepted": 8,
        "doubted": 1,
        "ignored": 4,
    }


def test_it_survives_splitting_saving_and_bytes(pair: list[Any]) -> None:
    for one in pair:
        begin(one)
        drive(one, telegrams())
        whole, counts = one.values(), outcomes(one)
        begin(one)
        drive(one, telegrams(), last=46, parts=5)  # before the last of those that agree
        saved = one.save()
        for state in (saved, one.deserialize(one.serialize(saved))):
            one.restore(state)
            drive(one, telegrams(), first=46)
            np.testing.assert_allclose(one.values(), whole, rtol=1e-12, atol=1e-12)
            assert outcomes(one) == counts
            one.free(state)


def test_late_telegrams_are_evaluated_as_those_in_time(pair: list[Any]) -> None:
    """What replay makes of them is what they would have made in time, those after them judged anew."""
    for one in pair:
        begin(one)
        drive(one, telegrams())
        in_time = one.values()
        begin(one)
        late = [(step + 9 * (i % 2), *rest) for i, (step, *rest) in enumerate(telegrams())]  # every other one overtaken
        drive(one, late, last=STEPS)  # type: ignore[arg-type]
        np.testing.assert_allclose(one.values(), in_time, rtol=1e-12, atol=1e-12)
    assert outcomes(pair[0]) == outcomes(pair[1])
    assert {k: outcomes(pair[0])[k] for k in ("accepted", "replayed", "ignored")} == {
        "accepted": 7,
        "replayed": 4,
        "ignored": 5,
    }


@pytest.mark.parametrize(
    ("name", "value", "expected"),
    [
        ("gate_floor", 0.0, "at least 0.001 m"),
        ("gate_floor", -1.0, "at least 0.001 m"),
        ("gate_drift", float("nan"), "at least 0"),
        ("gate_drift", float("inf"), "at least 0"),
        ("gate", 3.0, "at least 0 and at most 2"),
    ],
)
def test_a_gate_that_cannot_be_is_refused_in_words(name: str, value: float, expected: str, pair: list[Any]) -> None:
    sealed, block = pair
    with pytest.raises(FMICallException):
        begin(sealed, **{name: value})
    said = f"time cannot run with these values: {name} must be a finite number, {expected} ({name} ="
    assert said in sealed.log[-1]
    with pytest.raises(FMICallException, match=re.escape(said)):
        begin(block, **{name: value})


def test_names_of_the_memory_are_local_variables(pair: list[Any]) -> None:
    gate = [s for s in scalar_names(pair[1].slave.system.states) if s.startswith("gate_")]
    assert gate
    assert all(pair[0].by_name[name].causality == "local" for name in gate)
