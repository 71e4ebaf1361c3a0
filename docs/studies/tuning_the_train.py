"""Observers of the train on the line Amsterdam - Utrecht before and after tuning, with seeds that no search used.

``python docs/studies/tuning_the_train.py`` prints the table of docs/theses/tuning_the_train.md, with ``--write`` it
puts it there; that takes 35 s of CPU. ``--quick`` takes one seed and the first minute. The scenario is the file
``drawn.toml`` of that page; the values are those that the commands there found.
"""

from __future__ import annotations

import argparse
import re
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

from page_tables import write_table

from cosim import Scenario
from cosim.statistics.intervals import mean_of
from cosim.studies.measures import error_measures

PAGE = Path(__file__).parents[1] / "theses" / "tuning_the_train.md"
EVALUATES = range(10, 16)  # searches saw 0 and 1
QUICK = 60.0  # end of a quick run [s]

EKF, THETA, JAMS = "balise_odometer_ekf", "adaptive_gain_cdo", "quasi_lpv_uio"


class Tuned(NamedTuple):
    """An observer with what a search found.

    Attributes:
        observer: component of the scenario. label: of the row. values: parameters by name; none as it stands there.
    """

    observer: str
    label: str
    values: Mapping[str, float]


ROUNDS: tuple[tuple[Tuned, ...], ...] = (
    (
        Tuned(EKF, "EKF, guessed", {}),
        Tuned(THETA, "adaptive gain, as in the scenario", {}),
        Tuned(JAMS, "jam rules, as in the scenario", {}),
    ),
    (
        Tuned(
            EKF,
            "EKF, CMA-ES: preset `tuned`",
            {
                "acceleration_density": 6.15e-6,
                "disturbance_density": 9.83e-8,
                "creep_share": 0.0902,
                "creep_time": 12.4,
                "odometer_deviation": 0.387,
            },
        ),
        Tuned(THETA, "adaptive gain, CMA-ES", {"theta_max": 1.0, "theta_min": 0.333, "ratio": 1.64}),
        Tuned(JAMS, "jam rules, CMA-ES", {"threshold": 0.35, "disturbance_bound": 0.023}),
    ),
    (
        Tuned(
            EKF,
            "EKF, BBO",
            {
                "acceleration_density": 8.15e-5,
                "disturbance_density": 6.49e-9,
                "creep_share": 0.0997,
                "creep_time": 5.87,
                "odometer_deviation": 0.214,
            },
        ),
    ),
    (
        Tuned(
            EKF,
            "EKF, likelihood",
            {
                "acceleration_density": 8.03e-5,
                "disturbance_density": 3.79e-6,
                "creep_share": 0.0185,
                "creep_time": 50.1,
                "odometer_deviation": 0.0105,
            },
        ),
    ),
)
"""Observers that are judged in the same runs; those of the first round stand as in the scenario."""


def drawn_faults() -> Scenario:
    """The scenario of the page: the shipped one with three observers and faults that are drawn from a seed."""
    found = re.search(r"^```toml\n# drawn\.toml\n(.*?)^```", PAGE.read_text(encoding="utf-8"), re.DOTALL | re.MULTILINE)
    if found is None:
        sys.exit(f"{PAGE.name} has no toml block that begins with '# drawn.toml'")
    with TemporaryDirectory() as folder:
        file = Path(folder) / "drawn.toml"
        file.write_text(found[1], encoding="utf-8")
        scenario = Scenario.load(file)
    scenario.folder = PAGE.parent  # the file was temporary
    return scenario


def validated(
    chosen: Sequence[Tuned], seeds: Sequence[int] = EVALUATES, stop: float | None = None
) -> dict[str, list[dict[str, float]]]:
    """Measures of observers with each seed, by observer; names are without that of the observer.

    Args:
        chosen: observers and values. seeds: of the faults. stop: end of the run [s]; None for the whole line.

    Raises:
        RuntimeError: a run failed.
    """
    scenario = drawn_faults()
    for tuned in chosen:
        for name, value in tuned.values.items():
            scenario.set(f"{tuned.observer}.{name}", value)
    if stop is not None:
        scenario.set("stop", stop)
    rows: dict[str, list[dict[str, float]]] = {tuned.observer: [] for tuned in chosen}
    for seed in seeds:
        outcome = scenario.set("seed", seed).run(warn=lambda _text: None)
        if outcome.failure is not None:
            raise RuntimeError(outcome.failure)
        found = error_measures(outcome).items()
        for name, kept in rows.items():
            kept.append({key.removeprefix(f"{name}."): v for key, v in found if key.startswith(f"{name}.")})
    return rows


def row(tuned: Tuned, before: Sequence[Mapping[str, float]], after: Sequence[Mapping[str, float]]) -> list[str]:
    """Cells of the table, means over the seeds with 95 % intervals.

    Args:
        tuned: observer and label. before, after: measures with each seed, of the scenario as it is and of these values.
    """
    cells = [tuned.label]
    gain = [b["position_error_rms"] - a["position_error_rms"] for b, a in zip(before, after, strict=True)]
    cells.append(mean_of([a["position_error_rms"] for a in after]).text())
    cells.append(mean_of(gain).text() if tuned.values else "–")
    cells += [f"{max(a['gap_error_max'] for a in after):.1f}", mean_of([a["speed_error_rms"] for a in after]).text()]
    if "missed_faults" in after[0]:
        faults, missed, false = (sum(a[name] for a in after) for name in ("faults", "missed_faults", "false_alarms"))
        cells.append(f"{missed:.0f} of {faults:.0f}, {false:.0f}")
    else:
        cells.append("–")
    for name in ("nis", "position_nees", "speed_nees"):
        cells.append(mean_of([a[name] for a in after]).text(digits=2) if name in after[0] else "–")
    return cells


def table(seeds: Sequence[int] = EVALUATES, stop: float | None = None) -> str:
    """The table of the page, in markdown.

    Args:
        seeds: of the faults. stop: see `validated`.
    """
    head = ["", "rms of position [m]", "better by [m]", "largest at a gap's end [m]", "rms of speed [m/s]"]
    head += ["missed faults, false alarms", "NIS", "NEES position", "NEES speed"]
    found = [validated(chosen, seeds, stop) for chosen in ROUNDS]
    lines = [head, ["---"] * len(head)]
    for first in ROUNDS[0]:
        for chosen, measured in zip(ROUNDS, found, strict=True):
            mine = [tuned for tuned in chosen if tuned.observer == first.observer]
            lines += [row(tuned, found[0][tuned.observer], measured[tuned.observer]) for tuned in mine]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def main() -> None:
    """Print the table, or write it into the page."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])  # type: ignore[union-attr]
    parser.add_argument("--write", action="store_true", help="put the table into the page")
    parser.add_argument("--quick", action="store_true", help="one seed and the first minute; is never written")
    options = parser.parse_args()
    made = table(EVALUATES[:1], QUICK) if options.quick else table()
    if not options.write or options.quick:
        print(made)
        return
    write_table(PAGE, "validated", made)


if __name__ == "__main__":
    main()
