"""The finding about gaps between samples: every mixture up to a length by one Lyapunov function, and constant gaps."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from math import inf, isinf

from fmu_observer.certificates.finding import Finding, Kind, limit_found, remark

CONSTANT_GAP, GROWTH, DECREASE = "constant gap", "growth from sample to sample", "decrease of the Lyapunov function"


def gap_finding(
    gap: float,
    horizon: float,
    constant_limit: float,
    mixed_limit: float,
    *,
    growth: float,
    decrease: float,
    holds: bool,
    error_model: str,
    remarks: Iterable[str] = (),
    matrix: tuple[tuple[float, ...], ...] = (),
) -> Finding:
    """What is found about gaps up to a length.

    Args:
        gap: longest one asked for [s]. horizon: longest one searched for limits [s]; inf where what is found holds for
            every gap.
        constant_limit: first constant gap at which the error grows from sample to sample [s]; inf for none.
        mixed_limit: longest gap such that one common quadratic Lyapunov function covers every mixture of gaps up to it
            [s]; inf if all up to the horizon are covered, 0 if none that was tried. Between the two limits mixtures may
            make the error grow.
        growth: largest factor per sample at the constant gap `gap` [1].
        decrease: smallest relative decrease of the Lyapunov function over all gaps up to `gap`, recomputed on a grid
            much finer than the one it was found on, less a bound for what lies between [1]; -inf without a candidate.
        holds: whether gaps up to `gap` are covered. error_model: the error equations used, and what they leave out.
        remarks: further conditions in words. matrix: of the Lyapunov function at `gap`, rows of shape (n, n).
    """
    found = limit_found("mixed gaps", mixed_limit, horizon, error_model, kind="sufficient")
    conditions = (
        limit_found(CONSTANT_GAP, constant_limit, horizon, error_model),
        Finding(GROWTH, growth, "1", "exact", f"at a constant gap of {gap:.4g} s", growth < 1.0),
        Finding(DECREASE, decrease, "1", "sufficient", f"gaps up to {gap:.4g} s"),
        *map(remark, remarks),
    )
    return Finding(
        found.what,
        found.value,
        "s",
        found.kind,
        error_model,
        holds,
        conditions=conditions,
        demand=gap,
        lyapunov_matrix=matrix,
    )


def with_limit(found: Finding, longest: float, growth: float) -> Finding:
    """The finding where something else ends at a gap, and grows by so much.

    Args:
        found: as `gap_finding` gives it. longest: gap beyond which it does not hold [s], inf for none.
        growth: factor per sample at the gap asked for [1].
    """
    constant, grows, *others = found.conditions
    largest = max(grows.value, growth)
    conditions = (_shortened(constant, longest, "exact"), replace(grows, value=largest, holds=largest < 1.0), *others)
    return replace(_shortened(found, longest, "sufficient"), conditions=conditions)


def _shortened(found: Finding, longest: float, kind: Kind) -> Finding:
    return replace(found, value=longest, kind=kind) if longest < found.limit else found


def explained_gaps(found: Finding, observer: str, event: str) -> str:
    """One to three plain sentences for the user, the error model included.

    Args:
        found: as `gap_finding` gives it. observer: name and preset. event: what the gaps lie between.
    """
    also = f" Also checked: {'; '.join(found.remarks)}." if found.remarks else ""
    return f"{observer}: {_verdict(found, event)}.{also} Checked on the {found.source}."


def _verdict(found: Finding, event: str) -> str:
    gap, limit = f"{found.demand:.4g} s", _limit(found, found)
    if found.holds:
        return f"stable for every sequence of {event} gaps up to {gap} (limit {limit})"
    growth = found.numbers[GROWTH]
    if growth >= 1.0:
        constant = _limit(found.condition(CONSTANT_GAP), found)
        return (
            f"UNSTABLE at a constant {event} gap of {gap}: the error grows {growth:.4g} times from {event} to {event}; "
            f"constant gaps are stable below: {constant}; mixed gaps are certified up to: {limit}"
        )
    return (
        f"NOT CERTIFIED for mixed {event} gaps up to {gap}: that constant gap is stable, but sequences of different "
        f"gaps are certified only up to: {limit}"
    )


def _limit(part: Finding, found: Finding) -> str:
    if part.limit == 0.0:
        return "no gap at all" if found.condition(CONSTANT_GAP).limit == 0.0 else "no gap that was tried"
    if isinf(part.limit):
        return "none" if part.value == inf else f"none found up to {part.value:.4g} s"
    return f"{part.value:.4g} s"
