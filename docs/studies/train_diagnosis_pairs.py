"""What the train's diagnosis tells of two faults at once, of sizes between the usual ones, and of a radar with coloured
noise: on journeys that no threshold saw, dry and wet.

``python docs/studies/train_diagnosis_pairs.py`` prints the tables of docs/train_diagnosis.md, with ``--write`` it puts
them there (a minute of CPU time).
"""

from __future__ import annotations

import re
import sys
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent))

from train_diagnosis_runs import PERIOD, Journey, balise_places, diagnosed, recorded, sensed
from turned_faults import Error

from fmu_observer.detection.train_diagnosis import TrainDiagnosis
from fmu_observer.detection.train_isolation import FAULTS
from fmu_observer.diagnosis.thresholds import alarm_rate, count_alarms

PAGE = Path(__file__).resolve().parents[1] / "train_diagnosis.md"
DRY = (Journey(33.0, 800.0, 0.4, 0.35, mass=1.01), Journey(48.0, 1150.0, 0.4, grade=0.0005))
WET = (
    Journey(33.0, 850.0, 0.35, rail=0.19, mass=1.01),
    Journey(42.0, 1050.0, 0.35, 0.45, rail=0.16, grade=-0.0005),
    Journey(52.0, 1250.0, 0.4, rail=0.24),
)
MEMBERS, SETTLED, WHEEL = 20, 50, 2.0
COLOUR, HUM = 2.0, 0.1  # [s] correlation, [m/s] deviation of what is added to the radar
Change = Callable[[dict[str, np.ndarray], slice], None]
Faults = dict[str, tuple[str, Error]]
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
)
SIZES = (
    ("odometer_1", 0.97), ("odometer_1", 0.96), ("odometer_1", 0.93), ("radar", 0.97), ("radar", 0.96), ("radar", 0.93),
    ("pressure_sensor", 0.87), ("pressure_sensor", 0.83),
)  # fmt: skip
NAMES = ["fault", "several_faults", *(f"{fault}_fault" for fault in FAULTS)]


def told(run: dict[str, np.ndarray], faults: Faults, settings: Mapping[str, float], seed: int) -> dict[str, np.ndarray]:
    """Outputs of the diagnosis where all faults act from a third of the journey on, shape (members, samples)."""
    read, places = sensed(run, MEMBERS, seed), balise_places(run)
    first = len(run["time"]) // 3
    error = np.zeros((MEMBERS, len(places)))
    for signal, off in faults.values():
        if signal:
            read[signal][:, first:] = off.gain * read[signal][:, first:] + off.offset
        else:
            error[:, np.flatnonzero(places > run["position"][first])[:1]] = off.offset
    found = diagnosed(run, read, settings, error, NAMES)
    return {name: rows[:, first - 1 :] for name, rows in found.items()}


def counted(runs: list[dict[str, np.ndarray]], faults: Faults, settings: Mapping[str, float], seed: int) -> list[str]:
    """Shares of the cases: detected, no single fault, each isolated, another isolated, as cells of a row."""
    outs = [told(run, faults, settings, seed + 100 * i) for i, run in enumerate(runs)]

    def share(of: Callable[[dict[str, np.ndarray]], np.ndarray]) -> str:
        return f"{100.0 * np.mean(np.concatenate([of(out) for out in outs])):.0f}"

    def isolated(out: dict[str, np.ndarray], fault: str) -> np.ndarray:
        return np.asarray((out[f"{fault}_fault"] >= WHEEL).any(axis=1))

    cells = [share(lambda out, n=name: (out[n] > 0.0).any(axis=1)) for name in NAMES[:2]]  # type: ignore[misc]
    cells.append(" / ".join(share(lambda out, f=fault: isolated(out, f)) for fault in faults))  # type: ignore[misc]
    others = [fault for fault in FAULTS if fault not in faults]
    cells.append(share(lambda out: np.any([isolated(out, fault) for fault in others], axis=0)))
    return cells


def fault_table(dry: list[dict[str, np.ndarray]], wet: list[dict[str, np.ndarray]]) -> str:
    """Pairs of faults, and sizes between, on both kinds of rails."""
    head = ("faults", "rails", "detected [%]", "no single fault [%]", "isolated, each [%]", "another isolated [%]")
    rows = [head, ("---",) * len(head)]
    wanted = [(" and ".join(pair), {fault: OFF[fault] for fault in pair}) for pair in PAIRS]
    wanted += [(f"{fault} reads {gain} of it", {fault: (OFF[fault][0], Error(gain))}) for fault, gain in SIZES]
    for title, faults in wanted:
        other = {fault: (signal, off.turned) for fault, (signal, off) in faults.items()}
        for rails, runs in (("dry", dry), ("wet", wet)):
            settings = TrainDiagnosis.presets["wet_rails" if rails == "wet" else "swept"]
            for sign, acting in (("", faults), (", turned", other)):
                rows.append((title.replace("_", " ") + sign, rails, *counted(runs, acting, settings, 7000)))
    return "\n".join(f"| {' | '.join(row)} |" for row in rows)


def free_table(dry: list[dict[str, np.ndarray]], wet: list[dict[str, np.ndarray]]) -> str:
    """Without a fault: detections and isolations an hour, with the radar's own noise and with coloured noise added."""
    head = ("radar", "rails, preset", "hours", "detected, an hour", "isolated, an hour", "of these")
    rows = [head, ("---",) * len(head)]
    for radar in ("own noise", f"and {HUM:g} m/s, correlated over {COLOUR:g} s"):
        for rails, runs, preset in (("dry", dry, "swept"), ("wet", wet, "wet_rails"), ("wet", wet, "swept")):
            detected = isolated = hours = 0.0
            which: dict[str, int] = {}
            for i, run in enumerate(runs):
                read = sensed(run, 2 * MEMBERS, 9000 + 100 * i)
                if radar != "own noise":
                    read["radar"] += hum(read["radar"].shape, 50 + i)
                out = {n: rows_[:, SETTLED:] for n, rows_ in diagnosed(
                    run, read, TrainDiagnosis.presets[preset], None, NAMES).items()}  # fmt: skip
                hours += out["fault"].size * PERIOD / 3600.0
                detected += sum(count_alarms(member > 0.0) for member in out["fault"])
                for fault in FAULTS:
                    alarms = sum(count_alarms(member >= WHEEL) for member in out[f"{fault}_fault"])
                    isolated += alarms
                    which |= {fault: which.get(fault, 0) + alarms} if alarms else {}
            rates = [alarm_rate(int(count), hours) for count in (detected, isolated)]
            cells = [f"{rate.rate:.2g} ({rate.low:.2g} to {rate.high:.2g})" for rate in rates]
            named = ", ".join(f"{fault.replace('_', ' ')} {count}" for fault, count in which.items()) or "-"
            rows.append((radar, f"{rails}, `{preset}`", f"{hours:.1f}", *cells, named))
    return "\n".join(f"| {' | '.join(row)} |" for row in rows)


def hum(shape: tuple[int, ...], seed: int) -> np.ndarray:
    """Noise of the first order [m/s], shape (members, samples)."""
    rng, kept = np.random.default_rng(seed), np.exp(-PERIOD / COLOUR)
    drawn = HUM * rng.standard_normal(shape)
    for k in range(1, shape[1]):
        drawn[:, k] = kept * drawn[:, k - 1] + np.sqrt(1.0 - kept * kept) * drawn[:, k]
    return drawn


def main() -> None:
    """Print the tables, or write them into the page."""
    dry, wet = ([recorded(journey) for journey in journeys] for journeys in (DRY, WET))
    tables = {"pairs": fault_table(dry, wet), "coloured": free_table(dry, wet)}
    for name, text in tables.items():
        print(text, end="\n\n")
        if "--write" in sys.argv:
            page = PAGE.read_text(encoding="utf-8")
            pattern = rf"(<!-- study: {name} -->\n\n).*?(\n\n<!-- end -->)"
            PAGE.write_text(re.sub(pattern, rf"\g<1>{text}\g<2>", page, flags=re.DOTALL), encoding="utf-8")


if __name__ == "__main__":
    main()
