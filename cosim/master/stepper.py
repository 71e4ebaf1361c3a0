"""Who executes the plan: Python, or a stepper handed in that does many steps in one call. Knows no such stepper."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Literal, Protocol

from cosim.master.axis import TimeAxis
from cosim.master.control.control import StepControl
from cosim.master.system import Row
from cosim.results.recorder import Recorder

Wanted = Literal["auto", "python", "compiled"]
_Finish = Callable[[], Sequence[Row]]


@dataclass(frozen=True)
class Chunk:
    """What a chunk did.

    Args:
        done: steps done and recorded.
        finish: does what is left of the next step, or all of it, in Python and returns its event rows; None where the
            next step may be the stepper's again.
        suspect: a value of the last row is not finite.
    """

    done: int
    finish: _Finish | None = None
    suspect: bool = False


class _Stepper(Protocol):
    """Does many communication steps in one call; `steps` counts them, `in_python` says of each component that Python
    moves in them why.
    """

    steps: int
    in_python: dict[str, str]

    def run(self, k: int, recorder: Recorder) -> Chunk:
        """Do steps from number `k` on; their rows go to `recorder`."""

    def summary(self, stepping: float) -> dict[str, Any]:
        """Its share, plain data; `stepping` is what all steps took [s]."""

    def close(self) -> None:
        """Let go of the components."""


@dataclass(frozen=True)
class StepperChoice:
    """Who executes the plan.

    Args:
        wanted: what was asked for. compiled: the compiled stepper; None where Python does all steps.
        reason: why Python does.
    """

    wanted: Wanted
    compiled: _Stepper | None = None
    reason: str | None = None

    @property
    def notes(self) -> tuple[str, ...]:
        """What the user should know of a choice that was left to the program."""
        if self.wanted != "auto":
            return ()
        if self.reason is not None:
            return (f"Python does all steps, not the compiled stepper: {self.reason}.",)
        reasons = () if self.compiled is None else self.compiled.in_python.values()
        return (f"Between the steps of the compiled stepper: {'; '.join(reasons)}.",) if reasons else ()

    def summary(self, stepping: float) -> dict[str, Any]:
        """What to report of it after the run, plain data: the name, steps it did, why not, and its share.

        Args:
            stepping: what all steps took [s].
        """
        if self.compiled is None:
            return {"name": "python", "steps_compiled": 0, "reason": self.reason}
        return {
            "name": "compiled",
            "steps_compiled": self.compiled.steps,
            "reason": None,
            "in_python": dict(self.compiled.in_python),
            **self.compiled.summary(stepping),
        }


ChooseStepper = Callable[[StepControl, TimeAxis], StepperChoice]
"""Chooses the stepper for a step control and its communication points; the components are instantiated."""


def python_stepper(_control: StepControl, _axis: TimeAxis) -> StepperChoice:
    """Python does all steps."""
    return StepperChoice("python", reason="asked for")
