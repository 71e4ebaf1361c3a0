"""One run of a choice again, and as a scenario: what is wrong in it stands there in ordinary components and keys."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from cosim.choice.disturbances import Disturbance
from cosim.choice.observer_scores import ObserverScore
from cosim.choice.trial import HARDER, Trial
from cosim.errors import ScenarioError
from cosim.simulation.scenario import Scenario
from fmus.tables.plain_data import jsonable
from fmus.tables.table import Parts, Readable, Table, text_column

_NAME = re.compile(r"(?:(?P<harder>harder)[ :]*)?(?:seed[ :]*)?(?P<number>\d+)|nominal")


@dataclass(frozen=True)
class ReplayedRun(Readable):
    """An observer in one run of a choice.

    Args:
        score: of it. disturbance: what was wrong. scenario: that plays the run.
    """

    score: ObserverScore
    disturbance: Disturbance
    scenario: Scenario

    @property
    def safe(self) -> bool:
        """Whether it stayed within the allowance."""
        return self.score.failure is None and self.score.used is not None and self.score.used.share <= 1.0

    @property
    def answer(self) -> str:
        """What became of the observer, in a line."""
        used = self.score.used
        found = self.score.failure or ("nothing is known of its position" if used is None else used.text)
        return f"{self.score.label} in {self.disturbance.name}: {found}"

    def parts(self) -> Parts:
        """What was wrong."""
        columns = [text_column("what", "what is wrong"), text_column("size", "how much"), text_column("when", "when")]
        wrong = self.disturbance if self.scenario.table().network is not None else replace(self.disturbance, loss=0.0)
        return [Table("wrong", columns, _wrong(wrong), wrong.name)]

    def to_data(self) -> dict[str, Any]:
        """Plain data."""
        used = None if self.score.used is None else jsonable(self.score.used)
        return {
            "observer": self.score.label,
            "used": used,
            "failure": self.score.failure,
            "run": jsonable(self.disturbance),
        }


def replayed(trial: Trial, name: str, folder: Path, **more: Any) -> ReplayedRun:
    """Do one run of a choice again.

    Args:
        trial: the nominal run, of one observer. name: of the run, as the choice names it: ``seed 3``, or 3 alone,
            ``harder seed 3``, ``nominal``.
        folder: for the recording of the plant, which the scenario plays, where the trial names none.
        more: other arguments of `benchmark_observers`.

    Raises:
        ScenarioError: there is no such run, the observer cannot listen here, or it is more than one.
    """
    matched = _NAME.fullmatch(name.strip().lower())
    if matched is None:
        raise ScenarioError(f"run {name!r}: expected the number of a seed, such as 3 or harder:3, or nominal.")
    number, factor = int(matched["number"] or 0), HARDER if matched["harder"] else 1.0
    kept = {} if trial.recorded is not None else {"record": folder}
    found = replace(trial, number=number, factor=factor).played(**kept, **more)
    if len(found.scores) != 1:
        raise ScenarioError(f"run {name!r}: expected one observer, got {len(found.scores)}.")
    (score,) = found.scores
    origin = found.outcomes[score.name].origin if score.name in found.outcomes else None
    if origin is None:
        raise ScenarioError(f"{score.label}: {score.failure}")
    table = origin.table.model_dump(by_alias=True, exclude_unset=True)
    table["title"] += f" in {found.disturbance.name}"
    return ReplayedRun(score, found.disturbance, Scenario(folder=origin.folder, where=origin.where, **table))


def _wrong(found: Disturbance) -> Sequence[list[str | None]]:
    """What is wrong: what it is, how much, and when."""
    shares = {
        "mass that the observer assumes": found.mass,
        "resistance that the observer assumes": found.resistance,
        "wheel of the odometer": found.wheel,
    }
    rows: list[list[str | None]] = [[n, f"{100.0 * (s - 1.0):+.1f} %", None] for n, s in shares.items() if s != 1.0]
    rows += [["noise of a reading", f"{found.noise:.3f} m/s", None]] if found.noise else []
    rows += [["packets lost besides", f"{100.0 * found.loss:.0f} %", None]] if found.loss else []
    rows += [["unknown slope", f"{1e3 * s.gradient:+.1f} per mille", _when(s.onset, s.length)] for s in found.slopes]
    kinds = {-1.0: "wheel jams, too slow by", 1.0: "wheel skids, too fast by"}
    return rows + [[kinds[f.kind], f"{100.0 * f.depth:.0f} %", _when(f.onset, f.length)] for f in found.faults]


def _when(onset: float, length: float) -> str:
    return f"{onset:.1f} to {onset + length:.1f} s"
