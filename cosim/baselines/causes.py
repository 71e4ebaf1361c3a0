"""How what was run differs between a baseline and a result: deliveries of FMUs first, most often they are the cause."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import chain

from cosim.baselines.model_identity import Identity

Pair = tuple[Identity, Identity]


def equal_models(before: Sequence[Identity], now: Sequence[Identity]) -> list[Pair]:
    """Components that both runs have, with what they were in each.

    Args:
        before: of the baseline. now: of the result.
    """
    by_name = {identity.name: identity for identity in now}
    return [(identity, by_name[identity.name]) for identity in before if identity.name in by_name]


def causes(pairs: Sequence[Pair], of_runs: Sequence[str]) -> list[str]:
    """What was different, a line each.

    Args:
        pairs: from `same_models`. of_runs: differences of the two runs that need no baseline.
    """
    found = [*chain.from_iterable(_of_delivery(*pair) for pair in pairs), *_not_kept(pairs)]
    return [*found, *chain.from_iterable(_options(*pair) for pair in pairs), *of_runs]


def _of_delivery(before: Identity, now: Identity) -> Iterable[str]:
    """How the FMU of a component differs from that of the baseline."""
    known = before.delivery is not None and now.delivery is not None
    changes = before.delivery.changes_to(now.delivery) if before.delivery and now.delivery else []
    if changes:
        yield f"{before.name}: {', '.join(changes)}"
    elif before.guid == now.guid and before.sha256 and now.sha256 and before.sha256 != now.sha256:
        equal = " and the same description" if known else ""
        yield f"{before.name}: the file {now.file} is not the one of the baseline, though it has the same GUID{equal}."
    elif before.guid != now.guid and now.kind == "FMU" and before.fmi_version == now.fmi_version:
        equal = "; its description states the same" if known else ""
        yield f"{before.name}: a new delivery of the model '{now.model}'{equal}."


def _not_kept(pairs: Sequence[Pair]) -> Iterable[str]:
    """That the baseline is older than the descriptions that are kept, once for all components."""
    names = [before.name for before, now in pairs if before.file and before.delivery is None and now.delivery]
    if names:
        yield (
            f"This baseline keeps no description of {', '.join(names)}, so what a delivery changes in it is not known; "
            "an update adds it."
        )


def _options(before: Identity, now: Identity) -> Iterable[str]:
    """Options of a shipped model that differ."""
    for name in sorted({*before.options, *now.options}):
        old, new = before.options.get(name, "its default"), now.options.get(name, "its default")
        if old != new:
            yield f"{before.name}: option {name} is {new} instead of {old}."
