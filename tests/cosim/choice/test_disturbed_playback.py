"""Disturbances between a recording and observers: what they do to what is heard and believed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from small_scenarios import small
from test_fmus.build import linear_fmu

from cosim import Scenario
from cosim.choice.benchmark import benchmark_observers
from cosim.choice.candidates import BenchmarkCandidate, find_candidates
from cosim.choice.disturbances import GRAVITY, Disturbance, Journey, OdometerFault, Slope
from cosim.choice.disturbed_playback import believing
from cosim.choice.known_parameters import derived_parameters, mass_remarks, stated_parameters
from cosim.choice.playback import find_parts
from cosim.results.result import Result, SignalInfo
from cosim.scenario.scenario_tables import ComponentTable
from fmu_observer import OBSERVERS
from fmus.cache import cached_fmu

HEARD = ["odometer_reset", "takagi_sugeno_cdo:long_gaps"]


def always(wrong: Disturbance) -> Callable[[Journey], Disturbance]:
    return lambda _journey: wrong


def scores(wrong: Disturbance, observers: Any = HEARD) -> dict[str, Any]:
    found = benchmark_observers(small(), observers, disturb=always(wrong))
    return {score.name: found.outcomes[score.name] for score in found.scores}


def test_a_channel_in_which_nothing_is_wrong_changes_no_bit() -> None:
    """The noise is too small to change a reading, and yet all blocks stand there."""
    nothing = scores(Disturbance())
    there = scores(
        Disturbance(noise=1e-300, faults=(OdometerFault(0.1, 0.1, 0.0, 1.0),), slopes=(Slope(0.0, 0.5, 0.0),))
    )
    for name, outcome in nothing.items():
        for signal in ("position", "speed"):
            times = np.unique(outcome.result.time)
            before, after = (np.interp(times, o.result.time, o[f"{name}.{signal}"]) for o in (outcome, there[name]))
            assert before.tobytes() == after.tobytes()


def test_a_jam_and_wear_are_in_the_way_of_the_odometer() -> None:
    """5 m in half a second at 10 m/s: 1 % more, and without the tenth in which the wheel stands."""
    at_balises = small().balises(positions=[1e3])
    wrong = Disturbance(wheel=1.01, faults=(OdometerFault(0.2, 0.1, 1.0, -1.0),))
    right, jammed = (
        benchmark_observers(at_balises, ["odometer_reset"], disturb=always(found)).outcomes["odometer_reset"]
        for found in (Disturbance(), wrong)
    )
    way, less = (o["odometer_reset.position"][-1] - o["odometer_reset.position"][0] for o in (right, jammed))
    assert less == pytest.approx(1.01 * 0.8 * way, rel=0.03)


def test_a_slope_is_an_effort_that_moves_nothing() -> None:
    heard = scores(Disturbance(slopes=(Slope(0.0, 9.0, 0.01),)), ["decaying_innovation_cdo:balise_holes"])
    (name, wrong), (_, right) = *heard.items(), *scores(Disturbance(), ["decaying_innovation_cdo:balise_holes"]).items()
    ahead = wrong[f"{name}.speed"][-1] - right[f"{name}.speed"][-1]
    assert ahead == pytest.approx(0.01 * GRAVITY * 0.5, rel=0.2)


def test_observers_believe_in_another_mass_also_where_it_is_their_default() -> None:
    scenario = small()
    found, _ = find_candidates(scenario, find_parts(scenario), ["observer", "odometer_reset"], {})
    own, plain = (believing(c, Disturbance(mass=1.2, resistance=0.5), Path()).table.parameters for c in found)
    assert own["mass"] == pytest.approx(1.2 * 90e3)
    assert own["davis_a"] == pytest.approx(450.0)
    assert "mass" not in plain


def test_an_observer_that_is_an_fmu_believes_in_another_mass_too(tmp_path: Path) -> None:
    """As its start value where the scenario sets none; in the FMU's own unit."""
    fmu: Any = cached_fmu(OBSERVERS["takagi_sugeno_cdo"](), fmi_version=3)
    table = ComponentTable.model_validate({"fmu": str(fmu), "parameters": {"davis_a": 1000.0}})
    one = BenchmarkCandidate("mine", table, {}, "scenario")
    found = believing(one, Disturbance(mass=1.2, resistance=0.5), tmp_path).table.parameters
    assert found["mass"] == pytest.approx(1.2 * 90e3)
    assert found["davis_a"] == pytest.approx(500.0)
    assert believing(one, Disturbance(), tmp_path) == one


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_the_mass_of_a_train_that_nobody_states_is_fitted_to_its_run(sign: float) -> None:
    scenario = small()
    parts = replace(find_parts(scenario), observers=())
    time = np.arange(0.0, 60.0, 0.1)
    speed = 10.0 * np.sin(time / 15.0) ** 2 + 3.0
    mass, rate = 420e3, np.gradient(speed, time)
    effort = mass * (rate + 0.01 + 3.6e-4 * speed + 1.8365e-5 * speed**2)
    names = ("locomotive.position", "locomotive.speed", "driver.effort", "odometer.reading")
    table = np.empty(len(time), dtype=[("time", float), *((name, float) for name in names)])
    table["time"] = time
    for name, values in zip(names, (np.cumsum(speed) * 0.1, speed, effort, speed), strict=True):
        table[name] = sign * values
    found = derived_parameters({}, parts, Result(table, [SignalInfo(name) for name in names]))
    assert found["mass"][0] == pytest.approx(mass, rel=0.02)
    assert found["davis_a"][0] == pytest.approx(0.01 * found["mass"][0])
    assert found["estimated_speed"][0] == sign * speed[0]
    assert found["odometer_period"][0] == pytest.approx(0.1)
    doubted = derived_parameters(
        {"mass": (90.0, "as for the plant")}, parts, Result(table, [SignalInfo(n) for n in names])
    )
    assert doubted["mass"][0] == found["mass"][0]
    assert mass_remarks(doubted)[0].endswith("since 90.0 kg (as for the plant) is that of no train; check it.")
    assert mass_remarks({"mass": (1.0, "of models per unit mass")}) == []
    stated = stated_parameters(scenario, parts)
    assert derived_parameters(stated, parts, Result(table, []))["mass"][0] == 90e3


def test_a_journey_is_what_it_says() -> None:
    found: list[Journey] = []

    def seen(journey: Journey) -> Disturbance:
        found.append(journey)
        return Disturbance()

    benchmark_observers(small(), ["odometer_reset"], disturb=seen)
    assert found[0].time[-1] == pytest.approx(0.5)
    assert found[0].position[-1] == pytest.approx(5.0, abs=0.1)


MASS, PULL = 90e3, 45e3  # [kg], [N]
SIGNALS = {
    "SI": ("m/s", "N", 1.0, 1.0, {}, {}),
    "declared": ("km/h", "kN", 3.6, 1e-3, {}, {}),
    "declared, taken as numbers": (
        *("km/h", "kN", 3.6, 1e-3),
        {"factor": 1.0 / 3.6, "units": "ignore"},
        {"factor": 1e3, "units": "ignore"},
    ),
    "without a unit": ("", "", 3.6, 1e-3, {"factor": 1.0 / 3.6}, {"factor": 1e3}),
}


def point_mass(folder: Path, name: str, sign: float) -> Scenario:
    """A mass that is pulled from 10 m/s on, forwards or backwards, with its odometer and effort in units of a kind."""
    speed_unit, effort_unit, speed, effort, read, pull = SIGNALS[name]
    fmu = linear_fmu(
        *(folder, "mass", [[0.0, 1.0], [0.0, 0.0]], [[0.0], [1.0 / MASS]]),
        *([[1.0, 0.0], [0.0, 1.0], [0.0, speed], [0.0, 0.0]], [[0.0], [0.0], [0.0], [effort]]),
        inputs=["pull"],
        outputs=["position", "speed", "odometer", "effort"],
        x0=[0.0, 10.0 * sign],
        u0=[PULL * sign],
        units={"position": "m", "speed": "m/s"}
        | {n: unit for n, unit in (("odometer", speed_unit), ("effort", effort_unit)) if unit},
    )
    scenario = Scenario(stop=12.0, step=0.05).add("mass", fmu=str(fmu))
    stated = {"mass": MASS, "estimated_speed": 10.0 * sign, "odometer_period": 0.05}
    scenario.add("observer", observer="quasi_lpv_uio", parameters=stated, **{"as": "block3"})
    scenario.connect("mass.odometer -> observer.odometer", **read).connect("mass.effort -> observer.effort", **pull)
    scenario.balises(
        position="mass.position", speed="mass.speed", layout="positions", positions=sorted([40.0 * sign, 80.0 * sign])
    )
    return scenario.report(true_position="mass.position", true_speed="mass.speed", odometer="mass.odometer")


@pytest.mark.compiler
@pytest.mark.parametrize("sign", [1.0, -1.0], ids=["forwards", "backwards"])
@pytest.mark.parametrize("name", [name for name in SIGNALS if name != "SI"])
def test_what_observers_hear_does_not_depend_on_the_units_of_the_plant(name: str, sign: float, tmp_path: Path) -> None:
    """Own observers, shipped ones and their disturbances, up to the rounding of a factor on each number."""
    slope, fault = Slope(2.0, 6.0, 5e-3), OdometerFault(5.0, 1.0, 0.5, 1.0)
    wrong = Disturbance(mass=1.1, wheel=1.01, slopes=(slope,), faults=(fault,))
    asked = ["observer", "odometer_reset", "decaying_innovation_cdo:balise_holes"]
    paths = [tmp_path / kind for kind in ("SI", "other")]
    for path in paths:
        path.mkdir()
    right, other = (
        benchmark_observers(point_mass(path, kind, sign), asked, disturb=always(wrong))
        for path, kind in zip(paths, ("SI", name), strict=True)
    )
    live = point_mass(paths[1], name, sign).run(progress=False)
    assert live["observer.speed"][0] == pytest.approx(10.0 * sign)
    for score in right.scores:
        for signal in ("position", "speed"):
            before, after = (b.outcomes[score.name][f"{score.name}.{signal}"] for b in (right, other))
            assert after == pytest.approx(before, rel=1e-9, abs=1e-9)
