"""What every model with named states and inputs has: how many states there are, and where states and inputs start."""

from __future__ import annotations

import numpy as np

from plant_models.hybrid import Signal


class NamedStates:
    """A model of n scalar states and m scalar inputs.

    Attributes:
        states: n of them. inputs: m of them.
    """

    states: tuple[Signal, ...]
    inputs: tuple[Signal, ...]

    @property
    def order(self) -> int:
        """Number of states, n."""
        return len(self.states)

    @property
    def start(self) -> np.ndarray:
        """Start of the estimates, shape (n,)."""
        return np.array([float(s.start_values[0]) for s in self.states])

    @property
    def start_inputs(self) -> np.ndarray:
        """Inputs at their starts, shape (m,)."""
        return np.array([float(s.start_values[0]) for s in self.inputs])
