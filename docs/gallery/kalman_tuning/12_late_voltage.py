"""A voltage of the wrong period, and how the order of the master takes care of it."""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np
from recordings import SEEDS, STATES, drive, in_run, recording, replay
from shared.sheet import Sheet

SLIPS = {
    "aligned": (0, 0, 0.0149),
    "voltage one step late": (1, 0, 0.0138),
    "voltage one step early": (-1, 0, 0.0165),
    "currents and what is compared one step late": (0, 1, 0.0177),
}
WHY = "ten seeds here and there, not the same noise; the tables cannot tell which was coded"
LATE = "an artefact: in this drive control sees the true state, so that its next voltage tells of it"
ORDER = "a signal that goes back to the motor is held for all, whatever the order of listing"
JACOBI = "all signals one step old: the filter is told of the currents of a step ago too, and so estimates the past"


def main() -> None:
    """Costs with slips, then the same run with other orders of listing."""
    sheet = Sheet(__file__, "Voltage and currents of the wrong sample", "Allaoui 2024, (2.25)-(2.31), (4.39)-(4.41)")
    costs = {name: np.array([_slipped(seed, *shifts) for seed in SEEDS]) for name, (*shifts, _) in SLIPS.items()}
    for name, (_, _, independent) in SLIPS.items():
        why = LATE if name == "voltage one step late" else WHY
        sheet.add(
            f"MSE of both currents, {name}", "A2", None, costs[name].mean(), why, repeats=0.02, independent=independent
        )
    for name in list(SLIPS)[1:]:
        change = costs[name].mean() / costs["aligned"].mean() - 1.0
        published = SLIPS[name][2] / SLIPS["aligned"][2] - 1.0
        sheet.add(f"change by: {name}", "1", None, change, WHY, repeats=0.2, independent=round(published, 3))
    straight = in_run(drive(0))
    table = drive(0).table()
    equal = {True}
    for order in (("filter", "control", "motor", "cycle"), ("control", "filter", "cycle", "motor")):
        listed = {name: table.components[name].model_dump(by_alias=True, exclude_unset=True) for name in order}
        again = drive(0, components=listed, connections=[str(line) for line in table.connections][::-1])
        equal.add(bool((in_run(again) == straight).all()))
    text = "the same to the bit" if equal == {True} else "differs"
    sheet.add("two other orders of listing", "1", None, text, ORDER)
    jacobi = in_run(drive(0, master__algorithm="jacobi"))
    ratio = jacobi[0] / straight[0]
    sheet.add("MSE of both currents, Jacobi over Gauss-Seidel, seed 0", "1", None, ratio, JACOBI, repeats=0.03)

    figure, axis = plt.subplots(figsize=(6, 3), layout="constrained")
    axis.boxplot(list(costs.values()))
    axis.set_xticks(
        range(1, len(costs) + 1),
        [name.replace(" one", "\none").replace(" what", "\nwhat") for name in costs],
        fontsize=8,
    )
    axis.set(ylabel="MSE of both currents [A2]")
    sheet.finish(figure)


def _slipped(seed: int, voltages: int, currents: int) -> float:
    """Cost with inputs that are so many samples late [A2]."""
    late = {"voltage_d": voltages, "voltage_q": voltages}
    late |= {"measured_current_d": currents, "measured_current_q": currents}
    reported = replay(seed).run(STATES[:2], late=late)[0]
    true = np.stack([recording(seed)[f"motor.{state}"] for state in STATES[:2]], axis=1)
    compared = true[: len(true) - currents]
    return float(np.mean((reported[currents:] - compared)[1:] ** 2, axis=0).sum())


if __name__ == "__main__":
    main()
