"""Observer of a state whose measurements come late and node by node, with finite-time predictors of the state now."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cached_property, partial
from typing import Any, Literal, Self

import numpy as np

from fmu_observer.certificates.finding import Finding, condition_found
from fmu_observer.certificates.impulsive_error import ImpulsiveError
from fmu_observer.certificates.printed_bounds.network_bounds import NetworkBounds, network_bounds
from fmu_observer.formulas.delay.finite_time_predictor import Prediction, at_age, integral_weights, moved_on
from fmu_observer.models.known_models import MODELS, find_model
from fmu_observer.models.observer_model import ObserverModel, named_as
from fmu_observer.observers.generic.delayed.delayed_limits import delay_findings, packet_findings
from fmu_observer.observers.generic.delayed.delayed_state_memory import (
    declared_memory,
    nodes_of_measurements,
    turns_of_nodes,
)
from fmu_observer.observers.generic.sampled.high_gain_sampled import HighGainSampled
from fmu_observer.observers.generic.sampled.sampled_observer import per_measurement
from fmu_observer.observers.parameter_values import Value, parameter_values
from plant_models.hybrid import Array, PeriodicEvent, TriggeredEvent, matrix, vector
from plant_models.hybrid.option import require_chosen, require_whole
from plant_models.hybrid.signal import Signal, discrete_output, input_signal, output_signal, parameter, state

Between = Literal["predicted", "held"]
BETWEEN: tuple[Between, ...] = ("predicted", "held")

DELAY, _MEMORY_PERIOD, MEMORY_PLACES = 0.1, 0.01, 20  # [s], [s], [1] [ours]: one predictor remembers 0.2 s
_THETA_PUBLISHED, _THETA_REPAIRED = 1.0, 5.0  # [1/s]
_MOST_PREDICTORS = 8


class DelayedStateObserver(HighGainSampled):
    """Observer of the state a delay ago, and of the state now: Hann 2014, (2.16), (2.57).

    A measurement of the instant t arrives at t + delay, one node after the other. The observer follows the delayed
    state ``x(t - delay)``, and its output w from packet to packet:

    ``dz = f(z, u(t - delay)) - theta inv(Delta) K (C z - w)``, ``dw = C f(z, u(t - delay))``, ``w_i = y_i`` for the
    measurements of the node that a packet is from. Predictors j = 1 ... m find from it the state now, each a share
    ``delay / m`` further:

    ``xi^j = xi^(j-1) + int f(xi^j, u) + s^j`` over the last ``delay / m``, ``ds = -sqrt|s| sign s``, so that s is zero
    after ``2 sqrt|s(0)|``, exactly: its root is computed and not integrated. What it waits for is the output
    `reaching_time`.

    Past inputs and rates f(xi^j) are memory: shift registers with a reading every `memory_period`. An input counts with
    its mean over the period, so its integral is exact; the integral of f follows the trapezoidal rule with an implicit
    end. The declared memory is ``predictors * memory_places * memory_period``; a longer delay is refused. Between two
    readings the prediction goes on along its rate. A delay below one `memory_period` takes inputs as they are now.

    Packets act when they arrive, and are not replayed at their stamps: the late policy is ``late``. One that was faster
    than `delay` has to wait for it, which the network of a scenario does (`equalise`).

    Presets, for chains of two blocks: `as_published` (theta = 1), `repaired` (theta = 5, which the published variances
    imply). The model must be a chain with its first block measured.

    Args:
        model: a model or the name of one in `MODELS`.
        predictors: m; 0 for the delayed state alone, which is then what the outputs are.
        memory_places: places of the memory for each predictor.
        between_samples: ``predicted`` as above, or ``held``: ``dw = 0``, for comparison.
        nodes: number of the node, from 1, of each measurement; by default each is on a node of its own.

    Raises:
        ValueError: the model does not suit, or an option is not legal.
    """

    name = "delayed_state_observer"
    description = "Observer of late measurements node by node, with finite-time predictors of the state now"
    source = "Hann 2014, (2.16), (2.57), Theorem 2.1"
    sampled_state = "predicted_output"
    theta_start = _THETA_REPAIRED
    internal_step = 2.5e-3  # four to a reading
    late_policy = "late"
    option_choices = {
        "model": tuple(MODELS),
        "predictors": (1, 0, 2, 3),
        "between_samples": BETWEEN,
    }

    def __init__(
        self,
        model: str | ObserverModel = "pendulum",
        *,
        predictors: int = 1,
        memory_places: int = MEMORY_PLACES,
        between_samples: Between = "predicted",
        nodes: Sequence[int] = (),
    ) -> None:
        chosen = find_model(model)
        require_whole(self.name, 0, _MOST_PREDICTORS, predictors=predictors)
        require_whole(self.name, memory_places=memory_places)
        require_chosen(self.name, self.option_choices, between_samples=between_samples)
        self.predictors, self.memory_places = predictors, memory_places
        self.predicts_output = between_samples == "predicted"
        self.node_of = nodes_of_measurements("delayed_state_observer", chosen, nodes)
        self.extra_memory = declared_memory(chosen, predictors, memory_places, self.total_places + 2)
        self.extra_outputs = self._outputs(chosen)
        super().__init__(
            chosen,
            predictors=predictors,
            memory_places=memory_places,
            between_samples=between_samples,
            nodes=tuple(nodes),
        )
        if chosen.order == 2 * len(chosen.measurements):
            self.presets = {"as_published": {"theta": _THETA_PUBLISHED}, "repaired": {}}
            self.default_preset = "repaired"

    # -- declarations -----------------------------------------------------------------------------------------------

    def _outputs(self, model: ObserverModel) -> tuple[Signal, ...]:
        delayed = [
            output_signal(f"delayed_{s.name}", s.unit, f"Estimate of a delay ago: {s.description}")
            for s in model.states
        ]
        if not self.predictors:
            return tuple(delayed)
        text = "Time until the last predictor is reached"
        return (*delayed, discrete_output("reaching_time", "s", text))

    @property
    def total_places(self) -> int:
        """Longest delay in memory periods."""
        return max(self.predictors, 1) * self.memory_places

    def theta_parameters(self) -> tuple[Signal, ...]:
        return (
            *super().theta_parameters(),
            parameter("delay", "s", DELAY, "Delay of every measurement when it arrives", min=0.0),
            parameter("memory_period", "s", _MEMORY_PERIOD, "Time between two readings into the memory", min=1e-6),
        )

    def declare_sampled_part(self, model: ObserverModel) -> None:
        integral = state("input_integral", "1", 0.0, "Inputs integrated since the last reading", size=len(model.inputs))
        self.extra_states = (
            per_measurement(model, "predicted_output", "Measurement a delay ago, as known now"),
            *((integral,) if model.inputs else ()),
        )

    def requirements(self, p: Any) -> dict[str, Array]:
        """The delay fits into the declared memory."""
        longest = self.total_places * p.memory_period
        text = (
            f"delay must fit into the declared memory, {self.total_places} times memory_period; raise the option "
            f"memory_places or memory_period"
        )
        return super().requirements(p) | {text: np.where(p.delay <= longest * (1.0 + 1e-12), 1.0, 0.0)}

    def deciding_parameters(self) -> tuple[Signal, ...]:
        """The gains: the delay and the memory do not act on the delayed error."""
        return tuple(s for s in super().deciding_parameters() if s.name not in ("delay", "memory_period"))

    # -- equations --------------------------------------------------------------------------------------------------

    def flow(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        model, z, now = self.model, self.estimates(x), self.known(u)
        acting = np.where(p.delay < p.memory_period, now, x.delayed_input) if model.inputs else now
        moved = model.flow(z, acting)
        error = model.measured(z) - self.sampled_part(x)
        follows = model.measured(moved)
        if not self.predicts_output:
            follows = 0.0 * follows
        flows = self.named_estimates(moved - self.correction(x, error, p)) | self.named_part(follows)
        return flows | ({"input_integral": now} if model.inputs else {})

    def update(self, event: str, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        """A packet sets the outputs of its node; a reading moves memory on."""
        if event == "reading":
            return self._read(t, x, u, p)
        received, outputs = self.measured(u), self.sampled_part(x)
        node = getattr(u, f"{event}_node")
        after = (
            np.where(node * (node - float(of)) == 0.0, received[i], outputs[i]) for i, of in enumerate(self.node_of)
        )
        return self.named_part(vector(*after))

    def output(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        """The state now, the delayed one, and the time until the predictors are reached."""
        states, z = self.model.states, self.estimates(x)
        delayed = named_as(states, z, "delayed_")
        if not self.predictors:
            return named_as(states, z) | delayed
        largest = 0.0
        for root in (root for roots in x.distance_root for root in roots):
            largest = np.maximum(largest, np.abs(root))
        now = z + x.prediction_offset + (t - x.reading_time) * x.prediction_offset_rate
        return named_as(states, now) | delayed | {"reaching_time": 2.0 * largest}

    def _read(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        """A period of the memory ends: the inputs are read, and all predictors move on by it."""
        h, now, first = p.memory_period, self.known(u), x.reading_begun[0] < 0.5
        means = []
        for i in range(len(self.model.inputs)):
            mean = np.where(first, now[i], x.input_integral[i] / h)
            means.append([mean, *(np.where(first, now[i], old) for old in x.past_input[i][:-1])])
        read = {"reading_time": vector(t), "reading_begun": vector(1.0)}
        if means:
            acting = vector(*(at_age(np.maximum(p.delay / h - 1.0, 0.0), mean) for mean in means))
            read |= {"input_integral": np.zeros(len(means)), "past_input": matrix(*means), "delayed_input": acting}
        return read | (self._predicted(x, means, now, first, p) if self.predictors else {})

    def _predicted(self, x: Any, means: list[list[Array]], now: Array, first: Array, p: Any) -> dict[str, Array]:
        """The predictors after a reading of these inputs, each from the one before."""
        h, n, count = p.memory_period, self.model.order, self.predictors
        share = p.delay / (count * h)  # of the delay, in places
        weights = integral_weights(share, self.memory_places)
        estimates = [*self.estimates(x)]
        base, drift = estimates, [0.0] * n
        predictors, rates = [], []
        for j in range(count):
            ahead = (count - 1 - j) * share - 0.5  # a mean stands for the middle of its period
            known = vector(*(at_age(ahead, mean) for mean in means)) if means else now
            before = Prediction(x.prediction[j], x.past_rate[j * n : (j + 1) * n], x.distance_root[j])
            rate_at = partial(self._rate, known=known)
            moved = moved_on(before, base, rate_at, first, weights, h, p.delay / count)
            predictors.append(moved)
            rates += [rates[:-1] for rates in moved.rates]
            ago = [at_age(share, moved.rates[i]) for i in range(n)]
            drift = [drift[i] + moved.rates[i][0] - ago[i] - moved.roots[i] for i in range(n)]
            base = moved.state
        return {
            "distance_root": matrix(*(moved.roots for moved in predictors)),
            "prediction": matrix(*(moved.state for moved in predictors)),
            "past_rate": matrix(*rates),
            "prediction_offset": vector(*(base[i] - estimates[i] for i in range(n))),
            "prediction_offset_rate": vector(*drift),
        }

    def _rate(self, x: list[Array], known: Array) -> Array:
        return self.model.flow(vector(*x), known)

    # -- certificate ------------------------------------------------------------------------------------------------

    def vertex_error(self, drift: np.ndarray, p: Any) -> ImpulsiveError:
        """`turned_error` as the certificate takes the turns."""
        return self.turned_error(drift, p, self.certified_turns)

    def turned_error(self, drift: np.ndarray, p: Any, turns: Sequence[Sequence[int]]) -> ImpulsiveError:
        """Error of the delayed state, and of the outputs since each was received, from packet to packet.

        Where nodes send in turn there is one copy of both for each turn of a round, and a packet moves the error from
        one copy to the next. A held output falls behind by what the plant does: a disturbance of the error, and no part
        of its equations.

        Args:
            drift: Jacobian of the model, shape (n, n).
            turns: measurements in each packet of a round, from 0.
        """
        n, q = self.model.order, self.outputs_count
        size, rounds = n + q, len(turns)
        reset = np.zeros((rounds, size, rounds, size))
        for turn, received in enumerate(turns):
            kept = [1.0] * n + [0.0 if i in received else 1.0 for i in range(q)]
            reset[(turn + 1) % rounds, :, turn, :] = np.diag(kept)
        generator = np.kron(np.eye(rounds), self.error_generator(drift, p))
        levels = (*self.levels(), *(0,) * q) * rounds
        return ImpulsiveError.of(generator, reset.reshape(rounds * size, rounds * size), levels)

    @property
    def certified_turns(self) -> tuple[tuple[int, ...], ...]:
        """Measurements in each packet of a round, as the certificate takes them: `turns`."""
        return self.turns

    def remark(self) -> str:
        """What the certificate is about."""
        rounds = len(self.certified_turns)
        packets = "all measurements in each packet" if rounds == 1 else f"{rounds} nodes that send in turn"
        return f"of the delayed state, {packets}; {super().remark()}"

    def condition_of(self, p: Any) -> Finding:
        """(1.51) and (1.52) for the delayed state, and the delay within the declared memory."""
        found = super().condition_of(p)
        longest = self.total_places * float(p.memory_period)
        return condition_found(
            holds=bool(found.holds) and float(p.delay) <= longest,
            numbers={**found.numbers, "delay [s]": float(p.delay), "declared_memory [s]": longest},
            statement=f"{found.statement}; delay <= declared_memory [s]",
            source=f"{found.source}; Hann 2014, (2.16)",
        )

    # -- limits -----------------------------------------------------------------------------------------------------

    def network_bounds(self, parameters: Mapping[str, Value] | None = None, preset: str | None = None) -> NetworkBounds:
        """Constants of Theorem 2.1 for the gains in use, the nodes sending in turn.

        Args:
            parameters: values by name that replace those of the preset. preset: to start from; None for the default.

        Raises:
            ValueError: a parameter or the preset is unknown, or the model gives no slopes.
        """
        return self._network_bounds(self.unpack_parameters(parameter_values(self, parameters, preset)))

    def limit_findings(self, values: np.ndarray) -> Iterator[Finding]:
        """Between two packets and in delay: (2.17) and (2.59) beside exact tests of the model linearised at its start,
        and runs.

        Args:
            values: of all parameters, shape (k,).

        Raises:
            ValueError: the model gives no slopes.
        """
        p, named = self.unpack_parameters(values), self.named_values(values)
        bounds = self._network_bounds(p)
        yield from packet_findings(self, p, named, bounds)
        if self.predictors:
            yield from delay_findings(self, p, named, bounds)

    def remembering(self, memory_places: int) -> Self:
        """The same observer with another memory.

        Args:
            memory_places: see the class.
        """
        between: Between = "predicted" if self.predicts_output else "held"
        return type(self)(
            self.model,
            predictors=self.predictors,
            memory_places=memory_places,
            between_samples=between,
            nodes=self.node_of,
        )

    @property
    def prediction_starts(self) -> tuple[float, ...]:
        """Starts of the predictions, predictor by predictor."""
        return tuple(float(s.start_values[0]) for s in self.model.states) * self.predictors

    def linearised_drift(self) -> np.ndarray:
        """Jacobian of the model at its start, shape (n, n)."""
        return np.asarray(self.model.jacobian(self.model.start, np.zeros(len(self.model.inputs))), dtype=float)

    def error_generator(self, drift: np.ndarray, p: Any) -> np.ndarray:
        """Generator of the errors of the estimate and of the kept outputs, shape (n + q, n + q).

        Args:
            drift: Jacobian of the model, shape (n, n).
        """
        gain, C, q = self.gain_matrices(p)[0], self.model.C, self.outputs_count
        rates = C @ drift if self.predicts_output else 0.0 * C
        return np.block([[drift - gain @ C, gain], [rates, np.zeros((q, q))]])

    @cached_property
    def turns(self) -> tuple[tuple[int, ...], ...]:
        """Measurements of each node, from 0: the turns of a round."""
        return turns_of_nodes(self.node_of)

    @property
    def node_events(self) -> tuple[str, ...]:
        """Event of each node in the order of `turns`, where each has its own; none here: a packet names its node."""
        return ()

    # -- internals --------------------------------------------------------------------------------------------------

    def _network_bounds(self, p: Any) -> NetworkBounds:
        return network_bounds(
            self.model.drifts,
            self.linearised_drift(),
            self.gain_matrices(p)[0],
            self.model.C,
            len(self.turns),
            self.predictors,
        )

    def _events(self) -> tuple[Any, ...]:
        reading = PeriodicEvent("reading", "memory_period", description="Inputs and rates are read into the memory")
        return (*(self._numbered(event) for event in super()._events()), reading)

    def _numbered(self, event: TriggeredEvent) -> TriggeredEvent:
        meaning = "Node that the packet is from, from 1; 0: it has all measurements"
        node = input_signal(f"{event.name}_node", "1", 0.0, meaning, variability="discrete")
        text = "A packet arrives, a delay after its measurement"
        return replace(event, payload=(node, *event.payload), description=text)
