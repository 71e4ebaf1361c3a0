"""Scenario Sc2: ADRC without estimates to 35 km/h on soapy water; four axles spin together, and the device sees little
of it.
"""

from __future__ import annotations

from shared.sheet import Sheet
from shared.shipped import run
from train_scenarios import (
    DEPARTURE,
    NOT_PRINTED,
    SOURCE,
    add_speed_errors,
    figure,
    indicated,
    sanding_time,
    slide,
    yes,
)

BURSTS = (
    "our rail is slippery from 20 m to 250 m; there the wheels spin and catch again in six bursts 5 s apart "
    "(published: two, 7 s "
    "apart), each for as long as the drive's rate of 68 kN/s needs to take the effort back"
)
SAND = (
    "asked for as the axles leave the slippery rail one by one; before, all four spin alike and the device is blind. A "
    "chance: over 10 draws of the rail's peak and of the odometer's phase it is asked for in 3 "
    "(docs/theses/multi_vehicle_train.md)"
)

if __name__ == "__main__":
    sheet = Sheet(__file__, "Sc2: ADRC, 35 km/h, soapy water", SOURCE)
    outcome = run("freight_sc2")
    found, (on, lasts) = slide(outcome), indicated(outcome)
    command, t = outcome["controller.effort"], outcome["time"] - DEPARTURE
    before, during = command[t < found.onset].max(), command[(t >= found.onset) & (t <= found.end)].max()
    sheet.add("axles that spin at once", "1", 4.0, float(found.axles))
    sheet.add("largest slip of the first axle", "%", 40.0, 100.0 * found.largest, BURSTS, repeats=0.05)
    sheet.add(
        "largest exceedance of 15 %, indicator",
        "points",
        25.0,
        100.0 * outcome["excessive_slip.exceedance"].max(),
        BURSTS,
        repeats=0.05,
    )
    sheet.add("indicator on, after the departure", "s", "44 s, from an unknown origin", on, NOT_PRINTED, repeats=0.05)
    sheet.add("indicator on for", "s", 15.0, lasts, BURSTS, repeats=0.05)
    sheet.add("sand requested for", "s", "requested", sanding_time(outcome), SAND, repeats=1.0)
    sheet.add("command goes on rising in slip", "", "yes", yes(bool(during > before)))
    add_speed_errors(sheet, outcome, (0.15, 0.33))
    sheet.finish(figure({"Sc2": outcome}))
