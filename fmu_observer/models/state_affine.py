"""The state-affine model with unknown constants: ``dx = A(t, u) x + B(t, u) + Phi(t, u) rho``, ``y = C x``. A value.

It knows signals and arrays; it does not move by itself and holds no gain.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from fmu_observer.models.checks import check_identifiers, check_numbers, check_signals, checked_matrix
from fmu_observer.models.observer_model import NamedStates
from plant_models.hybrid import Array, Signal

Matrices = Callable[[Array, Array], Array]  # (t, u of shape (m,)) -> an array


@dataclass(frozen=True, eq=False)
class StateAffineModel(NamedStates):
    """What an adaptive observer believes of its plant: Hann 2014, (4.1).

    Args:
        name, description, source, states, inputs: see `NamedStates`.
        measurements: scalar signals by `input_signal`, q of them; an observer calls them ``<event>_<name>``.
        unknowns: scalar signals by `state`, the unknown constants rho, m of them; their starts are what is believed
            first.
        drift: A, a function of t and u that returns shape (n, n). drive: B, likewise, shape (n,). regressor: Phi,
            likewise, shape (n, m); all in plain NumPy that can be traced.
        C: shape (q, n). event: name of the event at which a measurement arrives.
        sample_period: sampling period [s] that suits it. example: a start and constants to be tried, shape (n + m,);
            () for one beside what is believed first.

    Raises:
        ValueError: a shape does not fit the signals, or a name is no identifier or stands twice.
    """

    measurements: tuple[Signal, ...]
    unknowns: tuple[Signal, ...]
    drift: Matrices
    drive: Matrices
    regressor: Matrices
    C: np.ndarray
    event: str = "sample"
    sample_period: float = 0.1
    example: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        where = f"State-affine model {self.name!r}"
        check_identifiers(where, name=self.name, event=self.event)
        check_signals(where, states=(*self.states, *self.unknowns), inputs=self.inputs, measurements=self.measurements)
        check_numbers(where, {"sample_period": self.sample_period}, {})
        n, m, q = self.order, len(self.unknowns), len(self.measurements)
        reason = f"{n} states, {q} measurements and {m} unknown constants"
        object.__setattr__(self, "C", checked_matrix(where, "C", self.C, (q, n), reason))
        if len(self.example) not in (0, n + m):
            raise ValueError(f"{where}: the example has {len(self.example)} numbers, expected {n + m} for {reason}.")
        for name, shape in {"drift": (n, n), "drive": (n,), "regressor": (n, m)}.items():
            found = np.shape(getattr(self, name)(0.0, self.start_inputs))
            if found != shape:
                raise ValueError(f"{where}: {name}(t, u) returns shape {found}, expected {shape} for {reason}.")

    def flow(self, t: Array, x: Array, rho: Array, u: Array) -> Array:
        """``A(t, u) x + B(t, u) + Phi(t, u) rho``, shape (n,).

        Args:
            rho: unknown constants, shape (m,).
        """
        return self.drift(t, u) @ x + self.drive(t, u) + self.regressor(t, u) @ rho
