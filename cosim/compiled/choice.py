"""The choice of the stepper: compiled where the plan allows it and nobody wants otherwise, with the reason where it
does not.
"""

from __future__ import annotations

from cosim.compiled.compiled_stepper import CompiledStepper
from cosim.compiled.program import NotCompilable
from cosim.errors import CouplingError
from cosim.master.axis import TimeAxis
from cosim.master.control.control import StepControl
from cosim.master.control.fixed import FixedStep
from cosim.master.stepper import StepperChoice, Wanted, python_stepper


def choose_stepper(wanted: Wanted, control: StepControl, axis: TimeAxis) -> StepperChoice:
    """The stepper for a system; its components are instantiated, and stay the same.

    Args:
        wanted: ``auto``, ``python`` or ``compiled``. control: step control of the run. axis: communication points.

    Raises:
        CouplingError: the compiled one is demanded and cannot be had; why.
    """
    if wanted == "python":
        return python_stepper(control, axis)
    try:
        _check(control)
        return StepperChoice(wanted, CompiledStepper(control, axis))
    except NotCompilable as error:
        if wanted == "compiled":
            raise CouplingError(
                f"master.stepper = 'compiled' cannot be: {error}. Use 'auto', or 'python', which gives the same "
                f"numbers."
            ) from error
        return StepperChoice(wanted, reason=str(error))


def _check(control: StepControl) -> None:
    """Raise where the stepper can do no step of a run, whatever its components are."""
    if type(control) is not FixedStep:
        raise NotCompilable(f"the step control '{control.name}' is Python's")
    algorithm = control.system.algorithm
    if algorithm.name not in ("gauss-seidel", "jacobi") or getattr(algorithm, "threads", 1) != 1:
        raise NotCompilable(f"the algorithm '{algorithm.name}' is Python's")
