"""Intermediate update: an FMI 3 slave that calls back within its step, to be given inputs of that instant (FMI 3.0,
4.2.2).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from fmpy.model_description import ModelVariable


class IntermediateUpdate:
    """The callback of one slave.

    `request` names the inputs before the slave is instantiated; afterwards `handler` is called with the time [s]
    whenever the slave lets inputs be set within its step. An exception of the handler cannot pass through the slave's C
    code; it is kept, and raised by `check` after the step.
    """

    def __init__(self) -> None:
        self.requested: dict[str, int] = {}
        self.handler: Callable[[float], None] | None = None
        self._error: Exception | None = None

    def request(self, variables: Sequence[ModelVariable]) -> None:
        """Ask for calls for those of the inputs that may be set within a step.

        Args:
            variables: the inputs that are asked for.
        """
        self.requested = {v.name: v.valueReference for v in variables if v.intermediateUpdate}

    @property
    def arguments(self) -> dict[str, Any]:
        """What to instantiate the slave with."""
        if not self.requested:
            return {}
        return {"intermediateUpdate": self._called, "requiredIntermediateVariables": list(self.requested.values())}

    def check(self) -> None:
        """Raise what the handler raised within the last step."""
        if self._error is not None:
            error, self._error = self._error, None
            raise error

    def _called(self, _environment: Any, time: float, set_requested: bool, *_rest: Any) -> None:
        if not set_requested or self.handler is None or self._error is not None:
            return
        try:
            self.handler(time)
        except Exception as error:  # it would be lost in the slave
            self._error = error
