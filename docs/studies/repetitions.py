"""The unchanged run, again and again, in every way that should make no difference, and runs with other steps."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

from manoeuvre import ORDER, STEP, Conditions

from cosim import Result
from cosim.results.load_result import load_result

STEPS = (0.0025, 0.005, 0.02)  # [s]; the effort is constant between the points of all of them
REPETITIONS = 20


@dataclass(frozen=True)
class Repetition:
    """A way to run the same. `times` is how often, `make` does it."""

    what: str
    times: int
    make: Callable[[], Result]


def repetitions() -> list[Repetition]:
    """`REPETITIONS` runs of the unchanged FMU."""
    return [
        Repetition("same process, compiled stepper", 5, Conditions(stepper="compiled").run),
        Repetition("Python stepper", 3, Conditions(stepper="python").run),
        Repetition("components in another order", 3, Conditions(order=ORDER[::-1]).run),
        Repetition("FMI 2.0 instead of 3.0", 3, Conditions(fmi_version=2).run),
        Repetition("Python blocks, FMI 3.0", 2, Conditions(backend="block").run),
        Repetition("Python blocks, FMI 2.0", 1, Conditions(backend="block", fmi_version=2).run),
        Repetition("new process", 2, in_new_process),
        Repetition("new process, components in another order, Python stepper", 1, lambda: in_new_process("reversed")),
    ]


def other_steps() -> Iterator[Repetition]:
    """Communication steps that should agree with that of the baseline."""
    for step in STEPS:
        yield Repetition(
            f"communication step {1000.0 * step:g} ms instead of {1000.0 * STEP:g} ms", 1, Conditions(step=step).run
        )


def in_new_process(how: str = "") -> Result:
    """The unchanged run in a process of its own, handed back in a results folder."""
    with TemporaryDirectory() as folder:
        subprocess.run(
            [sys.executable, str(Path(__file__)), folder, *filter(None, [how])], check=True, capture_output=True
        )
        return load_result(folder)


def _run_and_write(folder: str, how: str = "") -> None:
    from cosim.results.results_folder import write_results  # noqa: PLC0415 - only in the new process

    conditions = Conditions(order=ORDER[::-1], stepper="python") if how else Conditions()
    write_results(conditions.run(), folder, ["npy"])


if __name__ == "__main__":
    _run_and_write(*sys.argv[1:])
