"""The controllers on trains: missions driven to their stop, slippery rails with and without estimates, axles that
slip.
"""

from __future__ import annotations

import numpy as np
import pytest
from control_runs import Controller, journey
from railway_runs import NO_ZONES, outputs, started

from plant_models import Locomotive
from plant_models.railway.adhesion import BurckhardtCurve
from plant_models.railway.control import AdrcController, AntiSlipDevice, MdpeController, Mission
from plant_models.railway.vehicle.train import Train

CONTROLLERS = {"adrc": AdrcController, "mdpe": MdpeController}
SLIPPERY = {
    **NO_ZONES,
    "zone_from[1]": 20.0,
    "zone_to[1]": 250.0,
    "burckhardt_degraded_a1": 0.08,
    "burckhardt_degraded_a3": 0.05,
}


@pytest.mark.parametrize(("controller", "preset"), [("mdpe", "sc1"), ("adrc", "sc2")])
def test_a_train_is_driven_over_its_mission_and_stops_at_the_point(controller: str, preset: str) -> None:
    train = started(Train(), **NO_ZONES)
    run = journey(train, Controller(CONTROLLERS[controller]()), started(Mission(braking="position"), preset), 130.0)
    assert run["position"][-1] == pytest.approx(850.0, abs=0.15)  # tolerance of the mission 0.05 m, a period at 0.3 m/s
    assert run["speed"][-1] == 0.0
    assert np.abs(run["speed"] - run["speed_reference"]).max() < 0.35
    holding = (run["time"] > 60.0) & (run["phase"] == 2.0)
    assert np.abs(run["speed"] - run["speed_reference"])[holding].max() < 0.01
    # The nominal start as a step peaks at 62 kN in the first coupler (independently measured); none of these is worse.
    assert np.abs(run["coupler_force[1]"]).max() < 62e3
    late = (run["phase"] == 3.0) & (run["speed"] < 5.0) & (run["speed"] > 2.5)
    assert np.abs(run["effort"][late]).max() < 2e3  # air has taken over
    assert run["brake_demand"][late].min() > 0.3


@pytest.mark.parametrize("controller", ["adrc", "mdpe"])
def test_a_single_mass_without_air_brake_is_driven_too(controller: str) -> None:
    train = started(Locomotive(), **NO_ZONES)
    run = journey(train, Controller(CONTROLLERS[controller](), "single_mass"), started(Mission(), "sc2"), 125.0)
    # By time nobody makes up for what the effort's rate costs at the start: 45 kN at 68 kN/s are 0.7 s.
    assert run["position"][-1] == pytest.approx(850.0, abs=1.0)
    assert run["speed"][-1] == 0.0
    assert np.abs(run["speed"] - run["speed_reference"]).max() < 0.25
    assert (run["brake_demand"] == 0.0).all()


def lost(run: dict[str, np.ndarray]) -> float:
    """Energy lost in slip [J]."""
    return float(np.trapezoid(run["adhesion_force"] * (run["wheel_speed"] - run["speed"]), run["time"]))


def test_estimates_keep_the_slip_down_where_the_rail_is_slippery() -> None:
    runs = {}
    for name, controller in CONTROLLERS.items():
        mission = started(Mission(braking="position"), "sc3")
        runs[name] = journey(started(Train(), **SLIPPERY), Controller(controller()), mission, 40.0)
    adrc, mdpe = runs["adrc"], runs["mdpe"]
    assert lost(mdpe) < 0.6 * lost(adrc)
    assert mdpe["estimated_slip"].max() < 0.14
    slipping = adrc["estimated_slip"] > 0.12
    assert slipping.sum() > 10 * (mdpe["estimated_slip"] > 0.12).sum()
    # Within the zone the effort rests on the rail's own limit, 62.3 kN at the peak of this curve.
    peak = BurckhardtCurve(0.08, 25.0, 0.05).peak() * 90e3 * 9.81
    limited = (mdpe["adhesion_level"] == 2.0) & (mdpe["time"] > 12.0) & (mdpe["time"] < 18.0)
    assert np.abs(mdpe["effort"][limited] / mdpe["effort_available"][limited] - 1.0).max() < 1e-6
    assert 0.75 * peak < mdpe["effort"][limited].min() <= mdpe["effort"][limited].max() < peak
    for run in runs.values():
        assert run["speed"][-1] == pytest.approx(35.0 / 3.6, abs=0.05)


def under_the_device(*axle_degraded: float) -> tuple[dict[str, float], Controller]:
    """The train at 10 m/s on a slippery rail under 200 kN through its anti-slip device, four seconds on."""
    shares = {f"axle_degraded[{i + 1}]": share for i, share in enumerate(axle_degraded)}
    everywhere = {**SLIPPERY, "zone_from[1]": -100.0, "zone_to[1]": 1e6}
    plant = Train()
    train = started(plant, x0=rolling(plant, 10.0), **everywhere, **shares)
    device = Controller(AntiSlipDevice(), start={"effort_setpoint": 200e3})
    for k in range(201):
        t = 0.02 * k
        train.advance(t)
        seen = outputs(train)
        reported = {f"axle_speed[{i}]": seen[f"axle_speed[{i}]"] for i in (1, 2, 3, 4)}
        train.u[0] = device.at(t, **reported)["effort"]
    return seen, device


def rolling(plant: Train, speed: float) -> np.ndarray:
    x = plant.start_state()
    names = [name for s in plant.states for name in s.scalar_names]
    for name, value in plant.rolling(speed).items():
        x[names.index(name)] = value
    return x


def test_the_device_catches_one_axle_and_is_blind_to_all_four() -> None:
    seen, device = under_the_device(1.0, 0.0, 0.0, 0.0)
    assert device.memory("share") < 0.9
    assert device.memory("flags[1]") == 0.0
    assert seen["axle_slip[1]"] < 0.3
    together, blind = under_the_device(1.0, 1.0, 1.0, 1.0)
    assert blind.memory("share") == 1.0  # all spin, and it sees nothing
    assert min(together[f"axle_slip[{i}]"] for i in (1, 2, 3, 4)) > 1.0
