"""Certificates before the run: which gaps the observers will meet, and whether their gains are certified for them."""

from __future__ import annotations

from collections.abc import Mapping
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


def expected_gap(layout: Layout, table: BalisesTable, start: float) -> ExpectedGap:
    """The longest gap as far as layout and scenario tell before the run."""
    late = table.latency + table.latency_jitter
    if isinstance(layout, InstantLayout):
        gaps = np.diff([start, *layout.instants])
        return ExpectedGap(float(gaps.max()) + late, "longest gap between the balise instants") if len(gaps) else _unknown()
    if table.expected_speed is None or len(layout.positions) < 2:
        return _unknown()
    spacing = float(np.diff(layout.positions).max())
    reason = f"spacing up to {spacing:g} m at the expected {table.expected_speed:g} m/s"
    return ExpectedGap(spacing / table.expected_speed + late, reason)


def check_certificates(
    components: Mapping[str, ComponentTable], gap: ExpectedGap, mode: str, where: str
) -> tuple[dict[str, dict[str, Any]], list[str]]:
    """Certificates of all observers that offer one.

    Args:
        components: tables of the balise receivers by name. gap: what to expect. mode: ``warn``, ``require`` or ``ignore``.

    Returns:
        Certificates by component as plain data, and warnings.

    Raises:
        CertificateError: `mode` is ``require`` and a certificate does not hold.
    """
    certificates: dict[str, dict[str, Any]] = {}
    warnings: list[str] = []
    if mode == "ignore":
        return certificates, warnings
    for name, table in components.items():
        system = make_system(table, where)
        certify = getattr(system, "certify", None)
        if certify is None:
            continue
        certificate = certify(gap.seconds or 0.5, parameters=_numbers(table), preset=table.preset)
        certificates[name] = certificate.to_dict() | {"explanation": certificate.explain()}
        if gap.seconds is None:
            known = f"its gains are certified up to {certificate.aperiodic_limit:.3g} s"
            warnings.append(f"{name}: balise gaps cannot be known before this run ({gap.reason}); {known}.")
            certificates[name]["holds"] = None
        elif not certificate.holds:
            warnings.append(f"{certificate.explain()} Expected: {gap.seconds:.3g} s ({gap.reason}).")
    if mode == "require" and any(c["holds"] is False for c in certificates.values()):
        raise CertificateError(f"{where}: certificates = 'require' and not all hold.\n" + "\n".join(warnings))
    return certificates, warnings


def _numbers(table: ComponentTable) -> dict[str, Any]:
    system = make_system(table, "")
    assert system is not None
    known = {n for s in system.parameter_signals for n in (s.name, *s.scalar_names)}
    return {name: value for name, value in table.parameters.items() if name in known}


def _unknown() -> ExpectedGap:
    return ExpectedGap(None, "balises are laid by position; give balises.expected_speed to check")
