"""The adhesion-condition detector: the maps of Table 4.5, its worked example, and the threshold that its rule amounts
to.
"""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np
from shared.runner import SystemRunner
from shared.sheet import Sheet

from fmu_observer.detection import AdhesionDetector, degraded_map, nominal_map, published_map

KMH = 1.0 / 3.6
SPEEDS = (5, 10, 20, 30, 40, 50)  # [km/h], of Table 4.5
GRID = (
    "the printed slips are multiples of 0.8 %, two of them cut off; ours is the continuous maximum of the same curves"
)
MIXED = (
    "the example sets a slip (3.49), relative to the odometer, against optima relative to the train speed; converted, "
    "35 % "
    "are 54 %. The verdict is the same at 35 %, but from 18 % on it is not"
)
CONDITIONS = {1.0: "nominal", 2.0: "degraded"}


def verdict(slip: float, definition: str, preset: str) -> str:
    """What the detector says at 5 km/h after 5 s of a slip."""
    runner = SystemRunner(AdhesionDetector(definition), preset)  # type: ignore[arg-type]
    runner.set("u", speed=5.0 * KMH, slip=slip)
    runner.runtime.start(0.0)
    runner.runtime.advance(5.0)
    return CONDITIONS[runner.outputs()["condition"]]


def main() -> None:
    """Optimal slips, example, and the map."""
    sheet = Sheet(__file__, "Adhesion-condition detector", "Bouchama 2024, (4.16)-(4.17), Table 4.5")
    figure, axis = plt.subplots(figsize=(7, 4.5), layout="constrained")
    for name, ours, table, colour in (
        ("nominal", nominal_map(), published_map(False), "tab:blue"),
        ("degraded", degraded_map(), published_map(True), "tab:orange"),
    ):
        kmh, slips = np.array(ours.speeds) / KMH, 100.0 * np.array(ours.slips)
        for speed in SPEEDS:
            at = int(np.argmin(np.abs(kmh - speed)))
            sheet.add(f"optimal slip, {name}, {speed} km/h", "%", 100.0 * table.slips[at], slips[at], GRID)
        shown = (kmh >= 5.0) & (kmh <= 60.0)
        axis.plot(kmh[shown], slips[shown], color=colour, label=f"optimum, {name}")
        at = [int(np.argmin(np.abs(kmh - speed))) for speed in SPEEDS]
        axis.plot(SPEEDS, [100.0 * table.slips[i] for i in at], "x", color=colour, label=f"Table 4.5, {name}")
    printed = [100.0 * abs(published_map(low).slips[4] - 0.35) for low in (False, True)]
    for name, published, distance in zip(("nominal", "degraded"), (25.0, 4.6), printed, strict=True):
        sheet.add(f"example, 5 km/h, slip 35 %: distance to the {name} optimum", "%", published, distance)
    sheet.add("example, 5 km/h, slip 35 %, as printed", "", "degraded", verdict(0.35, "speed", "as_published"))
    sheet.add(
        "the same, slip relative to the odometer and converted", "", "degraded", verdict(0.35, "odometer", "polach")
    )
    sheet.add("5 km/h, slip 18 %, as printed", "", None, verdict(0.18, "speed", "as_published"), MIXED)
    sheet.add(
        "5 km/h, slip 18 %, relative to the odometer and converted",
        "",
        None,
        verdict(0.18, "odometer", "polach"),
        MIXED,
    )
    kmh, middle = (
        np.array(nominal_map().speeds) / KMH,
        np.array(nominal_map().slips) + np.array(degraded_map().slips) - 0.01,
    )
    axis.plot(kmh[4:16], 50.0 * middle[4:16], "k--", label="threshold of the rule")
    axis.set(xlabel="speed [km/h]", ylabel="slip relative to the train speed [%]")
    sheet.finish(figure, axis)


if __name__ == "__main__":
    main()
