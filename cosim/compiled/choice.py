"""The choice of the stepper: compiled where the plan allows it and nobody wants otherwise, with the reason where it
does not.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

from cosim.compiled.program import NotCompilable
from cosim.compiled.stretch import CompiledStepper
from cosim.errors import CouplingError
from cosim.master.axis import TimeAxis
from cosim.master.control.control import StepControl

Wanted = Literal["auto", "python", "compiled"]


@dataclass(frozen=True)
class Choice:
    """Who executes the plan.

    Args:
        wanted: what was asked for. compiled: the compiled stepper; None where Python does all steps.
        reason: why Python does.
    """

    wanted: Wanted
    compiled: CompiledStepper | None = None
    reason: str | None = None

    @property
    def is_made(self) -> bool:
        """Whether anything has been decided."""
        return self.compiled is not None or self.reason is not None

    @property
    def notes(self) -> tuple[str, ...]:
        """What the user should know of a choice that was left to the program."""
        fallback = self.wanted == "auto" and self.reason is not None
        return (f"Python does all steps, not the compiled stepper: {self.reason}.",) if fallback else ()

    def summary(self) -> dict[str, Any]:
        """What to tell of it after the run, plain data: the name, steps it did, and why not."""
        if self.compiled is None:
            return {"name": "python", "steps_compiled": 0, "reason": self.reason}
        return {"name": "compiled", "steps_compiled": self.compiled.steps, "reason": None}


def choose_stepper(wanted: Wanted, control: StepControl, axis: TimeAxis) -> Choice:
    """The stepper for a system; its components are instantiated, and stay the same.

    Args:
        wanted: ``auto``, ``python`` or ``compiled``. control: step control of the run. axis: communication points.

    Raises:
        CouplingError: the compiled one is demanded and cannot be had; why.
    """
    if wanted == "python":
        return Choice(wanted, reason="asked for")
    try:
        return Choice(wanted, CompiledStepper(control, axis))
    except NotCompilable as error:
        if wanted == "compiled":
            raise CouplingError(
                f"master.stepper = 'compiled' cannot be: {error}. Use 'auto', or 'python', which gives the same "
                f"numbers."
            ) from error
        return Choice(wanted, reason=str(error))
