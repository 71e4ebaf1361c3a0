"""Which fault explains a set of alarms: structured residuals by a table of faults and the residuals that they move.

Pure functions that trace where a detector executes them; what can be distinguished at all is computed before.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import reduce
from typing import NamedTuple

import numpy as np

from plant_models.hybrid import Array

_NOWHERE: Mapping[str, Mapping[str, Array]] = {}


class IsolationVerdict(NamedTuple):
    """What a set of alarms says, each 1 or 0.

    Attributes:
        isolated: for each fault, whether it alone explains the alarms best. suspected: whether it does so as well as
            others. covers: whether it explains them at all. unexplained: whether there are alarms that no single fault
            explains.
    """

    isolated: list[Array]
    suspected: list[Array]
    covers: list[Array]
    unexplained: Array


@dataclass(frozen=True)
class IsolationTable:
    """Faults and the residuals that they move.

    A residual that a fault *must* move is above its threshold if the fault is large enough and lasts; one that it *may*
    move is so at times. All others stay quiet. A fault explains alarms of which it must or may move each. Of several,
    those explain them best that must move the fewest residuals which are quiet. One that explains them without any of
    those that it must move is suspected only where another fault explains them too.

    Args:
        residuals: names. must: by fault, the residuals that it moves. may: by fault, those that it moves at times.
        together: groups of residuals of which several that are quiet count as one: those of a sensor less fine than
            the others, or of one that comes later.

    Raises:
        ValueError: a fault names a residual that is not in the table, or `may` names another fault.
    """

    residuals: tuple[str, ...]
    must: Mapping[str, tuple[str, ...]]
    may: Mapping[str, tuple[str, ...]]
    together: tuple[tuple[str, ...], ...] = ()

    def __post_init__(self) -> None:
        for fault, moved in [*self.must.items(), *self.may.items()]:
            unknown = [name for name in moved if name not in self.residuals]
            if fault not in self.must or unknown:
                wrong = f"moves {', '.join(unknown)}" if unknown else "is not in `must`"
                raise ValueError(f"Fault {fault!r} {wrong}; the residuals are {', '.join(self.residuals)}.")

    @property
    def faults(self) -> tuple[str, ...]:
        """Names of the faults, in order."""
        return tuple(self.must)

    def evaluate(
        self,
        alarms: Sequence[Array],
        available: Sequence[Array],
        possible: Sequence[Array],
        apart: Mapping[str, Mapping[str, Array]] = _NOWHERE,
    ) -> IsolationVerdict:
        """Which faults explain the alarms, one at a time.

        Args:
            alarms: for each residual 1 where it is above its threshold, else 0. available: for each residual 1 where it
                can be computed, else 0. possible: for each fault 1 where there is what can fail, else 0.
            apart: by residual and fault, 1 where this residual was made without what the fault moves: then the fault
                does not explain it, although it may move it at other times.
        """
        counted = [alarm * there for alarm, there in zip(alarms, available, strict=True)]
        any_alarm, raised = largest(counted), dict(zip(self.residuals, counted, strict=True))
        silent = {name: there - raised[name] for name, there in zip(self.residuals, available, strict=True)}
        covers = [
            self._cover(fault, any_alarm * there, raised, apart)
            for fault, there in zip(self.faults, possible, strict=True)
        ]
        missing = [self._missing(fault, silent) for fault in self.faults]
        of_must = [largest([raised[n] for n in self.residuals if n in self.must[fault]]) for fault in self.faults]
        bests = self._bests(covers, missing)
        alone = np.where(sum(bests) < 1.5, 1.0, 0.0)
        only = np.where(sum(covers) < 1.5, 1.0, 0.0)
        sure = [alone * np.maximum(only, seen) for seen in of_must]
        return IsolationVerdict(
            [one * certain for one, certain in zip(bests, sure, strict=True)],
            [one * (1.0 - certain) for one, certain in zip(bests, sure, strict=True)],
            covers,
            any_alarm * (1.0 - largest(covers)),
        )

    def _bests(self, covers: Sequence[Array], missing: Sequence[Array]) -> list[Array]:
        """Of the faults that explain the alarms those of which the fewest residuals are missing."""
        none = len(self.residuals) + 1.0
        best: Array = none
        for cover, lacking in zip(covers, missing, strict=True):
            best = np.minimum(best, np.where(cover > 0.5, lacking, none))
        return [c * np.where(lacking < best + 0.5, 1.0, 0.0) for c, lacking in zip(covers, missing, strict=True)]

    def _cover(
        self, fault: str, cover: Array, raised: Mapping[str, Array], apart: Mapping[str, Mapping[str, Array]]
    ) -> Array:
        """Whether a fault explains every alarm, beginning with whether there is any and it can be there."""
        moved = {*self.must[fault], *self.may.get(fault, ())}
        for name, alarm in raised.items():
            cover = cover * (1.0 - alarm * (apart.get(name, {}).get(fault, 0.0) if name in moved else 1.0))
        return cover

    def _missing(self, fault: str, silent: Mapping[str, Array]) -> Array:
        """How many residuals are quiet that it must move, those of a group counted once."""
        quiet = {name: value for name, value in silent.items() if name in self.must[fault]}
        groups = [[quiet.pop(name) for name in group if name in quiet] for group in self.together]
        return sum(quiet.values(), 0.0) + sum((largest(group) for group in groups if group), 0.0)

    def detectable(self, available: Collection[str]) -> tuple[str, ...]:
        """Faults that must move a residual.

        Args:
            available: names of the residuals that can be computed.
        """
        return tuple(fault for fault in self.faults if self._signature(fault, available))

    def not_isolable(self, fault: str, available: Collection[str]) -> tuple[str, ...]:
        """Other faults that explain all that this one must move, and must move nothing else.

        Args:
            fault: that is there. available: names of the residuals that can be computed.
        """
        own = self._signature(fault, available)
        others = []
        for other in self.faults:
            its = self._signature(other, available)
            if other != fault and own and its <= own <= (its | set(self.may.get(other, ()))):
                others.append(other)
        return tuple(others)

    def _signature(self, fault: str, available: Collection[str]) -> set[str]:
        return {name for name in self.must[fault] if name in available}


def largest(values: Sequence[Array]) -> Array:
    """Largest of several numbers, batches or symbols.

    Args:
        values: at least one.
    """
    return reduce(np.maximum, values)
