"""Amsterdam - Utrecht with jams and skids drawn from twenty seeds: quartiles of the largest position error."""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np
from shared.sheet import Sheet

from cosim import Scenario
from cosim.evaluation.balise_gaps import gap_errors, largest
from cosim.scenario.scenario_tables import ComponentTable

SEEDS = range(20)
RATES = {"jam_rate": 0.05, "skid_rate": 0.01, "mean_length": 0.6, "least_depth": 0.2, "most_depth": 1.0}
KEPT = ("quasi_lpv_uio", "discrete_measurement_observer", "multirate_cdo", "takagi_sugeno_cdo", "odometer_reset")
WHY = "the thesis draws no faults; rates, lengths and depths are ours"


def scenario() -> Scenario:
    """The shipped scenario with drawn faults and fewer observers."""
    shipped = Scenario.load("amsterdam_utrecht")
    table = shipped.table().model_dump(by_alias=True, exclude_unset=True)
    dropped = [n for n, c in table["components"].items() if "observer" in c and n not in KEPT]
    for name in dropped:
        del table["components"][name]
    table["connections"] = [_without(line, dropped) for line in table["connections"]]
    table["components"]["wheel"] = {"model": "wheel_fault", "options": {"cause": "drawn"}, "parameters": RATES}
    assert ComponentTable.model_validate(table["components"]["wheel"])
    table["expect"] = []
    return Scenario(folder=shipped.folder, **table)


def _without(line: str, names: list[str]) -> str:
    source, _, targets = line.partition(" -> ")
    kept = [target for target in targets.split(", ") if target.partition(".")[0] not in names]
    return f"{source} -> {', '.join(kept)}"


def main() -> None:
    """Largest error at the end of a gap, over the seeds, for each observer."""
    sheet = Sheet(__file__, "Jams and skids drawn from seeds", "Aguiar Cota 2019, chapters 3 to 5; line openETCS")
    found: dict[str, list[float]] = {}
    labels: dict[str, str] = {}
    for seed in SEEDS:
        outcome = scenario().set("wheel.seed", seed).run(warn=lambda _text: None)
        errors = gap_errors(outcome.result, outcome.spec)
        labels |= errors.labels
        for name, values in errors.errors.items():
            found.setdefault(name, []).append(largest(values))
    for name, worst in found.items():
        for share, what in ((25, "lower quartile"), (50, "median"), (75, "upper quartile"), (100, "largest")):
            value = np.percentile(worst, share)
            sheet.add(f"largest error of a run, {what}: {labels[name]}", "m", None, value, WHY, repeats=0.1)
    figure, axis = plt.subplots(figsize=(8, 4), layout="constrained")
    axis.boxplot(list(found.values()), orientation="horizontal", whis=(0, 100))
    axis.set_yticks(range(1, len(found) + 1), [labels[name] for name in found])
    axis.set(xlabel=f"largest error at the end of a gap [m], {len(SEEDS)} seeds", xscale="log")
    sheet.finish(figure, grids=[axis])


if __name__ == "__main__":
    main()
