"""Scenario Sc1: soft acceleration to 35 km/h on clear water, with estimates; nothing slips."""

from __future__ import annotations

from shared.sheet import Sheet
from shared.shipped import run
from train_scenarios import (
    NOT_PRINTED,
    SOURCE,
    SPEED_ERRORS,
    figure,
    indicated,
    mean_speed_error,
    sanding_time,
    slide,
    yes,
)

if __name__ == "__main__":
    sheet = Sheet(__file__, "Sc1: observer-based control, 35 km/h, clear water", SOURCE)
    outcome = run("freight_sc1")
    sheet.add("excessive slip indicated", "", "no", yes(indicated(outcome)[1] > 0.0))
    sheet.add("sand requested", "", "no", yes(sanding_time(outcome) > 0.0))
    sheet.add("largest slip", "%", None, 100.0 * slide(outcome).largest, NOT_PRINTED, repeats=0.1)
    for name, published in (("multirate_cdo", 0.14), ("takagi_sugeno_cdo", 0.17)):
        sheet.add(
            f"mean speed error, {name}", "km/h", published, mean_speed_error(outcome, name), SPEED_ERRORS, repeats=0.05
        )
    sheet.finish(figure({"Sc1": outcome}))
