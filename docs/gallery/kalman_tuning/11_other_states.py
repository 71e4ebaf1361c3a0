"""What the current errors do not show: speed, angle, the scale of the covariances, misprints, observability."""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np
from recordings import SEEDS, STATES, current_cost, drive, errors, in_run, of_rows, recording, replay
from shared.sheet import Sheet

from fmu_observer.observers.motors import MotorEkf, MotorEkfStator

FINALS = {"hand": (612.0, 57.0), "pso_20": (8.1, 5.3), "ga_20": (8.0, 5.4), "bbo_20": (9.2, 6.0)}
CURVES = "curves only; ten seeds here and there, not the same noise"
DEAD = (
    "the angle is the integral of the estimated speed, and noise of 1e-3 a sample walks 3.2 rad in a second: 5 rad2 on "
    "average over 1000 seeds, 11.6 over these ten"
)
SCALE = "P(0) = I is not scaled with them; nothing else differs"
RANK = "no current along d or q depends on the angle"
MISPRINT = "no statement which Jacobian was used; the currents cannot tell"
LOAD = "no statement whether the filter knows the load; the tables fit only if it does"
FEW = SEEDS[:3]


def main() -> None:
    """Errors of the printed finals in the other states, and what changes them or does not."""
    sheet = Sheet(__file__, "What the error of the currents does not show", "Allaoui 2024, Figs. 3.10-3.13, (4.42)")
    reported = np.array([errors(seed, of_rows(list(FINALS)), STATES[2:]) for seed in SEEDS]).mean(axis=0)
    for (row, (speed, angle)), (of_speed, of_angle) in zip(FINALS.items(), reported, strict=True):
        sheet.add(f"MSE of the speed, {row}", "rad2/s2", None, of_speed, CURVES, repeats=0.03, independent=speed)
        sheet.add(f"MSE of the angle, {row}", "rad2", None, of_angle, DEAD, repeats=0.05, independent=angle)

    best = of_rows(["bbo_20"])
    scaled = np.array([current_cost(seed, np.vstack([best, 0.1 * best, 10.0 * best])) for seed in FEW]).mean(axis=0)
    change = float(np.abs(scaled[1:] / scaled[0] - 1.0).max())
    sheet.add("cost with Q and R times 0.1 or 10 changes by", "1", None, change, SCALE, repeats=0.5, independent=0.002)
    _misprints(sheet)
    _unknown_load(sheet)
    for observer, rank in ((MotorEkf(), "3 of 4"), (MotorEkfStator(), "4 of 4")):
        found = next(observer.findings()).numbers
        text = f"{found['rank']:.0f} of {found['order']:.0f}"
        sheet.add(f"observability at 100 rad/s, {observer.name}", "1", None, text, RANK, independent=rank)
    standing = MotorEkfStator()
    p = standing.unpack_parameters(standing.start_parameters())
    still = standing.condition_of(p, speed=0.0, current_q=0.0).numbers
    text = f"{still['rank']:.0f} of 4"
    sheet.add("the same at rest without current, motor_ekf_stator", "1", None, text, "nothing turns")

    run = recording(0)
    figure, (left, right) = plt.subplots(1, 2, figsize=(8, 3.2), layout="constrained")
    parameters = {"process_variance": of_rows(["hand", "bbo_20"])[:, :4]}
    parameters["measurement_variance"] = of_rows(["hand", "bbo_20"])[:, 4:]
    estimates = replay(0).run(("speed", "angle"), parameters)
    for axis, name, i in ((left, "speed", 0), (right, "angle", 1)):
        for label, member in (("hand", 0), ("bbo_20", 1)):
            axis.plot(
                run.result.time[::10], (estimates[member, :, i] - run[f"motor.{name}"])[::10], label=label, lw=0.7
            )
        axis.set(xlabel="t [s]", ylabel=f"error of the {name} [{'rad/s' if name == 'speed' else 'rad'}]")
    left.legend(fontsize=8)
    sheet.finish(figure)


def _misprints(sheet: Sheet) -> None:
    """The filter with the Jacobian as printed, beside the same drive."""
    printed, exact = (
        np.mean([in_run(drive(seed, filter__options__jacobian=jacobian)) for seed in FEW], axis=0)
        for jacobian in ("as_published", "exact")
    )
    for name, ratio, independent in zip(
        ("currents", "speed", "angle"), printed / exact, (1.0, 1.06, 1.18), strict=True
    ):
        quantity = f"MSE of the {name}, Jacobian as printed over exact"
        sheet.add(quantity, "1", None, ratio, MISPRINT, repeats=0.05, independent=independent)


def _unknown_load(sheet: Sheet) -> None:
    """The filter that is told of no load."""
    lines = [str(line).replace(", filter.load_torque", "") for line in drive(0).table().connections]
    currents, speed, _ = in_run(drive(0, connections=lines))
    quantity = "filter without the load"
    sheet.add(f"MSE of the currents, {quantity}", "A2", None, currents, LOAD, repeats=0.05, independent="0.20-0.23")
    sheet.add(f"MSE of the speed, {quantity}", "rad2/s2", None, speed, LOAD, repeats=0.05, independent="2.0e4-3.6e4")


if __name__ == "__main__":
    main()
