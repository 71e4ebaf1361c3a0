"""Scenario Sc1: soft acceleration to 35 km/h on clear water, with estimates; nothing slips."""

from __future__ import annotations

from shared.sheet import Sheet
from shared.shipped import run
from train_scenarios import NOT_PRINTED, SOURCE, add_speed_errors, figure, indicated, sanded, slide, yes

if __name__ == "__main__":
    sheet = Sheet(__file__, "Sc1: observer-based control, 35 km/h, clear water", SOURCE)
    outcome = run("freight_sc1")
    sheet.add("excessive slip indicated", "", "no", yes(indicated(outcome)[1] > 0.0))
    sheet.add("sand requested", "", "no", sanded(outcome))
    sheet.add("largest slip", "%", None, 100.0 * slide(outcome).largest, NOT_PRINTED, repeats=0.1)
    add_speed_errors(sheet, outcome, (0.14, 0.17))
    sheet.finish(figure({"Sc1": outcome}))
