"""Which parts of the stories of Sc1 to Sc4 come out, over seeds of the receiver and over rails that are not printed.

``python docs/studies/stories.py`` prints the tables of docs/theses/multi_vehicle_train.md (15 minutes on two cores).
Three studies:

- ``theta``: the observers' gain is chosen on Sc1 with seeds that no other table here uses;
- ``receiver``: the shipped scenarios with 20 seeds of the receiver, the only noise in them (`10_hz` has an odometer
  without any);
- ``rails``: Sc2, whose loop hears no receiver, with seeds, rails and the phase of the odometer drawn together, within
  what the page says is usual.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from cosim import Outcome, Scenario

sys.path.insert(0, str(Path(__file__).parents[1] / "gallery" / "freight_trains"))
from train_scenarios import DEPARTURE, indicated, lowest_limit, mean_speed_error, sanding_time, slide, stopped

SCENARIOS = ("freight_sc1", "freight_sc2", "freight_sc3", "freight_sc4")
OBSERVERS = ("multirate_cdo", "takagi_sugeno_cdo")
CHOSEN_ON, EVALUATED_ON = range(100, 110), range(20)  # seeds of the receiver
DRAWN = range(10)  # seeds of the rails
THETAS = (0.5, 0.7, 1.0, 1.5, 2.0, 3.0)  # [1/s]
FIX_GAINS = (4.55, 7.125, 4.55, 1.0)  # of the Takagi-Sugeno observer, poles -0.5, -0.8, -1.25, -2, for theta = 1
SOAPY = (0.0747, 0.1329)  # mu0 of Polach for peaks of 0.05 and 0.08 at 35 km/h
PHASES = (0.0, 0.02, 0.04, 0.06, 0.08)  # [s] of the odometer against the departure, by communication steps
WORKERS = 2

Numbers = Mapping[str, float]
Settings = Mapping[str, Any]


def story(outcome: Outcome) -> dict[str, float]:
    """The parts of a story; what is counted is 0 or 1, slips and shares are in %, times in s, errors in km/h."""
    found, (_, lasts) = slide(outcome), indicated(outcome)
    columns = outcome.result.table.dtype.names or ()
    numbers = {
        "largest slip of the first axle [%]": 100.0 * found.largest,
        "an axle beyond 15 %": float(found.axles > 0),
        "all axles beyond 15 % at once": float(found.axles == 4),
        "all axles beyond 15 % [s]": found.together,
        "indicator on": float(lasts > 0.0),
        "indicator on [s]": lasts,
        "sand": float(sanding_time(outcome) > 0.0),
        "sand [s]": sanding_time(outcome),
        "command rises in slip": float(_rises(outcome, found.onset, found.end)),
        "stops beyond the stopping point [m]": stopped(outcome)[1],
    }
    if "controller.effort_available" in columns:
        lowest = lowest_limit(outcome)
        numbers["lowest limit of the effort [% of 350 kN]"] = 100.0 * lowest
        numbers["effort limited to less than half"] = float(lowest < 0.5)
    return numbers | {f"mean speed error, {name} [km/h]": mean_speed_error(outcome, name) for name in OBSERVERS}


def receivers(seeds: Sequence[int]) -> list[Settings]:
    """Variations of the seed, of which only the receiver draws."""
    return [{"seed": seed} for seed in seeds]


def rails(seeds: Sequence[int]) -> list[Settings]:
    """Variations of the receiver, of the soapy rail's peak and of the phase of the odometer."""
    drawn = []
    for seed in seeds:
        numbers = np.random.default_rng(seed)
        peak, phase = float(numbers.uniform(*SOAPY)), float(numbers.choice(PHASES))
        drawn.append({"seed": seed, "odometer.sample_offset": phase, "train.polach_degraded_mu0": peak})
    return drawn


def beside(thetas: Sequence[float]) -> Scenario:
    """Sc1 with both observers at every theta beside its own: all see the same journey, which the shipped one drives."""
    scenario = Scenario.load("freight_sc1").set("certificates", "ignore")
    for i, theta in enumerate(thetas):
        fixes = [gain * theta ** (k + 1) for k, gain in enumerate(FIX_GAINS)]
        for name, family, gains in (
            (OBSERVERS[0], "augmented_high_gain_cdo", {"theta_gps": theta}),
            (OBSERVERS[1], "augmented_takagi_sugeno_cdo", {"gps_gain": fixes, "gps_decay": fixes[0]}),
        ):
            known = {"n_axles": 4.0, "estimated_speed": 0.0, **gains}
            scenario.add(f"{name}_{i}", observer=family, preset="gps", options={"fixes": "sampled"}, parameters=known)
            scenario.connect(
                f"odometer.reading -> {name}_{i}.odometer",
                f"receiver.reading -> {name}_{i}.fix_position",
                f"train.rim_effort -> {name}_{i}.effort",
            )
    return scenario


def study(name: str, variations: Sequence[Settings]) -> list[Numbers]:
    """The stories of one scenario, in order of its variations.

    Raises:
        RuntimeError: a run failed.
    """
    reported: dict[int, Numbers] = {}
    for run in Scenario.load(name).set("certificates", "ignore").vary(variations).each(WORKERS):
        if run.outcome is None or run.failure is not None:
            raise RuntimeError(f"{name}, {run.settings}: {run.failure}")
        reported[run.number] = story(run.outcome)
    return [reported[number] for number in sorted(reported)]


def table(stories: Mapping[str, Sequence[Numbers]]) -> str:
    """Scenarios side by side as markdown: how often a part comes out, or the median of a number and its ends."""
    quantities = list(dict.fromkeys(key for found in stories.values() for numbers in found for key in numbers))
    lines = ["| | " + " | ".join(stories) + " |", "|" + "---|" * (1 + len(stories))]
    for quantity in quantities:
        cells = [_cell(quantity, [n[quantity] for n in found if quantity in n]) for found in stories.values()]
        lines.append(f"| {quantity} | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def choice(thetas: Sequence[float] = THETAS, seeds: Sequence[int] = CHOSEN_ON) -> dict[tuple[str, float], list[float]]:
    """Mean speed errors in Sc1 [km/h] by observer and theta, one for each seed."""
    errors: dict[tuple[str, float], list[float]] = {(name, theta): [] for name in OBSERVERS for theta in thetas}
    for run in beside(thetas).vary(receivers(seeds)).each(WORKERS):
        if run.outcome is None or run.failure is not None:
            raise RuntimeError(f"{run.settings}: {run.failure}")
        for (name, theta), found in errors.items():
            found.append(mean_speed_error(run.outcome, f"{name}_{thetas.index(theta)}"))
    return errors


def choice_table(errors: Mapping[tuple[str, float], Sequence[float]]) -> str:
    """Medians of the mean speed errors by theta as markdown."""
    thetas = list(dict.fromkeys(theta for _, theta in errors))
    lines = ["| theta [1/s] | " + " | ".join(f"{theta:g}" for theta in thetas) + " |", "|---" * (1 + len(thetas)) + "|"]
    lines += [
        f"| {name} | " + " | ".join(f"{np.median(errors[name, theta]):.3f}" for theta in thetas) + " |"
        for name in OBSERVERS
    ]
    return "\n".join(lines)


def _cell(quantity: str, numbers: Sequence[float]) -> str:
    if not numbers:
        return ""
    if not quantity.endswith("]"):
        return f"{sum(numbers):.0f} of {len(numbers)}"
    low, middle, high = np.percentile(numbers, (0.0, 50.0, 100.0))
    return f"{middle:.3g}" if high - low <= 0.005 * abs(middle) else f"{middle:.3g} ({low:.3g} to {high:.3g})"


def _rises(outcome: Outcome, onset: float, end: float) -> bool:
    """Whether the command goes beyond what it was when the first axle went beyond 15 %."""
    t, command = outcome["time"] - DEPARTURE, outcome["controller.effort"]
    return bool(np.isfinite(onset) and command[(t >= onset) & (t <= end)].max() > command[t < onset].max())


def main(chosen: Sequence[str]) -> None:
    """Print the tables."""
    if "theta" in chosen:
        print(f"Median over {len(CHOSEN_ON)} seeds of the mean speed error in Sc1 [km/h]\n\n{choice_table(choice())}\n")
    if "receiver" in chosen:
        print(table({name: study(name, receivers(EVALUATED_ON)) for name in SCENARIOS}), "\n")
    if "rails" in chosen:
        print(table({"freight_sc2": study("freight_sc2", rails(DRAWN))}), "\n")


if __name__ == "__main__":
    main(sys.argv[1:] or ("theta", "receiver", "rails"))
