"""Where candidates are run: the whole scenario, or the observer alone beside one recorded run of the plant for each
seed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from cosim.choice.candidates import BenchmarkCandidate, find_candidates, with_candidate
from cosim.choice.playback import ScenarioParts, find_parts, playback_scenario, recording_scenario
from cosim.simulation.scenario import Scenario
from cosim.tuning.costs import Cost


@dataclass(frozen=True)
class Seeded:
    """The scenario with one seed.

    Args:
        seed: of it. whole: the scenario. parts: plant side and observers; None where whole runs are made.
        candidate: who listens to the recording.
    """

    seed: int
    whole: Scenario
    parts: ScenarioParts | None = None
    candidate: BenchmarkCandidate | None = None

    def recording(self) -> Scenario | None:
        """What is to be recorded before candidates can be run; None where whole runs are made."""
        return None if self.parts is None else recording_scenario(self.whole, self.parts)

    def base(self, folder: Path, cost: Cost) -> Scenario:
        """What is run with each candidate.

        Args:
            folder: with the recording. cost: whose signals must be there.
        """
        if self.parts is None or self.candidate is None:
            return self.whole
        played = playback_scenario(self.whole, self.parts, folder, [self.candidate])
        there = played.table().components
        for other in dict.fromkeys(signal.partition(".")[0] for signal in cost.signals):
            if other not in there and other in self.parts.plant:
                played.add(other, recording=str(folder.resolve()), component=other)
        return played


def seeded(scenario: Scenario, seed: int, observer: str | None, heads: Sequence[str], whole: bool) -> Seeded:
    """Choose where the candidates of a seed are run.

    Args:
        scenario: with the seed in it. seed: the seed. observer: that is tuned, or None.
        heads: components and tables that are tuned.
        whole: whether whole runs are wanted in any case.
    """
    if whole or observer is None or set(heads) != {observer}:
        return Seeded(seed, scenario)
    parts = find_parts(scenario)
    if observer not in parts.observers or observer in parts.plant:
        return Seeded(seed, scenario)
    (candidate,), _ = find_candidates(scenario, parts, [observer])
    return Seeded(seed, scenario, parts, candidate)


def with_observer(scenario: Scenario, name: str) -> tuple[Scenario, str]:
    """The scenario with an observer that it is evaluated by: its own, or a shipped one that listens as those do.

    Args:
        scenario: the scenario. name: of a component, or of a shipped observer.

    Returns:
        The scenario, and the name of the component.

    Raises:
        ScenarioError: there is neither, or the observer cannot listen here.
    """
    if name in scenario.table().components:
        return scenario.copy().report(observers=[name]), name
    (candidate,), _ = find_candidates(scenario, find_parts(scenario), [name])
    return with_candidate(scenario, candidate), candidate.name


def why_whole(scenario: Scenario, observer: str | None, heads: Sequence[str]) -> str:
    """Why candidates need runs of the whole scenario, in words.

    Args:
        scenario: the scenario. observer: that is tuned, or None. heads: components and tables that are tuned.
    """
    others = [head for head in heads if head != observer]
    if observer is None or others:
        return f"{', '.join(dict.fromkeys(others or heads))} is tuned, which is no observer that only listens"
    parts = find_parts(scenario)
    if observer not in parts.observers:
        return f"{observer} is no observer that the report names, or that estimates position or speed"
    return f"something listens to {observer}"
