"""How often a component is called for what, and how long that takes. Standard library only.

Steps, events, saved and restored states are timed one by one, since a call of the clock is nothing beside them. Reading
and writing are counted, and every `EVERY`-th is timed: timing all would cost more than the calls themselves.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from time import perf_counter
from typing import Any

from cosim.diagnostics.sampled_times import BINS, bin_of, typical_seconds

EARLY, EVERY = 3, 64  # the third call is timed, the first ones are not like the others; then every 64th
_OF_METHOD = {
    "notify": "event",
    "handle_event": "event",
    "report_clock": "event",
    "save": "save",
    "restore": "restore",
    "release": "release",
}
"""What a method of a component counts as."""


class CallStatistics:
    """Count and time of one kind of call."""

    __slots__ = ("_counted", "_pending", "_sampled_calls", "_sampled_seconds", "_seconds", "_timed", "depth")

    def __init__(self) -> None:
        self._counted, self._timed, self._seconds, self.depth = 0, 0, 0.0, 0
        self._sampled_calls, self._sampled_seconds = [0] * BINS, [0.0] * BINS
        self._pending: list[Callable[[], int]] = []

    @property
    def count(self) -> int:
        """How many calls there were."""
        return self._counted + sum(calls() for calls in self._pending)

    @property
    def seconds(self) -> float:
        """Seconds of all calls [s]: those that were timed one by one, and an estimate of the others by samples."""
        return self._seconds + (self.count - self._timed) * typical_seconds(self._sampled_calls, self._sampled_seconds)

    def add(self, seconds: float, count: int = 1) -> None:
        """Take calls that were timed elsewhere, e.g. by a stepper in C.

        Args:
            seconds: of all of them [s]. count: how many.
        """
        self._counted += count
        self._timed += count
        self._seconds += seconds

    def counting(
        self, call: Callable[[], None], explain: Callable[[Exception], Exception], last: Any = None, number: int = 0
    ) -> Callable[[], None]:
        """The same call, counted; one in many is timed. Costs 40 ns.

        Args:
            call: what is called often. explain: what to raise in place of what it raises.
            last: a cell in which to store, before each call, its `number`; see `cosim.process.last_call`.
        """
        last = [0] if last is None else last
        cycle = left = EARLY

        def timed() -> None:
            nonlocal cycle, left
            self._counted += cycle
            cycle = left = EVERY
            begin = perf_counter()
            call()
            seconds = perf_counter() - begin
            place = bin_of(seconds)
            self._sampled_calls[place] += 1
            self._sampled_seconds[place] += seconds

        def counted() -> None:
            nonlocal left
            left -= 1
            last[0] = number
            try:
                if left:
                    call()
                else:
                    timed()
            except Exception as error:
                raise explain(error) from error

        self._pending.append(lambda: cycle - left)
        return counted


def counted(method: Callable[..., Any], kind: str) -> Callable[..., Any]:
    """A method of a component that is counted under `kind`; one that calls another of its kind counts once."""

    @wraps(method)
    def call(self: Any, *arguments: Any, **named: Any) -> Any:
        statistics: CallStatistics = self.call_statistics[kind]
        if statistics.depth:
            return method(self, *arguments, **named)
        statistics.depth, begin = 1, perf_counter()
        try:
            return method(self, *arguments, **named)
        finally:
            statistics.depth = 0
            statistics._counted, statistics._timed = statistics._counted + 1, statistics._timed + 1
            statistics._seconds += perf_counter() - begin

    call.counted_as = kind  # type: ignore[attr-defined]
    return call


def count_methods(cls: type) -> None:
    """Let the methods of a class of components count themselves, inherited ones too.

    Args:
        cls: the class.
    """
    for name, kind in _OF_METHOD.items():
        method = getattr(cls, name, None)
        if callable(method) and not hasattr(method, "counted_as") and not hasattr(method, "__isabstractmethod__"):
            setattr(cls, name, counted(method, kind))
