"""Sc2 against Sc3 on the same rail: what estimates save. Between them Sc2 with its way counted by the observer."""

from __future__ import annotations

from shared.sheet import Sheet
from shared.shipped import run
from train_scenarios import SOURCE, connections_with, figure, sanding_time, slide, stopped

COMPARED = (
    "the thesis compares the two in words; by the odometer's count the spinning wheels of Sc2 run ahead of the train"
)
BY_OBSERVER = {"odometer.distance -> mission.position": "multirate_cdo.position -> mission.position"}

if __name__ == "__main__":
    sheet = Sheet(__file__, "Sc2 against Sc3: the same rail without and with estimates", SOURCE)
    outcomes = {
        "Sc2": run("freight_sc2"),
        "Sc2, way by the observer": run("freight_sc2", {"connections": connections_with("freight_sc2", BY_OBSERVER)}),
        "Sc3": run("freight_sc3"),
    }
    for name, outcome in outcomes.items():
        found, (duration, beyond) = slide(outcome), stopped(outcome)
        rows = (
            ("energy lost in slip", "MJ", found.lost / 1e6, 0.05),
            ("largest slip", "%", 100.0 * found.largest, 0.1),
            ("all axles beyond 15 %", "s", found.together, 0.2),
            ("distance", "m", outcome["train.position"][-1], 0.02),
            ("stops beyond the stopping point by", "m", beyond, 0.1),
            ("duration of the journey", "s", duration, 0.02),
            ("sand requested for", "s", sanding_time(outcome), 0.3),
        )
        for quantity, unit, value, repeats in rows:
            sheet.add(f"{name}: {quantity}", unit, None, float(value), COMPARED, repeats=repeats)
    sheet.finish(figure(outcomes))
