"""What jams and skids do to a counted distance between balises: Figures 2-9 to 2-14."""

from __future__ import annotations

from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from shared.sheet import Sheet

import cosim

SPEED = 20.0  # [m/s]; ours
LOSS = (
    "Figs. 2-9 and 2-11 show about 5 m lost in 200 m of jams and about 15 m won by a skid, and print neither lengths "
    "nor depths: those here are ours; the independent number is v T d"
)
IMPLIED = "how long a wheel is locked in all, if full jams at the mean speed between those balises make the 5 m"
SHARE = "S09 of the figures in words: v (1 - T / Dt), up to one pulse of the window"
MICRO = "the thesis says that micro-jams give a slow bias, and no number"


def run(cause: str = "stated", **faults: Any) -> Any:
    """A wheel at constant speed beside balises every 200 m, with an odometer that is integrated and reset there."""
    s = cosim.Scenario(stop=40.0, step=0.05, certificates="ignore")
    train = {"train_speed": SPEED, "davis_a": 0.0, "davis_b": 0.0, "davis_c": 0.0}
    stated = {name: values + [0.0] * (4 - len(values)) for name, values in faults.items() if isinstance(values, list)}
    kinds = {"fault_kind": [k or -1.0 for k in stated["fault_kind"]]} if "fault_kind" in stated else {}
    s.add("train", model="longitudinal_train", parameters=train)
    s.add("wheel", model="wheel_fault", options={"cause": cause}, parameters={**faults, **stated, **kinds})
    s.add("odometer", model="pulse_odometer", options={"count_from": "wheel_distance"})
    s.add("reset", observer="odometer_reset")
    s.connect("train.wheel_speed -> wheel.speed", "wheel.wheel_speed -> odometer.wheel_speed")
    s.connect("wheel.wheel_distance -> odometer.wheel_distance", "odometer.reading -> reset.odometer")
    s.balises(position="train.position", speed="train.speed", layout="spacing", spacing=200.0, track_end=800.0)
    outcome = s.run(warn=lambda _: None)
    assert outcome.failure is None, outcome.failure
    return outcome


def before_balise(outcome: Any, place: float) -> float:
    """Error of the integrated odometer when the train comes to a balise [m]."""
    row = int(np.searchsorted(outcome["train.position"], place - 1e-6))  # the first row there is that before the event
    return float((outcome["reset.position"] - outcome["train.position"])[row])


def main() -> None:
    """Errors at balises under jams and a skid, the reading of one window, and micro-jams."""
    sheet = Sheet(__file__, "Jams, skids and what the odometer makes of them", "Aguiar Cota 2019, Figs. 2-9 to 2-14")
    jams = run(fault_onset=[5.0, 15.0, 25.0, 35.0], fault_length=[0.25] * 4)
    skid = run(fault_onset=[15.0], fault_length=[1.5], fault_depth=[0.5], fault_kind=[1.0])
    micro = run("drawn", effort=-1.0, jam_rate=2.0, mean_length=0.02, least_depth=1.0, seed=1)
    lost, won = -before_balise(jams, 400.0), before_balise(skid, 400.0)
    sheet.add("position lost to a jam of 0.25 s", "m", None, lost, LOSS, independent=0.25 * SPEED)
    sheet.add("position won by a skid of 1.5 s and depth 0.5", "m", None, won, LOSS, independent=0.75 * SPEED)
    sheet.add("jam time behind Fig. 2-9, balises at 98 and 107 s", "s", None, 5.0 / (200.0 / (107.0 - 98.0)), IMPLIED)
    window = run(fault_onset=[15.02], fault_length=[0.04])  # 20 % of a window of 0.2 s
    row = int(np.searchsorted(window["time"], 15.21))
    expected = SPEED * (1.0 - 0.2)
    reading = float(window["odometer.reading"][row])
    sheet.add("reading over a window with 20 % of jam", "m/s", None, reading, SHARE, independent=expected)
    sheet.add(
        "lost to drawn micro-jams, 20 ms in the mean, two a second, in 200 m",
        "m",
        None,
        -before_balise(micro, 400.0),
        MICRO,
    )
    figure, (left, right) = plt.subplots(1, 2, figsize=(9, 4), layout="constrained")
    for label, outcome in {"four jams": jams, "a skid": skid, "micro-jams": micro}.items():
        left.plot(outcome["time"], outcome["reset.position"] - outcome["train.position"], label=label)
    left.set(xlabel="time [s]", ylabel="position error, reset at balises [m]")
    for label, outcome in {"a jam of 0.25 s": jams, "a skid of 0.5": skid, "micro-jams": micro}.items():
        near = (outcome["time"] > 14.0) & (outcome["time"] < 17.5)
        right.step(outcome["time"][near], outcome["odometer.reading"][near], where="post", label=label)
    right.set(xlabel="time [s]", ylabel="reading of the odometer [m/s]")
    sheet.finish(figure, left, right)


if __name__ == "__main__":
    main()
