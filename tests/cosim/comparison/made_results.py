"""Results made by hand: a table from arrays, with units and variability as asked."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from cosim.comparison.compare import compare_results
from cosim.comparison.comparison import Comparison
from cosim.comparison.tolerance import Tolerance, Tolerances
from cosim.comparison.verdict import SignalComparison
from cosim.results.result import BaliseRecord, Result, SignalInfo

STRICT = Tolerance(absolute=1e-3, relative=0.0, time=1e-6)


def made(
    time: Any,
    *,
    units: Mapping[str, str] | None = None,
    discrete: Iterable[str] = (),
    events: Iterable[BaliseRecord] = (),
    summary: Mapping[str, Any] | None = None,
    **signals: Any,
) -> Result:
    """A result of some signals; ``plant__speed`` becomes ``plant.speed``."""
    columns = {name.replace("__", "."): np.asarray(values, dtype=float) for name, values in signals.items()}
    table = np.zeros(len(time), dtype=[("time", float), *((name, float) for name in columns)])
    table["time"] = time
    for name, values in columns.items():
        table[name] = values
    held = set(discrete)
    infos = [
        SignalInfo(name, (units or {}).get(name, "1"), variability="discrete" if name in held else "continuous")
        for name in columns
    ]
    return Result(table, infos, list(events), summary or {})


def compared(reference: Result, result: Result, tolerance: Tolerance = STRICT, **more: Any) -> Comparison:
    """The comparison with one tolerance for all."""
    return compare_results(reference, result, Tolerances(tolerance), **more)


def signal(time: Any, reference: Any, result: Any, tolerance: Tolerance = STRICT, **more: Any) -> SignalComparison:
    """The comparison of one signal ``y`` on one grid."""
    return compared(made(time, y=reference, **more), made(time, y=result, **more), tolerance)["y"]


def kinds(one: SignalComparison) -> list[str]:
    """Kinds of the findings, worst first."""
    return [finding.kind for finding in one.findings]
