"""Scenarios Sc1 to Sc4 of Table 4.4: what comes out of their stories, energy is conserved, and fixes count at their own
instants.

The runs are those of the shipped seed. What is asked of them holds for all 20 seeds of docs/studies/stories.py; what
holds for some only (an axle beyond 15 % and sand in Sc3, an axle beyond 15 % in Sc4) is not asked for.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from cosim import Outcome, Scenario
from fmu_observer.block import make_block
from fmu_observer.observers.train import AugmentedHighGainCdo, AugmentedTakagiSugenoCdo
from plant_models.railway.adhesion import POLACH_WET

pytestmark = pytest.mark.compiler

Array = NDArray[np.float64]
ALL = ("freight_sc1", "freight_sc2", "freight_sc3", "freight_sc4")
SOAPY = ALL[1:]
WITH_ESTIMATES = ("freight_sc1", "freight_sc3", "freight_sc4")
OBSERVERS = ("multirate_cdo", "takagi_sugeno_cdo")
DEPARTURE, EXCESSIVE = 20.0, 0.15
AXLES = range(1, 5)


@cache
def run(name: str) -> Outcome:
    outcome = Scenario.load(name).run(warn=lambda _warning: None)
    assert outcome.failure is None
    return outcome


def rows(outcome: Outcome, name: str) -> Array:
    """A signal without the first of two rows of one instant."""
    last = np.append(np.diff(outcome["time"]) > 1e-9, True)
    found: Array = np.asarray(outcome[name], dtype=float)[last]
    return found


def axles(outcome: Outcome, name: str) -> Array:
    return np.array([rows(outcome, f"train.{name}[{k}]") for k in AXLES])


def beyond(outcome: Outcome) -> Array:
    """Number of axles whose slip (4.14) is beyond 15 %, above 10 km/h, at every instant."""
    speed, wheels = rows(outcome, "train.speed"), axles(outcome, "axle_speed")
    slips = np.where(speed > 2.8, (wheels - speed) / np.maximum(wheels, 2.8), 0.0)
    return np.asarray((slips > EXCESSIVE).sum(axis=0), dtype=float)


def lost_in_slip(outcome: Outcome) -> float:
    sliding = axles(outcome, "axle_speed") - rows(outcome, "train.speed")
    return float(np.trapezoid((axles(outcome, "axle_creep_force") * sliding).sum(axis=0), rows(outcome, "time")))


def mean_error(outcome: Outcome, observer: str) -> float:
    """Mean speed error under way [km/h]."""
    speed = rows(outcome, "train.speed")
    under_way = (rows(outcome, "time") > DEPARTURE) & (speed > 0.0)
    return float(3.6 * np.abs(rows(outcome, f"{observer}.speed") - speed)[under_way].mean())


def indicated(outcome: Outcome) -> bool:
    return bool((rows(outcome, "excessive_slip.slip_indicator") > 1.5).any())


def sanded(outcome: Outcome, *, controller: bool = True) -> bool:
    asked = rows(outcome, "anti_slip.sanding_request").max()
    return bool(max(asked, rows(outcome, "controller.sanding_request").max() if controller else 0.0) > 0.5)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["freight_sc1", "freight_sc3", "freight_sc4"])
def test_the_certificates_of_the_stories_hold_for_the_fixes_that_come(name: str) -> None:
    outcome = run(name)
    found = outcome.result.summary["certificates"]
    assert {n: (found[n]["holds"], found[n]["max_gap"]) for n in ("multirate_cdo", "takagi_sugeno_cdo")} == {
        "multirate_cdo": (True, 0.1),
        "takagi_sugeno_cdo": (True, 0.1),
    }
    assert not [text for text in outcome.warnings if "nothing triggers" in text]


# -- the stories
# --------------------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_sc1_nothing_slips_on_clear_water() -> None:
    outcome = run("freight_sc1")
    assert beyond(outcome).max() == 0.0
    assert lost_in_slip(outcome) < 0.15e6  # creep alone
    assert not indicated(outcome)
    assert not sanded(outcome)
    assert rows(outcome, "anti_slip.effort_share").min() == 1.0


@pytest.mark.slow
def test_sc2_four_axles_spin_together_and_the_command_goes_on_rising() -> None:
    outcome = run("freight_sc2")
    count, time, command = beyond(outcome), rows(outcome, "time"), rows(outcome, "controller.effort")
    together = count == len(AXLES)
    assert np.trapezoid(together.astype(float), time) > 10.0
    assert indicated(outcome)
    onset = time[count > 0.0][0]
    assert command[time > onset].max() > command[time <= onset].max()
    assert rows(outcome, "excessive_slip.exceedance").max() > 0.25  # published: by 25 points


@pytest.mark.slow
def test_sc2_the_device_is_blind_while_all_axles_spin() -> None:
    outcome = run("freight_sc2")
    flagged = np.array([rows(outcome, f"anti_slip.axle_slipping[{k}]") for k in AXLES]).sum(axis=0)
    together = beyond(outcome) == len(AXLES)
    assert (flagged[together] == 0.0).mean() > 0.9
    assert flagged.max() > 0.0  # it sees axles that enter the slippery rail one by one


def largest_slip(outcome: Outcome) -> tuple[float, float]:
    """Slip of the worst axle above 10 km/h [1], and when [s]."""
    speed, wheels = rows(outcome, "train.speed"), axles(outcome, "axle_speed")
    slips = np.where(speed > 2.8, (wheels - speed) / np.maximum(wheels, 2.8), 0.0).max(axis=0)
    return float(slips.max()), float(rows(outcome, "time")[slips.argmax()])


@pytest.mark.slow
def test_sc3_the_effort_is_cut_and_hardly_any_sand_is_asked_for() -> None:
    """Published is a slip of 16 to 40 % and no sand; over 20 seeds 13 to 25 %, and sand for up to 1.8 s in 5 of
    them.
    """
    outcome = run("freight_sc3")
    time, effort = rows(outcome, "time"), rows(outcome, "anti_slip.effort")
    slip, worst = largest_slip(outcome)
    assert 0.1 < slip < 0.3
    assert beyond(outcome).max() < len(AXLES) or np.trapezoid(beyond(outcome) == len(AXLES), time) < 0.1  # Sc2: 15 s
    assert effort[(time > worst) & (time < worst + 3.0)].min() < 0.6 * effort[time <= worst].max()
    assert rows(outcome, "controller.effort_available").min() < 0.2 * 350e3
    assert rows(outcome, "anti_slip.sanding_request").max() == 0.0
    assert np.trapezoid(rows(outcome, "controller.sanding_request"), time) < 2.0
    assert not indicated(outcome)


def cut(outcome: Outcome) -> float:
    """Largest command on the slippery rail, a share of the largest one before it."""
    time, command = rows(outcome, "time"), rows(outcome, "controller.effort")
    return float(command[(time > 34.0) & (time < 50.0)].max() / command[time <= 30.0].max())


@pytest.mark.slow
def test_sc4_the_command_is_cut_to_less_than_four_fifths() -> None:
    """Median over five seeds: of 24 the cut is to 0.55 to 0.90, above 0.8 in two."""
    scenario = Scenario.load("freight_sc4")
    runs = [scenario.run(warn=lambda _: None, overrides={"seed": seed}) for seed in range(1, 5)]
    assert np.median([cut(outcome) for outcome in (run("freight_sc4"), *runs)]) < 0.8


@pytest.mark.slow
def test_sc4_the_command_is_cut_before_the_slip_is_excessive() -> None:
    """Published is a slip that the command follows; here the controller knows of it within the step: 11 to 17 % over 20
    seeds.
    """
    outcome = run("freight_sc4")
    assert 0.05 < largest_slip(outcome)[0] < 0.2
    assert cut(outcome) < 1.0
    assert rows(outcome, "controller.effort_available").min() < 0.2 * 350e3
    assert 3.6 * rows(outcome, "train.speed").max() == pytest.approx(50.0, abs=1.0)
    assert not sanded(outcome)
    assert not indicated(outcome)


@pytest.mark.slow
def test_estimates_save_nine_tenths_of_the_energy_lost_in_slip_on_one_rail() -> None:
    tables = [Scenario.load(name).table().components["train"] for name in ("freight_sc2", "freight_sc3")]
    assert tables[0] == tables[1]
    assert lost_in_slip(run("freight_sc3")) < 0.1 * lost_in_slip(run("freight_sc2"))


@pytest.mark.parametrize("name", WITH_ESTIMATES)
@pytest.mark.slow
def test_with_estimates_the_train_stops_as_near_as_the_receiver_knows(name: str) -> None:
    outcome = run(name)
    assert rows(outcome, "train.speed")[-1] == 0.0
    missed = rows(outcome, "train.position")[-1] - 850.0
    # It stops where the receiver says 850 m: its drift apart, the tolerance of the mission, and 0.3 m of estimate and
    # brake.
    assert abs(missed + rows(outcome, "receiver.drift")[-1]) < 0.35


@pytest.mark.slow
def test_spinning_wheels_count_a_way_that_the_train_has_not_run() -> None:
    outcome = run("freight_sc2")
    sliding = axles(outcome, "axle_speed")[0] - rows(outcome, "train.speed")
    counted = float(np.trapezoid(sliding, rows(outcome, "time")))
    assert counted > 100.0
    assert rows(outcome, "train.position")[-1] == pytest.approx(850.0 - counted, abs=1.0)  # sampled every 20 ms


@pytest.mark.parametrize("name", ALL)
@pytest.mark.slow
def test_speed_errors_are_those_of_the_published_size(name: str) -> None:
    # Published 0.14 to 0.33 km/h; 20 seeds of the receiver: 0.17 to 0.25 without, 0.28 to 0.51 in lasting slip.
    errors = [mean_error(run(name), observer) for observer in OBSERVERS]
    assert max(errors) < (0.6 if name == "freight_sc2" else 0.3)


@pytest.mark.slow
def test_in_slip_the_observer_of_the_adhesion_force_is_the_better_one() -> None:
    first, second = (mean_error(run("freight_sc2"), observer) for observer in OBSERVERS)
    # published: 0.33 against 0.15; Takagi-Sugeno takes the effort for the force at the rail
    assert second > 1.3 * first


@pytest.mark.parametrize("name", ALL)
@pytest.mark.slow
def test_couplers_are_never_at_risk(name: str) -> None:
    outcome = run(name)
    assert rows(outcome, "coupler_risk.risk").max() == 0.0
    assert rows(outcome, "train.coupler_force[1]").max() < 0.4 * 850e3


# -- physics
# ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ALL)
@pytest.mark.slow
def test_energy_is_conserved(name: str) -> None:
    outcome = run(name)
    steps = np.diff(rows(outcome, "time"))

    def work(force: Array, speed: Array) -> float:
        return float((0.5 * (force * speed)[1:] @ steps) + (0.5 * (force * speed)[:-1] @ steps))

    speed, wheels, creep = (
        rows(outcome, "train.speed"),
        axles(outcome, "axle_speed"),
        axles(outcome, "axle_creep_force"),
    )
    wagons = np.array([rows(outcome, f"train.wagon_speed[{i}]") for i in range(1, 5)])
    turned = 0.5 * (np.abs(wheels)[:, 1:] + np.abs(wheels)[:, :-1]).mean(axis=0) * steps
    # 1 N per kg at full service
    air = 80e3 * np.maximum(rows(outcome, "train.cylinder_pressure[1]") - 0.3e5, 0.0) / 3.2e5
    # The effort that acted in the step before each row: told at the rims, without the air brake.
    effort = (rows(outcome, "train.rim_effort") + np.sign(speed) * air)[1:]
    spent = {
        "electric brake": float(np.maximum(-effort, 0.0) @ turned),
        "air brake, locomotive": work(air, np.abs(wheels).mean(axis=0)),
        "air brake, wagons": work(rows(outcome, "train.wagon_brake_force"), wagons.mean(axis=0)),
        "resistance": work(rows(outcome, "train.resistance_force"), speed),
        "gradient": work(rows(outcome, "train.gradient_force"), speed),
        "slip": sum(work(force, wheel - speed) for force, wheel in zip(creep, wheels, strict=True)),
    }
    traction = float(np.maximum(effort, 0.0) @ turned)
    # trapezoids at 20 ms; the train stands at both ends
    assert sum(spent.values()) == pytest.approx(traction, rel=1e-3)
    if name in WITH_ESTIMATES:  # over the hill, 300 m of it: no potential energy but that of 2.4 m
        assert spent["gradient"] == pytest.approx(166e3 * 9.81 * 0.008 * 300.0, rel=2e-3)


@pytest.mark.parametrize("observer", OBSERVERS)
@pytest.mark.slow
def test_the_observers_know_of_the_indirect_brake(observer: str) -> None:
    outcome = run("freight_sc3")
    braking = (rows(outcome, "controller.brake_demand") > 0.01) & (rows(outcome, "train.speed") > 0.5)
    rail = rows(outcome, "train.adhesion_force")[braking]
    assert rail.mean() < -30e3
    # 29e3 where they are not told
    assert np.abs(rows(outcome, f"{observer}.adhesion_force")[braking] - rail).mean() < 4e3


def test_soapy_water_has_the_peak_that_the_files_claim() -> None:
    starts = {name: dict(Scenario.load(name).table().components["train"].parameters) for name in ALL}
    assert "polach_degraded_mu0" not in starts["freight_sc1"]
    assert POLACH_WET.peak(35.0 / 3.6)[1] == pytest.approx(0.151, abs=5e-4)
    for name in SOAPY:
        soapy = replace(POLACH_WET, mu0=starts[name]["polach_degraded_mu0"])
        assert soapy.peak(35.0 / 3.6)[1] == pytest.approx(0.065, abs=5e-4)


# -- how it runs
# --------------------------------------------------------------------------------------------------------


BOTH = pytest.mark.parametrize(
    ("component", "observer"),
    [(OBSERVERS[0], AugmentedHighGainCdo()), (OBSERVERS[1], AugmentedTakagiSugenoCdo())],
    ids=OBSERVERS,
)


@BOTH
def test_the_gains_are_certified_for_ten_fixes_a_second(component: str, observer: Any) -> None:
    first, *others = (dict(Scenario.load(name).table().components[component].parameters) for name in ALL)
    assert others == [first] * 3
    del first["estimated_speed"]  # a start, no parameter
    assert next(observer.findings(0.1, first, preset="gps")).holds


@pytest.mark.parametrize("name", ["freight_sc2", "freight_sc4"])  # one of each controller
@pytest.mark.slow
def test_blocks_and_fmus_give_equal_runs(name: str) -> None:
    short = {"stop": 0.6, "mission.departure_time": 0.1}
    native = Scenario.load(name).run(warn=lambda _warning: None, overrides=short)
    blocks = {f"{component}.as": "block3" for component in Scenario.load(name).table().components}
    python = Scenario.load(name).run(warn=lambda _warning: None, overrides={**short, **blocks})
    assert native["train.speed"][-1] > 0.0
    for signal in (
        "train.speed",
        "train.coupler_force[1]",
        "anti_slip.effort",
        "multirate_cdo.speed",
        "takagi_sugeno_cdo.speed",
    ):
        # the same operations in the same order; what remains is the order of additions in compiled expressions
        np.testing.assert_allclose(native[signal], python[signal], rtol=1e-9, atol=1e-9)


@BOTH
@pytest.mark.slow
def test_read_fixes_count_like_events_at_their_own_stamps(component: str, observer: Any) -> None:
    # The scenarios read the receiver's held output; here a block is told the same fixes as events of FMI 2, by count
    # and stamp.
    scenario = Scenario.load("freight_sc3")
    changes: dict[str, Any] = {
        "stop": 8.0,
        "mission.departure_time": 1.0,
        f"{component}.record": ["effort", "odometer"],
    }
    outcome = scenario.run(warn=lambda _warning: None, overrides=changes)
    block: Any = make_block(observer, fmi_version=2)
    reference = {v.name: v.valueReference for v in block.model_description.modelVariables}
    block.instantiate()
    for name, value in scenario.table().components[component].parameters.items():
        for i, number in enumerate(np.atleast_1d(np.asarray(value, dtype=float))):
            block.setReal([reference[f"{name}[{i + 1}]" if isinstance(value, list | tuple) else name]], [number])
    if component == "multirate_cdo":
        block.setReal([reference["theta_balise"]], [0.0])
    else:
        block.setReal([reference[f"balise_gain[{i}]"] for i in range(1, 5)], [0.0] * 4)
    block.setupExperiment(startTime=0.0)
    block.enterInitializationMode()
    block.exitInitializationMode()
    time, seen = rows(outcome, "time"), {n: rows(outcome, f"{component}.{n}") for n in ("effort", "odometer", "speed")}
    fixes = {n: rows(outcome, f"receiver.{n}") for n in ("gps_count", "gps_time", "gps_position")}
    for k in range(1, time.size):
        for name in ("effort", "odometer"):
            block.setReal([reference[name]], [seen[name][k]])
        block.setInteger([reference["gps_count"]], [int(fixes["gps_count"][k])])
        for name in ("gps_time", "gps_position"):
            block.setReal([reference[name]], [fixes[name][k]])
        block.doStep(time[k - 1], time[k] - time[k - 1])
        assert block.getReal([reference["speed"]])[0] == pytest.approx(seen["speed"][k], rel=1e-9, abs=1e-9), time[k]
