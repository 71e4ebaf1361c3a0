"""Thresholds, false alarms and detections of the train's diagnosis, and which faults which sensors distinguish.

``python docs/studies/train_diagnosis.py`` prints the tables of docs/theses/train_diagnosis.md, with ``--write`` it
writes them (four minutes). Thresholds come from fault-free journeys, a stated rate of false alarms each; false alarms
and faults are then counted on other journeys, rails, loads and seeds.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent))

from page_tables import print_tables
from train_diagnosis_runs import (
    INSIDE,
    OUTSIDE,
    PERIOD,
    WET_INSIDE,
    WET_OUTSIDE,
    Journey,
    balise_places,
    diagnosed,
    recorded,
    sensed,
)
from turned_faults import NONE, Error

from fmu_observer.detection.train_diagnosis import TrainDiagnosis
from fmu_observer.detection.train_isolation import FAULTS
from fmu_observer.formulas.diagnosis.thresholds import (
    alarm_rate,
    checked,
    clopper_pearson,
    count_alarms,
    rate_threshold,
)

PAGE = Path(__file__).resolve().parents[1] / "theses" / "train_diagnosis.md"
PER_HOUR = 0.05  # alarms that each residual may raise [1/h]
SEEDS, FAULTY = 120, 20
WET_SEEDS = 60
SETTLED = 50  # samples left out at the start
WHEEL = 2.0  # smallest code of an isolated fault
CODES = ["several_faults", *(f"{fault}_fault" for fault in FAULTS)]
IN_SAMPLE = "in sample"
SHARED = {
    "threshold_wheels": ("odometers",),
    "threshold_radar": ("odometer_1_radar", "odometer_2_radar"),
    "threshold_gps": ("odometer_1_gps", "odometer_2_gps", "radar_gps"),
    "threshold_position": ("gps_position",),
    "balise_floor": ("way_1", "way_2", "way_radar"),
    "threshold_pressure": ("pressure",),
    "threshold_traction": ("traction",),
    "threshold_brake": ("brake_measured", "brake_demanded"),
}
PERSISTENT = ("threshold_wheels", "threshold_radar", "threshold_gps", "threshold_position", "threshold_pressure")
Runs = list[dict[str, np.ndarray]]
Settings = Mapping[str, float]
WET: Settings = TrainDiagnosis.presets["wet_rails"]


def fault_free(runs: Runs, seeds: int, seed: int, settings: Settings | None = None) -> list[dict[str, np.ndarray]]:
    """Outputs of the diagnosis on fault-free journeys, one for each."""
    return [diagnosed(run, sensed(run, seeds, seed + i), settings) for i, run in enumerate(runs)]


def lasting(values: np.ndarray, samples: int) -> np.ndarray:
    """Smallest of so many values in a row: what an alarm with that persistence compares, shape (members, k)."""
    out = values.copy()
    for back in range(1, samples):
        out[:, back:] = np.minimum(out[:, back:], values[:, :-back])
    return out


def residual_recordings(outs: list[dict[str, np.ndarray]], name: str) -> list[np.ndarray]:
    """The residual that a threshold is for, over the threshold in use, each shape (samples,)."""
    samples = 3 if name in PERSISTENT else 1
    return [row for out in outs for r in SHARED[name] for row in lasting(out[f"ratio_{r}"][:, SETTLED:], samples)]


Outputs = dict[str, list[dict[str, np.ndarray]]]


def threshold_table(free: Outputs, settings: Settings | None = None) -> str:
    """What the sweep asks for, what is in use, and the false alarms of each set of journeys at what is in use."""
    p = TrainDiagnosis().unpack_parameters(TrainDiagnosis().start_parameters())._replace(**(settings or {}))
    titles = " | ".join(f"{title}: false alarms an hour" for title in free)
    lines = [
        f"| threshold | in use | asked for at {PER_HOUR:g} an hour | {titles} |",
        "|---|---|---|" + "---|" * len(free),
    ]
    for name, shared in SHARED.items():
        used = float(getattr(p, name))
        kept = {title: residual_recordings(outs, name) for title, outs in free.items()}
        asked = used * rate_threshold(kept[IN_SAMPLE], PERIOD, PER_HOUR)
        rates = " | ".join(_rate(rows, len(shared)) for rows in kept.values())
        lines.append(f"| `{name}` | {used:.4g} | {asked:.3g} | {rates} |")
    return "\n".join(lines)


def _rate(rows: list[np.ndarray], shared: int) -> str:
    found = checked(rows, 1.0, PERIOD * 1.0)
    found = alarm_rate(found.alarms, found.hours / shared)
    return f"{found.rate:.2g} ({found.low:.2g} to {found.high:.2g})"


def alarm_table(free: Outputs) -> str:
    """False alarms of the whole: anything suspected, anything isolated."""
    lines = ["| journeys | hours | suspected or isolated, an hour | isolated, an hour |", "|---|---|---|---|"]
    for title, outs in free.items():
        hours = sum(out["radar_fault"][:, SETTLED:].size for out in outs) * PERIOD / 3600.0
        row = []
        for least in (1.0, 2.0):
            alarms = 0
            for out in outs:
                worst = np.max([out[f"{fault}_fault"] for fault in FAULTS], axis=0)[:, SETTLED:]
                alarms += sum(count_alarms(member >= least) for member in worst)
            found = alarm_rate(alarms, hours)
            row.append(f"{alarms}: {found.rate:.2g} ({found.low:.2g} to {found.high:.2g})")
        lines.append(f"| {title} | {hours:.0f} | {row[0]} | {row[1]} |")
    return "\n".join(lines)


@dataclass(frozen=True)
class Case:
    """A fault of a size.

    Attributes:
        title: of the row. fault: that is to be told. signal: input of the diagnosis that it changes; empty for the
            balise. error: what the reading becomes; of a balise its offset [m]. during: ``any``, ``brake`` or ``pull``:
            when it begins. lasts: [s]; infinite for the rest of the run. frozen: the reading stays what it was.
    """

    title: str
    fault: str
    signal: str
    error: Error = NONE
    during: str = "any"
    lasts: float = np.inf
    frozen: bool = False


CASES = (
    *(Case(f"odometer 1 reads {g:g} of it", "odometer_1", "odometer_1", Error(g)) for g in (0.98, 0.95, 0.9, 0.8, 1.1)),
    Case("odometer 1 frozen", "odometer_1", "odometer_1", frozen=True),
    Case("odometer 2 reads 0.9 of it", "odometer_2", "odometer_2", Error(0.9)),
    *(
        Case(f"jam of wheel 1, {d:g}, 3 s", "odometer_1", "odometer_1", Error(1 - d), "brake", 3.0)
        for d in (0.1, 0.3, 1.0)
    ),
    Case("skid of wheel 1, 0.3, 3 s", "odometer_1", "odometer_1", Error(1.3), "pull", 3.0),
    *(Case(f"radar reads {g:g} of it", "radar", "radar", Error(g)) for g in (0.98, 0.95, 0.9)),
    Case("radar frozen", "radar", "radar", frozen=True),
    *(Case(f"satellites jump by {d:g} m", "gps", "gps_position", Error(offset=d)) for d in (3.0, 6.0, 20.0)),
    Case("satellites drift by 0.3 m/s", "gps", "gps_position", Error(drift=0.3)),
    Case("satellites frozen", "gps", "gps_position", frozen=True),
    *(Case(f"balise off by {d:g} m", "balise", "", Error(offset=d)) for d in (3.0, 6.0, 12.0)),
    *(
        Case(f"pressure reads {g:g} of it", "pressure_sensor", "cylinder_pressure", Error(g), "brake")
        for g in (0.9, 0.8, 0.5)
    ),
    Case("pressure reads zero", "pressure_sensor", "cylinder_pressure", Error(0.0), "brake"),
)
TURNED = tuple(replace(case, error=case.error.turned) for case in CASES if not case.frozen)
ACTUATORS: tuple[tuple[str, str, Journey], ...] = tuple(
    (f"{title} {share:g} of it", fault, make(share))
    for title, fault, make in (
        ("traction gives", "traction", lambda s: Journey(50.0, 1000.0, 0.4, traction=s)),
        ("brake shoes give", "friction", lambda s: Journey(50.0, 1000.0, 0.4, 0.5, plant=(("brake_ratio", s),))),
        ("cylinders fill to", "cylinder", lambda s: Journey(50.0, 1000.0, 0.4, 0.5, brake=s)),
    )
    for share in (0.9, 0.8, 0.6)
)


def injected(
    case: Case, run: Mapping[str, np.ndarray], read: Mapping[str, np.ndarray], seed: int
) -> tuple[dict[str, np.ndarray], np.ndarray, np.ndarray]:
    """Readings with a fault from a random instant on, these instants [s], and errors of balises [m]."""
    rng = np.random.default_rng(seed)
    t, members = run["time"], len(read["odometer_1"])
    moving = (run["speed"] > 3.0) & (t > 15.0)
    force = {"any": np.ones(len(t), bool), "brake": run["demand"] > 0.2, "pull": run["effort"] > 30e3}[case.during]
    allowed = np.flatnonzero(moving & force & (t < t[moving][-1] - (5.0 if case.during != "any" else 20.0)))
    starts = rng.choice(allowed, members)
    places = balise_places(run)
    error = np.zeros((members, len(places)))
    if not case.signal:
        which = rng.integers(1, max(len(places) - 1, 2), members)
        error[np.arange(members), which] = case.error.offset
        return dict(read), np.interp(places[which], run["position"], t), error
    faulty = read[case.signal].copy()
    for member, start in enumerate(starts):
        end = min(start + round(case.lasts / PERIOD), len(t)) if np.isfinite(case.lasts) else len(t)
        part = faulty[member, start:end]
        if case.frozen:
            faulty[member, start:end] = faulty[member, start - 1]
        else:
            drifted = case.error.drift * PERIOD * np.arange(1, len(part) + 1)
            faulty[member, start:end] = case.error.gain * part + case.error.offset + drifted
    return {**read, case.signal: faulty}, t[starts], error


@dataclass(frozen=True)
class Score:
    """What became of the faults of one kind: numbers of faults, detected, isolated rightly and wrongly, told as
    several; delays [s]."""

    faults: int
    detected: int
    right: int
    wrong: int
    several: int
    delays: np.ndarray
    last_codes: np.ndarray


def scored(out: Mapping[str, np.ndarray], fault: str, t: np.ndarray, onsets: np.ndarray) -> Score:
    """Which faults were told, and how soon: the first alarm behind the onset, and the first fault that is isolated."""
    codes = np.stack([out[f"{name}_fault"] for name in FAULTS])
    own = FAULTS.index(fault)
    detected = right = wrong = several = 0
    delays, last = [], []
    for member, onset in enumerate(onsets):
        after = t >= onset - 1e-9
        own_code = np.where(after, codes[own, member], 0.0)
        if own_code.max() > 0.0:
            detected += 1
            delays.append(float(t[np.flatnonzero(own_code > 0.0)[0]] - onset))
        several += bool((out["several_faults"][member][after] > 0.0).any())
        isolated = np.where(after, codes[:, member], 0.0) >= WHEEL
        if isolated.any():
            first = int(np.flatnonzero(isolated.any(axis=0))[0])
            right += bool(isolated[own, first])
            wrong += not isolated[own, first]
            reported = own_code[own_code >= WHEEL]
            last.append(float(reported[-1]) if reported.size else 0.0)
    return Score(len(onsets), detected, right, wrong, several, np.array(delays), np.array(last))


def score_row(title: str, s: Score, note: str = "") -> str:
    """A line of the table."""
    low, high = clopper_pearson(s.detected, s.faults)
    delays = f"{np.median(s.delays):.1f} | {np.quantile(s.delays, 0.95):.1f}" if s.delays.size else "- | -"
    share = f"{100 * s.detected / s.faults:.0f} ({100 * low:.0f} to {100 * high:.0f})"
    reported = " | ".join(f"{100 * count / s.faults:.0f}" for count in (s.right, s.wrong, s.several))
    return f"| {title} | {s.faults} | {share} | {delays} | {reported} | {note} |"


def case_scores(
    runs: Runs, members: int, settings: Settings | None = None, cases: Sequence[Case] = CASES
) -> list[Score]:
    """What becomes of each case, on journeys that made no threshold."""
    reads = [sensed(run, members, 900 + i) for i, run in enumerate(runs)]
    by_case: list[list[Score]] = [[] for _ in cases]
    for i, (run, read) in enumerate(zip(runs, reads, strict=True)):
        drawn = [injected(case, run, read, 1000 * number + i) for number, case in enumerate(cases)]
        together = {name: np.concatenate([faulty[name] for faulty, _, _ in drawn]) for name in read}
        error = np.concatenate([error for _, _, error in drawn])
        out = diagnosed(run, together, settings, error, CODES)
        for number, (case, (_, onsets, _)) in enumerate(zip(cases, drawn, strict=True)):
            own = {name: values[number * members : (number + 1) * members] for name, values in out.items()}
            by_case[number].append(scored(own, case.fault, run["time"], onsets))
    return [joined(scores) for scores in by_case]


def fault_table(found: list[Score], members: int) -> str:
    """Detection, delay and isolation by fault and size."""
    lines = [
        "| fault | cases | detected [%], 95 % | delay, median [s] | 95 % of them within [s] | isolated rightly [%] | "
        "wrongly [%] | as several [%] | told as wheel / wrong / stuck [%] |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    for case, total in zip(CASES, found, strict=True):
        of = max(total.last_codes.size, 1)
        kinds = " / ".join(f"{100 * np.sum(total.last_codes == code) / of:.0f}" for code in (2.0, 3.0, 4.0))
        lines.append(score_row(case.title, total, kinds))
    for title, fault, journey in ACTUATORS:
        run = recorded(journey)
        acts = run["effort"] > 30e3 if fault == "traction" else run["demand"] > 0.2
        onset = run["time"][np.flatnonzero(acts & (run["speed"] > 1.0))[0]]
        out = diagnosed(run, sensed(run, members, 990), results=CODES)
        lines.append(score_row(title, scored(out, fault, run["time"], np.full(members, onset)), "-"))
    return "\n".join(lines)


def turned_table(found: list[Score], turned: list[Score]) -> str:
    """The faults that have a sign beside those of the other one: detection, delay and isolation.

    Args:
        found: of all `CASES`. turned: of `TURNED`.
    """
    heads = ("detected [%]", "delay, median; 95 % within [s]", "isolated rightly [%]", "wrongly [%]", "as several [%]")
    lines = ["| fault | turned | " + " | ".join(f"{head}, {sign}" for head in heads for sign in ("as above", "turned"))]
    lines = [f"{lines[0]} |", "|---|---|" + "---|" * (2 * len(heads))]
    signed = [(case, score) for case, score in zip(CASES, found, strict=True) if not case.frozen]
    for (case, one), other, two in zip(signed, TURNED, turned, strict=True):
        cells = [[f"{100 * s.detected / s.faults:.0f}" for s in (one, two)]]
        cells += [[_delays(s) for s in (one, two)]]
        reported = ("right", "wrong", "several")
        cells += [[f"{100 * getattr(s, name) / s.faults:.0f}" for s in (one, two)] for name in reported]
        e = other.error
        how = f"{e.gain:g} of it" if e.gain != 1.0 else f"{e.offset:g} m" if e.offset else f"{e.drift:g} m/s"
        lines.append(f"| {case.title} | {how} | " + " | ".join(" | ".join(c) for c in cells) + " |")
    return "\n".join(lines)


def _delays(s: Score) -> str:
    return f"{np.median(s.delays):.1f}; {np.quantile(s.delays, 0.95):.1f}" if s.delays.size else "-"


def wet_cost_table(dry: list[Score], wet: list[Score]) -> str:
    """What the wider thresholds cost, on the same dry journeys: faults that compare wheels."""
    lines = [
        "| fault | cases | "
        + " | ".join(
            f"{what}, `{preset}`"
            for what in ("detected [%]", "delay, median; 95 % within [s]", "isolated rightly [%]")
            for preset in ("swept", "wet_rails")
        )
        + " |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for case, *both in zip(CASES, dry, wet, strict=True):
        if case.fault in ("odometer_1", "odometer_2", "radar"):
            cells = [[f"{100 * s.detected / s.faults:.0f}" for s in both]]
            cells += [[_delays(s) for s in both]]
            cells += [[f"{100 * s.right / s.faults:.0f}" for s in both]]
            lines.append(f"| {case.title} | {both[0].faults} | " + " | ".join(" | ".join(c) for c in cells) + " |")
    return "\n".join(lines)


def joined(scores: list[Score]) -> Score:
    """The scores of several journeys as one."""
    numbers = (sum(getattr(s, name) for s in scores) for name in ("faults", "detected", "right", "wrong", "several"))
    arrays = (np.concatenate([getattr(s, name) for s in scores]) for name in ("delays", "last_codes"))
    return Score(*numbers, *arrays)


def tables(seeds: int = SEEDS, members: int = FAULTY) -> dict[str, str]:
    """All tables by name."""
    inside, outside = ([recorded(j) for j in journeys] for journeys in (INSIDE, OUTSIDE))
    dry, wet = ([run for run, j in zip(outside, OUTSIDE, strict=True) if (j.rail > 0.0) == on] for on in (False, True))
    sets = {IN_SAMPLE: (inside, 100), "out of sample, dry": (dry, 500), "out of sample, wet": (wet, 700)}
    free = {title: fault_free(runs, seeds, seed) for title, (runs, seed) in sets.items()}
    scores = case_scores(dry, members)
    wet_runs = {IN_SAMPLE: (WET_INSIDE, 100), "out of sample": (WET_OUTSIDE, 700)}
    creeping = {title: ([recorded(j) for j in journeys], seed) for title, (journeys, seed) in wet_runs.items()}
    rail = {title: fault_free(runs, WET_SEEDS, seed, WET) for title, (runs, seed) in creeping.items()}
    alarms = {f"`wet_rails`, wet, {title}": outs for title, outs in rail.items()}
    outside_wet, seed = creeping["out of sample"]
    alarms["`swept`, wet, out of sample"] = fault_free(outside_wet, WET_SEEDS, seed)
    alarms["`wet_rails`, dry, out of sample"] = fault_free(dry, seeds, 500, WET)
    return {
        "thresholds": threshold_table(free),
        "alarms": alarm_table(free),
        "faults": fault_table(scores, members),
        "turned": turned_table(scores, case_scores(dry, members, cases=TURNED)),
        "wet thresholds": threshold_table(rail, WET),
        "wet alarms": alarm_table(alarms),
        "wet cost": wet_cost_table(scores, case_scores(dry, members, WET)),
    }


def main() -> None:
    """Print the tables, or write them into the page."""
    print_tables(PAGE, tables())


if __name__ == "__main__":
    main()
