"""The train's diagnosis with two faults at once, with sizes between the usual ones, and with a radar of coloured noise:
on journeys from which no threshold came, dry and wet.

``python docs/studies/train_diagnosis_pairs.py`` prints the tables of docs/theses/train_diagnosis.md, with ``--write``
it puts them there (five minutes of CPU time).
"""

from __future__ import annotations

import itertools
import sys
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent))

from page_tables import print_tables
from train_diagnosis import PER_HOUR, SHARED, residual_recordings
from train_diagnosis_runs import INSIDE, PERIOD, Journey, balise_places, diagnosed, recorded, sensed
from turned_faults import Error

from fmu_observer.detection.train_diagnosis import TrainDiagnosis
from fmu_observer.detection.train_isolation import FAULTS
from fmu_observer.formulas.diagnosis.thresholds import alarm_rate, count_alarms, rate_threshold

PAGE = Path(__file__).resolve().parents[1] / "theses" / "train_diagnosis.md"
DRY = (Journey(33.0, 800.0, 0.4, 0.35, mass=1.01), Journey(48.0, 1150.0, 0.4, grade=0.0005))
WET = (
    Journey(33.0, 850.0, 0.35, rail=0.19, mass=1.01),
    Journey(42.0, 1050.0, 0.35, 0.45, rail=0.16, grade=-0.0005),
    Journey(52.0, 1250.0, 0.4, rail=0.24),
)
MEMBERS, SETTLED, WHEEL = 20, 50, 2.0
COLOURS, HUM = (0.1, 1.0, 10.0), 0.1  # [s] correlation, [m/s] deviation of what is added to the radar
INSIDE_SEEDS = 60

Faults = dict[str, tuple[str, Error]]
Runs = list[dict[str, np.ndarray]]
OFF: Faults = {  # by fault: input of the diagnosis, what becomes of it; of a balise its offset
    "odometer_1": ("odometer_1", Error(0.9)),
    "odometer_2": ("odometer_2", Error(0.9)),
    "radar": ("radar", Error(0.95)),
    "gps": ("gps_position", Error(offset=6.0)),
    "pressure_sensor": ("cylinder_pressure", Error(0.8)),
    "balise": ("", Error(offset=6.0)),
}
PAIRS = (
    ("odometer_1", "pressure_sensor"),
    ("radar", "pressure_sensor"),
    ("gps", "pressure_sensor"),
    ("radar", "balise"),
    ("odometer_1", "balise"),
    ("odometer_1", "odometer_2"),
    ("odometer_1", "gps"),
    ("odometer_1", "radar"),
    ("radar", "gps"),
    ("gps", "balise"),
)
SLOWED = ("odometer_1", "odometer_2")  # both read too little, while the train brakes
SIZES = (
    ("odometer_1", 0.97), ("odometer_1", 0.96), ("odometer_1", 0.93), ("radar", 0.97), ("radar", 0.96), ("radar", 0.93),
    ("pressure_sensor", 0.87), ("pressure_sensor", 0.83),
)  # fmt: skip
NAMES = ["fault", "several_faults", *(f"{fault}_fault" for fault in FAULTS)]


def reported(
    run: dict[str, np.ndarray],
    faults: Faults,
    settings: Mapping[str, float],
    seed: int,
    first: int,
    colour: float | None,
) -> dict[str, np.ndarray]:
    """Outputs of the diagnosis where all faults act from a sample on, shape (members, samples)."""
    read, places = humming(sensed(run, MEMBERS, seed), colour, seed), balise_places(run)
    error = np.zeros((MEMBERS, len(places)))
    for signal, off in faults.values():
        if signal:
            read[signal][:, first:] = off.gain * read[signal][:, first:] + off.offset
        else:
            error[:, np.flatnonzero(places > run["position"][first])[:1]] = off.offset
    found = diagnosed(run, read, settings, error, NAMES)
    return {name: rows[:, first - 1 :] for name, rows in found.items()}


def both_ways(faults: Faults) -> list[Faults]:
    """The faults with each combination of their signs."""
    turned = {fault: (signal, off.turned) for fault, (signal, off) in faults.items()}
    ways = itertools.product(*((faults[fault], turned[fault]) for fault in faults))
    return [dict(zip(faults, way, strict=True)) for way in ways]


def counted(
    runs: list[dict[str, np.ndarray]],
    signed: list[Faults],
    settings: Mapping[str, float],
    seed: int,
    brakes: bool,
    colour: float | None = None,
) -> list[str]:
    """Shares of the cases: detected, no single fault, each isolated, another isolated, as cells of a row."""
    onsets = [_brake(run) if brakes else len(run["time"]) // 3 for run in runs]
    faults = signed[0]
    outs = [
        reported(run, way, settings, seed + 100 * i, first, colour)
        for way in signed
        for i, (run, first) in enumerate(zip(runs, onsets, strict=True))
    ]

    def share(of: Callable[[dict[str, np.ndarray]], np.ndarray]) -> str:
        return f"{100.0 * np.mean(np.concatenate([of(out) for out in outs])):.0f}"

    def isolated(out: dict[str, np.ndarray], fault: str) -> np.ndarray:
        return np.asarray((out[f"{fault}_fault"] >= WHEEL).any(axis=1))

    cells = [share(lambda out, n=name: (out[n] > 0.0).any(axis=1)) for name in NAMES[:2]]  # type: ignore[misc]
    cells.append(" / ".join(share(lambda out, f=fault: isolated(out, f)) for fault in faults))  # type: ignore[misc]
    others = [fault for fault in FAULTS if fault not in faults]
    cells.append(share(lambda out: np.any([isolated(out, fault) for fault in others], axis=0)))
    return cells


def _brake(run: dict[str, np.ndarray]) -> int:
    """Sample from which on the last brake acts, by which the train comes to a stop."""
    return int(np.flatnonzero((run["effort"] > -20e3) & (run["demand"] < 0.2) & (run["speed"] > 3.0))[-1]) + 20


def fault_table(dry: list[dict[str, np.ndarray]], wet: list[dict[str, np.ndarray]]) -> str:
    """Pairs of faults, and sizes between, on both kinds of rails."""
    head = ("faults", "rails", "detected [%]", "no single fault [%]", "isolated, each [%]", "another isolated [%]")
    rows = [head, ("---",) * len(head)]
    wanted = [(" and ".join(pair), both_ways({fault: OFF[fault] for fault in pair})) for pair in PAIRS]
    wanted += [("both odometers too little in a brake", [{fault: OFF[fault] for fault in SLOWED}])]
    for fault, gain in SIZES:
        wanted.append(
            (f"{fault} reads {gain} or {2 - gain:.2f} of it", both_ways({fault: (OFF[fault][0], Error(gain))}))
        )
    for title, signed in wanted:
        for rails, runs in (("dry", dry), ("wet", wet)):
            settings = TrainDiagnosis.presets["wet_rails" if rails == "wet" else "swept"]
            found = counted(runs, signed, settings, 7000, "brake" in title)
            rows.append((title.replace("_", " "), rails, *found))
    return "\n".join(f"| {' | '.join(row)} |" for row in rows)


def free_table(dry: Runs, wet: Runs, inside: Runs) -> str:
    """Without a fault: detections and isolations an hour, with the radar's own noise and with coloured noise added; and
    what is left of them, and of a radar that is off, with thresholds that were made with such a radar."""
    head = ("radar", "rails, thresholds", "hours", "detected, an hour", "isolated, an hour", "of these")
    rows = [(*head, "a radar off by a tenth: detected / isolated [%]"), ("---",) * (len(head) + 1)]
    swept, creeping = (TrainDiagnosis.presets[preset] for preset in ("swept", "wet_rails"))
    for colour in (None, *COLOURS):
        radar = "own noise" if colour is None else f"and {HUM:g} m/s, correlated over {colour:g} s"
        sets = [("dry, `swept`", dry, swept), ("wet, `wet_rails`", wet, creeping)]
        if colour is not None:
            made = asked_for(inside, colour)
            said = ", ".join(f"`{name}` {value:g}" for name, value in made.items())
            sets.append((f"dry, {said}", dry, made))
        for title, runs, settings in sets:
            off = counted(runs, both_ways({"radar": ("radar", Error(0.9))}), settings, 7000, False, colour)
            rows.append((radar, title, *alarms(runs, settings, colour), f"{off[0]} / {off[2]}"))
    return "\n".join(f"| {' | '.join(row)} |" for row in rows)


def alarms(runs: Runs, settings: Mapping[str, float], colour: float | None) -> list[str]:
    """Hours without a fault, detections and isolations an hour, and which faults were isolated, as cells of a row."""
    detected = isolated = hours = 0.0
    which: dict[str, int] = {}
    for i, run in enumerate(runs):
        read = humming(sensed(run, 2 * MEMBERS, 9000 + 100 * i), colour, 50 + i)
        out = {n: rows[:, SETTLED:] for n, rows in diagnosed(run, read, settings, None, NAMES).items()}
        hours += out["fault"].size * PERIOD / 3600.0
        detected += sum(count_alarms(member > 0.0) for member in out["fault"])
        for fault in FAULTS:
            found = sum(count_alarms(member >= WHEEL) for member in out[f"{fault}_fault"])
            isolated += found
            which |= {fault: which.get(fault, 0) + found} if found else {}
    rates = [alarm_rate(int(count), hours) for count in (detected, isolated)]
    cells = [f"{rate.rate:.2g} ({rate.low:.2g} to {rate.high:.2g})" for rate in rates]
    named = ", ".join(f"{fault.replace('_', ' ')} {count}" for fault, count in which.items()) or "-"
    return [f"{hours:.1f}", *cells, named]


def asked_for(inside: Runs, colour: float) -> dict[str, float]:
    """Thresholds that such a radar asks for where they are above those in use, on the journeys they are made of."""
    system = TrainDiagnosis()
    p = system.unpack_parameters(system.start_parameters())
    reads = [humming(sensed(run, INSIDE_SEEDS, 100 + i), colour, 150 + i) for i, run in enumerate(inside)]
    outs = [diagnosed(run, read) for run, read in zip(inside, reads, strict=True)]
    asked = {
        name: float(getattr(p, name)) * rate_threshold(residual_recordings(outs, name), PERIOD, PER_HOUR)
        for name in SHARED
    }
    return {name: float(f"{1.05 * value:.2g}") for name, value in asked.items() if value > float(getattr(p, name))}


def humming(read: dict[str, np.ndarray], colour: float | None, seed: int) -> dict[str, np.ndarray]:
    """Readings with noise of the first order, correlated over `colour` [s], added to the radar."""
    if colour is None:
        return read
    rng, kept = np.random.default_rng(seed), np.exp(-PERIOD / colour)
    drawn = HUM * rng.standard_normal(read["radar"].shape)
    for k in range(1, drawn.shape[1]):
        drawn[:, k] = kept * drawn[:, k - 1] + np.sqrt(1.0 - kept * kept) * drawn[:, k]
    return {**read, "radar": read["radar"] + drawn}


def main() -> None:
    """Print the tables, or write them into the page."""
    dry, wet, inside = ([recorded(journey) for journey in journeys] for journeys in (DRY, WET, INSIDE))
    print_tables(PAGE, {"coloured": free_table(dry, wet, inside), "pairs": fault_table(dry, wet)})


if __name__ == "__main__":
    main()
