"""The model of a filter: how a state moves over a period and what is measured of it, noises included. A value.

It may come from an `ObserverModel` (`filter_model`) or from any hybrid system (`system_model`). It knows signals and
pure functions, and no filter.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, partial
from math import inf
from typing import NamedTuple

import numpy as np

from fmu_observer.formulas.filtering.kalman import symmetric
from fmu_observer.models.checks import check_identifiers, check_numbers, check_signals
from fmu_observer.models.discrete_model import transition
from fmu_observer.models.observer_model import NamedStates, ObserverModel
from plant_models.hybrid import Array, Signal, width
from plant_models.hybrid.exact_jacobian import exact_jacobian, is_affine


class Known(NamedTuple):
    """What a filter knows while the state moves or is measured.

    Attributes:
        t: time at the start of the period, or of the measurement [s]. u: inputs, held over the period, shape (m,).
        p: parameters of the model, shape (k,).
    """

    t: Array
    u: Array
    p: Array


Transition = Callable[[Array, Array, Known, Array], Array]  # (x (n,), w (r,), known, period [s]) -> shape (n,)
Measured = Callable[[Array, Array, Known], Array]  # (x (n,), v (s,), known) -> shape (q,)


@dataclass(frozen=True, eq=False)
class FilterModel(NamedStates):
    """What a filter believes of its plant: ``x+ = f(x, u, w)``, ``y = h(x, u, v)``; Allaoui 2024, (2.25).

    Args:
        name, description, source, states, inputs: see `NamedStates`.
        measurements: scalar signals by `input_signal`.
        parameters: signals by `parameter`, which become parameters of the filter.
        process_noises: scalar signals by `input_signal` through which noise enters the transition; none for additive
            noise on every state. measurement_noises: likewise for the measurements.
        moved: the transition f over a period, plain NumPy that can be traced; ignores w where noise is additive.
        measured: h, likewise.
        event: name of the event at which a measurement arrives unless set otherwise. sample_period: [s].
        any_period: whether `moved` holds for any period from zero; otherwise for one sampling period at a time.
        longest_period: the longest one for which it is as accurate as the system that it comes from [s].
        deviates: whether f or h is not affine in the state; None for what the traced functions show.

    Raises:
        ValueError: a name is no identifier or stands twice, a signal is of another kind, or nothing is measured.
    """

    measurements: tuple[Signal, ...]
    moved: Transition
    measured: Measured
    parameters: tuple[Signal, ...] = ()
    process_noises: tuple[Signal, ...] = ()
    measurement_noises: tuple[Signal, ...] = ()
    event: str = "sample"
    sample_period: float = 0.1
    any_period: bool = True
    longest_period: float = inf
    deviates: bool | None = None

    def __post_init__(self) -> None:
        where = f"Filter model {self.name!r}"
        check_identifiers(where, name=self.name, event=self.event)
        check_signals(where, states=self.states, inputs=self.inputs, measurements=self.measurements)
        check_numbers(where, {"sample_period": self.sample_period}, {})

    @property
    def noise_count(self) -> int:
        """Numbers in the process noise: one a declared input, or one a state."""
        return len(self.process_noises) or self.order

    @property
    def reading_noise_count(self) -> int:
        """Numbers in the measurement noise: one a declared input, or one a measurement."""
        return len(self.measurement_noises) or len(self.measurements)

    @property
    def linear(self) -> bool:
        """Whether transition and measurements are affine in the state."""
        return not self._deviates

    @cached_property
    def _deviates(self) -> bool:
        if self.deviates is not None:
            return self.deviates
        n, known = self.order, sum(self._sizes)
        return not (
            is_affine(self._moved_flat, n + len(self.process_noises), known + 1)
            and is_affine(self._measured_flat, n + len(self.measurement_noises), known)
        )

    def no_noise(self) -> np.ndarray:
        """Process noise that is absent, shape (r,)."""
        return np.zeros(len(self.process_noises))

    def no_reading_noise(self) -> np.ndarray:
        """Measurement noise that is absent, shape (s,)."""
        return np.zeros(len(self.measurement_noises))

    def transition_jacobians(self, x: Array, known: Known, period: Array) -> tuple[Array, Array | None]:
        """Exact Jacobians of the transition by state and noise, at no noise; also on traced symbols.

        Args:
            x: state before, shape (n,). known: time, inputs and parameters. period: [s].

        Returns:
            F of shape (n, n), and W of shape (n, r); None for additive noise.
        """
        found = self._moved_jacobian(np.hstack([x, self.no_noise()]), np.hstack([*_flat(known), _row(period)]))
        return found[:, : self.order], found[:, self.order :] if self.process_noises else None

    def transition_error(self, x: np.ndarray, known: Known, period: float) -> float:
        """How far the transition and its Jacobian are from those in steps of half the length, as a share of the latter.

        Args:
            x: state before, shape (n,). known: time, inputs and parameters. period: [s].

        Returns:
            The largest difference of an entry over the largest entry, at least 1, of the finer Jacobian; infinite where
            there are no numbers. Zero for a model that moves at its own period only.
        """
        if not self.any_period:
            return 0.0
        half, none = 0.5 * period, self.no_noise()
        with np.errstate(all="ignore"):
            whole, _ = self.transition_jacobians(x, known, period)
            first, _ = self.transition_jacobians(x, known, half)
            then = known._replace(t=known.t + half)
            second, _ = self.transition_jacobians(self.moved(x, none, known, half), then, half)
            finer = np.asarray(second) @ np.asarray(first)
            share = np.abs(np.asarray(whole) - finer).max() / max(1.0, np.abs(finer).max())
        return float(share) if np.isfinite(share) else inf

    def measurement_jacobians(self, x: Array, known: Known) -> tuple[Array, Array | None]:
        """Exact Jacobians of the measurements by state and noise, at no noise; also on traced symbols.

        Args:
            x: state, shape (n,). known: time, inputs and parameters.

        Returns:
            H of shape (q, n), and V of shape (q, s); None for additive noise.
        """
        found = self._measured_jacobian(np.hstack([x, self.no_reading_noise()]), np.hstack(_flat(known)))
        return found[:, : self.order], found[:, self.order :] if self.measurement_noises else None

    # -- internals --------------------------------------------------------------------------------------------------

    @property
    def _sizes(self) -> tuple[int, int, int]:
        return 1, len(self.inputs), width(self.parameters)

    def _known(self, flat: Array) -> Known:
        m, k = len(self.inputs), width(self.parameters)
        return Known(flat[0], flat[1 : 1 + m], flat[1 + m : 1 + m + k])

    def _moved_flat(self, xw: Array, flat: Array) -> Array:
        n = self.order
        return self.moved(xw[:n], xw[n:], self._known(flat), flat[sum(self._sizes)])

    def _measured_flat(self, xv: Array, flat: Array) -> Array:
        return self.measured(xv[: self.order], xv[self.order :], self._known(flat))

    @cached_property
    def _moved_jacobian(self) -> Callable[[Array, Array], Array]:
        return exact_jacobian(self._moved_flat, self.order + len(self.process_noises), sum(self._sizes) + 1)

    @cached_property
    def _measured_jacobian(self) -> Callable[[Array, Array], Array]:
        return exact_jacobian(self._measured_flat, self.order + len(self.measurement_noises), sum(self._sizes))


def filter_model(model: ObserverModel) -> FilterModel:
    """An observer model as the model of a filter, noise additive on states and measurements.

    Args:
        model: the plant as observers know it; its unknown inputs are left out.
    """
    return FilterModel(
        name=model.name,
        description=model.description,
        source=model.source,
        states=model.states,
        inputs=model.inputs,
        measurements=model.measurements,
        moved=partial(_moved, model),
        measured=lambda x, _v, _known: model.measured(x),
        event=model.event,
        sample_period=model.sample_period,
        deviates=model.phi is not None,
    )


def _moved(model: ObserverModel, x: Array, _w: Array, known: Known, period: Array) -> Array:
    return transition(model, x, known.u, period)


def _flat(known: Known) -> tuple[Array, ...]:
    return _row(known.t), known.u, known.p


def _row(value: Array) -> Array:
    return np.reshape(value, (1,))


def noise_over(model: FilterModel, x: Array, known: Known, period: Array, density: Array) -> Array:
    """Covariance that white noise on the states leaves after a period, by Simpson's rule of its integral.

    Exact for chains of up to two integrators; positive for any period.

    Args:
        model: holds for any period. x: state at the start, shape (n,). known: time, inputs and parameters.
        period: [s]. density: spectral density, shape (n, n) [x2/s].

    Returns:
        ``integral of F(s) density F(s)'`` over the period, shape (n, n).
    """
    half, _ = model.transition_jacobians(x, known, 0.5 * period)
    whole, _ = model.transition_jacobians(x, known, period)
    middle = half @ density @ half.T
    return symmetric((period / 6.0) * (density + 4.0 * middle + whole @ density @ whole.T))
