"""Certificates before the run: which gaps the observers will meet, and whether their gains are certified for them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import astuple, dataclass
from math import inf
from typing import Any

import numpy as np

from cosim.balises.layout import InstantLayout
from cosim.balises.recorded import RecordedLayout
from cosim.errors import CertificateError
from cosim.scenario.layouts import Layout
from cosim.scenario.models import make_system
from cosim.scenario.tables import BalisesTable, ComponentTable
from fmu_observer.observers.parameter_values import parameter_values
from plant_models.disk_cache.entries import remembered
from plant_models.disk_cache.identity import identity
from plant_models.hybrid import HybridSystem


@dataclass(frozen=True)
class ExpectedGap:
    """The longest time between two balises that the receivers must expect.

    Args:
        seconds: [s], or None where it cannot be known before the run.
        reason: where the number comes from.
        distance: longest way to a balise, from another one or from the start of the track [m]; None where time decides.
        spacings: shortest and longest way between two balises [m]; None where time decides, or there is but one.
    """

    seconds: float | None
    reason: str
    distance: float | None = None
    spacings: tuple[float, float] | None = None


NO_BALISES = ExpectedGap(None, "no balise instant lies within the run")

WALKING = 1.0
"""Who is certified for the gaps of a train at this speed [m/s] is certified for all that a moving train meets."""
DETECTORS = "fmu_observer.detection."
"""Room of the models that correct no state by a gain, so that there is nothing to certify."""
ROUNDING = 1e-9  # relative, of distances between positions
ASKED_FOR_LIMITS_ONLY = 0.5
"""A gap to ask for [s] where only the limits of a certificate are of interest; they do not depend on it."""


def expected_gap(layout: Layout, table: BalisesTable, start: float) -> ExpectedGap:
    """The longest gap between the stamps of two balises, as far as layout and scenario tell before the run.

    A constant latency does not count: what arrives late is used at its stamp.

    Args:
        table: of the scenario. start: begin of the run [s].
    """
    if isinstance(layout, RecordedLayout):
        gaps = np.diff([start, *layout.instants[layout.instants > start]])
        return ExpectedGap(float(gaps.max()), "longest gap between the recorded telegrams") if len(gaps) else NO_BALISES
    if table.missed_fraction > 0.0 or table.missed:
        return ExpectedGap(None, "balises are missed by chance or by name, so a gap may be of any length")
    if isinstance(layout, InstantLayout):
        gaps = np.diff([start, *layout.instants[layout.instants > start]])
        return ExpectedGap(float(gaps.max()), "longest gap between the balise instants") if len(gaps) else NO_BALISES
    positions = layout.positions
    if "track_start" in table.model_fields_set:  # a train that begins there does not meet what lies before
        positions = positions[positions >= table.track_start]
    if not len(positions):
        return ExpectedGap(None, f"no balise lies behind the start of the track at {table.track_start:g} m")
    between = np.diff(positions)
    spacings = (float(between.min()), float(between.max())) if len(between) else None
    distance = float(np.diff([min(table.track_start, positions[0]), *positions]).max())
    if table.expected_speed is None:
        reason = "balises are laid by position; give balises.expected_speed to check"
        return ExpectedGap(None, reason, distance, spacings)
    reason = f"up to {distance:g} m between balises or to the first one, at the expected {table.expected_speed:g} m/s"
    return ExpectedGap(distance / table.expected_speed, reason, distance, spacings)


def check_certificates(
    components: Mapping[str, ComponentTable], gap: ExpectedGap, mode: str, where: str
) -> tuple[dict[str, dict[str, Any]], list[str]]:
    """Certificates of all observers that offer one.

    Args:
        components: tables of the balise receivers by name. gap: what to expect. mode: ``warn``, ``require`` or
            ``ignore``.
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
    for name, table in components.items():
        system = make_system(table, where)
        if type(system).__module__.startswith(DETECTORS):
            continue  # it has no gain that a gap could make unstable
        if not hasattr(system, "certify"):
            warnings.append(
                f"{name}: not checked against the balise gaps; an FMU or a model without certificate cannot tell its "
                f"limit."
            )
            continue
        certificates[name], doubt = _known_judgement(name, table, system, gap)
        warnings += [*doubt, *_other_spacing(name, table, system, gap)]
    if mode == "require" and warnings:
        raise CertificateError(f"{where}: certificates = 'require' and not all hold.\n" + "\n".join(warnings))
    return certificates, warnings


def _known_judgement(name: str, table: ComponentTable, system: Any, gap: ExpectedGap) -> Sequence[Any]:
    """What `_judge` says, from the cache where it was asked before."""
    asked = name, system, table.preset, given_parameters(table, system), astuple(gap)
    key = identity(asked, code=("fmu_observer", "cosim/scenario/certificates.py"))
    return remembered("certificate", key, lambda: _judge(name, table, system, gap))  # type: ignore[no-any-return]


def _judge(name: str, table: ComponentTable, system: Any, gap: ExpectedGap) -> tuple[dict[str, Any], list[str]]:
    """Certificate of one observer as plain data, and what speaks against it, with what would be certified instead."""
    asked = ASKED_FOR_LIMITS_ONLY if gap.seconds is None else gap.seconds
    in_use = {"parameters": given_parameters(table, system), "preset": table.preset}
    certificate = system.certify(asked, **in_use)
    if gap.seconds is None and gap.distance is not None and certificate.aperiodic_limit == inf:
        # no limit so far: ask for gaps like these
        certificate = system.certify(max(asked, gap.distance / WALKING), **in_use)
        if certificate.holds:
            return certificate.to_dict() | {"explanation": certificate.explain()}, []
    data: dict[str, Any] = certificate.to_dict() | {"explanation": certificate.explain()}
    if gap.seconds is None:
        known = f"its gains are certified up to {certificate.aperiodic_limit:.3g} s"
        if gap.distance is not None and 0.0 < certificate.aperiodic_limit < inf:
            known += f", enough for {gap.distance:g} m from {gap.distance / certificate.aperiodic_limit:.3g} m/s on"
        doubt = f"{name}: balise gaps cannot be known before this run ({gap.reason}); {known}."
        unknown = dict.fromkeys(("max_gap", "spectral_radius", "quadratic_margin", "holds"))
        return data | unknown | {"explanation": doubt}, [doubt]
    if certificate.holds:
        return data, []
    advice = system.advise(gap.seconds, **in_use) if hasattr(system, "advise") else None
    instead = f" Instead: {advice}." if advice else ""
    return data, [f"{certificate.explain()} Expected: {gap.seconds:.3g} s ({gap.reason}).{instead}"]


def _other_spacing(name: str, table: ComponentTable, system: Any, gap: ExpectedGap) -> list[str]:
    """A doubt where an observer expects balises at another spacing than the layout's, and does not learn it."""
    if gap.spacings is None or "expected_spacing" not in {s.name for s in system.parameter_signals}:
        return []
    values = system.unpack_parameters(parameter_values(system, given_parameters(table, system), table.preset))
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


def given_parameters(table: ComponentTable, system: HybridSystem) -> dict[str, Any]:
    """What the table of a component says of the parameters of its system, by name.

    Args:
        table: of the component. system: the hybrid system that it names.
    """
    known = {n for s in system.parameter_signals for n in (s.name, *s.scalar_names)}
    return {name: value for name, value in table.parameters.items() if name in known}
