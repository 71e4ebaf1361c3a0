"""What a preset was made for, where it is not for any plant. Data only."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple


class MadeFor(NamedTuple):
    """Where a preset is right; an observer has them by preset as `made_for`, and a run warns where it is not so.

    Attributes:
        what: in words. ranges: lowest and highest value of parameters by name, in their units. instead: what to do.
    """

    what: str
    ranges: Mapping[str, tuple[float, float]]
    instead: str
