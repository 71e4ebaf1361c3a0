"""A few and small changes that still break something: changes are taken back one by one, then brought towards what the
scenario has. Knows no scenarios.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from cosim.studies.measures import is_number

Settings = Mapping[str, Any]
Broken = Callable[[Sequence[Settings]], list[bool]]
"""Of some settings, whether something is broken with each."""
_HALVINGS = 6


def fewest(found: Settings, broken: Broken) -> dict[str, Any]:
    """Changes of which none can be left out.

    First each alone is tried; where none is enough they are left out one after the other, as long as any can be.

    Args:
        found: settings that break something. broken: see `Broken`.
    """
    alone = [{name: value} for name, value in found.items()]
    if len(alone) > 1:
        for settings, is_broken in zip(alone, broken(alone), strict=True):
            if is_broken:
                return settings
    kept = dict(found)
    while len(kept) > 1:
        without = [{n: v for n, v in kept.items() if n != name} for name in kept]
        smaller = next((s for s, is_broken in zip(without, broken(without), strict=True) if is_broken), None)
        if smaller is None:
            break
        kept = smaller
    return kept


def nearest(found: Settings, nominal: Settings, broken: Broken) -> dict[str, Any]:
    """Numbers brought towards what the scenario has, one after the other, by halving the part that is not known, as if
    what is nearer were broken less; the last that was seen to break something is kept.

    Args:
        found: settings that break something. nominal: what the scenario has, of those that are numbers.
            broken: see `Broken`.
    """
    kept = dict(found)
    for name, value in found.items():
        start = nominal.get(name)
        if not is_number(value) or not is_number(start) or start == value:
            continue
        met, unmet = 0.0, 1.0  # parts of the way from the scenario to what was found
        for _ in range(_HALVINGS):
            middle = 0.5 * (met + unmet)
            tried = start + middle * (value - start)
            tried = round(tried) if isinstance(value, int) else tried
            if tried in (start, kept[name]):
                break
            if broken([kept | {name: tried}])[0]:
                unmet, kept[name] = middle, tried
            else:
                met = middle
    return kept
