"""Moving-horizon observer of any model: least squares over a window of time-stamped rows, by a real-time iteration."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from typing import Any, ClassVar, NamedTuple

import numpy as np

from fmu_observer.certificates.finding import Finding
from fmu_observer.formulas.filtering.kalman import through
from fmu_observer.formulas.moving_horizon.real_time_iteration import (
    MOST_PASSES,
    MOST_ROWS,
    iterate,
    require_window,
    window_memory,
    window_outputs,
    window_values,
)
from fmu_observer.formulas.moving_horizon.robust_loss import LOSSES, SCALES, Loss
from fmu_observer.formulas.moving_horizon.row_window import RowLayout, WindowRow
from fmu_observer.formulas.moving_horizon.window_problem import Limits, Moved, Seen, WindowProblem
from fmu_observer.models.filter_models import FilterModel, Known
from fmu_observer.models.observer_model import named_as, stacked, stacked_of
from fmu_observer.models.traced_system_model import Source
from fmu_observer.observers.gated_observer import GATED_EVENT
from fmu_observer.observers.generic.discrete.extended_kalman_filter import ExtendedKalmanFilter
from fmu_observer.observers.generic.discrete.filter_signals import Belief
from fmu_observer.observers.generic.discrete.gaussian_filter import Form
from fmu_observer.observers.innovation_gate import OFF
from fmu_observer.observers.model_observer import as_matrix
from plant_models.hybrid import Array, Signal, parameter, vector
from plant_models.hybrid.missing import is_there, or_else
from plant_models.hybrid.option import is_number
from plant_models.hybrid.signal import within_bounds

_TOLERANCE = 1e-9  # of the largest singular value of the measured rows: below it, a direction is not shown
_PART = 1e-6  # of the largest entry of a direction: below it, a state has no part in it


class _WindowObservability(NamedTuple):
    """What a window shows of the state in its first row.

    Attributes:
        measured: what the rows measure of it, shape (N * q, n). rank: independent directions that are shown.
        unseen: orthonormal basis of those that are not, shape (n, n - rank). states: names of the states.
    """

    measured: np.ndarray
    rank: int
    unseen: np.ndarray
    states: tuple[str, ...]

    def explain(self) -> str:
        """In words, with a window as the subject: it shows every state, or which directions it does not."""
        if not self.unseen.shape[1]:
            return "shows all of them without the arrival cost"
        directions = "; ".join(self._direction(column) for column in self.unseen.T)
        return (
            f"shows {self.rank} without the arrival cost; it does not show {directions}, which is known only from what "
            "was measured before. A longer window may show it"
        )

    def _direction(self, column: np.ndarray) -> str:
        largest = column[np.argmax(np.abs(column))]
        parts = [(name, v) for name, v in zip(self.states, column / largest, strict=True) if abs(v) > _PART]
        if len(parts) == 1:
            return parts[0][0]
        return "the combination " + " ".join(f"{value:+.3g} {name}" for name, value in parts)


WINDOW, PASSES = 6, 2  # rows and passes unless set otherwise: small, so that it is built in a second [ours]
_UNBOUNDED = 1e30  # a bound that is none; FMI knows no infinite start values
Bounds = Mapping[str, Sequence[float | None]]


class MovingHorizonObserver(ExtendedKalmanFilter):
    """Moving-horizon estimation: Omar 2012, sections 1.4.8 and 4.2, (1.4.78)-(1.4.81), (4.2.2)-(4.2.4).

    Minimised at every row, over the states of the last `window` rows: the arrival cost of what has left the window,
    ``w' inv(Q) w`` of the process noise between rows, and the loss of the residuals ``y - h(x)`` in their deviations.
    `passes` Gauss-Newton passes of fixed cost begin at the solution before, moved on by a row. The arrival cost is
    exact for linear systems, so that the estimate of one without bounds and with the loss ``squares`` is that of the
    Kalman filter at every window; a window of one row is the extended Kalman filter.

    Rows are the instants at which measurements arrive (option `arrival` of `GaussianFilter`), at any distance. One that
    is missing is a row that did not happen; one that is late is replayed, so that it stands in the window at its stamp.
    A prediction by the event `sampling` alone is a row too.

    An unknown parameter is a state without noise, an unknown input one that noise alone drives. The estimate keeps its
    bounds at every instant, whatever is measured. So do disturbances, what moves a state from row to row beyond the
    model; a state whose own bounds leave no room for that keeps its own. Innovations, NIS and likelihood are those of
    the step from the estimate before, as of the extended filter; under a robust loss there is no output `nis`, since
    what it doubts would be judged with the rest. Where a robust loss judges telegrams, the gate of balises is off
    unless it is set.

    Args:
        model: name of an observer model or of a plant, or one itself.
        window: rows in the window, 1 to 1000. passes: Gauss-Newton passes at a row, 1 to 20.
        bounds: lowest and highest value by name of a state; None or an infinite one where there is none,
            ``{"x2": [0.0, None]}``. They are starts of the parameters `lower_bounds` and `upper_bounds`.
        noise_bounds: least and most by which a disturbance moves a state from row to row, by its name, zero between
            them; where noise is given by its density, for each second between rows. They are starts of the parameters
            `lower_noise_bounds` and `upper_noise_bounds`.
        loss: ``squares``, ``huber`` or ``geman_mcclure``, for all measurements or for each in a list.
        options: those of `GaussianFilter`.

    Raises:
        ValueError: an option is not legal, or the model does not suit; the message says which.
    """

    name = "moving_horizon_observer"
    description = "Moving-horizon observer: least squares over the last rows, with bounds and robust losses"
    source = "Omar 2012, sections 1.4.8 and 4.2; real-time iteration and arrival cost are ours"
    forms: ClassVar[tuple[Form, ...]] = ("joseph", "short")
    iterate = staticmethod(iterate)
    option_choices = {
        **ExtendedKalmanFilter.option_choices,
        "form": ("joseph", "short"),
        "window": range(1, MOST_ROWS + 1),
        "passes": range(1, MOST_PASSES + 1),
        "bounds": (),
        "noise_bounds": (),
        "loss": LOSSES,
    }

    def __init__(
        self,
        model: Source = "pendulum",
        *,
        window: int = WINDOW,
        passes: int = PASSES,
        bounds: Bounds | None = None,
        noise_bounds: Bounds | None = None,
        loss: Loss | Sequence[Loss] = "squares",
        **options: Any,
    ) -> None:
        require_window(self.name, window, passes)
        self.window, self.passes, self.bounds, self._loss = window, passes, _bounds(self.name, bounds), loss
        self.noise_bounds = _bounds(self.name, noise_bounds, "noise_bounds")
        both = {"bounds": self.bounds, "noise_bounds": self.noise_bounds}
        stated = {key: {name: list(pair) for name, pair in of.items()} for key, of in both.items() if of}
        listed = loss if isinstance(loss, str) else list(loss)
        super().__init__(model, window=window, passes=passes, loss=listed, **stated, **options)

    def update(self, event: str, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        """The window with a row more, and the estimates that it gives."""
        n, before = self.model.order, self.belief(x)
        filtered = super().update(event, t, x, u, p)
        row, shared = self._row(event, t, x, u, p), stacked_of(p, self.parameter_signals)
        start = np.hstack([before.estimate, before.estimate, np.reshape(before.spread, (n * n,))])
        found = self.iterate(
            self.problem,
            self.passes,
            np.where(x.primed > 0.5, x.arrival_cost, start),
            x.window,
            x.window_estimates,
            self.problem.layout.packed(row),
            self._predicted_point(before.estimate, row, shared),
            shared,
        )
        belief = Belief(found.estimate, as_matrix(found.covariance, n, n))
        return filtered | self._remembered(belief) | found.remembered

    def output(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        inside = self.problem.clipped(self.belief(x).estimate, stacked_of(p, self.parameter_signals))
        values = super().output(t, x, u, p)
        if self.robust:
            values.pop("nis")
        return values | named_as(self.model.states, inside) | window_values(x.last_pass)

    def requirements(self, p: Any) -> dict[str, Array]:
        """Those of the filter; no lowest value above the highest; the scale of the loss within its bounds."""
        needed = super().requirements(p)
        scale = [s for s in self.parameters if s.name == "loss_scale"]
        needed |= within_bounds(scale, p)
        for k, name in enumerate(self.bounds):
            text = f"lower_bounds[{k + 1}] must be below upper_bounds[{k + 1}], the bounds of {name}"
            needed[text] = np.where(p.lower_bounds[k] < p.upper_bounds[k], 1.0, 0.0)
        for k, name in enumerate(self.noise_bounds):
            text = f"lower_noise_bounds[{k + 1}] <= 0 <= upper_noise_bounds[{k + 1}], the disturbances of {name}"
            legal = np.logical_and(p.lower_noise_bounds[k] <= 0.0, p.upper_noise_bounds[k] >= 0.0)
            needed[text] = np.where(legal, 1.0, 0.0)
        return needed

    def condition_of(self, p: Any) -> Finding:
        """That of the filter behind the arrival cost, and which states the rows of a window show on their own."""
        steady, model = super().condition_of(p), self.model
        inputs = stacked(tuple(float(s.start_values[0]) for s in model.inputs))
        known = Known(0.0, inputs, np.asarray(self.known_parameters(p), dtype=float))
        observed = window_observability(model, known, float(p.sample_period), self.window)
        rows = f"A window of {self.window} full row{'s' if self.window > 1 else ''}"
        rows = f"{rows} {observed.explain()}"
        complete = not observed.unseen.size
        of_window = Finding("window_rank", observed.rank, "1", "exact", "", complete, "" if complete else rows)
        return replace(steady, conditions=(*steady.conditions, of_window), statement=f"{steady.statement}. {rows}")

    @cached_property
    def problem(self) -> WindowProblem:
        """The least-squares problem of the window."""
        names = [s.name for s in self.model.states]
        return WindowProblem(
            order=self.model.order,
            layout=self._layout,
            moved=self._moved,
            seen=self._seen,
            bounded=tuple(names.index(name) for name in self.bounds),
            limits=self._limits,
            losses=self._losses,
            loss_scale=lambda shared: self.unpack_parameters(shared).loss_scale,
            form="short" if self.form == "short" else "joseph",
            disturbed=tuple(names.index(name) for name in self.noise_bounds),
            noise_limits=self._noise_limits,
        )

    # -- internals --------------------------------------------------------------------------------------------------

    def _row(self, event: str, t: Array, x: Any, u: Any, p: Any) -> WindowRow:
        """The row that an event brings."""
        arrived = self.arrivals.rows(event)
        begun = np.where(x.primed > 0.5, 1.0, 0.0)
        period = begun * (t - x.last_time) if self.arrivals.timed else p.sample_period + 0.0 * begun
        known, q = self.known(t, u, p), len(self.model.measurements)
        y = self.arrivals.measured(event, u) if arrived else np.zeros(0)
        place, there, y = {row: i for i, row in enumerate(arrived)}, is_there(y), or_else(y, 0.0)
        measured = vector(*(y[place[j]] if j in place else 0.0 * begun for j in range(q)))
        used = vector(*(there[place[j]] if j in place else 0.0 * begun for j in range(q)))
        accuracy = (self.reported_accuracy(event, u) + 0.0 * begun,) if self._carries_accuracy else ()
        inputs = vector(*(known.u[i] for i in range(len(self.model.inputs))), *accuracy) if accuracy else known.u
        return WindowRow(begun, period, t + 0.0 * begun, inputs, measured, used)

    def _predicted_point(self, x: Array, row: WindowRow, shared: Array) -> Array:
        """Where the first pass linearises the newest row: the estimate before, moved on, within the bounds."""
        known = self._known_of(row, self.unpack_parameters(shared))
        moved = self.model.moved(x, self.model.no_noise(), known, row.period)
        return self.problem.clipped(np.where(row.moves > 0.5, moved, x), shared)

    def _known_of(self, row: WindowRow, p: Any) -> Known:
        return Known(row.time - row.period, self._inputs_of(row), self.known_parameters(p))

    def _inputs_of(self, row: WindowRow) -> Array:
        return row.inputs[: len(self.model.inputs)]

    @property
    def _carries_accuracy(self) -> bool:
        """Whether rows of balises carry their location accuracy, behind the inputs."""
        return GATED_EVENT in self.arrivals.names and self.weighing == "itself"

    @property
    def _layout(self) -> RowLayout:
        return RowLayout(len(self.model.inputs) + self._carries_accuracy, len(self.model.measurements))

    def _moved(self, x: Array, row: WindowRow, shared: Array) -> Moved:
        p = self.unpack_parameters(shared)
        known, model, r = self._known_of(row, p), self.model, self.model.noise_count
        if self.arrivals.timed:
            noise = self._noise_of_density(x, known, row.period, p)
        else:
            noise = as_matrix(p.process_covariance, r, r)
        F, W = model.transition_jacobians(x, known, row.period)
        return Moved(model.moved(x, model.no_noise(), known, row.period), F, through(noise, W))

    def _seen(self, x: Array, row: WindowRow, shared: Array) -> Seen:
        p, model = self.unpack_parameters(shared), self.model
        known = Known(row.time, self._inputs_of(row), self.known_parameters(p))
        H, V = model.measurement_jacobians(x, known)
        accuracy = row.inputs[len(model.inputs)] if self._carries_accuracy else 0.0
        noise = through(self.reading_noise(accuracy, p), V)
        return Seen(model.measured(x, model.no_reading_noise(), known), H, noise)

    def _declare(self) -> None:
        """Signals of the filter, then the window's."""
        model, bounds = self.model, self.bounds
        names, q = [s.name for s in model.states], len(model.measurements)
        losses = self._losses = _losses(self.name, self._loss, q)
        for option, name in (*(("bounds", n) for n in bounds), *(("noise_bounds", n) for n in self.noise_bounds)):
            if name not in names:
                raise ValueError(f"{self.name}: {option}: no state {name!r}; states: {', '.join(names)}.")
        self.robust = any(loss != "squares" for loss in losses)
        if self.robust:
            self.gate_start = OFF
        for name, (low, high) in self.noise_bounds.items():
            if (low or 0.0) > 0.0 or (high or 0.0) < 0.0:
                raise ValueError(f"{self.name}: noise_bounds of {name!r} are [{low}, {high}]; zero must lie within.")
        own: tuple[Signal, ...] = () if all(loss == "squares" for loss in losses) else (_loss_scale(losses),)
        for prefix, of, what in (("", bounds, "values"), ("_noise", self.noise_bounds, "disturbances")):
            if of:
                lowest, highest = _starts(of)
                text, size = f"{what}, SI units: {', '.join(of)}", len(of)
                own += (
                    parameter(f"lower{prefix}_bounds", "1", lowest, f"Lowest {text}", size=size),
                    parameter(f"upper{prefix}_bounds", "1", highest, f"Highest {text}", size=size),
                )
        self.own_parameters = own
        super()._declare()
        self.states += window_memory(model.start, np.eye(model.order), self._layout.width, self.window)
        kept = (s for s in self.outputs if not (self.robust and s.name == "nis"))
        self.outputs = (*kept, *window_outputs(self.window))

    def _limits(self, shared: Array) -> Limits:
        if not self.bounds:
            return Limits(np.zeros(0), np.zeros(0))
        p = self.unpack_parameters(shared)
        return Limits(p.lower_bounds, p.upper_bounds)

    def _noise_limits(self, row: WindowRow, shared: Array) -> Limits:
        if not self.noise_bounds:
            return Limits(np.zeros(0), np.zeros(0))
        p, elapsed = self.unpack_parameters(shared), row.period if self.arrivals.timed else 1.0
        return Limits(p.lower_noise_bounds * elapsed, p.upper_noise_bounds * elapsed)


def _starts(bounds: Bounds) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Start values of lowest and highest, with numbers where there is none."""
    lower = tuple(-_UNBOUNDED if low is None else max(float(low), -_UNBOUNDED) for low, _ in bounds.values())
    upper = tuple(_UNBOUNDED if high is None else min(float(high), _UNBOUNDED) for _, high in bounds.values())
    return lower, upper


def _bounds(who: str, stated: Bounds | None, option: str = "bounds") -> dict[str, Sequence[float | None]]:
    """Bounds by name of a state, each a pair of numbers or None, the lowest below the highest."""
    if stated is not None and not isinstance(stated, Mapping):
        raise ValueError(
            f"{who}: {option} = {stated!r}; expected [lowest, highest] by name of a state, as in {{'x2': [0.0, 1.0]}}."
        )
    for name, pair in (stated or {}).items():
        legal = isinstance(pair, list | tuple) and len(pair) == 2
        if not legal or not all(bound is None or is_number(bound) for bound in pair):
            raise ValueError(f"{who}: {option} of {name!r} are {pair!r}; expected [lowest, highest], both numbers.")
        low, high = pair
        if low is not None and high is not None and not low < high:
            raise ValueError(f"{who}: {option} of {name!r} are {pair!r}; the lowest must be below the highest.")
    return dict(stated or {})


def _losses(who: str, loss: Loss | Sequence[Loss], count: int) -> tuple[Loss, ...]:
    losses = (loss,) * count if isinstance(loss, str) else tuple(loss)
    wrong = [stated for stated in losses if stated not in LOSSES]
    if wrong or len(losses) != count:
        raise ValueError(
            f"{who}: loss = {loss!r}; expected one of {', '.join(LOSSES)}, or a list of them with one for each of the "
            f"{count} measurements."
        )
    return losses


def _loss_scale(losses: Sequence[Loss]) -> Any:
    robust = next(loss for loss in losses if loss != "squares")
    return parameter("loss_scale", "1", SCALES[robust], "Deviations at which the loss begins to doubt", min=1e-3)


def window_observability(model: FilterModel, known: Known, period: float, rows: int) -> _WindowObservability:
    """What a number of full rows show of the state in the first of them, along the model's own way without noise.

    Args:
        model: the model, from its start. known: time, inputs held, and parameters. period: from row to row [s].
        rows: N.
    """
    x, passage, seen = model.start, np.eye(model.order), []
    for i in range(rows):
        now = known._replace(t=known.t + i * period)
        H, _ = model.measurement_jacobians(x, now)
        F, _ = model.transition_jacobians(x, now, period)
        seen.append(np.asarray(H) @ passage)
        passage = np.asarray(F) @ passage
        x = np.asarray(model.moved(x, model.no_noise(), now, period), dtype=float)
    measured = np.vstack(seen)
    _, values, directions = np.linalg.svd(measured)
    rank = int(np.sum(values > _TOLERANCE * values[0])) if values[0] > 0.0 else 0
    return _WindowObservability(measured, rank, directions[rank:].T, tuple(s.name for s in model.states))
