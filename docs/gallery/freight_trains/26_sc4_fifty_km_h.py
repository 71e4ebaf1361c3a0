"""Scenario Sc4: soft acceleration to 50 km/h on soapy water, observer-based control: the command follows the slip, no
sand.

The command is cut before the slip is excessive: docs/theses/multi_vehicle_train.md says in how many of 20 seeds an axle
passes 15 %.
"""

from __future__ import annotations

from shared.sheet import Sheet
from shared.shipped import run
from train_scenarios import NOT_PRINTED, SOURCE, add_speed_errors, figure, instant, lowest_limit, sanded, slide, yes

SEEDS = (
    "over 20 seeds of the receiver an axle passes 15 % in 1 (largest slip 11 to 17 %), and sand is asked for in none"
)

if __name__ == "__main__":
    sheet = Sheet(__file__, "Sc4: observer-based control, 50 km/h, soapy water", SOURCE)
    outcome = run("freight_sc4")
    found = slide(outcome)
    sheet.add(
        "onset of slip, after the departure",
        "s",
        "28 s, from an unknown origin",
        instant(found.onset),
        f"{NOT_PRINTED}; {SEEDS}",
        repeats=0.05,
    )
    sheet.add("largest slip", "%", None, 100.0 * found.largest, SEEDS, repeats=0.1)
    reason = "the lowest limit that the controller sets itself on the slippery rail, of 350 kN"
    sheet.add("effort limited to", "%", None, 100.0 * lowest_limit(outcome), reason, repeats=0.1)
    sheet.add("command reduced in slip", "", "yes", yes(lowest_limit(outcome) < 0.5))
    sheet.add("sand requested", "", "no", sanded(outcome))
    add_speed_errors(sheet, outcome, (None, None), "no speed error is printed for Sc4")
    sheet.finish(figure({"Sc4": outcome}))
