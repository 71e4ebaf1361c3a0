"""Recorded returns: what functions of an FMU said when the stepper called them, handed to the Python that would have
called them.

So the Python stepper goes on from the middle of a step with its own rules for errors, events, early returns and
termination, and the FMU is not called twice. Touches the table of functions that fmpy's slave goes through.
"""

from __future__ import annotations

import ctypes
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from typing import Any

from cosim.components.recording import RecordingSlave
from fmus.fmi.types import BOOLEANS, CTYPES

OK = 0
COUNT, VALUES = (
    2,
    3,
)  # places of the number of references and of the values among the arguments of a function that gets variables


class RecordedReturn:
    """Stands in for a function of the library, for one call.

    Args:
        status: what it returned. results: what it wrote into its last arguments. values: the doubles it read, as bytes.
    """

    def __init__(self, status: int = OK, results: tuple[Any, ...] = (), values: bytes | None = None) -> None:
        self.status, self.results, self.values = status, results, values

    def __call__(self, function: str, *arguments: Any) -> int:
        """Return what the library did.

        Args:
            function: that is called. arguments: of the call.

        Raises:
            RuntimeError: the values are not as many as the call asks for: it is for another call.
        """
        if self.results:
            for argument, result in zip(arguments[-len(self.results) :], self.results, strict=True):
                argument._obj.value = result
        if self.values is not None:
            if len(self.values) != (wanted := _bytes_wanted(function, arguments)):
                raise RuntimeError(f"{function} for {wanted} bytes met an answer of {len(self.values)}.")
            ctypes.memmove(arguments[VALUES], self.values, len(self.values))
        return self.status


def _bytes_wanted(function: str, arguments: Sequence[Any]) -> int:
    """How much a call writes; FMI 3 says the number of values last, before it is the number of references.

    Args:
        function: that gets variables. arguments: of the call.
    """
    count = arguments[COUNT] if len(arguments) == VALUES + 1 else arguments[-1]
    version, kind = (int(function[3]) if function[3].isdigit() else 1), function.partition("Get")[2]
    held = BOOLEANS[version] if kind == "Boolean" else CTYPES[kind]
    return int(getattr(count, "value", count)) * ctypes.sizeof(held[0])


@contextmanager
def repeated(slave: Any, responses: Mapping[str, Sequence[RecordedReturn]]) -> Iterator[None]:
    """Within this context the first calls of functions in `responses` return these; further calls reach the library.

    Args:
        slave: that is driven.
    """
    functions: dict[str, Any] = slave._functions
    real = {name: functions[name] for name in responses}

    def stand_in(name: str, waiting: list[RecordedReturn]) -> Any:
        def call(*arguments: Any) -> int:
            response = waiting.pop(0)
            if not waiting:
                functions[name] = real[name]
            return response(name, *arguments)

        call.restype, call.argnames, call.argtypes = ctypes.c_int, (), ()  # type: ignore[attr-defined]
        return call

    functions.update({name: stand_in(name, list(queue)) for name, queue in responses.items() if queue})
    try:
        yield
    finally:
        functions.update(real)


class Repetition:
    """The time in which Python is at work on a step that the stepper has begun: slaves repeat what they said.

    Nobody calls the stepper then.

    Args:
        slaves: of the plan, in its order.

    `active` says that it is so now.
    """

    def __init__(self, slaves: Sequence[Any]) -> None:
        self._slaves, self.active = slaves, False

    @contextmanager
    def of(self, responses: Mapping[int, Mapping[str, Sequence[RecordedReturn]]]) -> Iterator[None]:
        """Within this context it is so.

        Args:
            responses: what was said, by place in the plan, then by function.
        """
        self.active = True
        try:
            with ExitStack() as stack:
                for place, said in responses.items():
                    slave = self._slaves[place]
                    if not isinstance(slave, RecordingSlave):  # which goes to any time, whatever it was asked before
                        stack.enter_context(repeated(slave, said))
                yield
        finally:
            self.active = False
