"""What a comparison found: signal by signal, event by event. Imports NumPy only; knows no files and no pictures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Literal

import numpy as np

from cosim.comparison.tolerance import Tolerance
from cosim.results.result import BaliseRecord, PacketRecord
from cosim.results.shown_unit import ShownUnit

Record = BaliseRecord | PacketRecord

Kind = Literal[
    "value",  # outside the tube
    "jump_time",  # a jump at another instant than allowed
    "jump_missing",  # the reference jumps, the result does not
    "jump_extra",  # the result jumps, the reference does not
    "nan",  # not a number where the reference has one, or the other way round
    "ends_early",
    "ends_late",
    "starts_late",
    "starts_early",
    "gap",  # no rows where the reference has many
    "unit",  # units that cannot be converted into each other
]
SPAN = ("starts_early", "starts_late", "ends_early", "ends_late", "gap")
"""Kinds that concern the rows, and no value that was compared."""
Status = Literal["equal", "within", "differs", "missing", "extra", "ignored"]
"""``equal``: every bit; ``within`` the tolerance; ``missing``: only the reference has the signal; ``extra``: only the
result.
"""


@dataclass(frozen=True, slots=True)
class ComparisonFinding:
    """One way in which a signal differs.

    Args:
        kind: what it is.
        time: where, or where it begins [s].
        end: where it ends [s]; `time` for a single instant.
        reference, result: values there (times for ``jump_time``); NaN where there is none.
        size: how large it is: in the unit of the signal, in seconds for times.
        allowed: how large it may be.
        text: one line for people, with numbers and units.
        worst: where it is largest [s]; NaN where that is where it begins.
    """

    kind: Kind
    time: float
    end: float
    reference: float
    result: float
    size: float
    allowed: float
    text: str
    worst: float = float("nan")


@dataclass(frozen=True)
class Curves:
    """What is needed to draw a comparison of one signal; all arrays of a line have the same shape (rows,).

    Args:
        reference_time, reference: the reference [s], [unit]. result_time, result: what is compared with it.
        tube_time, lower, upper: the tube; NaN rows separate its pieces.
        error_time, error: signed value error at the points compared, [unit].
        allowed: allowed size of the error [unit].
        held: whether values stay until the next row.
    """

    reference_time: np.ndarray
    reference: np.ndarray
    result_time: np.ndarray
    result: np.ndarray
    tube_time: np.ndarray
    lower: np.ndarray
    upper: np.ndarray
    error_time: np.ndarray
    error: np.ndarray
    allowed: float
    held: bool = False

    def as_shown(self, unit: ShownUnit) -> Curves:
        """The same in a unit.

        Args:
            unit: in which it is shown.
        """
        return replace(
            self,
            reference=unit.values(self.reference),
            result=unit.values(self.result),
            lower=unit.values(self.lower),
            upper=unit.values(self.upper),
            error=self.error / unit.factor,
            allowed=unit.difference(self.allowed),
        )


@dataclass(frozen=True)
class SignalComparison:
    """The comparison of one signal.

    Args:
        name: of the signal. unit: SI unit of the reference. status: see `Status`.
        tolerance: in use. allowed: difference in value allowed [unit]. allowed_time: in time [s].
        max_error: largest difference in value beyond what the allowed time explains [unit]; NaN where nothing was
            compared.
        max_error_at: when [s].
        max_shift: largest difference in time of a matched jump [s]; 0 without jumps.
        rms_error: time-weighted root mean square of the value error [unit].
        share_outside: share of the compared points outside the tube [1].
        worst: the worst points, largest excess first, a few: (time [s], reference, result, error).
        findings: everything beyond tolerance, worst first.
        nearest: for a missing signal, names in the result that look like it.
        curves: for pictures; None where there is nothing to draw.
        same_values: for a missing signal, the name of one that only the result has, with its values.
        scale: range of the reference, of which a relative tolerance is a share [unit].
        remark: what to know of a signal that passed, a line for people; empty where there is nothing.
        shown_in: unit in which texts, pages and pictures show it; None for `unit`.
    """

    name: str
    unit: str
    status: Status
    tolerance: Tolerance
    allowed: float = float("nan")
    allowed_time: float = float("nan")
    max_error: float = float("nan")
    max_error_at: float = float("nan")
    max_shift: float = 0.0
    rms_error: float = float("nan")
    share_outside: float = 0.0
    worst: Sequence[tuple[float, float, float, float]] = ()
    findings: Sequence[ComparisonFinding] = ()
    nearest: Sequence[str] = ()
    curves: Curves | None = None
    equal_values: str = ""
    scale: float = float("nan")
    remark: str = ""
    shown_in: ShownUnit | None = None

    @property
    def shown(self) -> ShownUnit:
        """The unit in which texts, pages and pictures show it."""
        return self.shown_in or ShownUnit(self.unit, kept=self.unit)

    def as_shown(self) -> SignalComparison:
        """The same with all numbers in the unit in which it is shown, for texts and pictures."""
        unit, size = self.shown, self.shown.difference
        if unit.is_kept:
            return self
        worst = [(t, unit.value(one), unit.value(two), size(error)) for t, one, two, error in self.worst]
        return replace(
            self,
            unit=unit.name,
            allowed=size(self.allowed),
            max_error=size(self.max_error),
            rms_error=size(self.rms_error),
            worst=worst,
            curves=None if self.curves is None else self.curves.as_shown(unit),
            scale=size(self.scale),
            shown_in=None,
        )

    @property
    def share_of_range(self) -> float:
        """Largest error as a share of the range of the reference [1]; NaN where there is no range."""
        return self.max_error / self.scale if self.scale > 0.0 else float("nan")

    @property
    def hint(self) -> str:
        """Where a missing signal may be found, in words that follow others; empty where nothing is known."""
        if self.equal_values:
            return f"; {self.equal_values} has its values"
        return f"; nearest: {', '.join(self.nearest)}" if self.nearest else ""

    @property
    def passed(self) -> bool:
        """Whether the signal is as it should be."""
        return self.status in ("equal", "within", "ignored")


@dataclass(frozen=True, slots=True)
class EventDifference:
    """One telegram or packet that is not as in the reference.

    Args:
        kind: ``missing``, ``extra``, ``time`` (stamp or delivery) or ``payload``.
        reference, result: the telegrams or packets; None where there is none.
        text: one line for people.
    """

    kind: Literal["missing", "extra", "time", "payload"]
    reference: Record | None
    result: Record | None
    text: str


@dataclass(frozen=True)
class EventComparison:
    """The comparison of two tables of telegrams or packets.

    Args:
        matched: number of those that are in both.
        differences: what is missing, extra or different.
        max_shift: largest difference of two stamps [s].
        compared: False where one side keeps none at all (a plain CSV file, say), so that nothing was compared.
    """

    matched: int = 0
    differences: Sequence[EventDifference] = ()
    max_shift: float = 0.0
    compared: bool = True


@dataclass(frozen=True)
class ComparisonData:
    """The comparison of a result with a reference.

    Args:
        reference, result: what they are called.
        signals: one entry for each signal, in the order of the reference, extra ones last.
        events: of the telegrams. packets: of the packets of a network.
        notes: what to know beside it: other versions, other parameters, unused tolerances.
        causes: of the notes, how what was run differs from what the reference is of; the likeliest cause first.
        extra_fails: whether signals that only the result has count as a difference.
    """

    reference: str
    result: str
    signals: Sequence[SignalComparison]
    events: EventComparison = field(default_factory=EventComparison)
    notes: Sequence[str] = ()
    extra_fails: bool = False
    packets: EventComparison = field(default_factory=EventComparison)
    causes: Sequence[str] = ()

    @property
    def equal(self) -> bool:
        """Whether everything is within tolerance."""
        return not self.failed and not self.event_differences

    @property
    def event_differences(self) -> list[EventDifference]:
        """Telegrams, then packets, that are not as in the reference."""
        return [*self.events.differences, *self.packets.differences]

    @property
    def failed(self) -> list[SignalComparison]:
        """Signals that are not as they should be, the worst first: missing ones, then by excess over what is
        allowed.
        """
        bad = [s for s in self.signals if not s.passed and (s.status != "extra" or self.extra_fails)]
        return sorted(bad, key=_badness, reverse=True)

    def __getitem__(self, name: str) -> SignalComparison:
        """The comparison of one signal.

        Raises:
            KeyError: neither side has it.
        """
        for signal in self.signals:
            if signal.name == name:
                return signal
        raise KeyError(f"signal {name!r} was not compared")

    def to_dict(self) -> dict[str, Any]:
        """Plain data for a JSON file, without curves."""
        return {
            "equal": self.equal,
            "reference": self.reference,
            "result": self.result,
            "signals": [_signal_data(s) for s in self.signals],
            "events": _event_data(self.events),
            "packets": _event_data(self.packets),
            "notes": list(self.notes),
            "causes": list(self.causes),
        }


def _badness(signal: SignalComparison) -> float:
    if signal.status in ("missing", "extra"):
        return float("inf")
    ratios = [f.size / f.allowed if f.allowed > 0.0 else float("inf") for f in signal.findings if f.kind == "value"]
    return max(ratios, default=1.0)


def _event_data(events: EventComparison) -> dict[str, Any]:
    data = {name: getattr(events, name) for name in ("compared", "matched", "max_shift")}
    return data | {"differences": [{"kind": d.kind, "text": d.text} for d in events.differences]}


def _signal_data(signal: SignalComparison) -> dict[str, Any]:
    names = (
        "name",
        "unit",
        "status",
        "allowed",
        "allowed_time",
        "scale",
        "max_error",
        "max_error_at",
        "max_shift",
        "rms_error",
        "share_outside",
    )
    tolerances: Mapping[str, float] = {
        k: getattr(signal.tolerance, k) for k in ("absolute", "relative", "time", "time_relative")
    }
    return {name: getattr(signal, name) for name in names} | {
        "tolerance": dict(tolerances),
        "worst": [list(point) for point in signal.worst],
        "findings": [
            {k: getattr(f, k) for k in ("kind", "time", "end", "size", "allowed", "text")} for f in signal.findings
        ],
        "nearest": list(signal.nearest),
        "equal_values": signal.equal_values,
    }
