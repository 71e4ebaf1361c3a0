"""The general Takagi-Sugeno continuous-discrete observer of chapter 2. Uses Takagi-Sugeno models and certificates."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from itertools import combinations
from typing import Any, Literal

import numpy as np

from fmu_observer.certificates.aperiodic import certify_sampled_error, with_switching_noted
from fmu_observer.certificates.finding import Finding, condition_found
from fmu_observer.certificates.impulsive_error import ImpulsiveError
from fmu_observer.models.known_models import TAKAGI_SUGENO_MODELS, find_takagi_sugeno_model
from fmu_observer.models.observer_model import named_as, stacked_of
from fmu_observer.models.takagi_sugeno import TakagiSugenoModel
from fmu_observer.observability import require_detectable_vertices
from fmu_observer.observers.evaluated_observer import GapCertified
from fmu_observer.observers.gated_observer import GatedObserver
from fmu_observer.observers.generic.sampled.takagi_sugeno_gains import GAINS, TakagiSugenoGains
from fmu_observer.observers.model_signals import estimate_outputs, estimate_states, measured_inputs
from fmu_observer.observers.parameter_values import Value, parameter_values
from plant_models.hybrid import Array, TriggeredEvent, vector
from plant_models.hybrid.option import require_chosen
from plant_models.hybrid.signal import Signal, discrete_output, memory, output_signal, parameter, state

Premise = Literal["estimated", "live", "frozen"]
PREMISES: tuple[Premise, ...] = ("estimated", "live", "frozen")


class GeneralTakagiSugenoCdo(GatedObserver, GapCertified):
    """Takagi-Sugeno observer with continuous and aperiodic sampled outputs: Bouchama 2024, (2.6).

    ``dxh = sum_i h_i [A_i xh + B_i u - K_i2 (C2 xh - y2) - K_i1 c]``, ``dc = -eta c``, ``c = C1 xh - y1`` at a sample.
    The decaying gain ``exp(-eta (t - t_k)) K_i1`` is one more state a sampled output, reset at samples. Which output a
    gain belongs to follows from its shape: K_i1 has a column for each sampled output, K_i2 for each continuous one.

    The weights h depend on the premises, read from the state nearest to the estimate that agrees with what `premise`
    lets it see:
    ``frozen`` at the last sample, as printed in (2.6): the error then does not go to zero on a moving plant; ``live``:
    y2 of now and y1 of the last sample; ``estimated`` (default): y2 of now, all else estimated, the only one with which
    the error vanishes.

    Premises outside their bounds use the nearer vertices. That is counted: `premise_violations` samples at which it was
    so, and `premise_outside_time` for how long.

    Args:
        model: a Takagi-Sugeno model or the name of one.
        premise: see above.
        gains: gains of the parameters' starts; None for the shipped ones of that model. A model of your own needs them.

    Presets, where the model has them: `as_published` gains of the thesis; `redesigned` by Theorem 7 (see
    `takagi_sugeno_gains`).

    Raises:
        ValueError: model or premise is unknown, gains are missing or of another shape, nothing is sampled, or a vertex
        has a mode
            that does not decay and is not measured.
    """

    name = "general_takagi_sugeno_cdo"
    description = (
        "Takagi-Sugeno continuous-discrete observer of any such model, continuous and aperiodic sampled outputs"
    )
    source = "Bouchama 2024, (2.6)"
    option_choices = {"model": tuple(TAKAGI_SUGENO_MODELS), "premise": PREMISES}

    def __init__(
        self,
        model: str | TakagiSugenoModel = "takagi_sugeno_train",
        premise: Premise = "estimated",
        gains: TakagiSugenoGains | None = None,
    ) -> None:
        self.model = chosen = find_takagi_sugeno_model(model)
        require_chosen(self.name, self.option_choices, premise=premise)
        if not chosen.sampled:
            raise ValueError(
                f"{self.name}: model {chosen.name!r} has no sampled measurement; use an observer of continuous ones."
            )
        if not isinstance(gains, TakagiSugenoGains | None):
            raise ValueError(f"{self.name}: gains must be TakagiSugenoGains(eta, sampled, continuous), got {gains!r}.")
        self.premise = premise
        require_detectable_vertices(chosen, self.name)
        shipped = GAINS.get(chosen.name, {}) if gains is None else {"stated": gains}
        if not shipped:
            raise ValueError(
                f"{self.name}: no gains are shipped for model {chosen.name!r}; give gains=, e.g. by design_theorem7."
            )
        self.presets = {name: values.parameters(chosen) for name, values in shipped.items()}
        self.default_preset = next(iter(self.presets))
        self.parameters = self._gain_parameters()
        self.states = (*self._estimator_states(), *self._memory())
        self.inputs = (*chosen.inputs, *measured_inputs(chosen.continuous))
        self.outputs = (
            *estimate_outputs(chosen.states),
            discrete_output("premise_violations", "1", "Samples at which a premise was outside its bounds"),
            output_signal("premise_outside_time", "s", "For how long a premise was outside its bounds"),
        )
        payload = measured_inputs(chosen.sampled, f"{chosen.event}_", "discrete")
        self.events = (TriggeredEvent(chosen.event, payload, "A sampled measurement arrives, at its own time stamp"),)
        super().__init__(model=chosen.name, premise=premise)

    # -- equations ----------------------------------------------------------------------------------------------------

    def flow(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        model = self.model
        estimate, innovation = self._estimate(x), stacked_of(x, model.sampled, "innovation_")
        values = self._premises_in_use(x, u)
        h = model.weights(values)
        predicted = model.blend(h, estimate, stacked_of(u, model.inputs))
        correction = self._corrected(h, p.sampled_gain, innovation)
        if model.continuous:
            continuous = model.C_continuous @ estimate - self._continuous(u)
            correction = correction + self._corrected(h, p.continuous_gain, continuous)
        return {
            **named_as(model.states, predicted - correction, "estimated_"),
            **named_as(model.sampled, -p.innovation_decay * innovation, "innovation_"),
            "time_outside": model.outside(values),
        }

    def update(self, event: str, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        """The innovation is set anew and the premises are examined; the estimates stay."""
        model, estimate = self.model, self._estimate(x)
        arrived = stacked_of(u, model.sampled, f"{model.event}_")
        values = self._premises_at(estimate, None if self.premise == "estimated" else arrived, u)
        kept = {"frozen": values, "live": arrived, "estimated": ()}[self.premise]
        return {
            **named_as(model.sampled, model.C_sampled @ estimate - arrived, "innovation_"),
            "violations_counted": x.violations_counted + model.outside(values),
            **named_as(self._held, kept, "held_"),
        }

    def output(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        counts = {"premise_violations": x.violations_counted, "premise_outside_time": x.time_outside}
        return named_as(self.model.states, self._estimate(x)) | counts

    # -- stability ----------------------------------------------------------------------------------------------------

    def vertex_errors(
        self, parameters: Mapping[str, Value] | None = None, preset: str | None = None
    ) -> tuple[ImpulsiveError, ...]:
        """Error equations at every vertex for the gains in use, in the scaled coordinates of the model.

        Args:
            parameters: values by name that replace those of the preset. preset: preset to start from.
        """
        p = self.unpack_parameters(parameter_values(self, parameters, preset))
        return tuple(self._error_at(h, p) for h in np.eye(self.model.vertices))

    def gap_finding(self, gap: float, p: Any) -> Finding:
        """Certificate over the vertices and halfway between every two, in the coordinates of the model."""
        N = self.model.vertices
        pairs = [0.5 * (np.eye(N)[i] + np.eye(N)[j]) for i, j in combinations(range(N), 2)]
        errors = tuple(self._error_at(h, p) for h in (*np.eye(N), *pairs))
        left_out = (
            f"error of {self.model.name} at its {N} vertices and halfway between them, weights constant over a gap; "
            "the change of the weights and their difference to the plant's, which act as inputs to it, are left out"
        )
        found = certify_sampled_error(errors, gap, left_out)
        if self.premise != "frozen":
            found = with_switching_noted(found, errors, "weights")
        T = np.asarray(self.model.scaling)
        P = tuple(
            tuple(float(v * T[i] * T[j]) for j, v in enumerate(row)) for i, row in enumerate(found.lyapunov_matrix)
        )
        return replace(found, lyapunov_matrix=P)

    def condition_of(self, p: Any) -> Finding:
        """Whether every vertex error decays for infinitely frequent samples: ``A_i - K_i1 C1 - K_i2 C2`` is Hurwitz."""
        limits = [self._error_at(h, p).continuous_limit for h in np.eye(self.model.vertices)]
        abscissas = [float(np.linalg.eigvals(limit).real.max()) for limit in limits if limit is not None]
        return condition_found(
            holds=max(abscissas) < 0.0,
            numbers={f"abscissa_{i + 1} [1/s]": value for i, value in enumerate(abscissas)},
            statement="A_i - K_i1 C1 - K_i2 C2 is Hurwitz at every vertex, necessary for any gap",
            source="Bouchama 2024, (2.9)",
        )

    # -- internals ----------------------------------------------------------------------------------------------------

    def _error_at(self, h: np.ndarray, p: Any) -> ImpulsiveError:
        model, T = self.model, np.asarray(self.model.scaling)
        N, n = model.vertices, model.order
        drift = np.tensordot(h, model.A, 1)
        if model.continuous:
            drift = drift - np.tensordot(h, np.reshape(p.continuous_gain, (N, n, -1)), 1) @ model.C_continuous
        gain = np.tensordot(h, np.reshape(p.sampled_gain, (N, n, -1)), 1)
        decay = float(p.innovation_decay) * np.eye(len(model.sampled))
        return ImpulsiveError.with_innovation(drift * T[:, None] / T, gain * T[:, None], decay, model.C_sampled / T)

    def _corrected(self, h: tuple[Array, ...], gain: Array, error: Array) -> Array:
        """``sum_i h_i K_i error``, shape (n,); the gain is flat: vertex, state, measurement."""
        n, q = self.model.order, len(error)
        rows = []
        for i in range(n):
            entries = [
                sum(weight * gain[(v * n + i) * q + c] for v, weight in enumerate(h)) * error[c] for c in range(q)
            ]
            rows.append(sum(entries[1:], entries[0]))
        return vector(*rows)

    def _premises_in_use(self, x: Any, u: Any) -> tuple[Array, ...]:
        held = tuple(getattr(x, f"held_{premise.name}") for premise in self._held)
        if self.premise == "frozen":
            return held
        return self._premises_at(self._estimate(x), held if self.premise == "live" else None, u)

    def _premises_at(self, estimate: Array, sampled: Array | None, u: Any) -> tuple[Array, ...]:
        continuous, known = self._continuous(u) if self.model.continuous else None, stacked_of(u, self.model.inputs)
        return self.model.premise_values(self.model.informed(estimate, sampled, continuous), known)

    def _continuous(self, u: Any) -> Array:
        return stacked_of(u, self.model.continuous, "measured_")

    def _estimate(self, x: Any) -> Array:
        return stacked_of(x, self.model.states, "estimated_")

    @property
    def _held(self) -> tuple[Any, ...]:
        """What is held of the last sample: premises, or measurements."""
        held: dict[str, tuple[Any, ...]] = {"frozen": self.model.premises, "live": self.model.sampled, "estimated": ()}
        return held[self.premise]

    def _gain_parameters(self) -> tuple[Signal, ...]:
        model, starts = self.model, self.presets[self.default_preset or ""]
        parts = (("sampled", model.sampled, "K_i1"), ("continuous", model.continuous, "K_i2"))
        gains = (
            parameter(
                f"{kind}_gain",
                "1",
                starts[f"{kind}_gain"],
                f"{symbol}: by vertex, state, measurement, in SI units",
                size=model.vertices * model.order * len(measured),
            )
            for kind, measured, symbol in parts
            if measured
        )
        decay = parameter(
            "innovation_decay", "1/s", starts["innovation_decay"], "Decay rate eta of the sampled gain", min=0.0
        )
        return (decay, *gains)

    def _estimator_states(self) -> tuple[Signal, ...]:
        model = self.model
        return (
            *estimate_states(model.states),
            *(
                state(f"innovation_{s.name}", s.unit, 0.0, f"Error at the last sample, decaying: {s.name}")
                for s in model.sampled
            ),
            state("time_outside", "s", 0.0, "For how long a premise was outside its bounds"),
        )

    def _memory(self) -> tuple[Signal, ...]:
        model = self.model
        counted = memory("violations_counted", "1", 0.0, "Samples at which a premise was outside its bounds")
        premises = model.premise_values(model.start, np.zeros(len(model.inputs)))
        starts = {"frozen": premises, "live": model.C_sampled @ model.start, "estimated": ()}[self.premise]
        held = zip(self._held, starts, strict=True)
        return (
            counted,
            *(memory(f"held_{s.name}", s.unit, float(v), f"At the last sample: {s.description}") for s, v in held),
        )
