"""Certificates before the run: whether the gains of the observers are certified for the gaps that they will meet."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import astuple
from math import inf
from typing import Any

from cosim.errors import CertificateError
from cosim.run.component_models import given_parameters, make_system, values_in_use
from cosim.run.expected_gaps import ExpectedGap
from cosim.scenario.scenario_tables import ComponentTable
from plant_models.disk_cache.entries import remembered
from plant_models.disk_cache.identity import identity

_WALKING = 1.0
"""Who is certified for the gaps of a train at this speed [m/s] is certified for all that a moving train meets."""
_DETECTORS = "fmu_observer.detection."
"""Room of the models that correct no state by a gain, so that there is nothing to certify."""
UNKNOWN = (
    "{}: not known before the run whether it stays stable over the gaps between its samples: an FMU, or a model "
    "without a method certify, does not say. Watch its errors."
)
ROUNDING = 1e-9  # relative, of distances between positions
_ASKED_FOR_LIMITS_ONLY = 0.5
"""A gap to ask for [s] where only the limits of a certificate are of interest; they do not depend on it."""


def check_certificates(
    components: Mapping[str, ComponentTable], gaps: Mapping[str, ExpectedGap], mode: str, where: str
) -> tuple[dict[str, dict[str, Any]], list[str]]:
    """Certificates of all observers that offer one.

    Args:
        components: tables by name. gaps: what each that waits for samples has to expect. mode: ``warn``, ``require``
            or ``ignore``.
        where: name of the scenario, for messages.

    Returns:
        Certificates by component as plain data, and warnings.

    Raises:
        CertificateError: `mode` is ``require`` and a certificate does not hold, or cannot be had.
    """
    certificates: dict[str, dict[str, Any]] = {}
    warnings: list[str] = []
    if mode == "ignore":
        return certificates, warnings
    for name, gap in gaps.items():
        table = components[name]
        system = make_system(table, where)
        if type(system).__module__.startswith(_DETECTORS):
            continue  # it has no gain that a gap could make unstable
        if not hasattr(system, "certify"):
            warnings.append(UNKNOWN.format(name))
            continue
        certificates[name], doubt = _known_judgement(name, table, system, gap)
        warnings += [*doubt, *_other_spacing(name, table, system, gap)]
    if mode == "require" and warnings:
        raise CertificateError(f"{where}: certificates = 'require' and not all hold.\n" + "\n".join(warnings))
    return certificates, warnings


def _known_judgement(name: str, table: ComponentTable, system: Any, gap: ExpectedGap) -> Sequence[Any]:
    """What `_judge` says, from the cache where it was asked before."""
    asked = name, system, table.preset, given_parameters(table, system), astuple(gap)
    key = identity(asked, code=("fmu_observer", "cosim/run/certificates.py"))
    return remembered("certificate", key, lambda: _judge(name, table, system, gap))  # type: ignore[no-any-return]


def _judge(name: str, table: ComponentTable, system: Any, gap: ExpectedGap) -> tuple[dict[str, Any], list[str]]:
    """Certificate of one observer as plain data, and what speaks against it, with what would be certified instead."""
    asked = _ASKED_FOR_LIMITS_ONLY if gap.seconds is None else gap.seconds
    in_use = {"parameters": given_parameters(table, system), "preset": table.preset}
    certificate = system.certify(asked, **in_use)
    if gap.seconds is None and gap.distance is not None and certificate.aperiodic_limit == inf:
        # no limit so far: ask for gaps like these
        certificate = system.certify(max(asked, gap.distance / _WALKING), **in_use)
        if certificate.holds:
            return certificate.to_dict() | {"explanation": certificate.explain()}, []
    data: dict[str, Any] = certificate.to_dict() | {"explanation": certificate.explain()}
    if gap.seconds is None:
        limit = certificate.aperiodic_limit
        reach = f"up to {limit:.3g} s" if limit < inf else f"for all gaps looked at, up to {certificate.horizon:.3g} s"
        known = f"its gains are certified {reach}"
        if gap.distance is not None and 0.0 < limit < inf:
            known += f", enough for {gap.distance:g} m from {gap.distance / limit:.3g} m/s on"
        doubt = f"{name}: {certificate.event} gaps cannot be known before this run ({gap.reason}); {known}."
        unknown = dict.fromkeys(("max_gap", "spectral_radius", "quadratic_margin", "holds"))
        return data | unknown | {"explanation": doubt}, [doubt]
    if certificate.holds:
        return data, []
    if gap.never:
        return data, [
            f"{name}: {gap.reason}: it is on its own for all of {gap.seconds:.4g} s, and its gains are certified for "
            f"gaps up to {certificate.certified_up_to:.3g} s. Connect what it waits for, or judge it by its errors and "
            f"leave this out by certificates = 'ignore'."
        ]
    advice = system.advise(gap.seconds, **in_use) if hasattr(system, "advise") else None
    instead = f" Instead: {advice}." if advice else ""
    return data, [f"{certificate.explain()} Expected: {gap.seconds:.3g} s ({gap.reason}).{instead}"]


def _other_spacing(name: str, table: ComponentTable, system: Any, gap: ExpectedGap) -> list[str]:
    """A doubt where an observer expects balises at another spacing than the layout's, and does not learn it."""
    if gap.spacings is None or "expected_spacing" not in {s.name for s in system.parameter_signals}:
        return []
    values = values_in_use(table, system)
    expected, error = float(values.expected_spacing), float(values.assumed_spacing_error)
    shortest, longest = gap.spacings
    within = expected * (1.0 - error) <= shortest * (1.0 + ROUNDING) and longest <= expected * (1.0 + error) * (
        1.0 + ROUNDING
    )
    if within or system.options.get("spacing") == "learnt":
        return []
    return [
        f"{name}: expects balises every {expected:g} m within {100.0 * error:g} %, but the layout has them "
        f"{shortest:g} to "
        f"{longest:g} m apart; set expected_spacing and assumed_spacing_error, or let it learn the spacing."
    ]
