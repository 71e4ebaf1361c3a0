"""Base of the adaptive observers of state-affine models: their signals, their outputs and what all of them do between
samples.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Iterator
from math import inf
from typing import Any, ClassVar, NamedTuple

import numpy as np

from fmu_observer.certificates.aperiodic import certify_sampled_error
from fmu_observer.certificates.finding import Finding, as_printed, condition_found, limit_found, to_simulate
from fmu_observer.certificates.gap_error import first_unstable_gap
from fmu_observer.certificates.gap_findings import with_limit
from fmu_observer.certificates.impulsive_error import ImpulsiveError
from fmu_observer.certificates.printed_bounds.adaptive_bounds import adaptive_bounds, gain_bound, settled_gain
from fmu_observer.formulas.adaptation.adaptive_law import (
    Adaptation,
    Gains,
    Plant,
    Sizes,
    adaptation_flow,
    adaptation_of,
    adaptation_states,
    error_drift,
    gains_of,
    learnt_constants,
    smallest_eigenvalue,
    start_covariance,
)
from fmu_observer.models.known_models import STATE_AFFINE_MODELS, find_state_affine_model
from fmu_observer.models.observer_model import named_as, stacked_of
from fmu_observer.models.state_affine import StateAffineModel
from fmu_observer.observers.evaluated_observer import GapCertified
from fmu_observer.observers.gated_observer import GatedObserver
from fmu_observer.observers.generic.adaptive.adaptive_limits import adaptive_search
from fmu_observer.observers.model_signals import arrival_event, estimate_outputs, estimate_states
from plant_models.hybrid import Array, HybridSystem, Runtime, Signal, output_signal, parameter, scalar_names

_HORIZON = 40.0  # [s]; the second regressor of the printed example has faded long before
_COARSE = 0.01  # [s], internal step: RK4 of frequencies of 20 rad/s to 1e-5
_LEFT = 0.02  # share of the first error that may be left in the states
_LAST_PART = 0.8  # of the horizon; what is left after it counts


class _Left(NamedTuple):
    """Shares of the first error that are left, as root mean squares over errors that are equally likely at the start.

    Args:
        states: largest over the last fifth of the horizon. constants: of each unknown constant, at its end.
    """

    states: float
    constants: tuple[float, ...]


SHORTEST, _BISECTIONS = 0.02, 6  # [s], [1] of the search for the longest period


_LIMITS: dict[Any, float] = {}  # of this process; a run of 40 s takes a quarter of a second


_LATER, _EXCITED = 10.0, 0.5  # [s], [1] [ours]: when the excitation is judged, against that at half the time
_LONGEST_PERIOD = 1.0  # [s] up to which limits are searched
_NOTHING_KNOWN = 100.0  # [ours] start value of every standard deviation
_LEAST_VARIANCE = 1e-30  # below it a standard deviation is reported as 1e-15
_ADAPTIVE_PARAMETERS = (
    parameter("mu", "1/s", 10.0, "Decay of S: the state's gain forgets measurements at this rate", min=1e-9),
    parameter("forgetting", "1/s", 1.0, "Rate at which the adaptation gain forgets; 1 as published", min=0.0),
    parameter("gain_floor", "1", 0.0, "One over the largest adaptation gain; 0 for no limit, as published", min=0.0),
    parameter("least_excitation", "1", 0.0, "Mean excitation below which a constant is held; 0 for never", min=0.0),
    parameter("excitation_time", "s", 1.0, "Window of the mean excitation", min=1e-9),
)


class AdaptiveObserver(GatedObserver, GapCertified):
    """Base of the observers of state and unknown constants at once: Hann 2014, chapter 4.

    States are the estimates, the constants, the adaptation (`adaptive_law.adaptation_states`), and what a subclass
    keeps of the measurements, q numbers. Outputs are the estimates and the constants under their names, for each
    constant `<name>_deviation`, the standard deviation of its error, and `<name>_learnt`, 1 where it is learnt and 0
    where it is held for want of excitation; `smallest_excitation`, the smallest eigenvalue of the mean of
    ``chi' chi``; and `innovation`.

    The covariance is exact for the model with white noise of `noise_deviation` at each measurement, whatever the
    instants: the errors obey a linear equation that the observer knows. It begins at `_NOTHING_KNOWN` for all.

    Args:
        model: a state-affine model or the name of one. sampled: whether the sensitivity of the output is sampled like
            it. options: of the subclass.

    Raises:
        ValueError: the model is unknown, or has more than three unknown constants.
    """

    internal_step = 5e-3
    option_choices = {"model": tuple(STATE_AFFINE_MODELS)}
    predicts: ClassVar[bool]

    def __init__(self, model: str | StateAffineModel, sampled: bool, **options: Any) -> None:
        self.model = chosen = find_state_affine_model(model)
        self.sizes = Sizes(chosen.order, len(chosen.unknowns), len(chosen.measurements), sampled)
        if self.sizes.m not in (1, 2, 3):
            raise ValueError(
                f"{self.name}: the model {chosen.name!r} has {self.sizes.m} unknown constants; 1 to 3 can be learnt."
            )
        believed = (*chosen.states, *chosen.unknowns)
        first = start_covariance(chosen.C, (_NOTHING_KNOWN,) * len(believed), self.sizes, self.predicts)
        self.states = (
            *estimate_states(believed),
            *adaptation_states(self.sizes, first),
            self.kept_signal(),
        )
        self.inputs = chosen.inputs
        self.outputs = _adaptive_outputs(chosen)
        self.parameters = self.bounded_parameters = (
            *_ADAPTIVE_PARAMETERS,
            parameter("noise_deviation", "1", 0.0, "Standard deviation of the noise of a measurement", min=0.0),
        )
        self.events = (arrival_event(chosen.event, chosen.measurements),)
        super().__init__(model=chosen.name, **options)

    # -- what a subclass writes -------------------------------------------------------------------------------------

    @abstractmethod
    def kept_signal(self) -> Signal:
        """What is kept of the measurements: q predicted outputs (a state), or q held innovations (memory)."""

    @abstractmethod
    def acting(self, x: Any) -> Array:
        """The innovation that acts, shape (q,)."""

    @abstractmethod
    def kept_after(self, x: Any, y: Array) -> dict[str, Array]:
        """What is kept once the measurements y are known, by name."""

    # -- what follows -----------------------------------------------------------------------------------------------

    def flow(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        """Estimates, constants, adaptation, and predicted outputs where they are predicted."""
        estimate, rho, adaptation = self._parts(x)
        known = stacked_of(u, self.model.inputs)
        plant = Plant(
            self.model.drift(t, known), self.model.drive(t, known), self.model.regressor(t, known), self.model.C
        )
        gains = self._gains(adaptation, p)
        c = self.acting(x)
        predicted = plant.A @ estimate + plant.B + plant.Phi @ rho
        drift = error_drift(plant, gains, self.sizes, self.predicts)
        return {
            **named_as(self.model.states, predicted - gains.total @ c, "estimated_"),
            **named_as(self.model.unknowns, -(gains.constants @ c), "estimated_"),
            **adaptation_flow(adaptation, plant, gains, drift, p.mu, p, self.sizes),
            **({"predicted_output": self.model.C @ predicted - gains.output @ c} if self.predicts else {}),
        }

    def update(self, event: str, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        """What is kept is set by the measurements, and the covariance with it; all else stays continuous."""
        V, variance = x.error_covariance, p.noise_deviation**2
        for row in range(self.sizes.q):
            V = _covariance_after(V, self.model.C, row, variance, self.sizes, self.predicts)
        seen = {"seen_sensitivity": self.model.C @ x.sensitivity} if self.sizes.sampled else {}
        y = stacked_of(u, self.model.measurements, f"{self.model.event}_")
        return seen | {"error_covariance": V} | self.kept_after(x, y)

    def output(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        n, m = self.sizes[:2]
        estimate, rho, adaptation = self._parts(x)
        learnt = learnt_constants(adaptation.excitation, p.least_excitation, m)
        found = named_as(self.model.states, estimate)
        for j, s in enumerate(self.model.unknowns):
            variance = adaptation.covariance[n + j, n + j]
            found |= {
                s.name: rho[j],
                f"{s.name}_deviation": np.sqrt(np.maximum(variance, _LEAST_VARIANCE)),
                f"{s.name}_learnt": learnt[j],
            }
        innovation = self.acting(x)
        return found | {
            "smallest_excitation": smallest_eigenvalue(adaptation.excitation, m),
            "innovation": innovation[0] if self.sizes.q == 1 else innovation,
        }

    # -- certificate ------------------------------------------------------------------------------------------------

    def known_error(self, mu: float) -> ImpulsiveError:
        """Error of the observer that knows the constants, its gain settled, A as it is at time 0.

        Args:
            mu: decay of S [1/s].
        """
        K = settled_gain(self.model, mu)
        decay = self.model.C @ K if self.predicts else np.zeros((self.sizes.q, self.sizes.q))
        u = self.model.start_inputs
        return ImpulsiveError.with_innovation(np.asarray(self.model.drift(0.0, u)), K, decay, self.model.C)

    def gap_finding(self, gap: float, p: Any) -> Finding:
        """Certificate of the state's error with the constants known, and what the adaptation leaves at `gap`."""
        found = certify_sampled_error(
            (self.known_error(float(p.mu)),),
            gap,
            "errors of the states with the constants known, the gain settled and A as it is at time 0; those of the "
            "adaptation by their linear equation, which no measurement enters, from the start on and at a constant gap "
            "only; noise is left out",
        )
        values = np.concatenate([np.ravel(np.asarray(getattr(p, s.name), float)) for s in self.parameter_signals])
        left = _errors_left(self, values, gap)
        of_constants = ", ".join(
            f"{s.name} {share:.2g}" for s, share in zip(self.model.unknowns, left.constants, strict=True)
        )
        text = (
            f"at a constant gap of {gap:.4g} s the states keep {left.states:.2g} of the first error after "
            f"{_HORIZON:g} s, the constants {of_constants}; {_LEFT:g} of it in the states is allowed"
        )
        known = first_unstable_gap([self.known_error(float(p.mu))], _LONGEST_PERIOD)
        longest = _adaptation_limit(self, values, min(known, _LONGEST_PERIOD))
        allowed = gap <= longest and left.states < _LEFT
        kept = Finding("errors kept by the states", left.states, "1", "exact", "the adaptation", allowed, text)
        return with_limit(found, longest, left.states ** (gap / _HORIZON)).also(kept)

    def condition_of(self, p: Any) -> Finding:
        """Persistent excitation (4.8), and (4.63) where the output is predicted, at the model's `sample_period`."""
        early, late = (adaptive_bounds(self.model, float(p.mu), begin=begin) for begin in (0.5 * _LATER, _LATER))
        alpha0 = late.alpha0
        values = {"alpha0": alpha0, "least_alpha0": _EXCITED * early.alpha0}
        statement = (
            f"excitation that lasts, alpha0 >= least_alpha0: at {_LATER:g} s at least {_EXCITED:g} of that at "
            f"{0.5 * _LATER:g} s"
        )
        excited = alpha0 > 0.0 and alpha0 >= values["least_alpha0"]
        if not self.predicts:
            return condition_found(excited, values, statement, "Hann 2014, (4.8); theorem 4.6 prints no period")
        longest = late.longest_period
        return condition_found(
            excited and self.model.sample_period <= longest,
            values
            | {
                "smallest_inverse_R": gain_bound(late.window, alpha0),
                "period [s]": self.model.sample_period,
                "longest_period [s]": longest,
            },
            f"{statement}; period <= longest_period [s], sufficient and ten orders of magnitude too careful",
            "Hann 2014, (4.8), Lemma 4.3, (4.63)",
        )

    # -- limits -----------------------------------------------------------------------------------------------------

    def limit_findings(self, values: np.ndarray) -> Iterator[Finding]:
        """Between two samples: (4.63) beside the exact limit of the linear error equations, and runs.

        Args:
            values: of all parameters, shape (k,).
        """
        what, mu = "period of the samples", float(self.unpack_parameters(values).mu)
        if self.predicts:
            bounds = adaptive_bounds(self.model, mu)
            text = f"tau_MASP for a vanishing rate, {bounds.explain()}; from time 0 on, later alpha0 is smaller"
            yield as_printed(what, bounds.longest_period, text, "Hann 2014, (4.63)")
        search = adaptive_search(self, dict(zip(scalar_names(self.parameter_signals), map(float, values), strict=True)))
        known = min(first_unstable_gap([self.known_error(mu)], _LONGEST_PERIOD), _LONGEST_PERIOD)
        adapted = _adaptation_limit(self, values, known, search.left)
        exact = adapted if known == _LONGEST_PERIOD else min(adapted, known)
        test = (
            "the observer that knows the constants, its gain settled, unstable, or more than "
            f"{search.left:.2g} of the states' first error left by the adaptation after {_HORIZON:g} s, to 5 %"
        )
        yield limit_found(what, exact, _LONGEST_PERIOD, test, shortest=_shortest_tried(known))
        yield to_simulate(search, what)

    # -- internals --------------------------------------------------------------------------------------------------

    def estimates(self, x: Any) -> Array:
        """The estimated state, shape (n,)."""
        return stacked_of(x, self.model.states, "estimated_")

    def _parts(self, x: Any) -> tuple[Array, Array, Adaptation]:
        rho = stacked_of(x, self.model.unknowns, "estimated_")
        return self.estimates(x), rho, adaptation_of(x, self.model.C, self.sizes)

    def _gains(self, adaptation: Adaptation, p: Any) -> Gains:
        learnt = learnt_constants(adaptation.excitation, p.least_excitation, self.sizes.m)
        return gains_of(adaptation, self.model.C, learnt)


def _adaptive_outputs(model: StateAffineModel) -> tuple[Signal, ...]:
    """Outputs of an adaptive observer of a model.

    Args:
        model: state-affine.
    """
    of_constants: list[Signal] = []
    for s in model.unknowns:
        of_constants += [
            *estimate_outputs([s]),
            output_signal(f"{s.name}_deviation", s.unit, f"Standard deviation of its error: {s.description}"),
            output_signal(f"{s.name}_learnt", "1", f"1 where it is learnt, 0 where it is held: {s.description}"),
        ]
    q = len(model.measurements)
    return (
        *estimate_outputs(model.states),
        *of_constants,
        output_signal("smallest_excitation", "1", "Smallest eigenvalue of the mean Gramian of the excitation"),
        output_signal("innovation", "1", "Innovation that acts", size=None if q == 1 else q),
    )


def _covariance_after(V: Array, C: Array, row: int, variance: Array, sizes: Sizes, predicts: bool) -> Array:
    """Covariance of the error after one measurement, shape (n + m + q, n + m + q)."""
    n, m, _q = sizes[:3]
    jump = np.eye(sizes.error)
    place = n + m + row
    jump[place, :] = 0.0
    if not predicts:
        jump[place, :n] = np.asarray(C)[row]
    added = np.zeros((sizes.error, sizes.error))
    added[place, place] = 1.0
    return jump @ V @ jump.T + variance * added


def _adaptation_limit(observer: Any, parameters: np.ndarray, high: float, left: float = _LEFT) -> float:
    """Longest period [s] at which the adaptation leaves no more than a share of the states, to 5 %, rounded down.

    By bisection, which takes what fails once for what fails from there on.
    """
    key = (observer.name, observer.model.name, observer.sizes, high, left, tuple(float(v) for v in parameters))
    if key not in _LIMITS:
        _LIMITS[key] = _longest_kept(lambda period: _errors_left(observer, parameters, period).states < left, high)
    return _LIMITS[key]


def _longest_kept(keeps: Callable[[float], bool], high: float) -> float:
    shortest = _shortest_tried(high)
    if high == 0.0 or not keeps(shortest):
        return 0.0
    if keeps(high):
        return inf
    low, top = shortest, high
    for _ in range(_BISECTIONS):
        middle = float(np.sqrt(low * top))
        low, top = (middle, top) if keeps(middle) else (low, middle)
    return low


def _shortest_tried(high: float) -> float:
    """The shortest period that the search for the longest one tries [s]."""
    return min(SHORTEST, 0.5 * high)


def _errors_left(observer: Any, parameters: np.ndarray, period: float) -> _Left:
    """Errors after `_HORIZON`, samples coming each `period`, inputs at their starts, no noise."""
    system: HybridSystem = observer
    n, m = observer.sizes[:2]
    runtime = Runtime(system)
    runtime.p[:] = parameters
    names = scalar_names(system.parameter_signals)
    runtime.p[names.index("noise_deviation")] = 0.0
    runtime.p[names.index("internal_step")] = max(runtime.p[names.index("internal_step")], _COARSE)
    places = [i for i, name in enumerate(scalar_names(system.states)) if name.startswith("error_covariance")]
    size = observer.sizes.error
    diagonal = [places[i * size - i * (i - 1) // 2] for i in range(n + m)]
    first = float(np.sqrt(np.mean(runtime.x[diagonal])))
    runtime.start(0.0)
    count = max(int(_HORIZON / period), 1)
    largest = 0.0
    with np.errstate(over="ignore", invalid="ignore"):
        for k in range(1, count + 1):
            runtime.advance(k * period)
            variances = runtime.x[diagonal]
            if not np.all(np.isfinite(runtime.x)):
                return _Left(np.inf, (np.inf,) * m)
            if k > _LAST_PART * count:
                largest = max(largest, float(np.mean(np.maximum(variances[:n], 0.0))))
            runtime.trigger(observer.model.event)
        constants = np.sqrt(np.maximum(runtime.x[diagonal][n:], 0.0)) / first
    return _Left(float(np.sqrt(largest)) / first, tuple(map(float, constants)))
