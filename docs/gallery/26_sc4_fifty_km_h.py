"""Scenario Sc4: soft acceleration to 50 km/h on soapy water, observer-based control: the command follows the slip, no sand."""

from __future__ import annotations

from sheet import Sheet
from shipped import run
from train_scenarios import DEPARTURE, NOT_PRINTED, SOURCE, figure, mean_speed_error, sanding_time, slide, yes

if __name__ == "__main__":
    sheet = Sheet(__file__, "Sc4: observer-based control, 50 km/h, soapy water", SOURCE)
    outcome = run("freight_sc4")
    found, t = slide(outcome), outcome["time"] - DEPARTURE
    command = outcome["controller.effort"]
    before, during = command[t < found.onset].max(), command[(t >= found.onset) & (t <= found.end)].min()
    sheet.add("onset of slip, after the departure", "s", "28 s, from an unknown origin", found.onset, NOT_PRINTED, repeats=0.05)
    sheet.add("largest slip", "%", None, 100.0 * found.largest, NOT_PRINTED, repeats=0.1)
    sheet.add("command reduced in slip", "", "yes", yes(bool(during < 0.7 * before)))
    sheet.add("sand requested", "", "no", yes(sanding_time(outcome) > 0.0))
    for name in ("multirate_cdo", "takagi_sugeno_cdo"):
        error = mean_speed_error(outcome, name)
        sheet.add(f"mean speed error, {name}", "km/h", None, error, "no speed error is printed for Sc4", repeats=0.05)
    sheet.finish(figure({"Sc4": outcome}))
