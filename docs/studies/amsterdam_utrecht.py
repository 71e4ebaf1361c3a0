"""Every train observer on the line Amsterdam - Utrecht: how far it is off at the end of the longest gaps.

``python docs/studies/amsterdam_utrecht.py`` prints the tables of docs/theses/amsterdam_utrecht.md, with ``--write`` it
puts them there. Everything runs in one run of the shipped scenario: its own observers, and beside them those that it
leaves out, with gains for gaps of 32 s.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent))

from page_tables import write_table
from turned_faults import turned

from cosim import Outcome, Scenario
from cosim.evaluation.balise_gaps import GapErrors, gap_errors, largest, root_mean_square
from fmu_observer.design.augmented_gains import design_for_gap
from fmus.tables.numbers import error_number, number

SCENARIO = "amsterdam_utrecht"
PAGE = Path(__file__).parents[1] / "theses" / "amsterdam_utrecht.md"
LONGEST_TIME = 32.0  # [s] between two balises, in the slow parts of the run
FAULTS = 16  # jams and skids of the scenario
STEPS = (0.01, 0.05, 0.1)  # [s]


def scenario(*, everybody: bool = True, faults: bool = True, **changes: Any) -> Scenario:
    """The shipped scenario, with all train observers or its own only, with or without jams and skids.

    Args:
        everybody: whether the observers take part that the shipped scenario leaves out.
        faults: whether wheels jam and skid.
        changes: other settings, with ``__`` for the dot.
    """
    chosen = Scenario.load(SCENARIO)
    if not faults:
        chosen.set("wheel.fault_length", [0.0] * FAULTS)
    for key, value in changes.items():
        chosen.set(key.replace("__", "."), value)
    if everybody:
        _add_the_others(chosen)
    return chosen


def _add_the_others(chosen: Scenario) -> None:
    reported = chosen.table().components["multirate_cdo"].parameters
    train = {k: v for k, v in reported.items() if k not in ("theta_2", "odometer_period")}
    placed = design_for_gap(LONGEST_TIME)
    by_gap = {"balise_gain": list(placed.gains), "balise_decay": placed.decay, "gps_gain": [0.0] * 4, "gps_decay": 0.0}
    others: dict[str, dict[str, Any]] = {
        "differentiator_cdo": {**train, "theta": reported["theta_2"]},
        "augmented_high_gain_cdo": {
            **train,
            "theta_balise": 0.978 / LONGEST_TIME,
            "theta_gps": 0.0,
            "odometer_period": 0.2,
        },
        "augmented_takagi_sugeno_cdo": {**train, **by_gap},
        "stopping_uio": {k: train[k] for k in ("mass", "davis_b", "estimated_position", "estimated_speed")},
    }
    for name, parameters in others.items():
        chosen.add(name, observer=name, label=f"`{name}`", parameters=parameters)
        chosen.connect(f"driver.effort -> {name}.effort", f"odometer.reading -> {name}.odometer")
    chosen.set("stopping_uio.as", "fmu2")  # samples every millisecond: in FMI 3.0 it would return at each of them


def run(chosen: Scenario) -> tuple[Outcome, GapErrors]:
    """Run it and judge the ends of the gaps.

    Raises:
        RuntimeError: the run failed.
    """
    outcome = chosen.run(warn=lambda _text: None)
    if outcome.failure is not None:
        raise RuntimeError(outcome.failure)
    return outcome, gap_errors(outcome.result, outcome.spec)


def table(heading: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A table in markdown."""
    lines = [heading, ["---"] * len(heading), *rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def longest_gaps(found: GapErrors) -> str:
    """Errors at the end of the ten longest gaps, metres and seconds of running time."""
    chosen = [found.gaps[i] for i in found.longest()]
    head = ["", *(f"{gap.length:.0f} m" for gap in chosen)]
    rows = [
        ["from 426-", *(gap.origin.removeprefix("426-") for gap in chosen)],
        ["lasts [s]", *(number(gap.seconds) for gap in chosen)],
        ["speed at its end [km/h]", *(f"{3.6 * gap.speed:.0f}" for gap in chosen)],
        ["SUBSET-041 [m]", *(number(gap.envelope) for gap in chosen)],
    ]
    for name, errors in found.errors.items():
        seconds = found.running_time(name)
        cells = [f"{_metres(errors[i])} m, {_metres(seconds[i])} s" for i in found.longest()]
        rows.append([found.labels[name], *cells])
    return table(head, rows)


def all_gaps(found: GapErrors, quiet: GapErrors, other: GapErrors) -> str:
    """What all gaps come to, with jams and skids, without, and with those of the other sign.

    Args:
        found: of the run with faults. quiet: of the same run without. other: with all faults turned.
    """
    head = [f"{len(found.gaps)} gaps", "largest [m]", "rms [m]", "largest [s]", "within SUBSET-041 [%]"]
    head += ["largest without jams and skids [m]", "jams and skids turned: largest [m]", "rms [m]"]
    rows = []
    for name, errors in found.errors.items():
        seconds = found.running_time(name)
        cells = [error_number(largest(errors)), error_number(root_mean_square(errors))]
        cells += [error_number(largest(seconds[~np.isnan(seconds)])), number(100.0 * found.within_envelope(name))]
        cells += [error_number(largest(quiet.errors[name])), error_number(largest(other.errors[name]))]
        rows.append([found.labels[name], *cells, error_number(root_mean_square(other.errors[name]))])
    return table(head, rows)


def reported(outcome: Outcome) -> list[list[str]]:
    """Faults told and false alarms of the observers that tell any, as cells of a table."""
    known = [entry for entry in outcome.result.summary["fault_detection"] if entry["indicates"]]
    return [[entry["observer"], f"{entry['detected']} of {entry['faults']}", f"{entry['false']}"] for entry in known]


def detections(outcome: Outcome, other: Outcome) -> str:
    """Faults told with either sign.

    Args:
        outcome: of the run with faults. other: with all faults turned.
    """
    head = ["", "faults told", "false alarms", "turned: faults told", "false alarms"]
    return table(
        head, [[f"`{one[0]}`", *one[1:], *two[1:]] for one, two in zip(reported(outcome), reported(other), strict=True)]
    )


def certified(outcome: Outcome) -> Mapping[str, str]:
    """Whether each observer is certified for the longest gap at full speed, in words."""
    known = outcome.result.summary["certificates"]
    words = {True: "yes", False: "no"}
    return {name: words[bool(entry["holds"])] for name, entry in known.items()}


def step_table() -> str:
    """Largest difference of the errors at the end of the gaps from those at steps of 50 ms.

    Driver and wheel act every 50 ms at all steps, so that the train is the same one.
    """
    found = {}
    for step in STEPS[:2]:
        rate = round(0.05 / step)
        kept = {"driver__every": rate, "wheel__every": rate, "tachometer__every": rate}
        found[step] = run(scenario(everybody=False, step=step, **kept))[1]
    free = {step: run(scenario(everybody=False, step=step))[1] for step in STEPS}
    rows = []
    for name in free[0.05].errors:
        cells = [
            _difference(found[0.01], found[0.05], name),
            _difference(free[0.01], free[0.05], name),
            _difference(free[0.1], free[0.05], name),
        ]
        rows.append([free[0.05].labels[name], *(number(c) for c in cells)])
    head = ["largest difference from 50 ms [m]", "10 ms, same driver", "10 ms", "100 ms"]
    return table(head, rows)


def _difference(one: GapErrors, other: GapErrors, name: str) -> float:
    return float(np.max(np.abs(one.errors[name] - other.errors[name])))


def _metres(value: float) -> str:
    return error_number(float(value), 2)


def tables() -> dict[str, str]:
    """All tables, by their names on the page."""
    outcome, found = run(scenario())
    _, quiet = run(scenario(faults=False))
    other_outcome, other = run(turned(scenario()))
    known = certified(outcome)
    head, line, *rows = all_gaps(found, quiet, other).splitlines()
    head += " certified for 22.5 s |"
    evaluated = [f"{row} {known.get(name, '–')} |" for name, row in zip(found.errors, rows, strict=True)]
    return {
        "longest gaps": longest_gaps(found),
        "all gaps": "\n".join([head, f"{line} --- |", *evaluated]),
        "turned": detections(outcome, other_outcome),
        "steps": step_table(),
    }


def main() -> None:
    """Print all tables, or write them into the page."""
    made = tables()
    if "--write" not in sys.argv:
        print("\n\n".join(made.values()))
        return
    for name, text in made.items():
        write_table(PAGE, name, text)


if __name__ == "__main__":
    main()
