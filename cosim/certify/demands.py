"""Demands on an observer held against its findings: gaps, a period, a delay, an error."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from math import nan
from typing import Any

from fmu_observer.certificates.finding import Finding, Kind
from fmu_observer.event_protocol import DEFAULT_REPLAY_HORIZON

_MEMORY = "declared_memory"


@dataclass(frozen=True)
class Demands:
    """What is to be certified; None for what is not.

    Args:
        gap: longest of any mixture of gaps between samples [s]. period: constant one [s]. delay: of samples [s].
        error: largest speed error just before the next sample [m/s]. missing: most samples missing in a row, for which
            bounds of the error are found too. by: kind of bound that decides.
    """

    gap: float | None = None
    period: float | None = None
    delay: float | None = None
    error: float | None = None
    missing: int = 0
    by: Kind = "sufficient"


@dataclass(frozen=True)
class Certified:
    """An observer with its findings.

    Args:
        observer: name. findings: the one that decides first. demanded: those that demands were held against.
        notes: what else is to be known.
    """

    observer: str
    findings: tuple[Finding, ...]
    demanded: tuple[Finding, ...] = ()
    notes: tuple[str, ...] = ()

    @property
    def unmet(self) -> list[str]:
        """Demands that do not hold, in words."""
        return [_in_words(self.observer, found) for found in self.demanded if not found.holds]

    def to_dict(self) -> dict[str, Any]:
        """Plain data."""
        return {
            "observer": self.observer,
            "findings": [found.to_dict() for found in self.findings],
            "demanded": [found.to_dict() for found in self.demanded],
            "notes": list(self.notes),
        }


def certified(
    name: str, system: Any, demands: Demands, parameters: Mapping[str, Any] | None = None, preset: str | None = None
) -> Certified:
    """All findings of an observer, and demands held against them.

    Args:
        name: for messages and tables. system: the observer, with `findings`. demands: to be certified.
        parameters, preset: as for `findings`.

    Raises:
        ValueError: a demand, a parameter or the preset is not legal.
    """
    parameters = dict(parameters or {})
    own_delay = demands.delay is not None and "delay" in {s.name for s in system.parameter_signals}
    if own_delay:
        parameters["delay"] = demands.delay
    findings = list(system.findings(demands.gap, parameters, preset))
    if demands.error is not None or demands.missing:
        findings = [found for found in findings if found.unit != "m/s"]
        findings += system.error_bounds(parameters, preset).findings(demands.error, demands.missing)
    demanded = list(_demanded(findings, demands, system, own_delay))
    shown = {(found.what, found.kind): found for found in demanded}
    return Certified(name, tuple(shown.get((f.what, f.kind), f) for f in findings), tuple(demanded))


def _demanded(findings: Sequence[Finding], demands: Demands, system: Any, own_delay: bool) -> Iterator[Finding]:
    if demands.gap is not None:
        about_gaps = next((found for found in findings if found.demand is not None), None)
        yield about_gaps or _nothing_known("mixed gaps", demands.gap)
    if demands.period is not None:
        constant = next((found for found in findings if _is_of_period(found)), None)
        yield _held_against(constant, demands.period) if constant else _nothing_known("constant gap", demands.period)
    if demands.delay is not None:
        yield from _of_delay(findings, demands.delay, system, own_delay)
    if demands.error is not None:
        yield next(found for found in findings if found.unit == "m/s" and found.kind == demands.by)


def _of_delay(findings: Sequence[Finding], delay: float, system: Any, own: bool) -> Iterator[Finding]:
    """The limit of the predictors and the memory, where an observer knows the delay; else that samples are replayed."""
    if not own:
        source = "late samples are used at their stamps, back to the replay horizon"
        within = delay <= DEFAULT_REPLAY_HORIZON
        replayed = Finding("delay", DEFAULT_REPLAY_HORIZON, "s", "exact", source, within, demand=delay)
        yield replayed if system.triggered_events else _nothing_known("delay", delay)
        return
    limits = [found for found in findings if found.what.startswith("delay") and found.kind == "exact"]
    yield from (_held_against(found, delay) for found in limits)
    for found in findings:
        if _MEMORY in found.numbers:
            yield replace(found.condition(_MEMORY), demand=delay, holds=delay <= found.numbers[_MEMORY])


def _is_of_period(found: Finding) -> bool:
    of_time = found.unit == "s" and found.kind in ("exact", "not found up to")
    return of_time and not found.what.startswith(("mixed", "delay"))


def _held_against(found: Finding, demand: float) -> Finding:
    within = demand <= found.value if found.kind == "not found up to" else demand < found.value
    return replace(found, demand=demand, holds=within)


def _nothing_known(what: str, demand: float) -> Finding:
    return Finding(what, nan, "s", "exact", "none", False, "it has no finding about that", demand=demand)


def _in_words(observer: str, found: Finding) -> str:
    if found.explanation:
        return found.explanation
    known = f"{found.value:.4g} {found.unit} is known ({found.kind})" if found.value == found.value else found.statement
    return f"{observer}: {found.what} of {found.demand:.4g} {found.unit} is not certified; {known}."
