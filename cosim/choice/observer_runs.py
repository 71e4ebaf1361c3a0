"""Runs of observers beside one recording, as many of them in one run as come out there as they do alone. Evaluates
nothing.

An observer that fails is taken out and run alone, so that it keeps what it computed and the others theirs.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from cosim.choice.playback import Listener, ScenarioParts, is_over_network, needed_components, playback_scenario
from cosim.errors import CosimError
from cosim.run.component_models import make_system
from cosim.run.outcome import INTERRUPTED, Outcome
from cosim.simulation.scenario import Scenario


@dataclass(frozen=True)
class ObserverRun:
    """What the runs of one observer left.

    Args:
        outcome: of the last one, with all that ran in it; None where it could not be set up.
        costs: time in the observer per communication step, of each run [s].
        refusal: why it could not be set up, empty where it could.
    """

    outcome: Outcome | None = None
    costs: tuple[float, ...] = ()
    refusal: str = ""


@dataclass
class ObserverRuns:
    """Runs observers beside a recording.

    Args:
        scenario: that was recorded. parts: of it. folder: with the results of the plant side.
        repeat: runs of each observer. disturb: changes the tables of each run.
        progress: called with what is run now and the number of runs of an observer done. building: receives the
            observers that are compiled for the first time.
        found: what is known so far, by observer; kept where somebody interrupts.
    """

    scenario: Scenario
    parts: ScenarioParts
    folder: Path
    repeat: int
    disturb: Callable[[dict[str, Any]], dict[str, Any]]
    progress: Callable[[str, int], None]
    building: Callable[[str], None] | None = None
    found: dict[str, ObserverRun] = field(default_factory=dict)

    def run(self, listeners: Sequence[Listener]) -> None:
        """Run them all.

        Args:
            listeners: observers beside the recording.

        Raises:
            KeyboardInterrupt: somebody interrupts.
        """
        for group in self._groups(listeners):
            self._run(group)

    def _run(self, group: Sequence[Listener]) -> None:
        """Run these in one run, or in several where one of them fails."""
        for _ in range(self.repeat):
            self.progress(group[0].table.label or group[0].name, sum(len(run.costs) for run in self.found.values()))
            try:
                outcome = self._once(group)
            except CosimError as error:
                failure = str(error)
                self.found |= {one.name: ObserverRun(refusal=failure) for one in group}
            else:
                failure = outcome.failure or ""
                self._keep(group, outcome)
            if failure:
                break
        if not failure or len(group) == 1:
            return
        for one in group:
            del self.found[one.name]
        for part in _parted(group, failure):
            self._run(part)

    def _once(self, group: Sequence[Listener]) -> Outcome:
        outcome = playback_scenario(self.scenario, self.parts, self.folder, group, self.disturb).run(
            warn=_ignore, progress=False, building=self.building
        )
        if outcome.failure == INTERRUPTED:
            raise KeyboardInterrupt
        return outcome

    def _keep(self, group: Sequence[Listener], outcome: Outcome) -> None:
        start, step = self.parts.table.start, self.parts.table.step
        reached = max(round((outcome.result.summary["reached"] - start) / step), 1)
        for one in group:
            before = self.found.get(one.name, ObserverRun())
            cost = outcome.result.summary["seconds"][one.name] / reached
            self.found[one.name] = replace(before, outcome=outcome, costs=(*before.costs, cost))

    def _groups(self, listeners: Sequence[Listener]) -> list[list[Listener]]:
        """Those that can be in one run: alike in how they are stepped, and none in the place of a recorded component
        that another one needs.
        """
        groups: list[tuple[Hashable, set[str], list[Listener]]] = []
        for one in listeners:
            try:
                kind, needed = self._kind(one), set(needed_components(self.parts, one))
            except CosimError as error:
                self.found[one.name] = ObserverRun(refusal=str(error))
                continue
            for other, recorded, members in groups:
                names = {member.name for member in members}
                if other == kind and one.name not in recorded and not needed & names:
                    recorded.update(needed)
                    members.append(one)
                    break
            else:
                groups.append((kind, needed, [one]))
        return [members for _, _, members in groups]

    def _kind(self, one: Listener) -> Hashable:
        """What observers of one run have in common: who steps them, when telegrams reach them, over what. An FMU by
        path, or what has steps of its own, is alone.
        """
        table = one.table
        if table.fmu is not None or table.every != 1 or table.substeps != 1:
            return one.name
        hosted = (table.backend or "").startswith("block") or make_system(table, one.name) is None
        return hosted, (table.backend or "").endswith("2"), is_over_network(self.parts, one.name)


def _parted(group: Sequence[Listener], failure: str) -> list[Sequence[Listener]]:
    """A group in two: the one that the failure names and the others, or half of them and the rest."""
    named = [one for one in group if f"'{one.name}'" in failure]
    if len(named) == 1:
        return [[one for one in group if one is not named[0]], named]
    middle = len(group) // 2
    return [group[:middle], group[middle:]]


def _ignore(_text: str) -> None:
    """What is doubtful about an observer stands in its score."""
