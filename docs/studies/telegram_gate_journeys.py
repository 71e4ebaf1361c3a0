"""The gate on journeys that no threshold saw: random trains, slopes, speeds, rails and layouts of balises.

``python docs/studies/telegram_gate_journeys.py`` prints the second table of docs/theses/telegram_gate.md, with
``--write`` it puts it there; that takes a quarter of an hour of CPU. What a telegram is asked, and what is counted, is
that of `telegram_gate`; only trains, lines and settings are others.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from page_tables import write_table
from telegram_gate import FAMILIES, OFFSETS, Recording, Telegram, accepted_false, beside, ignored_true, recorded

from cosim import Scenario
from fmu_observer import OBSERVERS
from fmu_observer.design.certified_gains import certified_gains

PAGE = Path(__file__).parents[1] / "theses" / "telegram_gate.md"
JOURNEYS = range(20)
SPACINGS = {20.0: 4e3, 100.0: 8e3, 300.0: 15e3, 1000.0: 40e3, 2000.0: 40e3}
"""Mean distance of the balises [m], and the way on which they lie [m]; each distance is 0.7 to 1.3 times that."""
STATED_OFFSETS = (3.0, 10.0, 30.0, 100.0, 300.0)  # [m], of the table
STEP, STOP = 0.1, 900.0  # [s]
STUDIED: Mapping[str, str | None] = {
    "odometer_reset": None,
    "balise_odometer_ekf": None,
    "balise_moving_horizon": None,
    "quasi_lpv_uio": None,
    "discrete_measurement_observer": None,
    "continuous_discrete_observer": None,
    "takagi_sugeno_cdo": "long_gaps",
    "augmented_takagi_sugeno_cdo": "odometer_trusted",
    "adaptive_wheel_radius": None,
    "adaptive_davis": None,
    "multirate_cdo": None,
    "discrete_uio": None,
    "adaptive_gain_cdo": None,
    "decaying_innovation_cdo": "balise_holes",
    "dynamic_gain_cdo": "balise_holes",
}
"""Observers with a gate, and their presets for balises far apart."""
UIO_GAINS = {
    "odometer_gain": [0.0, 0.61985, 0.0, 1.47044, 0.0, 1.7439],
    "balise_gain": [0.890843, 0.0, 0.019872, 0.0, 0.000222, 0.0],
}
"""Of the scenario `amsterdam_utrecht`, for an odometer at 5 Hz and balises every 45 s at most."""
LOST = 1e4  # an observer that is so far off has diverged [m]


@dataclass(frozen=True)
class Journey:
    """A train on its way.

    Args:
        recording: of the plant. train: its parameters, by the observers' names. wrong: mass and resistance as shares of
            the true ones that an observer with a wrong model believes. random: for the layouts.
    """

    recording: Recording
    train: Mapping[str, float]
    wrong: tuple[float, float]
    random: np.random.Generator


def draw_journey(seed: int) -> Journey:
    """A train of 60 to 2000 t at up to 15 to 45 m/s, slopes of up to 12 per mille every 0.5 to 2.5 km, six wet
    stretches, two stops, readings with noise of up to 0.05 m/s.
    """
    random = np.random.default_rng(seed)
    mass = float(np.exp(random.uniform(np.log(60e3), np.log(2000e3))))
    shares = random.uniform([0.01, 2e-4, 0.7e-5], [0.03, 1e-3, 2e-5])
    train = {"mass": mass} | {f"davis_{key}": mass * float(share) for key, share in zip("abc", shares, strict=True)}
    train |= {"wheel_radius": 0.46, "wheel_inertia": 180.0, "n_axles": float(max(round(mass / 17e3), 2))}
    top = random.uniform(15.0, 45.0)
    times, speeds = _profile(random, top)
    ends = np.cumsum(random.uniform(500.0, 2500.0, 32))
    slopes = np.clip(random.normal(0.0, 0.005, 32), -0.012, 0.012)
    wet = (np.arange(6) + random.uniform(0.0, 0.7, 6)) * 4e3
    made = Scenario(stop=STOP, step=STEP)
    made.add(
        "train",
        model="locomotive",
        options={"zones": "position", "zone_count": 6, "gradient_count": 32},
        parameters={**train, "adhesive_share": 0.7, "internal_step": 0.005, "train_position": 0.0, "train_speed": 0.0}
        | {"zone_from": wet.tolist(), "zone_to": (wet + random.uniform(200.0, 900.0, 6)).tolist()}
        | {"gradient_position": [0.0, *ends[:-1].tolist()], "gradient": [0.0, *slopes[1:].tolist()]},
    )
    gains = {"proportional_gain": 0.8 * mass, "integral_gain": 0.1 * mass, "holding_effort": 0.3 * mass}
    gains |= {"effort_limit": 0.7 * mass, "power_limit": 12.0 * mass}
    course = {"profile_time": times, "profile_speed": speeds}
    made.add("driver", model="driver", options={"profile_count": len(times)}, parameters=gains | course)
    noise = {"sample_period": STEP, "noise_std": float(random.uniform(0.0, 0.05)), "seed": seed}
    made.add("tachometer", model="odometer", parameters=noise)
    wrong = float(random.uniform(0.8, 1.2)), float(random.uniform(0.5, 1.5))
    return Journey(recorded(made), train, wrong, random)


def _profile(random: np.random.Generator, top: float) -> tuple[list[float], list[float]]:
    """Corners of the speed over time [s], [m/s]: eight speeds, held, with stops behind the third and the sixth."""
    times, speeds = [0.0], [0.0]
    for k, share in enumerate(random.uniform(0.3, 1.0, 8)):
        for target, hold in [(share * top, random.uniform(20.0, 90.0))] + [(0.0, random.uniform(30.0, 90.0))] * (
            k in (2, 5)
        ):
            ramp = abs(target - speeds[-1]) / random.uniform(0.2, 0.5)
            times += [times[-1] + max(ramp, 1.0), times[-1] + max(ramp, 1.0) + hold]
            speeds += [target, target]
    return [float(t) for t in times], [float(v) for v in speeds]


def lay(journey: Journey, spacing: float) -> tuple[np.ndarray, np.ndarray]:
    """When balises are passed [s], and where they lie [m]."""
    recording, reach = journey.recording, SPACINGS[spacing]
    count = int(reach / spacing * 1.5) + 2
    places = np.cumsum(spacing * journey.random.uniform(0.7, 1.3, count))
    places = places[places < min(reach, recording.position[-1] - 0.5)]
    moving = np.concatenate([[True], np.diff(recording.position) > 0.0])
    return np.interp(places, recording.position[moving], recording.t[moving]), places


def settings(name: str, journey: Journey, model: str, spacing: float, longest: float) -> dict[str, Any]:
    """Parameters and start values of an observer: those of the train, true or wrong, the rest its own but for gains
    that must fit the gaps: certified for the longest [s], or for the spacing [m].
    """
    system: Any = OBSERVERS[name]()
    known = {s.name for s in (*system.parameter_signals, *system.states)}
    mass, drag = journey.wrong if model == "wrong" else (1.0, 1.0)
    values: dict[str, Any] = {key: value * (mass if key == "mass" else drag) for key, value in journey.train.items()}
    values |= {key: journey.train[key] for key in ("wheel_radius", "wheel_inertia", "n_axles")}
    values |= {"odometer_period": STEP, "estimated_speed": 0.0, "odometer_speed": 0.0}
    if name in FAMILIES:
        found = certified_gains(
            longest,
            lambda theta: {FAMILIES[name]: min(theta, 8.0)},
            lambda gains: next(system.findings(longest, gains)),
        )
        values |= found or {}
    if name == "adaptive_gain_cdo":
        values |= {"theta_min": min(1.0 / longest, 0.25), "theta_max": min(4.0 / longest, 8.0), "ratio": 1.0}
        values |= {"expected_spacing": spacing, "assumed_spacing_error": 0.3}
    if name == "discrete_uio":
        values |= UIO_GAINS | {"odometer_period": 0.2, "linearisation_speed": 25.0}
    if name in ("discrete_measurement_observer", "continuous_discrete_observer"):
        values |= {"odometer_error": 2.0}  # creep on wet rail, as in the scenario
    return {key: value for key, value in values.items() if key in known}


def follow(name: str, journey: Journey, spacing: float, model: str, laid: tuple[np.ndarray, ...]) -> list[Telegram]:
    """All telegrams of one observer on one journey."""
    stamps, places = laid
    values = settings(name, journey, model, spacing, float(np.diff(stamps, prepend=0.0).max()))
    return beside(name, STUDIED[name], values, journey.recording, stamps, places, step=0.01)


def study(observers: Sequence[str], seeds: Sequence[int] = JOURNEYS) -> dict[Any, list[Telegram]]:
    """All telegrams, by observer, spacing and model."""
    found: dict[Any, list[Telegram]] = {}
    for seed in seeds:
        begin = time.process_time()
        journey = draw_journey(seed)
        layouts = {spacing: lay(journey, spacing) for spacing in SPACINGS}
        for name in observers:
            for spacing, laid in layouts.items():
                for model in ("true", "wrong"):
                    found.setdefault((name, spacing, model), []).extend(follow(name, journey, spacing, model, laid))
        print(
            f"journey {seed}: {journey.recording.position[-1]:.0f} m, {time.process_time() - begin:.0f} s",
            file=sys.stderr,
            flush=True,
        )
    return found


def table(results: Mapping[Any, list[Telegram]]) -> str:
    """Ignored true and used false telegrams as markdown [%]: with the true model, with a wrong one."""
    head = "| observer | spacing | telegrams | true ignored | " + " | ".join(f"+-{o:g} m" for o in STATED_OFFSETS)
    lines = [head + " |", "|" + "---|" * (4 + len(STATED_OFFSETS))]
    for name, spacing in dict.fromkeys(key[:2] for key in results):
        both = [results[name, spacing, model] for model in ("true", "wrong")]
        count = sum(t.settled for telegrams in both for t in telegrams)
        lost = any(not abs(t.innovation) < LOST for telegrams in both for t in telegrams)
        false = np.transpose([np.interp(STATED_OFFSETS, OFFSETS, accepted_false(telegrams)) for telegrams in both])
        cells = [_pair(shares) for shares in ([ignored_true(t) for t in both], *false)]
        reported = ["diverges"] * len(cells) if lost else cells
        lines.append(f"| `{name}` | {spacing:g} m | {count} | {' | '.join(reported)} |")
    return "\n".join(lines)


def _pair(shares: Sequence[float]) -> str:
    """Two shares in per cent."""
    first, second = (f"{100.0 * share:.2g}".replace("1e+02", "100") for share in shares)
    return first if first == second else f"{first}, {second}"


def main(arguments: Sequence[str]) -> None:
    """Print the table; with ``--write`` put it on the page."""
    made = table(study([a for a in arguments if not a.startswith("-")] or list(STUDIED)))
    print(made)
    if "--write" in arguments:
        write_table(PAGE, "journeys", made)


if __name__ == "__main__":
    main(sys.argv[1:])
