"""What became of the balises of a run: all telegrams, how they were localised, and gaps beside what is certified."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Any

from cosim.balises.service import BaliseService
from cosim.results.result import BaliseRecord
from cosim.run.balise_service import Choice


def all_telegrams(service: BaliseService) -> list[BaliseRecord]:
    """Everything that was passed: told, missed, and still on its way at the end.

    Args:
        service: of the run.
    """
    names = [r.planned.component.name for r in service.receivers]
    waiting = [replace(e, outcomes=dict.fromkeys(names, "undelivered")) for e in service.mailbox.waiting]
    return [*service.mailbox.log, *waiting]


def balise_summary(
    choice: Choice | None,
    service: BaliseService | None,
    certificates: Mapping[str, dict[str, Any]],
    start: float,
    events: Sequence[BaliseRecord],
) -> tuple[dict[str, Any], list[str]]:
    """Method, probe, and the gaps that really occurred against what is certified.

    Args:
        choice: of the method; None without balises. service: of the run; None without balises.
        certificates: by component; each that is told of balises is told the largest gap seen. start: of the run [s].
        events: its telegrams.

    Returns:
        What the summary of the run says of it, and warnings of gaps beyond what is certified.
    """
    if choice is None or service is None:
        nothing = dict.fromkeys(("localisation", "probe", "redo_differences", "largest_gap"))
        return {**nothing, "undelivered": 0}, []
    stamps = sorted(event.stamp for event in events if event.kind == "true")
    gap = max((b - a for a, b in pairwise([start, *stamps])), default=None)
    beyond, told = [], {r.planned.component.name for r in service.receivers}
    for name, certificate in certificates.items():
        if name not in told:
            continue
        limit = certificate["certified_up_to"]
        certificate["largest_gap_seen"] = gap
        if limit is not None and gap is not None and gap > limit and certificate["holds"] is not False:
            beyond.append(f"{name}: the longest gap between balises was {gap:.3g} s, certified are {limit:.3g} s.")
    found = {
        "localisation": choice.to_dict(),
        "probe": None if choice.probe is None else choice.probe.to_dict(),
        "redo_differences": service.localiser.watch.redo_differences,
        "largest_gap": gap,
        "undelivered": len(service.mailbox.waiting),
    }
    return found, beyond
