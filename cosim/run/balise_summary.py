"""From the services of a run to what became of its balises: telegrams, how they were localised, and gaps beside what is
certified.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Any

from cosim.results.result import BaliseRecord
from cosim.run.services import Services


def all_telegrams(services: Services) -> list[BaliseRecord]:
    """Everything that was passed: delivered, missed, and still on its way at the end.

    Args:
        services: of the run.
    """
    if services.balises is None:
        return []
    mailbox = services.balises.mailbox
    waiting = [replace(e, outcomes=dict.fromkeys(_receivers(services), "undelivered")) for e in mailbox.waiting]
    return [*mailbox.log, *waiting]


def largest_gap(services: Services, start: float, telegrams: Sequence[BaliseRecord]) -> float | None:
    """The longest time without a balise [s]; None where none was passed, and without balises.

    Args:
        services: of the run. start: of the run [s]. telegrams: of the run.
    """
    if services.balises is None:
        return None
    stamps = sorted(telegram.stamp for telegram in telegrams if telegram.kind == "true")
    return max((b - a for a, b in pairwise([start, *stamps])), default=None)


def certificates_after(
    certificates: Mapping[str, dict[str, Any]], services: Services, gap: float | None
) -> tuple[dict[str, dict[str, Any]], list[str]]:
    """Certificates with the longest gap that receivers of telegrams met.

    Args:
        certificates: by component. services: of the run. gap: the longest between balises [s], None for none.

    Returns:
        Certificates by component, and warnings of gaps beyond what is certified.
    """
    found, beyond, receivers = dict(certificates), list[str](), _receivers(services)
    for name, certificate in certificates.items():
        if name not in receivers:
            continue
        limit = certificate["certified_up_to"]
        found[name] = certificate | {"largest_gap_seen": gap}
        if limit is not None and gap is not None and gap > limit and certificate["holds"] is not False:
            beyond.append(f"{name}: the longest gap between balises was {gap:.3g} s, certified are {limit:.3g} s.")
    return found, beyond


def balise_summary(services: Services, gap: float | None) -> dict[str, Any]:
    """Method, probe and gap, for the summary of a run.

    Args:
        services: of the run. gap: the longest between balises [s], None for none.
    """
    choice, service = services.choice, services.balises
    if choice is None or service is None:
        nothing = dict.fromkeys(("localisation", "probe", "redo_differences", "largest_gap"))
        return {**nothing, "undelivered": 0}
    return {
        "localisation": choice.to_dict(),
        "probe": None if choice.probe is None else choice.probe.to_dict(),
        "redo_differences": service.localiser.watch.redo_differences,
        "largest_gap": gap,
        "undelivered": len(service.mailbox.waiting),
    }


def _receivers(services: Services) -> list[str]:
    return [] if services.balises is None else [r.planned.component.name for r in services.balises.receivers]
