"""Certificates before the run: which gaps the observers will meet, and whether their gains are certified for them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from cosim.balises.layout import InstantLayout, Layout
from cosim.errors import CertificateError
from cosim.scenario.models import make_system
from cosim.scenario.schema import BalisesTable, ComponentTable


@dataclass(frozen=True)
class ExpectedGap:
    """The longest time between two balises that the receivers must expect.

    Args:
        seconds: [s], or None where it cannot be known before the run.
        reason: where the number comes from.
    """

    seconds: float | None
    reason: str


NO_BALISES = ExpectedGap(None, "no balise instant lies within the run")

ASKED_FOR_LIMITS_ONLY = 0.5
"""A gap to ask for [s] where only the limits of a certificate are of interest; they do not depend on it."""


def expected_gap(layout: Layout, table: BalisesTable, start: float) -> ExpectedGap:
    """The longest gap between the stamps of two balises, as far as layout and scenario tell before the run.

    A constant latency does not count: what arrives late is used at its stamp.
    """
    if table.missed_fraction > 0.0 or table.missed:
        return ExpectedGap(None, "balises are missed by chance or by name, so a gap may be of any length")
    if isinstance(layout, InstantLayout):
        gaps = np.diff([start, *layout.instants[layout.instants > start]])
        return ExpectedGap(float(gaps.max()), "longest gap between the balise instants") if len(gaps) else NO_BALISES
    if table.expected_speed is None:
        return ExpectedGap(None, "balises are laid by position; give balises.expected_speed to check")
    spacing = float(np.diff([min(table.track_start, layout.positions[0]), *layout.positions]).max())
    reason = f"up to {spacing:g} m between balises or to the first one, at the expected {table.expected_speed:g} m/s"
    return ExpectedGap(spacing / table.expected_speed, reason)


def check_certificates(
    components: Mapping[str, ComponentTable], gap: ExpectedGap, mode: str, where: str
) -> tuple[dict[str, dict[str, Any]], list[str]]:
    """Certificates of all observers that offer one.

    Args:
        components: tables of the balise receivers by name. gap: what to expect. mode: ``warn``, ``require`` or ``ignore``.

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
        certify = getattr(make_system(table, where), "certify", None)
        if certify is None:
            warnings.append(
                f"{name}: not checked against the balise gaps; an FMU or a model without certificate cannot tell its limit."
            )
            continue
        certificates[name], doubt = _judge(name, table, certify, gap)
        warnings += doubt
    if mode == "require" and warnings:
        raise CertificateError(f"{where}: certificates = 'require' and not all hold.\n" + "\n".join(warnings))
    return certificates, warnings


def _judge(name: str, table: ComponentTable, certify: Callable[..., Any], gap: ExpectedGap) -> tuple[dict[str, Any], list[str]]:
    """Certificate of one observer as plain data, and what speaks against it."""
    asked = ASKED_FOR_LIMITS_ONLY if gap.seconds is None else gap.seconds
    certificate = certify(asked, parameters=_numbers(table), preset=table.preset)
    data: dict[str, Any] = certificate.to_dict() | {"explanation": certificate.explain()}
    if gap.seconds is None:
        known = f"its gains are certified up to {certificate.aperiodic_limit:.3g} s"
        doubt = f"{name}: balise gaps cannot be known before this run ({gap.reason}); {known}."
        unknown = dict.fromkeys(("max_gap", "spectral_radius", "quadratic_margin", "holds"))
        return data | unknown | {"explanation": doubt}, [doubt]
    if certificate.holds:
        return data, []
    return data, [f"{certificate.explain()} Expected: {gap.seconds:.3g} s ({gap.reason})."]


def _numbers(table: ComponentTable) -> dict[str, Any]:
    system = make_system(table, "")
    assert system is not None
    known = {n for s in system.parameter_signals for n in (s.name, *s.scalar_names)}
    return {name: value for name, value in table.parameters.items() if name in known}
