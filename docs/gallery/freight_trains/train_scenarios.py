"""What the scripts of the multi-vehicle train share: run a scenario of Table 4.4, measure its story, draw it.

Slips are relative to the wheel's speed, (4.14), with the true speed of the train, and counted above 10 km/h, where the
scenarios judge them.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import matplotlib.pyplot as plt
import numpy as np
from numpy.typing import NDArray
from shared.sheet import Sheet

from cosim import Outcome, Scenario

Array = NDArray[np.float64]
SOURCE = "Bouchama 2024, section 4.5, Table 4.4, Figures 4.18-4.37"
DEPARTURE, TARGET, EVALUATED_FROM, EXCESSIVE = 20.0, 850.0, 2.8, 0.15  # [s], [m], [m/s], [1]
WATER, EFFORT_LIMIT = (20.0, 250.0), 350e3  # [m], [N]
AXLES = range(1, 5)
OBSERVERS = ("multirate_cdo", "takagi_sugeno_cdo")
EFFORTS = {"command": "controller.effort", "let through": "anti_slip.effort", "adhesion": "train.adhesion_force"}
NOT_PRINTED = (
    "rail, gradient, departure, receiver, gains and thresholds are not printed, so ours: the story can agree, instants "
    "and "
    "percentages cannot"
)
SPEED_ERRORS = (
    "the receiver's noise, the observers' gains and the time over which the mean is taken are not printed; ours is "
    "from the "
    "departure to the stop, and the observers have to learn the coupler force anew at every change of the effort"
)


@dataclass(frozen=True)
class Slide:
    """Slip of the locomotive's axles.

    Args:
        largest: slip of the first axle [1]. axles: most axles beyond 15 % at once. together: time for which all four
        are [s].
        onset: first instant at which an axle is beyond 15 %, after the departure [s]; nan where none is. end: last one
        [s].
        lost: energy lost between wheels and rails [J].
    """

    largest: float
    axles: int
    together: float
    onset: float
    end: float
    lost: float


def connections_with(name: str, exchanged: Mapping[str, str]) -> list[str]:
    """The connections of a shipped scenario with other lines for some of them."""
    lines = [str(line) for line in Scenario.load(name).table().connections]
    return [exchanged.get(line, line) for line in lines]


def slide(outcome: Outcome) -> Slide:
    """How the axles slipped."""
    t, v = outcome["time"], outcome["train.speed"]
    wheels = np.array([outcome[f"train.axle_speed[{k}]"] for k in AXLES])
    forces = np.array([outcome[f"train.axle_creep_force[{k}]"] for k in AXLES])
    slips = _slip(wheels, v)
    beyond = (slips > EXCESSIVE).sum(axis=0)
    instants = t[beyond > 0] - DEPARTURE
    onset, end = (float(instants[0]), float(instants[-1])) if instants.size else (np.nan, np.nan)
    together = float(np.trapezoid(np.where(beyond == len(AXLES), 1.0, 0.0), t))
    lost = float(np.trapezoid((forces * (wheels - v)).sum(axis=0), t))
    return Slide(float(slips[0].max()), int(beyond.max()), together, onset, end, lost)


def mean_speed_error(outcome: Outcome, observer: str) -> float:
    """Mean magnitude of an observer's speed error from the departure to the stop [km/h]."""
    v = outcome["train.speed"]
    under_way = (outcome["time"] >= DEPARTURE) & (v > 0.0)
    return float(3.6 * np.abs(outcome[f"{observer}.speed"] - v)[under_way].mean())


def add_speed_errors(
    sheet: Sheet, outcome: Outcome, published: Sequence[float | None], why: str = SPEED_ERRORS
) -> None:
    """Lines of a sheet: the mean speed errors of both observers.

    Args:
        sheet: of the gallery. outcome: of the run. published: what the thesis prints, an observer each. why: the reason
        of a difference.
    """
    for name, printed in zip(OBSERVERS, published, strict=True):
        error = mean_speed_error(outcome, name)
        sheet.add(f"mean speed error, {name}", "km/h", printed, error, why, repeats=0.05)


def indicated(outcome: Outcome) -> tuple[float, float]:
    """When the excessive-slip indicator goes on, after the departure [s] (nan: never), and for how long it is on
    [s].
    """
    t, on = outcome["time"], outcome["excessive_slip.slip_indicator"] > 1.5
    return (float(t[on][0] - DEPARTURE) if on.any() else np.nan), float(np.trapezoid(on.astype(float), t))


def lowest_limit(outcome: Outcome) -> float:
    """Share of the locomotive's effort that the MDPE controller allows itself at least on the slippery rail [1]."""
    place, speed = outcome["train.position"], outcome["train.speed"]
    on_water = (place > WATER[0]) & (place < WATER[1]) & (speed > EVALUATED_FROM)
    return float(outcome["controller.effort_available"][on_water].min() / EFFORT_LIMIT)


def sanding_time(outcome: Outcome) -> float:
    """Time for which the anti-slip device or the controller ask for sand [s]."""
    asked = outcome["anti_slip.sanding_request"] > 0.5
    if "controller.sanding_request" in (outcome.result.table.dtype.names or ()):
        asked = asked | (outcome["controller.sanding_request"] > 0.5)
    return float(np.trapezoid(asked.astype(float), outcome["time"]))


def sanded(outcome: Outcome) -> str:
    """Whether sand was asked for, in words."""
    return yes(sanding_time(outcome) > 0.0)


def stopped(outcome: Outcome) -> tuple[float, float]:
    """Time from departure to stop [s], and place of the stop beyond the stopping point [m]."""
    moving = outcome["time"][outcome["train.speed"] > 0.0]
    return float(moving[-1] - DEPARTURE), float(outcome["train.position"][-1] - TARGET)


def instant(time: float) -> float | str:
    """An instant [s] for a table, in words where nothing happens."""
    return float(time) if np.isfinite(time) else "none beyond 15 %"


def yes(holds: bool) -> str:
    """Words for a table."""
    return "yes" if holds else "no"


def figure(outcomes: Mapping[str, Outcome]) -> plt.Figure:
    """Speeds, efforts, slips and speed errors of one or more runs, a column each."""
    drawn, axes = plt.subplots(
        4, len(outcomes), figsize=(8 * len(outcomes), 10), sharex=True, squeeze=False, layout="constrained"
    )
    for column, (title, outcome) in zip(axes.T, outcomes.items(), strict=True):
        column[0].set_title(title)
        _draw(column, outcome)
    return drawn


def _draw(column: Iterable[plt.Axes], outcome: Outcome) -> None:
    speeds, efforts, slips, errors = column
    t, v = outcome["time"] - DEPARTURE, outcome["train.speed"]
    speeds.plot(t, 3.6 * outcome["odometer.reading"], "0.7", lw=0.8, label="odometer")
    speeds.plot(t, 3.6 * outcome["mission.speed_reference"], "g--", lw=0.8, label="reference")
    speeds.plot(t, 3.6 * v, "k", label="train")
    for label, signal in EFFORTS.items():
        efforts.plot(t, outcome[signal] / 1e3, lw=0.8, label=label)
    for k in AXLES:
        slips.plot(t, 100.0 * _slip(outcome[f"train.axle_speed[{k}]"], v), lw=0.6, label=f"axle {k}")
    slips.plot(t, 15.0 * (outcome["excessive_slip.slip_indicator"] - 1.0), "r", label="indicator (15 %)")
    for name in OBSERVERS:
        errors.plot(t, 3.6 * (outcome[f"{name}.speed"] - v), lw=0.7, label=name)
    words = ("speed [km/h]", "effort [kN]", "slip [%]", "speed error [km/h]")
    for axis, text in zip((speeds, efforts, slips, errors), words, strict=True):
        axis.set_ylabel(text)
        axis.grid(alpha=0.3)
        axis.legend(fontsize=7, loc="upper right")
    speeds.set_ylim(-2.0, 80.0)
    errors.set_xlabel("time since the departure [s]")


def _slip(wheels: Array, speed: Array) -> Array:
    return np.where(speed > EVALUATED_FROM, (wheels - speed) / np.maximum(wheels, EVALUATED_FROM), 0.0)
