"""The wind turbine without faults: check values of its equations, wind, zones, pitch actuators, torque of the wind;
Figures 7.2, 7.13 and 7.15.
"""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np
from shared.sheet import Sheet

from cosim import Outcome, Scenario
from plant_models.exhibits.wind_turbine.drive_train import DriveTrain
from plant_models.exhibits.wind_turbine.rotor import Rotor, optimal_torque_gain

DRIVES = (
    ("efficiency 0.97", DriveTrain(), (-0.00724, -0.0550, 28.163)),
    ("efficiency 0.25", DriveTrain(efficiency=0.25), (-0.0238, -0.0466, 15.520)),
    ("as printed", DriveTrain(printed=1.0), (2.6e-5, 8.1e-5, 28.16)),
)
ACTUATORS = (("healthy", 11.11, 0.6), ("fault 8", 5.73, 0.45), ("fault 9", 3.42, 0.9))
NONE_PRINTED = "the thesis prints no number"
OUR_WIND = "wind is a stand-in of the same make; its numbers are drawn afresh"
BIAS, STOP = 1.5, 4400.0
SETTLED = 20.0


def closed_loop() -> Outcome:
    """Wind, turbine and controller over 4400 s, every fiftieth sample."""
    s = Scenario(stop=STOP, step=0.01)
    s.add("wind", model="wind", preset="synthetic").add("turbine", model="wind_turbine")
    s.add("controller", model="wind_turbine_controller")
    s.connect("wind.wind_speed -> turbine.wind_speed")
    s.connect("turbine.measured_generator_speed[1] -> controller.generator_speed")
    s.connect("turbine.measured_power -> controller.generator_power")
    s.connect("controller.torque_reference -> turbine.torque_reference")
    s.connect("controller.pitch_reference -> turbine.pitch_reference")
    outcome = s.master(record_every=50).run()
    if outcome.failure is not None:
        raise RuntimeError(outcome.failure)
    return outcome


def gain(frequency: np.ndarray, wn: float, zeta: float) -> np.ndarray:
    """Gain of a pitch actuator at frequencies [rad/s]."""
    s = 1j * frequency
    return np.abs(wn**2 / (s**2 + 2.0 * zeta * wn * s + wn**2))


def main() -> None:
    """Check values, then one run."""
    sheet = Sheet(
        __file__, "Wind turbine: equations, wind, torque of the wind", "Omar 2012, section 7.3, Figs. 7.2, 7.13, 7.15"
    )
    sheet.add("gain of zone 2", "N.m.s2", 1.2171, optimal_torque_gain(Rotor(), 0.97, 95.0), independent=1.21708)
    for name, drive, (slow, damping, swing) in DRIVES:
        values = np.linalg.eigvals(np.array(drive.matrix()))
        values = values[np.argsort(values.imag)]
        sheet.add(f"{name}: slow eigenvalue", "1/s", None, values[1].real, NONE_PRINTED, independent=slow)
        sheet.add(f"{name}: damping of the shaft", "1/s", None, values[2].real, NONE_PRINTED, independent=damping)
        sheet.add(f"{name}: oscillation of the shaft", "rad/s", None, values[2].imag, NONE_PRINTED, independent=swing)
    figure, axes = plt.subplots(1, 3, figsize=(11, 3.4), layout="constrained")

    outcome = closed_loop()
    time, wind = outcome.result.time, outcome["wind.wind_speed"]
    axes[0].plot(time, wind, lw=0.5)
    axes[0].set_title("Fig. 7.2: wind, a stand-in", fontsize=9)
    axes[0].set_xlabel("Time [s]")
    axes[0].set_ylabel("Wind [m/s]")
    zone = float(np.mean(outcome["controller.zone"] == 3))
    sheet.add("samples in zone 3", "%", None, 100.0 * zone, OUR_WIND, independent=30.0)

    frequency = np.geomspace(0.1, 100.0, 300)
    for name, wn, zeta in ACTUATORS:
        axes[1].semilogx(frequency, 20.0 * np.log10(gain(frequency, wn, zeta)), label=name)
    axes[1].set_title("Fig. 7.13: pitch actuators", fontsize=9)
    axes[1].set_xlabel("Frequency [rad/s]")
    axes[1].set_ylabel("Gain [dB]")
    axes[1].legend(fontsize=7)
    for at in (0.3, 10.0):
        healthy = gain(np.array([at]), *ACTUATORS[0][1:])[0]
        for name, wn, zeta in ACTUATORS[1:]:
            ratio = gain(np.array([at]), wn, zeta)[0] / healthy
            sheet.add(f"{name} against healthy at {at:g} rad/s", "dB", None, 20.0 * np.log10(ratio), NONE_PRINTED)

    settled = time >= SETTLED
    pitches = [np.degrees(outcome[f"turbine.measured_pitch[{2 * blade + 1}]"]) for blade in range(3)]
    measured = outcome["turbine.measured_wind"] - BIAS
    estimate = Rotor().torque(measured, outcome["turbine.measured_rotor_speed[1]"], pitches)[settled]
    true = outcome["turbine.rotor_torque"][settled]
    error = float(np.sqrt(np.mean((estimate - true) ** 2) / np.mean(true**2)))
    sheet.add("torque of the wind, relative rms error", "1", None, error, OUR_WIND, independent=0.095)
    part = (time[settled] > 1000.0) & (time[settled] < 1060.0)
    axes[2].plot(time[settled][part], estimate[part] / 1e6, lw=0.5, label="estimate")
    axes[2].plot(time[settled][part], true[part] / 1e6, lw=1.0, label="true")
    axes[2].set_title("Fig. 7.15: torque of the wind", fontsize=9)
    axes[2].set_xlabel("Time [s]")
    axes[2].set_ylabel("Torque [MN.m]")
    axes[2].legend(fontsize=7)
    sheet.finish(figure)


main()
