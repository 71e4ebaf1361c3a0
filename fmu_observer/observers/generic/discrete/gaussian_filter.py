"""Base of the filters that carry an estimate and its covariance: signals, arrival of measurements, innovations.

It knows models of filters and hybrid systems; how a filter predicts and corrects is written by its subclass.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from functools import reduce
from types import SimpleNamespace
from typing import Any, ClassVar, Literal

import numpy as np

from fmu_observer.certificates.finding import Finding
from fmu_observer.formulas.filtering.kalman import Corrected, log_likelihood, normalised_square
from fmu_observer.models.filter_models import Known, noise_over
from fmu_observer.models.moving_system import Steps
from fmu_observer.models.observer_model import named_as, stacked_of
from fmu_observer.models.traced_system_model import Source, find_filter_model
from fmu_observer.models.unknown_values import with_unknown
from fmu_observer.observers.evaluated_observer import EvaluatedObserver
from fmu_observer.observers.gated_observer import GATED_EVENT, GatedObserver
from fmu_observer.observers.generic.discrete.arrivals import INITIALISED, PERIODIC, Arrivals
from fmu_observer.observers.generic.discrete.covariance_requirements import is_positive, positive
from fmu_observer.observers.generic.discrete.filter_condition import steady_condition, within_steps
from fmu_observer.observers.generic.discrete.filter_signals import NOT_POSITIVE, Belief, SignalsOf, chosen
from fmu_observer.observers.innovation_gate import known_accuracy
from fmu_observer.observers.model_observer import as_matrix
from fmu_observer.observers.model_signals import matrix_parameter
from plant_models.hybrid import Array, Signal, parameter, vector
from plant_models.hybrid.missing import is_there
from plant_models.hybrid.option import require_chosen
from plant_models.hybrid.signal import within_bounds

Form = Literal["joseph", "short", "square_root"]

DENSITY = 1e-2  # of the default process noise in every state or noise input [x2/s] [ours]
VARIANCE = 1e-4  # of the default measurement noise [y2] [ours]
_LARGEST_ENTRY = 1e150  # of a factor: its square and sums of such are numbers
LEFT = 8.0 * float(np.finfo(np.float64).eps)  # of a variance, after a subtraction: what is smaller is rounding
SIGMAS = 3.0  # standard deviations of the position that the gate of balise telegrams grants [ours]


class GaussianFilter(GatedObserver, EvaluatedObserver):
    """Base of the Kalman filters of any `FilterModel`.

    The contract:

    1. A subclass writes `predicted` and `corrected`, pure functions of a `Belief`, and `forms`, the forms it has; in
       the form ``square_root`` the spread is a lower factor, otherwise the covariance.
    2. With `arrival` ``periodic`` all measurements are inputs ``measured_<y>``, read at the periodic event `sampling`.
       Any other name is a triggered event that brings the measurement as its payload ``<event>_<y>``; a list gives a
       name for each measurement, equal names arrive together. A measurement that is missing is NaN, or an event that
       does not occur; one that is late is replayed at its stamp by the late policy.
    3. At an event the belief is first predicted over the time since the last one, with the inputs of now, then
       corrected by what has arrived, without measurements that are NaN. If all is periodic the first sample corrects
       the start; noise is given as `process_covariance` of one period. With events it is given as `process_density`,
       `sampling` predicts too, and its first instant begins the time.
    4. The states are the estimates, the spread, the last innovation and what is known of it. A measurement
       ``position`` that arrives at the event ``balise`` passes the gate of balise telegrams, see `GatedObserver`.

    Args:
        model: name of an observer model or of a plant, ``file.py:Class``, or a model or system itself.
        outputs, inputs, process_noises, measurement_noises: of a plant, see `models.system_model`.
        period: that the filter of a plant is built for [s], the start of `sample_period` and the longest one: its steps
            are as short as the plant's own. By default four of them.
        substeps: how many steps there are in place of those, whatever the period.
        unknown: names of its parameters or inputs that are estimated too, see `models.unknown_values`.
        arrival: see above. form: of the covariance equations, one of `forms`.
        covariances: whether the whole covariance of the estimate is an output, `covariance`, row by row.
        options: of the subclass.

    Raises:
        ValueError: an option is not legal, or the model does not suit; the message says which.
    """

    forms: ClassVar[tuple[Form, ...]] = ("joseph", "short", "square_root")
    internal_step = 0.1  # nothing flows between samples
    own_parameters: tuple[Signal, ...] = ()
    option_choices = {
        "model": (),
        "outputs": (),
        "inputs": (),
        "process_noises": (),
        "measurement_noises": (),
        "period": (),
        "substeps": (),
        "unknown": (),
        "arrival": (),
        "form": ("joseph", "short", "square_root"),
        "covariances": (False, True),
    }

    def __init__(
        self,
        model: Source,
        *,
        outputs: Sequence[str] = (),
        inputs: Sequence[str] | None = None,
        process_noises: Sequence[str] = (),
        measurement_noises: Sequence[str] = (),
        period: float | None = None,
        substeps: int | None = None,
        unknown: Sequence[str] = (),
        arrival: str | Sequence[str] = PERIODIC,
        form: Form | None = None,
        covariances: bool = False,
        **options: Any,
    ) -> None:
        named: dict[str, Any] = {
            "outputs": outputs,
            "inputs": inputs,
            "process_noises": process_noises,
            "measurement_noises": measurement_noises,
        }
        self.model = find_filter_model(model, **named, steps=Steps(period, substeps))
        if unknown:
            self.model = with_unknown(self.model, unknown)
        self.form: Form = self.forms[0] if form is None else form
        require_chosen(self.name, {"form": self.forms}, form=self.form)
        self.arrivals, self.covariances = Arrivals(self.name, self.model, arrival), covariances
        self._declare()
        name = model if isinstance(model, str) else self.model.name
        recorded = _recorded(**named, period=period, substeps=substeps, unknown=unknown, arrival=arrival)
        super().__init__(model=name, **recorded, form=self.form, covariances=covariances, **options)

    # -- what a subclass writes -------------------------------------------------------------------------------------

    @abstractmethod
    def predicted(self, belief: Belief, known: Known, period: Array, noise: Array, p: Any) -> Belief:
        """The belief a period later.

        Args:
            belief: before. known: time, inputs and parameters of the model. period: [s].
            noise: covariance of the process noise in that period, shape (r, r).
        """

    @abstractmethod
    def corrected(
        self, belief: Belief, known: Known, y: Array, rows: Sequence[int], noise: Array, p: Any
    ) -> tuple[Corrected, Array]:
        """The belief after some measurements, and their innovation; those that are NaN have none and change nothing.

        Args:
            belief: before. known: time, inputs and parameters of the model. y: the measurements, shape (len(rows),).
            rows: which they are. noise: covariance of all measurement noise, shape (s, s).
        """

    def unmoved(self, belief: Belief, p: Any) -> Belief:
        """The belief as a prediction hands it on, where there is nothing to predict yet.

        Args:
            belief: at the start.
        """
        return belief

    # -- what it may use --------------------------------------------------------------------------------------------

    @property
    def rooted(self) -> bool:
        """Whether the spread is a factor of the covariance."""
        return self.form == "square_root"

    def known(self, t: Array, u: Any, p: Any) -> Known:
        """Time, inputs and parameters of the model."""
        return Known(t, stacked_of(u, self.model.inputs), self.known_parameters(p))

    def known_parameters(self, p: Any) -> Array:
        """Parameters of the model, shape (k,)."""
        return stacked_of(p, self.model.parameters)

    def belief(self, x: Any) -> Belief:
        """What the filter believes."""
        return Belief(stacked_of(x, self.model.states, "estimated_"), getattr(x, self._spread))

    def covariance_of(self, spread: Array) -> Array:
        """The covariance that a spread stands for, shape (n, n).

        Args:
            spread: shape (n, n).
        """
        return spread @ spread.T if self.rooted else spread

    def reported_accuracy(self, event: str, u: Any) -> Array:
        """The location accuracy that comes with an event, zero where none does [m].

        Args:
            event: its name. u: inputs of the filter, payload included.
        """
        return known_accuracy(u.balise_location_accuracy) if self.gated and event == GATED_EVENT else 0.0

    def reading_noise(self, accuracy: Array, p: Any) -> Array:
        """Covariance of the measurement noise with a balise reported so accurately, shape (s, s).

        Args:
            accuracy: of its place [m].
        """
        s = self.model.reading_noise_count
        noise = as_matrix(p.measurement_covariance, s, s)
        if self.weighing != "itself":
            return noise
        place = [m.name for m in self.model.measurements].index("position")
        at = np.diag(np.eye(s)[place])
        return noise + at * np.maximum(np.square(accuracy) / 3.0 - noise[place, place], 0.0)

    # -- what follows -----------------------------------------------------------------------------------------------

    def update(self, event: str, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        """Prediction over the time since the last event, then correction by what has arrived."""
        before, rows = self.belief(x), self.arrivals.rows(event)
        belief = self._ahead(before, t, x, u, p)
        kept = {"primed": 1.0, "covariance_lapsed": self._not_positive(x)}
        kept |= {"last_time": t} if self.arrivals.timed else {}
        if not rows:
            return self._remembered(belief) | kept
        y = self.arrivals.measured(event, u)
        noise = self.reading_noise(self.reported_accuracy(event, u), p)
        after, error = self.corrected(belief, self.known(t, u, p), y, rows, noise, p)
        there, found = is_there(y), after.innovation_covariance
        count = there @ np.ones(len(rows))
        share = LEFT if self.form == "short" else 0.0  # the other forms subtract nothing
        lost = _lost(self._variances(belief.spread), self._variances(after.covariance), share)
        kept["covariance_lapsed"] = np.maximum(kept["covariance_lapsed"], lost)
        some = count > 0.5  # of nothing at all the prediction stays, to the last bit
        belief = chosen(some, Belief(after.estimate, after.covariance), belief._replace(drawn=None))
        kept["last_nis"] = np.where(some, normalised_square(error, found), x.last_nis)
        kept["log_likelihood"] = x.log_likelihood + np.where(some, log_likelihood(error, found, count), 0.0)
        if self.arrivals.several:
            kept["last_count"] = np.where(some, count, x.last_count)
        e, S = _replaced(x.last_innovation, x.last_innovation_covariance, rows, error, found, there)
        return self._remembered(belief) | kept | {"last_innovation": e, "last_innovation_covariance": S}

    def _ahead(self, before: Belief, t: Array, x: Any, u: Any, p: Any) -> Belief:
        """The belief at an event before what arrives there; at the first one of a period it is the start."""
        if self.arrivals.timed:
            period = np.where(x.primed > 0.5, t - x.last_time, 0.0)
            known = self.known(t - period, u, p)
            noise = self._noise_of_density(before.estimate, known, period, p)
            return self.predicted(before, known, period, noise, p)
        known, r = self.known(t - p.sample_period, u, p), self.model.noise_count
        noise = as_matrix(p.process_covariance, r, r)
        return chosen(x.primed > 0.5, self.predicted(before, known, p.sample_period, noise, p), self.unmoved(before, p))

    def _remembered(self, belief: Belief) -> dict[str, Array]:
        return named_as(self.model.states, belief.estimate, "estimated_") | {self._spread: belief.spread}

    def _not_positive(self, x: Any) -> Array:
        """Whether the covariance is none, or was none before; a correction may hide that."""
        if self.rooted:
            return x.covariance_lapsed
        return np.maximum(x.covariance_lapsed, 1.0 - is_positive(x.estimate_covariance))

    def _variances(self, spread: Array) -> list[Array]:
        n = self.model.order
        return [spread[i] @ spread[i] if self.rooted else spread[i, i] for i in range(n)]

    def output(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        n, q, states = self.model.order, len(self.model.measurements), self.model.states
        P = self.covariance_of(self.belief(x).spread)
        values = {s.name: getattr(x, f"estimated_{s.name}") for s in states}
        values |= {f"{s.name}_std": np.sqrt(np.maximum(P[i, i], 0.0)) for i, s in enumerate(states)}
        values |= named_as(self.model.measurements, x.last_innovation, "innovation_")
        values["innovation_covariance"] = np.reshape(x.last_innovation_covariance, (q * q,))
        values |= {"nis": x.last_nis, "innovation_likelihood": x.log_likelihood}
        if self.arrivals.several:
            values["nis_degrees"] = x.last_count
        values[NOT_POSITIVE.name] = self._not_positive(x)
        if self.covariances:
            values["covariance"] = np.reshape(P, (n * n,))
        return values

    def requirements(self, p: Any) -> dict[str, Array]:
        """Covariances are symmetric and positive; other parameters within their bounds."""
        s = self.model.reading_noise_count
        r = self.model.noise_count
        needed = super().requirements(p) | within_bounds(self.own_parameters, p) | within_steps(self.model, p)
        needed |= positive(self._process_name, getattr(p, self._process_name), r, definite=False)
        return needed | positive("measurement_covariance", p.measurement_covariance, s, definite=True)

    def start_requirements(self, x: Any, p: Any) -> dict[str, Array]:
        """The covariance of the first estimate is one; of a factor every value is legal whose square is a number."""
        n, spread = self.model.order, getattr(x, self._spread)
        if not self.rooted:
            return positive(self._spread, np.reshape(spread, (n * n,)), n, definite=False)
        text = f"{self._spread}: entries below {_LARGEST_ENTRY:g}, whose squares are numbers"
        return {text: np.where(np.max(np.abs(spread)) < _LARGEST_ENTRY, 1.0, 0.0)}

    def condition_of(self, p: Any) -> Finding:
        """Whether the filter linearised at the start of the estimates has a stable steady state."""
        start, period = self.model.start, float(p.sample_period)
        inputs = self.model.start_inputs
        starts = SimpleNamespace(**{s.name: float(s.start_values[0]) for s in self.model.inputs})
        known = Known(0.0, inputs, np.asarray(self.known(0.0, starts, p).p, dtype=float))
        r, s = self.model.noise_count, self.model.reading_noise_count
        if self.arrivals.timed:
            noise = np.asarray(self._noise_of_density(start, known, period, p))
        else:
            noise = as_matrix(np.asarray(p.process_covariance), r, r)
        readings = as_matrix(np.asarray(p.measurement_covariance), s, s)
        return steady_condition(self.model, start, known, period, noise, readings, self.source)

    def own_bound(self, x: Any, p: Any) -> Array:
        """Three standard deviations of the position [m], for the gate of balise telegrams."""
        i = self._estimated.index(self.position_state)
        return SIGMAS * np.sqrt(np.maximum(self.covariance_of(self.belief(x).spread)[i, i], 0.0))

    # -- internals --------------------------------------------------------------------------------------------------

    @property
    def _process_name(self) -> str:
        return "process_density" if self.arrivals.timed else "process_covariance"

    def _noise_of_density(self, x: Array, known: Known, period: Array, p: Any) -> Array:
        r = self.model.noise_count
        density = as_matrix(p.process_density, r, r)
        if self.model.process_noises:  # held over the period
            return density / np.where(period > 0.0, period, 1.0)
        return noise_over(self.model, x, known, period, density)

    def _declare(self) -> None:
        """Signals and events, from the model and the way its measurements arrive."""
        model = self.model
        signals = SignalsOf(model, self.arrivals, rooted=self.rooted, covariances=self.covariances)
        self.states = (*signals.memory(), INITIALISED)
        self._estimated = tuple(s.name for s in self.states[: model.order])
        self._spread = self.states[model.order].name
        self.inputs = (*model.inputs, *self.arrivals.inputs)
        self.events = self.arrivals.events
        self.outputs = signals.outputs()
        self.parameters = (*self._declared_noise(), *self.own_parameters, *model.parameters)
        period = "Period of the prediction" if self.arrivals.timed else "Sampling period of the measurements"
        self.parameters += (parameter("sample_period", "s", model.sample_period, period, min=1e-6),)
        if GATED_EVENT in self.arrivals.names:
            self.position_state = self._position_state()
            self.weighing = "innovation" if model.measurement_noises else "itself"

    def _declared_noise(self) -> tuple[Signal, ...]:
        r, s = self.model.noise_count, self.model.reading_noise_count
        readings = VARIANCE * np.eye(s)
        return (
            matrix_parameter(self._process_name, *self._default_noise(r)),
            matrix_parameter("measurement_covariance", readings, "Covariance RN of the measurements, row by row"),
        )

    def _default_noise(self, r: int) -> tuple[np.ndarray, str]:
        model, density = self.model, DENSITY * np.eye(r)
        if self.arrivals.timed:
            return density, "Spectral density of the process noise, row by row"
        text = "Covariance QN of the process noise of one period, row by row"
        if model.process_noises:
            return (density / model.sample_period if model.any_period else np.eye(r)), text
        if not model.any_period:
            return density * model.sample_period, text
        inputs = model.start_inputs
        parameters = np.array([value for s in model.parameters for value in s.start_values])
        known = Known(0.0, inputs, parameters)
        return np.asarray(noise_over(model, model.start, known, model.sample_period, density)), text

    def _position_state(self) -> str:
        """The state that the reported position is: the one whose column in its row of the Jacobian is largest."""
        names = [s.name for s in self.model.measurements]
        parameters = np.array([value for s in self.model.parameters for value in s.start_values])
        inputs = self.model.start_inputs
        H, _ = self.model.measurement_jacobians(self.model.start, Known(0.0, inputs, parameters))
        return self._estimated[int(np.argmax(np.abs(np.asarray(H)[names.index("position")])))]


def _recorded(**options: Any) -> dict[str, Any]:
    """The options that are set, as they are recorded: sequences as lists."""
    kept = {name: list(value) if isinstance(value, list | tuple) else value for name, value in options.items()}
    return {name: value for name, value in kept.items() if value is not None and value != []}


def _lost(before: Sequence[Array], after: Sequence[Array], share: float) -> Array:
    """1 where a correction left no more of a variance than a share of it: noise leaves some of every variance."""
    lost = [
        np.where(now > share * then, 0.0, np.where(then > 0.0, 1.0, 0.0))
        for then, now in zip(before, after, strict=True)
    ]
    return reduce(np.maximum, lost)


def _replaced(e: Array, S: Array, rows: Sequence[int], error: Array, found: Array, there: Array) -> tuple[Array, Array]:
    """The last innovations and their covariance, with those of `rows` replaced that are there."""
    q = e.shape[0]
    place = {row: i for i, row in enumerate(rows)}
    new: list[Any] = [there[place[i]] > 0.5 if i in place else None for i in range(q)]
    innovations = [e[i] if new[i] is None else np.where(new[i], error[place[i]], e[i]) for i in range(q)]
    entries = [
        S[i, j]
        if new[i] is None or new[j] is None
        else np.where(there[place[i]] * there[place[j]] > 0.5, found[place[i], place[j]], S[i, j])
        for i in range(q)
        for j in range(q)
    ]
    return vector(*innovations), as_matrix(vector(*entries), q, q)
