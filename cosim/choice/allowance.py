"""How far a position may be off: what SUBSET-041 grants, or another allowance; and how much of it an observer uses."""

from __future__ import annotations

import re
from dataclasses import dataclass
from math import inf

import numpy as np

from cosim.errors import ScenarioError
from cosim.evaluation.balise_gaps import EQUAL_WITHIN, FIXED_SHARE, SHARE_OF_DISTANCE, telegrams_read, travelled
from cosim.evaluation.metrics import evaluated_size
from cosim.evaluation.roles import estimation_error, recorded
from cosim.evaluation.spec import ReportSpec
from cosim.results.result import Result
from fmus.tables.numbers import number

_TEXT = re.compile(r"\s*([^\s%]+?)\s*(?:m\s*)?\+\s*([^\s%+]+)\s*%\s*")


@dataclass(frozen=True)
class Allowance:
    """What a position may be off.

    Args:
        fixed: right at a balise [m]. share: of the distance since the last balise that was delivered [1].
    """

    fixed: float = FIXED_SHARE
    share: float = SHARE_OF_DISTANCE

    @classmethod
    def of(cls, text: str) -> Allowance:
        """An allowance from words such as ``5+5%``.

        Args:
            text: metres, plus a share of the distance in per cent.

        Raises:
            ScenarioError: it is something else, or not positive.
        """
        matched = _TEXT.fullmatch(text)
        try:
            found = cls(float(matched[1]), float(matched[2]) / 100.0) if matched else None
        except ValueError:
            found = None
        if found is None or not (0.0 < found.fixed < inf and 0.0 <= found.share < inf):
            raise ScenarioError(f"allowance {text!r}: expected metres plus per cent of the distance, such as 5+5%.")
        return found

    @property
    def text(self) -> str:
        """In words."""
        subset = "SUBSET-041: " if self == Allowance() else ""
        return f"{subset}{self.fixed:g} m + {100.0 * self.share:g} % of the distance since the last balise"

    def at(self, result: Result, spec: ReportSpec) -> np.ndarray | None:
        """What is allowed at each row [m], shape (rows,); None where the true position is not recorded.

        Args:
            result: a run. spec: roles of its signals.
        """
        position = recorded(result, spec.true_position)
        if position is None or not len(position):
            return None
        return np.asarray(self.fixed + self.share * _since_last_balise(result, travelled(position)))


@dataclass(frozen=True)
class UsedAllowance:
    """How much of an allowance an observer uses in a run.

    Args:
        share: the largest, infinite once diverged [1]. time: when [s]. rms: of the position error [m].
        allowed: root mean square of what is allowed [m].
    """

    share: float
    time: float
    rms: float
    allowed: float

    @property
    def text(self) -> str:
        """In words."""
        share, rms = number(100.0 * self.share), number(self.rms)
        return f"at most {share} % of the allowance, at {self.time:.1f} s, position error {rms} m rms"


def used_allowance(result: Result, spec: ReportSpec, name: str, allowance: Allowance) -> UsedAllowance | None:
    """How much an observer uses from `evaluate_after` on; None where its position or the true one is not recorded.

    Args:
        result: the run. spec: roles of its signals. name: of the observer. allowance: what is granted.
    """
    error, allowed = estimation_error(result, spec, name, "position"), allowance.at(result, spec)
    settled = result.time >= spec.evaluate_after
    if error is None or allowed is None or len(np.unique(result.time[settled])) < 2:
        return None  # one row has no length that an error could be weighed by
    time, error, allowed = result.time[settled], np.abs(error[settled]), allowed[settled]
    shares = np.where(np.isfinite(error), error, np.inf) / allowed
    place = int(np.argmax(shares))
    held = evaluated_size(time, allowed).rms
    return UsedAllowance(float(shares[place]), float(time[place]), evaluated_size(time, error).rms, held)


def _since_last_balise(result: Result, way: np.ndarray) -> np.ndarray:
    """Way since the last balise whose telegram has been delivered, or since the start [m], shape (rows,).

    Args:
        result: the run. way: of the train at its rows [m], shape (rows,).
    """
    passed = np.zeros(len(way))
    latest = -np.inf
    for event in telegrams_read(result.events):
        if event.stamp < latest:
            continue  # it was overtaken
        latest = event.stamp
        until = event.delivered_at + EQUAL_WITHIN * max(1.0, abs(event.delivered_at))
        row = int(np.searchsorted(result.time, until, side="right")) - 1
        first = row if result.time[row] >= event.delivered_at - EQUAL_WITHIN * max(1.0, until) else row + 1
        passed[max(first, 0) :] = float(np.interp(event.stamp, result.time, way))
    return np.asarray(way - passed)
