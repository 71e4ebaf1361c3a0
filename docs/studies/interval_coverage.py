"""How often the 95 % intervals of `cosim.statistics` hold the truth, over synthetic campaigns of which it is known.

``python docs/studies/interval_coverage.py`` prints the tables of docs/reference/statistics.md, with ``--write`` it puts
them there; that takes some minutes. ``--campaigns N`` draws so many.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import scipy
from page_tables import print_tables

from cosim.statistics.comparisons import compared
from cosim.statistics.intervals import coverage, event_rate, mean_of, mean_over_samples, proportion, quantile
from cosim.statistics.run_counts import RateGoal, runs_to_show_below
from cosim.statistics.sensitivity import explained_share, rank_correlation
from cosim.statistics.spread import Spread

PAGE = Path(__file__).parents[1] / "reference" / "statistics.md"
RUNS = (20, 100, 1000)
CAMPAIGNS = 10_000
SAMPLES = 50  # in a run
SPREAD = 0.6  # of the logarithm of a skewed measure
Draw = Callable[[np.random.Generator, int], tuple[Spread, float]]


def _share(rate: float) -> Draw:
    return lambda random, n: (proportion(int(random.binomial(n, rate)), n), rate)


def _any_share(random: np.random.Generator, n: int) -> tuple[Spread, float]:
    rate = random.uniform()
    return proportion(int(random.binomial(n, rate)), n), rate


def _events(random: np.random.Generator, n: int) -> tuple[Spread, float]:
    return event_rate(int(random.poisson(0.05 * n)), n), 0.05


def _quantile(share: float) -> Draw:
    truth = float(np.exp(SPREAD * scipy.special.ndtri(share)))
    return lambda random, n: (quantile(random.lognormal(0.0, SPREAD, n), share), truth)


def _mean(random: np.random.Generator, n: int) -> tuple[Spread, float]:
    return mean_of(random.normal(size=n)), 0.0


def _skewed_mean(random: np.random.Generator, n: int) -> tuple[Spread, float]:
    return mean_of(random.lognormal(0.0, SPREAD, n)), float(np.exp(0.5 * SPREAD**2))


def _errors(random: np.random.Generator, n: int) -> np.ndarray:
    """Errors of unit variance in runs, shape (runs, SAMPLES), each 0.8 times the one before and noise."""
    noise = random.normal(size=(n, SAMPLES))
    noise[:, 1:] *= 0.6
    return np.asarray(scipy.signal.lfilter([1.0], [1.0, -0.8], noise, axis=1))


def _nees(random: np.random.Generator, n: int) -> tuple[Spread, float]:
    squares = (_errors(random, n) ** 2 + _errors(random, n) ** 2).sum(axis=1)
    return mean_over_samples(squares, np.full(n, SAMPLES)), 2.0


def _bound(random: np.random.Generator, n: int) -> tuple[Spread, float]:
    inside = (np.abs(_errors(random, n)) <= 2.0).sum(axis=1)
    return coverage(inside, np.full(n, SAMPLES)), float(2.0 * scipy.special.ndtr(2.0) - 1.0)


def _paired(random: np.random.Generator, n: int) -> tuple[Spread, float]:
    weather = random.normal(size=n)
    a, b = weather + random.exponential(size=n), weather + random.exponential(size=n) + 0.3
    return compared({"a": a, "b": b})[0].difference, -0.3


def _rank(random: np.random.Generator, n: int) -> tuple[Spread, float]:
    x, z = random.normal(size=(2, n))
    truth = 6.0 / np.pi * np.arcsin(0.5 * 0.6)  # of two normal numbers with correlation 0.6
    return rank_correlation(x.tolist(), 0.6 * x + 0.8 * z), truth


def _explained(random: np.random.Generator, n: int) -> tuple[Spread, float]:
    x, z = random.normal(size=(2, n))
    # E[rank y | x] = Phi(0.6 x / sqrt(1 + 0.8^2)): ranks of two y of one x are correlated as normal numbers with 0.36
    truth = 6.0 / np.pi * np.arcsin(0.5 * 0.36)
    return explained_share(x.tolist(), 0.6 * x + 0.8 * z), truth


KINDS: dict[str, Draw] = {
    "share of 0.5": _share(0.5),
    "share of 0.05": _share(0.05),
    "share of 0.001": _share(0.001),
    "share, any from 0 to 1": _any_share,
    "rate of events, 0.05 a run": _events,
    "median": _quantile(0.5),
    "quartile": _quantile(0.25),
    "95 % quantile": _quantile(0.95),
    "mean, normal": _mean,
    "mean, skewed": _skewed_mean,
    "NEES of 2 states": _nees,
    "time within a bound": _bound,
    "median of paired differences": _paired,
    "rank correlation of 0.58": _rank,
    "explained share of 0.35": _explained,
}
EXACT = {"share of 0.5": 0.5, "share of 0.05": 0.05, "share of 0.001": 0.001}


def held(kind: str, n: int, campaigns: int) -> str:
    """How often an interval held its truth [%]; behind it, where that is known, the sum over all counts."""
    random = np.random.default_rng([n, *kind.encode()])
    found = [KINDS[kind](random, n) for _ in range(campaigns)]
    if np.isnan(found[0][0].low):
        return f"needs {found[0][0].needed}"
    share = np.mean([spread.low <= truth <= spread.high for spread, truth in found])
    return f"{100 * share:.1f}" + (f" ({100 * _summed(EXACT[kind], n):.2f})" if kind in EXACT else "")


def _summed(rate: float, n: int) -> float:
    weights = scipy.stats.binom.pmf(np.arange(n + 1), n, rate)
    ends = [proportion(k, n) if weight > 1e-12 else Spread(0.0) for k, weight in enumerate(weights)]
    return float(sum(w for w, end in zip(weights, ends, strict=True) if end.low <= rate <= end.high))


def looks(campaigns: int, rate: float, goal: RateGoal, most: int) -> tuple[float, float, float]:
    """Of campaigns that are looked at in 200 places: whose last interval held, all of whose held, and the share of
    such whose Clopper-Pearson intervals all held.
    """
    random = np.random.default_rng(1)
    places = np.unique(np.geomspace(20, most, 200).astype(int))
    last, always, naive = 0, 0, 0
    for _ in range(campaigns):
        counts = np.cumsum(random.uniform(size=most) < rate)[places - 1]
        spreads = [goal.interval(int(k), int(n)) for k, n in zip(counts, places, strict=True)]
        exact = [proportion(int(k), int(n)) for k, n in zip(counts, places, strict=True)]
        last += spreads[-1].low <= rate <= spreads[-1].high
        always += all(s.low <= rate <= s.high for s in spreads)
        naive += all(s.low <= rate <= s.high for s in exact)
    return last / campaigns, always / campaigns, naive / campaigns


def main() -> None:
    """The tables."""
    words = sys.argv
    campaigns = int(words[words.index("--campaigns") + 1]) if "--campaigns" in words else CAMPAIGNS
    lines = [f"| 95 % interval of | {' | '.join(f'{n} runs' for n in RUNS)} |", "|---" * (len(RUNS) + 1) + "|"]
    for kind in KINDS:
        cells = " | ".join(held(kind, n, campaigns) for n in RUNS)
        lines.append(f"| {kind} | {cells} |")
        print(lines[-1], flush=True)
    sequential = ["| rate | all 200 looks held | the last held | Clopper-Pearson at all looks |", "|---|---|---|---|"]
    for rate in (0.5, 0.05, 0.005):
        last, always, naive = looks(campaigns // 10, rate, RateGoal(below=0.05), 2000)
        sequential.append(f"| {rate:g} | {100 * always:.1f} % | {100 * last:.1f} % | {100 * naive:.1f} % |")
    counts = [
        "| claim | fixed before, no failure | one failure allowed | may look after every run |",
        "|---|---|---|---|",
    ]
    for limit in (1e-2, 1e-3, 1e-4):
        fixed = [runs_to_show_below(limit, failures) for failures in (0, 1)]
        counts.append(f"| below {limit:g} | {fixed[0]} | {fixed[1]} | {RateGoal(below=limit).runs()} |")
    print_tables(PAGE, {"held": "\n".join(lines), "looks": "\n".join(sequential), "counts": "\n".join(counts)})


if __name__ == "__main__":
    main()
