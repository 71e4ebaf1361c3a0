"""What can be probed: the face of a co-simulation component that the behaviour checks need. Types only.

`fmus.check.slave.FmuSlave` has it, and so have the components of the master: its probe and ``fmus check`` run the same
code.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Protocol

import numpy as np
from fmpy.model_description import ModelDescription

FAILURES = (RuntimeError, ValueError, OSError)
"""What the calls of a steppable component raise: nothing else may come out of one, whatever its slave throws."""


class Steppable(Protocol):
    """A co-simulation component, from instantiation to the end.

    1. `instantiate`, `set_start`, `enter_initialization`, readers and writers, `exit_initialization`, then `advance` in
       turn, `terminate`, `free`. `reset` leads back to the state after `instantiate`.
    2. `save`, `restore` and `release` exist where `can_save` says so.
    3. Each call raises one of `FAILURES` where the slave refuses or throws.
    """

    name: str
    description: ModelDescription
    terminated: bool
    tolerance: float | None
    """Relative tolerance of its solver that it is told at set-up; None where it is told none."""

    @property
    def variables(self) -> Mapping[str, Any]:
        """Variables of the model description by name."""

    @property
    def can_save(self) -> bool:
        """Whether it says that its state can be saved and restored."""

    @property
    def can_vary_step(self) -> bool:
        """Whether it says that the communication step may vary."""

    def names(self, causality: str) -> list[str]:
        """Names of the scalar numeric variables of one causality."""

    def instantiate(self) -> None:
        """Create the instance."""

    def reset(self) -> None:
        """Back to the state after `instantiate`."""

    def set_start(self, name: str, value: float) -> None:
        """Set a variable before initialisation.

        Args:
            name: of the class.
        """

    def enter_initialization(self, start_time: float, stop_time: float) -> None:
        """Begin initialisation; times in [s].

        Args:
            start_time: [s]. stop_time: [s], without effect.
        """

    def exit_initialization(self) -> None:
        """End initialisation, discrete states settled."""

    def reader(self, names: Sequence[str], values: np.ndarray) -> Callable[[], None]:
        """A call that reads variables into `values`, shape (len(names),)."""

    def writer(self, names: Sequence[str]) -> tuple[Callable[[], None], np.ndarray]:
        """A call that writes variables, and the array of shape (len(names),) it writes from."""

    def advance(self, t: float, until: float) -> None:
        """Step from `t` to `until` [s]."""

    def save(self) -> Any:
        """The state."""

    def restore(self, state: Any) -> None:
        """Return to a saved state."""

    def release(self, state: Any) -> None:
        """Free a saved state."""

    def terminate(self) -> None:
        """End the run; never raises."""

    def free(self) -> None:
        """Free the instance and its library; never raises."""

    def failure(self, reason: str, t: float | None = None) -> Exception:
        """An error of this component, one of `FAILURES`.

        Args:
            t: time at which it happened [s].
        """
