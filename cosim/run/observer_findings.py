"""Findings before the run: whether gains are stable for the gaps that observers will meet, and whether conditions hold.

One way for all that brings samples: balises, packets, connections and recordings.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import asdict, astuple, replace
from itertools import islice
from math import inf, isfinite
from typing import Any, NamedTuple

from cosim.errors import CertificateError
from cosim.run.component_models import make_system, stated_parameters, values_in_use
from cosim.run.expected_gaps import ExpectedGap
from cosim.scenario.scenario_tables import ComponentTable
from fmu_observer.certificates.finding import Finding
from fmu_observer.certificates.gap_findings import CONSTANT_GAP, DECREASE, GROWTH
from fmu_observer.observers.evaluated_observer import OTHER_GAINS
from plant_models.disk_cache.entries import remembered
from plant_models.disk_cache.identity import identity
from plant_models.missing_package import MissingPackageError

_WALKING = 1.0
"""Who is stable for the gaps of a train at this speed [m/s] is stable for all that a moving train meets."""
_DETECTORS = "fmu_observer.detection."
"""Room of the models that correct no state by a gain, so that there is nothing to evaluate."""
_UNKNOWN = (
    "{}: not known before the run whether it stays stable over the gaps between its samples: an FMU, or a model whose "
    "findings are not about gaps, does not say. Watch its errors."
)
_ROUNDING = 1e-9  # relative, of distances between positions
_LIMITS_ONLY = 0.5
"""A gap to ask for [s] where only limits are of interest; they do not depend on it."""

Evaluation = tuple[Finding | None, list[str]]
"""The finding about gaps, where there is one, and warnings."""


def evaluate_observers(
    components: Mapping[str, ComponentTable], gaps: Mapping[str, ExpectedGap], mode: str, where: str
) -> tuple[dict[str, dict[str, Any]], list[str]]:
    """Findings about gaps of all observers that have some, and what speaks against the observers.

    Args:
        components: tables by name. gaps: what each that waits for samples has to expect. mode: ``warn``, ``require`` or
            ``ignore``.
        where: name of the scenario, for messages.

    Returns:
        Findings by component as plain data, and warnings: those about gaps first, then conditions that do not hold.

    Raises:
        CertificateError: `mode` is ``require`` and something does not hold, or is not known.
    """
    certificates: dict[str, dict[str, Any]] = {}
    about_gaps: list[str] = []
    others: list[str] = []
    for name, table in components.items() if mode != "ignore" else ():
        gap = gaps.get(name)
        system: Any = make_system(table, where) if gap is not None or table.observer is not None else None
        if (gap is None and not hasattr(system, "findings")) or type(system).__module__.startswith(_DETECTORS):
            continue
        found, warnings = evaluated(name, table, system, gap)
        if found is not None and gap is not None:
            certificates[name] = _entry(found, table, system)
            about_gaps += [*warnings, *_other_spacing(name, table, system, gap)]
        else:
            about_gaps += [] if gap is None else [_UNKNOWN.format(name)]
            others += [f"{name}: {warning}" for warning in warnings]
    if mode == "require" and (about_gaps or others):
        texts = "\n".join([*about_gaps, *others])
        raise CertificateError(f"{where}: certificates = 'require' and not all hold.\n{texts}")
    return certificates, [*about_gaps, *others]


class GapSeen(NamedTuple):
    """The longest gap between samples that an observer met [s], None for no sample; and what it lies between."""

    seconds: float | None
    between: str


def findings_after(
    certificates: Mapping[str, dict[str, Any]], gaps: Mapping[str, GapSeen]
) -> tuple[dict[str, dict[str, Any]], list[str]]:
    """Findings held against the gaps of a run.

    Args:
        certificates: as `evaluate_observers` gives them. gaps: that occurred, by component.

    Returns:
        The same with what was seen, and warnings of gaps beyond what is certified.
    """
    found, beyond = dict(certificates), list[str]()
    for name, (gap, between) in gaps.items():
        if name not in certificates:
            continue
        found[name] = certificates[name] | {"largest_gap_seen": gap}
        limit = certificates[name]["certified_up_to"]
        if limit is not None and gap is not None and gap > limit and certificates[name]["holds"] is not False:
            beyond.append(f"{name}: the longest gap between {between} was {gap:.3g} s, certified are {limit:.3g} s.")
    return found, beyond


def evaluated(name: str, table: ComponentTable, system: Any, gap: ExpectedGap | None) -> Evaluation:
    """The finding of one observer that decides, from the cache where it was asked for before.

    Args:
        name: of the component. table: of it. system: what it names; one without findings has none. gap: to expect.
    """
    if not hasattr(system, "findings"):
        return None, []
    asked = name, system, table.preset, stated_parameters(table, system), None if gap is None else astuple(gap)
    key = identity(asked, code=("fmu_observer", "cosim/run/observer_findings.py"))

    def evaluate() -> tuple[dict[str, Any] | None, list[str]]:
        found, warnings = _evaluated(name, table, system, gap)
        return None if found is None else asdict(found), warnings

    try:
        fields, warnings = remembered("finding", key, evaluate)
    except MissingPackageError as error:
        return None, [f"what is certified is not known. {error}."]
    return None if fields is None else Finding.of(fields), warnings


def _evaluated(name: str, table: ComponentTable, system: Any, gap: ExpectedGap | None) -> Evaluation:
    in_use = stated_parameters(table, system), table.preset
    if not hasattr(system, "sampled_events"):
        return None, _of_condition(system, *in_use)
    if gap is None:
        return None, []
    asked = _LIMITS_ONLY if gap.seconds is None else gap.seconds
    found = iter(system.findings(asked, *in_use))
    first: Finding = next(found)
    if gap.seconds is not None:
        return first, [] if first.holds else _of_gap(name, first, found, gap)
    if gap.distance is not None and first.limit == inf:  # no limit so far: ask for gaps like these
        first = next(iter(system.findings(max(asked, gap.distance / _WALKING), *in_use)))
        if first.holds:
            return first, []
    return _of_unknown_gap(name, first, gap)


def _of_condition(system: Any, parameters: Mapping[str, Any], preset: str | None) -> list[str]:
    """What the condition of an observer says against it, or why it cannot be evaluated."""
    try:
        found = next(iter(system.findings(None, parameters, preset)), None)
    except (ValueError, ArithmeticError) as error:
        return [f"its condition cannot be evaluated with these parameters: {error}."]
    if found is None:
        return []
    refuted = [] if found.holds else [f"its condition {found.explain()}"]
    return [*refuted, *(f"{c.statement}." for c in found.conditions if c.holds is False and c.statement)]


def _of_gap(name: str, found: Finding, others: Iterator[Finding], gap: ExpectedGap) -> list[str]:
    """That gains are not certified for a gap, and which ones would be, where the next finding names some."""
    if gap.never:
        return [
            f"{name}: {gap.reason}: it is on its own for all of {gap.seconds:.4g} s, and its gains are certified for "
            f"gaps up to {found.value:.3g} s. Connect what it waits for, or evaluate it by its errors and leave this "
            f"out by certificates = 'ignore'."
        ]
    advice = next((other.statement for other in islice(others, 1) if other.what == OTHER_GAINS), "")
    instead = f" Instead: {advice}." if advice else ""
    return [f"{found.explain()} Expected: {gap.seconds:.3g} s ({gap.reason}).{instead}"]


def _of_unknown_gap(name: str, found: Finding, gap: ExpectedGap) -> Evaluation:
    """What is certified, where the gap to expect is not known before the run."""
    limit = found.limit
    reach = f"up to {limit:.3g} s" if limit < inf else f"for all gaps searched, up to {found.value:.3g} s"
    known = f"its gains are certified {reach}"
    if gap.distance is not None and 0.0 < limit < inf:
        known += f", enough for {gap.distance:g} m from {gap.distance / limit:.3g} m/s on"
    gaps = found.what.removeprefix("mixed ")
    text = f"{name}: {gaps} cannot be known before this run ({gap.reason}); {known}."
    return replace(found, holds=None, demand=None, explanation=text), [text]


def _entry(found: Finding, table: ComponentTable, system: Any) -> dict[str, Any]:
    """The entry of a results folder: infinite limits as None; numbers at a gap only where one was asked for."""
    constant, in_use = found.condition(CONSTANT_GAP), (stated_parameters(table, system), table.preset)
    ends = [part.value for part in (found, constant) if part.limit == inf]
    numbers = {
        "max_gap": found.demand,
        "horizon": min(ends, default=inf),
        "constant_limit": constant.limit,
        "aperiodic_limit": found.limit,
        "certified_up_to": found.value,
        "spectral_radius": None if found.demand is None else found.numbers[GROWTH],
        "quadratic_margin": None if found.demand is None else found.numbers[DECREASE],
    }
    return {name: value if value is not None and isfinite(value) else None for name, value in numbers.items()} | {
        "holds": found.holds,
        "error_model": found.source,
        "observer": system.name,
        "preset": table.preset or system.default_preset or "declared starts",
        "parameters": system.deciding_values(*in_use) if hasattr(system, "deciding_values") else {},
        "notes": list(found.remarks),
        "event": found.what.removeprefix("mixed ").removesuffix(" gaps"),
        "lyapunov_matrix": [list(row) for row in found.lyapunov_matrix],
        "explanation": found.explain(),
    }


def _other_spacing(name: str, table: ComponentTable, system: Any, gap: ExpectedGap) -> list[str]:
    """A warning where an observer expects balises at another spacing than the layout's, and does not learn it."""
    if gap.spacings is None or "expected_spacing" not in {s.name for s in system.parameter_signals}:
        return []
    values = values_in_use(table, system)
    expected, error = float(values.expected_spacing), float(values.assumed_spacing_error)
    shortest, longest = gap.spacings
    lowest, highest = expected * (1.0 - error), expected * (1.0 + error) * (1.0 + _ROUNDING)
    if (lowest <= shortest * (1.0 + _ROUNDING) and longest <= highest) or system.options.get("spacing") == "learnt":
        return []
    return [
        f"{name}: expects balises every {expected:g} m within {100.0 * error:g} %, but the layout has them "
        f"{shortest:g} to {longest:g} m apart; set expected_spacing and assumed_spacing_error, or let it learn the "
        f"spacing."
    ]
