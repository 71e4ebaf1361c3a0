"""Whether the covariances of observers fit their errors: NIS and NEES of a run, with their bands. Imports NumPy;
SciPy where a filter is judged.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from cosim.evaluation.metrics import FEWEST_INSTANTS
from cosim.evaluation.roles import estimate, label, recorded
from cosim.evaluation.spec import ReportSpec
from cosim.results.result import Result
from fmu_observer.formulas.filtering.covariance_consistency import Consistency, evaluate, normalised_squares
from fmus.tables.numbers import number

Kind = Literal["NIS", "NEES", "error"]
STD = "_std"
_NOT_MEASUREMENTS = ("_std", "_covariance", "_likelihood")

ADVICE = {
    "overconfident": "it trusts itself more than its errors allow. Increase the covariance of the process noise, or "
    "that of the measurements where the sensor is worse than stated; a wrong model or a bias looks alike",
    "underconfident": "its errors are smaller than it reports. Decrease the covariances of process or measurements; a "
    "plant or a sensor that adds no noise in this run looks alike",
}
MEANING = {
    "NIS": "how far measurements are from what it expects, squared, over the variance that it reports for that",
    "NEES": "how far all its states are from the truth, squared, over the variances that it reports for that",
    "error": "how far this one is from the truth, squared, over the variance that it reports for that",
}
"""What is judged, by kind, for those who do not know the words."""
_NOTHING_WRONG = 1e-6
"""Mean square of errors, in units of what is reported, below which a run holds no noise to judge a covariance by."""
_COLOURED = (
    "Innovations look small because the error lasts (a wheel that creeps, a bias): give it a state, or increase the "
    "covariance of the process noise"
)


@dataclass(frozen=True)
class FilterConsistency:
    """Normalised squares of one observer over the evaluated part of a run.

    Args:
        observer: component name. kind: ``NIS`` of the innovation, ``NEES`` of all states with their covariance, or
            ``error``, of one quantity with its standard deviation.
        quantity: what an ``error`` is of; empty for the others.
        time: of the samples [s], shape (samples,). squares: normalised squares, shape (samples,).
        degrees: degrees of freedom of each sample, shape (samples,).
        found: mean, bands and verdict.
    """

    observer: str
    kind: Kind
    quantity: str
    time: np.ndarray
    squares: np.ndarray
    degrees: np.ndarray
    found: Consistency

    @property
    def name(self) -> str:
        """What is normalised, for people."""
        return f"NEES of {self.quantity}" if self.kind == "error" else self.kind

    def to_data(self) -> dict[str, Any]:
        """Numbers for the summary of a run."""
        found = self.found
        return {
            "observer": self.observer,
            "quantity": self.name,
            "degrees": found.degrees,
            "mean": found.mean,
            "low": found.band.low,
            "high": found.band.high,
            "inside": found.inside,
            "samples": found.samples,
            "independent_samples": found.independent,
            "verdict": found.verdict,
        }


def filter_consistency(result: Result, spec: ReportSpec) -> list[FilterConsistency]:
    """NIS and NEES of all observers that state a covariance, from the start of the evaluation on.

    An observer is judged by its outputs: ``nis`` (degrees: the outputs ``innovation...``, or ``nis_degrees`` at each
    sample); ``<x>_std`` beside the true value of x; and all of them together where ``covariance`` was recorded, its
    rows in the order of the ``<x>_std``. The true value of x is the signal with its role, or the output x of the
    component that gives the true position or speed.

    Args:
        result: the run. spec: observers, roles and start of the evaluation.

    Returns:
        Observer by observer: NIS, NEES, then single quantities.
    """
    if not len(result.time):
        return []
    return [found for observer in spec.observers for found in _of_one(result, spec, observer)]


def consistency_warnings(result: Result, spec: ReportSpec) -> Iterator[str]:
    """Texts for filters whose covariance does not fit, one an observer.

    Each test more raises false alarms, so an observer that reports NIS is warned of by NIS, and by NEES where that says
    that it trusts itself too much; one that reports no NIS by NEES, and one without a covariance by single quantities.

    Args:
        result: the run. spec: observers, roles and labels.
    """
    entries = filter_consistency(result, spec)
    for observer in spec.observers:
        entry = next((e for e in _deciding(entries, observer) if e.found.verdict in ADVICE), None)
        if entry is None:
            continue
        found = entry.found
        larger = next((e for e in entries if e.observer == observer and _is_error(e, "overconfident")), None)
        if entry.kind == "NIS" and found.verdict == "underconfident" and larger is not None:
            yield (
                f"{label(spec, observer)} leaves out an error that lasts (is not white): its {entry.name} is "
                f"{number(found.mean)} on average where {number(found.degrees)} is expected, yet its {larger.name} is "
                f"{number(larger.found.mean)} where {number(larger.found.degrees)} is ({entry.name}: "
                f"{MEANING[entry.kind]}; {larger.name}: {MEANING[larger.kind]}). {_COLOURED}; "
                "see docs/reference/consistency.md."
            )
            continue
        yield (
            f"{label(spec, entry.observer)} is {found.verdict}: its {entry.name} is {number(found.mean)} on average "
            f"where {number(found.degrees)} is expected ({number(found.band.low)} to {number(found.band.high)} for 99 "
            f"% of consistent filters; {entry.name}: {MEANING[entry.kind]}): {ADVICE[found.verdict]}; see "
            f"docs/reference/consistency.md."
        )


def _is_error(entry: FilterConsistency, verdict: str) -> bool:
    """Whether an entry judges errors from the truth, and so."""
    return entry.kind != "NIS" and entry.found.verdict == verdict


def _deciding(entries: Sequence[FilterConsistency], observer: str) -> list[FilterConsistency]:
    """Entries of an observer that may warn."""
    nis, nees, single = (
        [e for e in entries if e.observer == observer and e.kind == kind] for kind in ("NIS", "NEES", "error")
    )
    if nis:
        return nis + [e for e in nees if e.found.verdict == "overconfident"]
    return nees or single


def _true_value(result: Result, spec: ReportSpec, quantity: str) -> np.ndarray | None:
    """The true value of a quantity, shape (rows,), or None where none was recorded."""
    of_role = recorded(result, getattr(spec, f"true_{quantity}", None))
    if of_role is not None:
        return of_role
    for place in (spec.true_position, spec.true_speed):
        plant = "" if place is None else place.rpartition(".")[0]
        found = recorded(result, f"{plant}.{quantity}") if plant else None
        if found is not None:
            return found
    return None


def _of_one(result: Result, spec: ReportSpec, observer: str) -> Iterator[FilterConsistency]:
    fields = [f for f in result.table.dtype.names or () if f.startswith(f"{observer}.")]
    names = [f.removeprefix(f"{observer}.") for f in fields]
    nis = estimate(result, observer, "nis")
    if nis is not None:
        rows = np.flatnonzero(np.diff(nis) != 0.0) + 1  # between samples it is held
        rows = rows[result.time[rows] >= spec.evaluate_after]
        yield from _evaluated(
            observer, "NIS", "", result.time[rows], nis[rows], _degrees(result, observer, names)[rows]
        )
    rows = _instants(result, spec)
    quantities = [name.removesuffix(STD) for name in names if name.endswith(STD)]
    errors: dict[str, np.ndarray] = {}
    for quantity in quantities:
        true, believed = _true_value(result, spec, quantity), recorded(result, f"{observer}.{quantity}")
        if true is not None and believed is not None:
            with np.errstate(invalid="ignore", over="ignore"):
                errors[quantity] = (believed - true)[rows]
    time, n = result.time[rows], len(quantities)
    covariance = [f"{observer}.covariance[{i}]" for i in range(1, n * n + 1)]
    if n > 1 and len(errors) == n and set(covariance) <= set(fields):
        P = np.stack([result[name][rows] for name in covariance], axis=1).reshape(-1, n, n)
        squares = normalised_squares(np.stack(list(errors.values()), axis=1), P)
        yield from _evaluated(observer, "NEES", "", time, squares, np.full(len(time), float(n)))
    for quantity, error in errors.items():
        spread = result[f"{observer}.{quantity}{STD}"][rows]
        squares = normalised_squares(error[:, None], spread[:, None] ** 2)
        yield from _evaluated(observer, "error", quantity, time, squares, np.ones(len(time)))


def _evaluated(
    observer: str, kind: Kind, quantity: str, time: np.ndarray, squares: np.ndarray, degrees: np.ndarray
) -> Iterator[FilterConsistency]:
    known = ~np.isnan(squares)
    if np.count_nonzero(known) < FEWEST_INSTANTS:
        return
    time, squares, degrees = time[known], squares[known], degrees[known]
    if kind != "NIS" and squares.mean() < _NOTHING_WRONG * degrees.mean():
        return  # the plant moves without noise as the filter expects it to
    found = evaluate(squares, degrees, white=kind == "NIS")
    yield FilterConsistency(observer, kind, quantity, time, squares, degrees, found)


def _degrees(result: Result, observer: str, names: list[str]) -> np.ndarray:
    """Degrees of freedom of NIS in each row: reported, or the number of innovations, or 1."""
    degrees = estimate(result, observer, "nis_degrees")
    if degrees is not None:
        return degrees
    return np.full(len(result.time), float(measurement_count(names)))


def measurement_count(outputs: Iterable[str]) -> int:
    """How many measurements the innovations of an observer are of; 1 where it reports none of them.

    Args:
        outputs: names of its outputs, vectors element by element.
    """
    return max(len([name for name in outputs if name.startswith("innovation") and not _ends(name)]), 1)


def _ends(name: str) -> bool:
    return name.partition("[")[0].endswith(_NOT_MEASUREMENTS)


def _instants(result: Result, spec: ReportSpec) -> np.ndarray:
    """The last row of each instant that is judged."""
    last = np.append(np.diff(result.time) > 0.0, True)
    return np.flatnonzero(last & (result.time >= spec.evaluate_after))
