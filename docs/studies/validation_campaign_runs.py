"""Behind the rates of the validation campaign: each jam that was missed, each false detection, the residual without
jams, and the bounds of Table 5.9 over the samples that were not used. See docs/theses/validation_campaign.md.

``python docs/studies/validation_campaign_runs.py`` writes the tables into the page (3 minutes on one core). Published
numbers are those of Aguiar Cota 2019.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from validation_campaign import OBSERVER, PUBLISHED, SEEDS, write

from cosim import Result, Scenario
from cosim.evaluation.fault_detection import GRACE, intervals
from fmu_observer.certificates.bounds import cdo_bound, dmo_bound, improved_dmo_bound
from fmus.tables.numbers import number

JAM_CASES = tuple(name for name in PUBLISHED if "micro" not in name)
PERIOD, STEP = 0.2, 0.05  # [s] of the odometer's readings, of the rows
LATE = 0.8  # [s]: two samples that agree, the begin of the first of them, and what is left of the sample of the end
LEAST_WAY = 1e-3  # [m]: less is rounding

# Section 5.4: set D, m = .1 1/s, the gain and overshoot printed there
BETA, M, XI = 1.9, 0.1, 1.7
GAIN = float(np.linalg.norm((3.4 + 5.7e-3, -3.4, -1.5)))
CLASSES = {  # by the length of the fault [s]: over, up to
    "small, up to 0.2 s": (0.0, 0.2),
    "between": (0.2, 0.6),
    "medium, 0.6 to 1.2 s": (0.6, 1.2),
    "big, longer": (1.2, np.inf),
}
TABLE_5_9: Mapping[str, tuple[float, float, float]] = {  # DMO, CDO, i-DMO
    "fault-free": (5.3, 4.96, 0.7),
    "small, up to 0.2 s": (6.0, 10.0, 1.28),
    "medium, 0.6 to 1.2 s": (26.11, 2.2e6, 13.4),
    "big, longer": (40.49, 7e9, 33.3),
}


@dataclass(frozen=True, slots=True)
class Run:
    """One braking: what the odometer lost, what jammed, what was told. Times in seconds, ways in metres."""

    case: str
    seed: int
    result: Result
    start: float
    threshold: float

    @property
    def jams(self) -> list[tuple[float, float]]:
        """Jams as the rows show them."""
        found = intervals(self.result.time, self.result["wheel.active"])
        return [jam for jam in found if jam[0] >= self.start]

    @property
    def detections(self) -> list[tuple[float, float]]:
        """Times for which the odometer was told to lie."""
        found = intervals(self.result.time, self.result[f"{OBSERVER}.odometer_fault"])
        return [reported for reported in found if reported[1] > self.start]

    def lost(self, begin: float, end: float) -> float:
        """Way that the wheel lost, of jams of any length: the rim counts what no row shows."""
        missing = self.result["train.position"] - self.result["wheel.wheel_distance"]
        rows = np.searchsorted(self.result.time, np.array([begin, end]) + 1e-6, side="right") - 1
        before, after = missing[np.clip(rows, 0, None)]
        return float(after - before)

    def residual(self, begin: float, end: float) -> float:
        """Largest size of the residual [m/s]."""
        rows = (self.result.time >= begin - 1e-6) & (self.result.time <= end + 1e-6)
        return float(np.abs(self.result[f"{OBSERVER}.residual"][rows]).max())


def runs(cases: Iterable[str] = JAM_CASES, seeds: Iterable[int] = SEEDS) -> Iterator[Run]:
    """The campaign, run by run."""
    shipped = Scenario.load("validation_campaign")
    for case in cases:
        values = shipped.cases[case]
        start = float(values.get("report.evaluate_after", 120.0))
        for seed in seeds:
            outcome = shipped.copy().set("case", case).set("seed", seed).run(warn=lambda _: None)
            if outcome.failure is not None:
                raise RuntimeError(f"{case}, drawing {seed}: {outcome.failure}")
            yield Run(case, seed, outcome.result, start, float(values[f"{OBSERVER}.threshold"]))


def traced(run: Run) -> list[tuple[Any, ...]]:
    """Misses, false detections and late ends of a run: case, drawing, what, when, lost way, residual, cause."""
    found: list[tuple[Any, ...]] = []
    jams, detections, end = run.jams, run.detections, float(run.result.time[-1])
    matched: set[int] = set()
    for k, (a, b) in enumerate(jams):
        following = jams[k + 1][0] if k + 1 < len(jams) else np.inf
        own = [i for i, (c, d) in enumerate(detections) if c <= min(b + GRACE, following) and d > a]
        matched |= set(own)
        if not own:
            lost, size = run.lost(a - STEP, b + STEP), run.residual(a, min(b + 2 * PERIOD, following))
            cause = "not explained"
            if end - a <= PERIOD + STEP:
                cause = "the run ends with the sample"
            elif size < run.threshold:
                cause = "below the threshold"
            found.append((run.case, run.seed, "missed", a, lost, size, cause))
        elif detections[own[-1]][1] - b > LATE:
            lost = run.lost(b + STEP, detections[own[-1]][1])
            if lost > LEAST_WAY:
                cause = "the next jam begins before two samples agree: told as one"
            else:
                cause = "the model held in the jam is off"
            size = run.residual(b + PERIOD, detections[own[-1]][1] - STEP)
            found.append((run.case, run.seed, "late end", b, lost, size, cause))
    for i, (c, d) in enumerate(detections):
        if i not in matched:
            lost = run.lost(c - PERIOD, c)
            cause = "a jam between two rows" if lost > LEAST_WAY else "not explained"
            found.append((run.case, run.seed, "false", c, lost, run.residual(c, d), cause))
    return found


def trace_table(found: Iterable[tuple[Any, ...]]) -> str:
    """A row each."""
    rows = ["| case, drawing | what | at [s] | way lost [m] | residual [m/s] | because |", "|---|---|---|---|---|---|"]
    for case, seed, what, when, lost, size, cause in sorted(found, key=lambda row: (row[2], row[6])):
        rows.append(f"| {case}, {seed} | {what} | {when:.2f} | {lost:.3f} | {size:.2f} | {cause} |")
    return "\n".join([*rows, ""])


def unused(run: Run) -> Iterator[tuple[float, float]]:
    """Length of the jams of a detection, from the first to the end of the last, and the time between the samples used
    before and after it [s].
    """
    for c, d in run.detections:
        own = [jam for jam in run.jams if c <= jam[1] + GRACE and d > jam[0]]
        if own:
            yield own[-1][1] - own[0][0], d - c + PERIOD


def bounds(gap: float) -> tuple[float, float, float]:
    """DMO, CDO and i-DMO bound of the error just before the next sample that is used, without one at the last."""
    deviation = XI * gap  # the most by which the speed differs from the held reading within the gap
    return (
        float(dmo_bound(gap, 0.0, BETA, M, GAIN, deviation)),
        float(cdo_bound(gap, 0.0, BETA, M, GAIN, deviation)),
        float(improved_dmo_bound(gap, 0.0, BETA, M, GAIN, XI)),
    )


def bounds_by_class(found: Iterable[tuple[float, float]]) -> dict[str, tuple[int, float, tuple[float, float, float]]]:
    """Number of gaps, their mean [s] and the mean bounds [m/s], by class."""
    gaps = list(found)
    table = {"fault-free": (0, PERIOD, bounds(PERIOD))}
    for name, (over, up_to) in CLASSES.items():
        own = [gap for length, gap in gaps if over + 1e-6 < length <= up_to + 1e-6]
        means = np.mean([bounds(gap) for gap in own], axis=0) if own else np.full(3, np.nan)
        table[name] = len(own), float(np.mean(own)) if own else np.nan, tuple(map(float, means))  # type: ignore[assignment]
    return table


def bounds_table(table: Mapping[str, tuple[int, float, tuple[float, float, float]]]) -> str:
    """A row a class: published, then ours."""
    rows = ["| fault | number | mean time without a reading [s] | DMO [m/s] | CDO [m/s] | i-DMO [m/s] |"]
    rows.append("|---|---|---|---|---|---|")
    for name, (count, gap, means) in table.items():
        published = TABLE_5_9.get(name, (None,) * 3)
        cells = [f"{number(old, 2)} · **{new:.3g}**" for old, new in zip(published, means, strict=True)]
        rows.append(f"| {name} | {count or 'all other'} | {gap:.2f} | {' | '.join(cells)} |")
    return "\n".join([*rows, ""])


GAINS = (("proportional", 0.5), ("integral", 0.05))  # those of the pneumatic cases
# What moves the residual besides jams: values that differ from the shipped ones, and the deceleration [m/s2]
CALM = {f"{name}.{gain}_gain": value for name in ("driver", "plan") for gain, value in GAINS}
Variant = tuple[Mapping[str, Any], float | None]
VARIANTS: Mapping[str, Variant] = {
    "as shipped: 0.8 m/s², LS 0.5 m/s²": ({}, None),
    "brake at 1.0 m/s²": ({}, 1.0),
    "brake at 1.2 m/s²": ({}, 1.2),
    "brake at 1.5 m/s²": ({}, 1.5),
    "lag of the brake 1 s, calm driver": ({"driver.effort_lag": 1.0, **CALM}, None),
    "lag of the brake 2 s, calm driver": ({"driver.effort_lag": 2.0, **CALM}, None),
    "the brake gives 0.7 of what is asked for": ({"train.brake_coefficient": 0.7}, None),
    "100 teeth": ({"odometer.teeth": 100.0}, None),
    "age of the readings not told": ({f"{OBSERVER}.reading_age": 0.0}, None),
    "the same, readings held as published": (
        {f"{OBSERVER}.reading_age": 0.0, f"{OBSERVER}.options": {"hold": "reading"}},
        None,
    ),
}
GROUPS = ("HS", "AS", "LS", "pneumatic")
CRUISE = {"HS": (45.0, 120.0), "AS": (30.0, 100.0), "LS": (17.0, 80.0)}  # speed [m/s], begin of the braking [s]
ENDS_AT = 2.5  # [m/s]
JAM_SEEDS = range(4)


def changed_run(case: str, values: Mapping[str, Any], deceleration: float | None, seed: int | None) -> Run:
    """A braking of a variant, without jams or with those of a seed."""
    scenario = Scenario.load("validation_campaign").set("case", case).set("seed", seed or 0)
    if seed is None:
        scenario.set("wheel.jam_rate", 0.0)
    speed, start = CRUISE[case[:2]]
    if deceleration is not None:
        times = [0.0, 0.5, start, start + speed / deceleration, 200.0, 200.0, 200.0, 200.0]
        for name in ("driver", "plan"):
            scenario.set(f"{name}.profile_time", times).set(f"{name}.effort_limit", 2.0)
        scenario.set("stop", round(start + (speed - ENDS_AT) / deceleration, 1))
    for name, value in values.items():
        scenario.set(name, value)
    outcome = scenario.run(warn=lambda _: None)
    if outcome.failure is not None:
        raise RuntimeError(f"{case}: {outcome.failure}")
    return Run(case, seed or 0, outcome.result, start, float(scenario.cases[case][f"{OBSERVER}.threshold"]))


def quiet_table() -> str:
    """A row a variant: the largest residual of a group without jams over the threshold, its alarms, and with jams how
    many were missed.
    """
    rows = [f"| what differs | {' | '.join(GROUPS)} |", "|---|" + "---|" * len(GROUPS)]
    for words, (values, deceleration) in VARIANTS.items():
        cells = []
        for group in GROUPS:
            cases = [c for c in JAM_CASES if (group in c if group == "pneumatic" else c[:2] == group and c[3] != "p")]
            quiet = [changed_run(case, values, deceleration, None) for case in cases]
            share = max(run.residual(run.start, np.inf) / run.threshold for run in quiet)
            alarms = sum(len(run.detections) for run in quiet)
            jammed = [changed_run(cases[-1], values, deceleration, seed) for seed in JAM_SEEDS]
            missed = sum(row[2] == "missed" for run in jammed for row in traced(run))
            cells.append(f"{share:.2f}, {alarms}, {missed}/{sum(len(run.jams) for run in jammed)}")
        rows.append(f"| {words} | {' | '.join(cells)} |")
    return "\n".join([*rows, ""])


def main() -> None:
    """Run all and rewrite the page."""
    write("quiet", quiet_table())
    seen: list[tuple[Any, ...]] = []
    gaps: list[tuple[float, float]] = []
    for run in runs():
        seen += traced(run)
        gaps += unused(run)
    write("traces", trace_table(seen))
    write("bounds", bounds_table(bounds_by_class(gaps)))


if __name__ == "__main__":
    main()
