"""Optimisers on the published tuning problem: the six variances of the motor's Kalman filter, 30 seeds of every method.

``python docs/studies/optimisers.py`` prints the table of docs/reference/tuning.md, with ``--write`` it puts its rows
there, and draws docs/images/optimisers.png where all methods ran; that takes about twenty minutes. ``--only GA`` runs
the methods whose label begins so, ``--seeds N`` the first N seeds.

The drive is run once for a noise record of 10 000 samples; candidates are members of a batch over what the filter
heard, and all see the same record.
"""

from __future__ import annotations

import argparse
import re
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from cosim import Scenario
from cosim.studies.replay import Replay
from fmu_observer.design.likelihood import AccumulatedOutput
from fmu_observer.design.optimisers.known_optimisers import find_optimiser
from fmu_observer.design.optimisers.optimiser_search import Search, minimise
from fmu_observer.design.optimisers.search_space import Bounded, SearchSpace

NAMES = (*(f"process_variance[{i}]" for i in range(1, 5)), "measurement_variance[1]", "measurement_variance[2]")
CURRENTS = ("current_d", "current_q")
LOW, HIGH = 1e-6, 20.0
TRUE = np.array([1e-3] * 4 + [0.1] * 2)
BUDGET = 600  # evaluations of those that go on until the floor
ITERATIONS = (0, 5, 10, 15, 20)
WITHIN = 1.05  # of the floor
SEEDS = 30
PAGE = Path(__file__).parents[1] / "guide" / "tuning.md"
PICTURE = Path(__file__).parents[1] / "images" / "optimisers.png"


class Drive:
    """A noise record of the shipped drive, and the cost of candidates over it: sum of the mean square errors of both
    currents [A2].

    Args:
        seed: of the noise. stop: length of the record [s].
    """

    def __init__(self, seed: int, stop: float = 1.0) -> None:
        scenario = Scenario.load("traction_drive").set("motor.seed", seed).set("stop", stop).set("expect", [])
        self.run = scenario.run(warn=lambda _text: None)
        self.replay = Replay(self.run, "filter")
        self.true = np.stack([self.run[f"motor.{name}"] for name in CURRENTS], axis=1)

    def cost(self, variances: np.ndarray) -> np.ndarray:
        """Costs, shape (m,), of variances, shape (m, 6)."""
        stated = {"process_variance": variances[:, :4], "measurement_variance": variances[:, 4:]}
        found = self.replay.run(CURRENTS, stated, members=len(variances))
        errors = (found - self.true)[:, 1:]
        return np.asarray((errors**2).mean(axis=1).sum(axis=1))

    @property
    def floor(self) -> float:
        """Cost with the variances of the noise itself."""
        return float(self.cost(TRUE[np.newaxis])[0])


@dataclass(frozen=True)
class Method:
    """How one line of the table searches.

    Args:
        label: for people. name: of the optimiser. iterations: after the first population. log: whether in logarithms.
        options: of the optimiser.
    """

    label: str
    name: str
    iterations: int
    log: bool = False
    options: Mapping[str, Any] | None = None


POPULATION = 20
LONG = BUDGET // POPULATION - 1
METHODS = (
    Method("PSO", "pso", LONG),
    Method("BBO, blended", "bbo", LONG),
    Method("BBO, Algorithms 3.1, 3.2", "biogeography_printed", LONG),
    Method("PSO in logarithms", "pso", LONG, log=True),
    Method("BBO, blended, in logarithms", "bbo", LONG, log=True),
    Method("CMA-ES in logarithms, population 9", "cma", BUDGET // 9, log=True),
    Method("GA, population 100, start [0, 0.1]", "ga", 20, options={"start": (0.0, 0.1)}),
)
GRADIENT = Method("gradient of the likelihood, in logarithms", "gradient", 60, log=True, options={"gradients": True})


def space(log: bool) -> SearchSpace:
    """The six variances with the bounds of the reference."""
    return SearchSpace([Bounded(name, LOW, HIGH, log) for name in NAMES])


def searches(drive: Drive, method: Method, seeds: Sequence[int]) -> list[Search]:
    """A method with several seeds on one record."""
    box = space(method.log)
    cost: Callable[[np.ndarray], np.ndarray] = lambda candidates: drive.cost(box.values(candidates))  # noqa: E731
    kind = find_optimiser(method.name)
    return [
        minimise(kind(box.lower, box.upper, seed=seed, **(method.options or {})), cost, method.iterations)
        for seed in seeds
    ]


def likelihood(drive: Drive) -> AccumulatedOutput:
    """Log-likelihood of the innovations over the record, with its gradient by the six variances."""
    return AccumulatedOutput(drive.replay.system, drive.replay.inputs(), NAMES)


def gradient_searches(drive: Drive, seeds: Sequence[int]) -> list[Search]:
    """Descents along the likelihood; the cost in the tables is that of the currents at the same candidates."""
    box, reported, found = space(True), likelihood(drive), []
    for seed in seeds:
        optimiser = find_optimiser(GRADIENT.name)(box.lower, box.upper, seed=seed, gradients=True)  # type: ignore[call-arg]
        points: list[np.ndarray] = []
        for _ in range(GRADIENT.iterations):
            candidates = optimiser.ask()
            if not len(candidates):
                break
            values = box.values(candidates)[0]
            height, slope = reported(values)
            optimiser.tell(candidates, [-height], [-slope * values])  # by the logarithm
            points.append(values)
        costs = np.minimum.accumulate(drive.cost(np.array(points)))
        found.append(Search(points[-1], float(costs[-1]), costs, np.arange(1.0, len(costs) + 1)))
    return found


def convergence(found: Sequence[Search]) -> list[float]:
    """Median best cost at the iterations of the tables."""
    return [float(np.median([s.costs[min(k, len(s.costs) - 1)] for s in found])) for k in ITERATIONS]


def finals(found: Sequence[Search], iteration: int = 20) -> tuple[float, float, float]:
    """10 %, 50 % and 90 % of the cost at an iteration."""
    low, middle, high = np.percentile([s.costs[min(iteration, len(s.costs) - 1)] for s in found], (10, 50, 90))
    return float(low), float(middle), float(high)


def to_floor(found: Sequence[Search], floor: float) -> tuple[float, float, float, int]:
    """Quartiles of the evaluations to within 5 % of the floor (infinite where it was never reached), and how many
    reached it.
    """
    counts = np.array([s.evaluations_to(WITHIN * floor) for s in found])
    low, middle, high = (float(np.percentile(counts, q, method="inverted_cdf")) for q in (25, 50, 75))
    return low, middle, high, int(np.isfinite(counts).sum())


def main() -> None:
    """Both tables and the picture."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])  # type: ignore[union-attr]
    parser.add_argument("--seeds", type=int, default=SEEDS)
    parser.add_argument("--noise", type=int, default=3, help="seed of the noise record")
    parser.add_argument("--only", default="", help="methods whose label begins so")
    parser.add_argument("--write", action="store_true", help="put the rows into the page")
    options = parser.parse_args()
    drive, seeds = Drive(options.noise), range(options.seeds)
    floor = drive.floor
    print(f"noise record {options.noise}, floor {floor:.5f} A2, {len(seeds)} seeds\n")
    counted = "evaluations to 1.05 floor: quartile, median, quartile"
    print("| method | " + " | ".join(f"it. {k}" for k in ITERATIONS) + f" | 10 % to 90 % at 20 | {counted} | reached |")
    print("|" + "---|" * (len(ITERATIONS) + 4))
    curves, rows = {}, {}
    for method in (m for m in (GRADIENT, *METHODS) if m.label.startswith(options.only)):
        found = gradient_searches(drive, seeds) if method is GRADIENT else searches(drive, method, seeds)
        curves[method.label] = found
        low, _, high = finals(found)
        first, middle, last, reached = to_floor(found, floor)
        cells = [f"{c:.4f}" for c in convergence(found)] + [f"{low:.4f} to {high:.4f}"]
        counts = ", ".join("never" if np.isinf(c) else f"{c:.0f}" for c in (first, middle, last))
        rows[method.label] = f"| {method.label} | {' | '.join(cells)} | {counts} | {reached} of {len(found)} |"
        print(rows[method.label], flush=True)
    if options.write:
        write(rows)
    if options.seeds == SEEDS and not options.only:
        draw(curves, floor)


def write(rows: Mapping[str, str]) -> None:
    """Put rows of the table into the page.

    Args:
        rows: by label.
    """
    page = PAGE.read_text(encoding="utf-8")
    for label, row in rows.items():
        page, count = re.subn(rf"^\| {re.escape(label)} \|.*$", lambda _m, row=row: row, page, flags=re.MULTILINE)  # type: ignore[misc]
        if count != 1:
            sys.exit(f"{PAGE.name} has {count} rows '| {label} |'")
    PAGE.write_text(page, encoding="utf-8")


def draw(curves: Mapping[str, Sequence[Search]], floor: float) -> None:
    """Median cost over evaluations."""
    import matplotlib as mpl  # noqa: PLC0415 - only to draw

    mpl.use("Agg")
    import matplotlib.pyplot as plt  # noqa: PLC0415

    from cosim.drawing.style import OBSERVER_LINES, RC  # noqa: PLC0415

    mpl.rcParams.update(RC)
    figure, axes = plt.subplots(figsize=(8.2, 4.2), layout="constrained")
    for place, (label, found) in enumerate(curves.items()):
        grid = np.unique(np.geomspace(1, BUDGET, 120).round())
        rows = [[s.costs[max(np.searchsorted(s.evaluations, n, "right") - 1, 0)] for n in grid] for s in found]
        style = OBSERVER_LINES[place % len(OBSERVER_LINES)] | ({"linewidth": 0.8} if place >= 6 else {})
        axes.plot(grid, np.median(rows, axis=0), label=label, **style)
    axes.axhline(floor, color="black", linewidth=0.8)
    axes.set(xscale="log", yscale="log", xlabel="Evaluations", ylabel="Median best cost [A2]")
    axes.legend(fontsize=8)
    figure.savefig(PICTURE, dpi=90)


if __name__ == "__main__":
    sys.exit(main())
