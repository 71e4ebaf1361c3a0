"""The promise of the package: a balise inside a communication step acts at its own instant, whatever the step.

The plant's effort and the odometer are constant over multiples of 100 ms, so that holding them over a step of 1, 10, 50
or 100 ms is exact; everything that then differs between the steps is a timing fault. Tolerance 1e-9 of the largest
value a state
takes: stamps are found to 1e-11 s, at 15 m/s.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from coupled_runs import Balises, Motion, Pushed, Ran, Staircase, block, positions, run

import fmu_observer
import fmus
from cosim.balises.layout import InstantLayout, aperiodic
from cosim.components.loading import load_fmu

STEPS = (0.001, 0.01, 0.05, 0.1)
DURATION = 3.0
OBSERVERS = ("takagi_sugeno_cdo", "differentiator_cdo", "multirate_cdo")
# two of them in one step
PLACES = positions(0.7, 3.0, 5.6, 5.9, 8.1, 11.3, 11.31, 14.0, 17.77, 20.0, 23.456, 26.0, 28.9)
CONNECTIONS = [
    ("steps.push", "plant.push"),
    ("steps.effort", "observer.effort"),
    ("steps.odometer", "observer.odometer"),
]


def states_after_balises(ran: Ran, names: list[str]) -> np.ndarray:
    return np.array([ran.after(f"observer.{name}") for name in names]).T


def run_observer(observer: Any, h: float, layout: Any, method: str, names: list[str] | None = None) -> Ran:
    parts = [block(Staircase(), "steps"), block(Pushed(), "plant"), observer]
    extra = {} if names is None else {"observer": names}
    return run(
        parts, CONNECTIONS, h, round(DURATION / h), Balises(layout, method=method, receivers=["observer"]), extra=extra
    )


def assert_agree(reference: np.ndarray, other: np.ndarray) -> None:
    assert reference.shape == other.shape
    scale = np.max(np.abs(reference), axis=0)
    assert np.max(np.abs(other - reference) / np.where(scale > 0.0, scale, 1.0)) <= 1e-9


@pytest.mark.parametrize("version", [3, 2])
@pytest.mark.parametrize("name", OBSERVERS)
def test_state_after_every_balise_does_not_depend_on_the_step(name: str, version: int) -> None:
    system = fmu_observer.OBSERVERS[name]()
    names = [n for s in system.states for n in s.scalar_names]
    reference = None
    for h in STEPS:
        ran = run_observer(block(system, "observer", version), h, PLACES, "rollback", names)
        assert len(ran.events) == len(PLACES.balises)
        assert {e.outcomes["observer"] for e in ran.events} == {"accepted"}
        seen = states_after_balises(ran, names)
        assert np.max(np.abs(seen[:, names.index("balise_innovation")])) > 1e-3  # balises do something
        reference = seen if reference is None else reference
        assert_agree(reference, seen)


@pytest.mark.parametrize("method", ["rollback", "predict", "interpolate"])
def test_every_method_that_is_exact_for_this_motion(method: str) -> None:
    """Under an effort that is constant over a step the position is a parabola, and the cubic through its ends is
    exact.
    """
    system = fmu_observer.OBSERVERS["takagi_sugeno_cdo"]()
    names = [n for s in system.states for n in s.scalar_names]
    reference = states_after_balises(run_observer(block(system, "observer"), 0.001, PLACES, "rollback", names), names)
    for h in STEPS:
        ran = run_observer(block(system, "observer"), h, PLACES, method, names)
        assert_agree(reference, states_after_balises(ran, names))


@pytest.mark.parametrize("method", ["rollback", "predict", "interpolate"])
def test_balises_placed_at_instants(method: str) -> None:
    system = fmu_observer.OBSERVERS["takagi_sugeno_cdo"]()
    layout = aperiodic(DURATION, seed=3)
    names = ["estimated_position", "estimated_speed", "balise_innovation"]
    runs = [run_observer(block(system, "observer"), h, layout, method, names) for h in STEPS]
    for ran in runs:
        assert [e.stamp for e in ran.events] == layout.instants.tolist()
        assert_agree(states_after_balises(runs[0], names), states_after_balises(ran, names))


def test_a_balise_at_a_communication_point_is_used_in_the_row_of_that_point() -> None:
    """At 10 m/s the balise at 5 m is passed at 0.5 s: the last row of that time holds the observer after the jump."""
    for version in (3, 2):
        observer = block(fmu_observer.OBSERVERS["takagi_sugeno_cdo"](), "observer", version)
        still = [("plant.speed", "observer.odometer")]
        motion = {"plant": {"v0": 10.0}}
        ran = run(
            [block(Motion(), "plant"), observer],
            still,
            0.1,
            10,
            Balises(positions(5.0), receivers=["observer"]),
            starts=motion,
        )
        at = np.flatnonzero(np.isclose(ran.time, 0.5, atol=1e-9))
        assert len(at) == 2
        before, after = ran["observer.innovation"][at]
        assert before == 0.0
        # The estimate starts at 1 m/s and trusts no odometer: it is some 4.5 m behind.
        assert after < -4.0


def test_several_balises_in_one_step_come_in_order() -> None:
    ran = run_observer(block(fmu_observer.OBSERVERS["takagi_sugeno_cdo"](), "observer"), 0.1, PLACES, "rollback")
    stamps = [e.stamp for e in ran.events]
    assert stamps == sorted(stamps)
    assert [e.position for e in ran.events] == PLACES.positions.tolist()
    steps = np.floor(np.array(stamps) / 0.1)
    assert np.max(np.bincount(steps.astype(int))) >= 2


@pytest.mark.compiler
@pytest.mark.parametrize("version", [3, 2])
def test_native_observer_agrees_with_itself_and_with_the_block(version: Any) -> None:
    """The exported FMU, told in event mode (FMI 3) or by count, time and payload (FMI 2)."""
    system = fmu_observer.OBSERVERS["takagi_sugeno_cdo"]()
    path = fmus.cached_fmu(system, fmi_version=version)
    names = ["position", "speed", "innovation"]
    reference = states_after_balises(run_observer(block(system, "observer"), 0.001, PLACES, "rollback"), names)
    for h in (0.01, 0.1):
        ran = run_observer(load_fmu(path, "observer"), h, PLACES, "rollback")
        assert_agree(reference, states_after_balises(ran, names))


@pytest.mark.compiler
@pytest.mark.parametrize("version", [3, 2])
def test_native_plant_is_equal_with_and_without_balises(version: Any) -> None:
    import plant_models

    path = fmus.cached_fmu(plant_models.PLANTS["locomotive"](), fmi_version=version)
    layout = InstantLayout(np.array([0.05, 0.1, 0.1234, 0.777, 1.0]))
    start = {"plant": {"effort": 5e4}}

    def go(balises: Balises | None) -> Ran:
        return run([load_fmu(path, "plant")], [], 0.1, 15, balises, starts=start)

    alone = go(None)
    for method in ("rollback", "interpolate"):
        for places in (layout, positions(1e-4, 0.0123, 0.2, 0.5)):
            watched = go(Balises(places, method=method))
            assert len(watched.events) >= 4
            at = np.isin(watched.time, alone.time)
            last = np.append(np.diff(watched.time[at]) > 0.0, True)
            for column in alone.table.dtype.names:
                np.testing.assert_array_equal(watched[column][at][last], alone[column])
            assert watched.master.balises.localiser.watch.redo_differences == 0
