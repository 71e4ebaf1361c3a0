"""Augmented observers behind a train of five vehicles: speed error and coupler force by the noise of the satellite
receiver.
"""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np
from shared.runner import SystemRunner
from shared.sheet import Sheet

from fmu_observer.observers.train import AugmentedHighGainCdo, AugmentedTakagiSugenoCdo
from plant_models.railway.control.driver import Driver
from plant_models.railway.sensors.gps import Gps
from plant_models.railway.vehicle.train import Train

UPHILL, CRUISE, STOP, TICK = 0.008, 35.0 / 3.6, 80.0, 0.01  # [1], [m/s], [s], [s]
WEIGHT = 90e3 * 9.81  # [N], of the locomotive
RECEIVERS = {  # preset of the receiver, time constant of the drift [s]
    "fixes without error": ("ideal", 60.0),
    "drift of 0.5 m over 10 min, white noise of 0.05 m": ("half_metre", 600.0),
    "drift of 0.5 m over 1 min, white noise of 0.05 m": ("half_metre", 60.0),
    "white noise of 0.5 m": ("white", 60.0),
}
GAINS = {1.0: "theta = 1 1/s", 0.5: "theta = 0.5 1/s"}
PUBLISHED = {"high gain": "0.14 and 0.15", "Takagi-Sugeno": "0.17 and 0.33"}
WHY = (
    "published on measured runs, whose data are not available: mean speed errors of 0.14 and 0.15 km/h (high gain) and "
    "0.17"
    " and 0.33 km/h (Takagi-Sugeno) in Sc1 and Sc2, with a receiver of 0.5 m; gains are not printed. An independent "
    "implementation gave 0.082 km/h without noise, 1.06 with 0.5 m of white noise at theta = 1 1/s, and 0.56 at 0.5 "
    "1/s. "
    "With white noise neither gain comes near what is published; with a drift of the same size it does, more over ten "
    "minutes than over one. One seed of 80 s each"
)
FORCE = (
    "no coupler force is printed as a number; an independent implementation gave 14.92 kN and, with couplers that "
    "ring, 8 "
    "kN rms; here it is the lag at the two changes of the effort"
)


def binomial(theta: float) -> dict[str, float]:
    """Fix gains theta^i (4, 6, 4, 1) of the Takagi-Sugeno family."""
    gains = [4.0 * theta, 6.0 * theta**2, 4.0 * theta**3, theta**4]
    return {f"gps_gain[{i + 1}]": gain for i, gain in enumerate(gains)} | {"gps_decay": gains[0]}


def journey() -> dict[str, np.ndarray]:
    """Every 10 ms: time, position, speed, wheel speed, effort and first coupler force, up to 35 km/h on 8 per mille."""
    train = SystemRunner(Train(), **{f"gradient[{i}]": UPHILL for i in (1, 2, 3, 4)})
    train.set("x", **train.system.rolling(0.5))  # type: ignore[attr-defined]
    reached = (CRUISE - 0.5) / 0.5
    profile = {"profile_time": [0.0, reached, *[STOP] * 6], "profile_speed": [0.5, CRUISE, *[CRUISE] * 6]}
    driver = SystemRunner(
        Driver(), **{f"{name}[{i + 1}]": v for name, values in profile.items() for i, v in enumerate(values)}
    )
    start = float(166e3 * 9.81 * UPHILL + 1.7e3)  # the hold at the start
    driver.set("x", integral=start, developed_effort=start)
    driver.set("u", odometer=0.5)
    train.set("u", effort=start)
    rows = []
    for k in range(round(STOP / TICK)):
        if k == 0:
            driver.runtime.start(0.0)
            train.runtime.start(0.0)
        seen, effort = train.outputs(), driver.outputs()["effort"]
        rows.append([k * TICK, seen["position"], seen["speed"], seen["wheel_speed"], effort, seen["coupler_force[1]"]])
        driver.set("u", odometer=seen["wheel_speed"])
        train.set("u", effort=effort)
        driver.runtime.advance((k + 1) * TICK)
        train.runtime.advance((k + 1) * TICK)
    names = ("time", "position", "speed", "wheel_speed", "effort", "coupler_force")
    return dict(zip(names, np.array(rows).T, strict=True))


def fixes(way: dict[str, np.ndarray], preset: str, drift_time: float) -> np.ndarray:
    """Positions told by the receiver every 0.1 s."""
    receiver, reported = SystemRunner(Gps(), preset, drift_time=drift_time), []
    for k in range(0, len(way["time"]), 10):
        receiver.set("u", position=way["position"][k])
        if k == 0:
            receiver.runtime.start(0.0)
        receiver.runtime.advance(way["time"][k])
        reported.append(receiver.outputs()["gps_position"])
    return np.array(reported)


def followed(observer: SystemRunner, way: dict[str, np.ndarray], reported: np.ndarray) -> np.ndarray:
    """Speed and coupler force (with gravity) of an observer, shape (rows, 2)."""
    observer.set("x", estimated_speed=0.5)
    rows = np.empty((len(way["time"]), 2))
    for k, t in enumerate(way["time"]):
        observer.runtime.advance(float(t))
        observer.set("u", effort=way["effort"][k], odometer=way["wheel_speed"][k])
        if k == 0:
            observer.runtime.start(0.0)
        if k % 10 == 0:
            observer.set("u", gps_position=reported[k // 10])
            observer.runtime.trigger("gps")
        values = observer.outputs()
        rows[k] = values["speed"], values["coupler_force"]
    return rows


def main() -> None:
    """Mean speed errors by receiver and gain, and the coupler force."""
    sheet = Sheet(__file__, "Augmented observers with satellite fixes", "Bouchama 2024, (4.7)-(4.13), section 4.5")
    way = journey()
    true = way["coupler_force"] + WEIGHT * UPHILL
    figure, (speeds, forces) = plt.subplots(1, 2, figsize=(10, 4), layout="constrained")
    for words, (preset, drift_time) in RECEIVERS.items():
        reported = fixes(way, preset, drift_time)
        for theta, label in GAINS.items():
            for family, make, gains in (
                ("high gain", AugmentedHighGainCdo, {"theta_gps": theta}),
                ("Takagi-Sugeno", AugmentedTakagiSugenoCdo, binomial(theta)),
            ):
                found = followed(SystemRunner(make(), n_axles=4.0, **gains), way, reported)
                error = 3.6 * np.abs(found[:, 0] - way["speed"])
                late = way["time"] > 10.0
                name = f"mean speed error, {family}, {label}, {words}"
                published = PUBLISHED[family] if drift_time > 60.0 else None
                sheet.add(name, "km/h", published, float(error[late].mean()), WHY, repeats=0.03)
                if preset == "ideal" and theta == 1.0:
                    hold = way["time"] > 40.0
                    sheet.add(
                        f"mean force of coupler and gradient, {family}", "kN", None, found[hold, 1].mean() / 1e3, FORCE
                    )
                    rms = np.sqrt(np.mean((found[late, 1] - true[late]) ** 2)) / 1e3
                    sheet.add(f"rms error of that force, {family}", "kN", None, rms, FORCE, repeats=0.05)
                    forces.plot(way["time"][::10], found[::10, 1] / 1e3, lw=0.8, label=family)
                if family == "Takagi-Sugeno" and theta == 0.5:
                    speeds.semilogy(way["time"][::10], error[::10] + 1e-4, lw=0.7, label=words)
    forces.plot(way["time"][::10], true[::10] / 1e3, "k", lw=0.4, label="true")
    forces.set(xlabel="time [s]", ylabel="force of coupler and gradient [kN]")
    speeds.set(xlabel="time [s]", ylabel="speed error, Takagi-Sugeno, theta 0.5 1/s [km/h]", ylim=(1e-3, None))
    sheet.finish(figure, speeds, forces)


if __name__ == "__main__":
    main()
