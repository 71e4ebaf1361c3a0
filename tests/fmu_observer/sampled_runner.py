"""Runners of observers corrected by samples: the true motion by an independent integrator, and errors along a
run.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence

import numpy as np
from scipy.integrate import solve_ivp

from fmu_observer.models.observer_model import ObserverModel, shift_matrix
from plant_models.hybrid import HybridSystem, NumpyKernel, Runtime, input_signal, scalar_names, state

Motion = Callable[[float], np.ndarray]


def true_motion(model: ObserverModel, start: Sequence[float], inputs: Sequence[float], end: float) -> Motion:
    """The state of the model over time under constant inputs, by DOP853 to 1e-12."""
    u = np.asarray(inputs, dtype=float)
    found = solve_ivp(
        lambda _t, x: model.flow(x, u),
        (0.0, end),
        np.asarray(start, dtype=float),
        "DOP853",
        dense_output=True,
        rtol=1e-12,
        atol=1e-13,
    )
    return found.sol  # type: ignore[no-any-return]


class SampledRunner:
    """An observer that follows a true motion, sampled at given instants; periodic observers sample by themselves."""

    def __init__(
        self,
        observer: HybridSystem,
        motion: Motion,
        inputs: Sequence[float],
        *,
        python: bool = False,
        **parameters: float,
    ) -> None:
        self.observer, self.motion = observer, motion
        self.runtime = Runtime(observer, NumpyKernel(observer) if python else None)
        self.names = scalar_names(observer.input_signals)
        self.periodic = bool(observer.periodic_events)
        known = scalar_names(observer.parameter_signals)
        for name, value in parameters.items():
            self.runtime.p[known.index(name)] = value
        self.runtime.u[: len(inputs)] = inputs
        self.model: ObserverModel = observer.model  # type: ignore[attr-defined]
        self._measure(0.0)
        self.runtime.start(0.0)

    def _measure(self, t: float) -> None:
        y = self.model.C @ self.motion(t)
        self.runtime.u[len(self.runtime.u) - len(y) :] = y

    def sample(self, t: float) -> None:
        """Advance to `t` and give a sample there."""
        if self.periodic:
            self._measure(t)
            self.runtime.advance(t)
            return
        self.runtime.advance(t)
        self._measure(t)
        self.runtime.trigger(self.observer.triggered_events[0].name)

    def follow(self, instants: Iterable[float]) -> None:
        """Samples at all of them."""
        for t in instants:
            self.sample(float(t))

    def error(self, t: float | None = None) -> np.ndarray:
        """Estimate less truth, now or after an advance to `t`, shape (n,)."""
        if t is not None:
            self.runtime.advance(t)
        return np.asarray(self.runtime.x[: self.model.order] - self.motion(self.runtime.t))


def aperiodic_instants(seed: int, longest: float, end: float) -> np.ndarray:
    """Instants up to `end` with gaps uniform in [0.2, 1] of the longest."""
    gaps = np.random.default_rng(seed).uniform(0.2, 1.0, int(6.0 * end / longest)) * longest
    instants = np.cumsum(gaps)
    return instants[instants < end]


def chain(length: int, width: int = 1, slope: float = 0.0) -> ObserverModel:
    """The bare chain of integrators, its first block measured; `slope` is added to the last diagonal entries."""
    n = length * width
    A = shift_matrix(length, width)
    damping = np.zeros((n, n))
    damping[n - width :, n - width :] = slope * np.eye(width)
    return ObserverModel(
        name="chain",
        description="Chain of integrators",
        source="textbook",
        states=tuple(state(f"x{i}", "1") for i in range(n)),
        inputs=(),
        measurements=tuple(input_signal(f"x{i}", "1") for i in range(width)),
        A=A,
        B=np.zeros((n, 0)),
        C=np.eye(width, n),
        phi=(lambda x, _u: damping @ x) if slope else None,
        lipschitz=abs(slope),
        slopes=(damping,) if slope else (),
    )
