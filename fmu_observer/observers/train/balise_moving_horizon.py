"""Train observer: moving-horizon estimation over the last readings of the odometer and the last balises."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from fmu_observer.formulas.moving_horizon.real_time_iteration import (
    MOST_PASSES,
    MOST_ROWS,
    WINDOW_OUTPUTS,
    iterate,
    require_window,
    window_memory,
    window_outputs,
    window_values,
)
from fmu_observer.formulas.moving_horizon.robust_loss import LOSSES, SCALES, Loss
from fmu_observer.formulas.moving_horizon.row_window import RowLayout, WindowRow
from fmu_observer.formulas.moving_horizon.window_problem import Limits, Moved, Seen, WindowProblem
from fmu_observer.observers.innovation_gate import OFF, known_accuracy, place_deviation
from fmu_observer.observers.train.balise_odometer_ekf import (
    BALISE_ROW,
    FIRST_DEVIATIONS,
    ODOMETER_ROW,
    OWN_PARAMETERS,
    TUNABLE,
    BaliseOdometerEkf,
    estimate_of,
    estimates,
    moving_speed,
)
from fmu_observer.observers.train.balise_odometer_transition import ORDER, D, P, V, transition
from fmu_observer.observers.train.train_signals import BALISE
from plant_models.hybrid import Array, memory, parameter, vector, warning_output
from plant_models.hybrid.option import require_chosen

WINDOW, PASSES = 10, 2  # rows and passes unless set otherwise: small, so that it is built in a second [ours]
LAYOUT = RowLayout(inputs=ORDER + 5, measurements=1)
OFFSETS, SPEED, EFFORT = slice(0, ORDER), ORDER, ORDER + 1  # inputs of a row
_IS_BALISE, _UNKNOWN, ACCURACY = ORDER + 2, ORDER + 3, ORDER + 4
_WINDOW_PARAMETERS = (
    parameter("speed_limit", "m/s", 100.0, "Highest speed, either way", min=0.1),
    parameter("disturbance_limit", "m/s2", 1.0, "Largest unknown acceleration, either way", min=1e-6),
    parameter("loss_scale", "1", SCALES["geman_mcclure"], "Deviations at which the loss begins to doubt", min=1e-3),
)

_RESTARTS = warning_output(
    "restarts",
    "Times that the position began anew, since most balises were refused",
    "began its position anew where it had refused most of its balises and these agreed: what it told before was "
    "off by more than its deviation. Look at the first telegrams, and at the deviations",
)


_ESTIMATES = ("estimated_position", "estimated_speed", "estimated_disturbance", "estimated_creep")
_REFUSALS = (
    memory("balises_believed", "1", 0.0, "Balises believed since the position began"),
    memory("balises_refused", "1", 0.0, "Balises refused in a row that agree"),
    memory("reported_place", "m", 0.0, "Place of the last balise, as told"),
    memory("restart_count", "1", 0.0, "Times that the position began anew"),
)


class Shared(NamedTuple):
    """Parameters that all rows of the window share, by their names."""

    mass: Array
    davis_b: Array
    davis_c: Array
    creep_time: Array
    creep_share: Array
    creep_effort: Array
    acceleration_density: Array
    disturbance_density: Array
    gradient_deviation: Array
    gradient_length: Array
    effort_share: Array
    effort_time: Array
    odometer_deviation: Array
    odometer_period: Array
    balise_deviation: Array
    speed_limit: Array
    disturbance_limit: Array
    loss_scale: Array


class BaliseMovingHorizon(BaliseOdometerEkf):
    """Moving-horizon estimation of a train from its odometer and balises: Omar 2012, (1.4.78); the train case is ours.

    States, transition and noises are those of `BaliseOdometerEkf`. The last `window` rows, readings and balises at
    their stamps, are kept; at every row `passes` Gauss-Newton passes minimise the arrival cost, the process noise
    between rows and the loss of the residuals, see `fmu_observer.formulas.moving_horizon`. Between rows the estimate
    flows with the effort as it is; a row keeps what the flow made of the estimate before, so that the window knows
    every change of the effort.

    Speed is within `speed_limit` either way, the unknown acceleration within `disturbance_limit`. The loss
    ``geman_mcclure`` doubts a false balise, and readings of a wheel that slides, by what the other rows of the window
    say before and after, and takes its doubt back where later rows agree with it: no gate has to decide at once. So the
    gate of balises is off unless it is set. `odometer_fault` and likelihood are those of the filter's step. So is the
    output `nis`, which only the loss ``squares`` has: under another one what it doubts would be judged with the rest.

    A false balise that comes first is believed, and the true ones after it are doubted. So balises in a row whose
    innovations are beyond `loss_scale` of their own deviations, and agree with each other within that, are counted.
    Where there are more of them than were believed, or `gate_recover`, the position begins anew at the last of them,
    and `restarts` shows it. A wheel that is locked from the start is believed, and doubted when it turns again: after
    `odometer_recover` without a reading within `odometer_gate` the speed begins anew at the reading, as in the filter.

    With the loss ``squares``, no bound active and every reading within its gate it is `BaliseOdometerEkf` at every
    window.

    Args:
        window: rows in the window, 1 to 1000. passes: Gauss-Newton passes at a row, 1 to 20.
        loss: ``geman_mcclure``, ``huber`` or ``squares``.

    Raises:
        ValueError: an option is not legal; the message says which.
    """

    name = "balise_moving_horizon"
    description = "Moving-horizon observer of odometer and balises, with disturbance and creep"
    source = "Omar 2012, (1.4.78), (4.2.2)-(4.2.4); real-time iteration and the train case are ours"
    parameters = (*OWN_PARAMETERS, *_WINDOW_PARAMETERS)
    bounded_parameters = (*TUNABLE, *_WINDOW_PARAMETERS)
    outputs = (*BaliseOdometerEkf.outputs, *window_outputs(WINDOW), _RESTARTS)
    iterate = staticmethod(iterate)
    option_choices = {
        "window": range(1, MOST_ROWS + 1),
        "passes": range(1, MOST_PASSES + 1),
        "loss": LOSSES,
    }

    def __init__(self, window: int = WINDOW, passes: int = PASSES, loss: Loss = "geman_mcclure") -> None:
        require_window(self.name, window, passes)
        require_chosen(self.name, self.option_choices, loss=loss)
        self.window, self.passes, self.loss = window, passes, loss
        self.gate_start = OFF
        reported_of = {s.name: s for s in window_outputs(window)}
        evaluated = (s for s in self.outputs if loss == "squares" or s.name != "nis")
        self.outputs = tuple(reported_of.get(s.name, s) for s in evaluated)
        super().__init__()
        self.options = {"window": window, "passes": passes, "loss": loss}

    def own_states(self) -> tuple[Any, ...]:
        covariance = np.diag(np.square(FIRST_DEVIATIONS))
        remembered = window_memory(np.zeros(ORDER), covariance, LAYOUT.width, self.window)
        return (*super().own_states(), *_REFUSALS, *remembered)

    @cached_property
    def problem(self) -> WindowProblem:
        """The least-squares problem of the window."""
        return WindowProblem(
            order=ORDER,
            layout=LAYOUT,
            moved=_moved,
            seen=_seen,
            bounded=(V, D),
            limits=_limits,
            losses=(self.loss,),
            loss_scale=lambda shared: _shared(shared).loss_scale,
        )

    def update(self, event: str, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        """The window with a row more, and the estimates that it gives."""
        filtered, fresh = self.corrected(event, t, x, u, p)
        estimate = np.where(fresh > 0.0, vector(*(filtered[name] for name in _ESTIMATES)), estimate_of(x))
        begun = x.last_pass[list(WINDOW_OUTPUTS).index("rows_in_window")] > 0.5
        shared = vector(*(getattr(p, name) for name in Shared._fields))
        start = np.hstack([estimate, estimate, np.reshape(x.estimate_covariance, (ORDER * ORDER,))])
        before = np.where(begun, x.window_estimates[-ORDER:], estimate)
        refusals = self._refusals(event, x, u, p, filtered)
        unknown = (refusals["restart_count"] - x.restart_count) * FIRST_DEVIATIONS[P] ** 2
        unknown = unknown + fresh * filtered["estimate_covariance"][P, P]
        row = self._row(event, t, x, u, p, (before, estimate), unknown)
        found = self.iterate(
            self.problem,
            self.passes,
            np.where(begun, x.arrival_cost, start),
            x.window,
            x.window_estimates,
            LAYOUT.packed(row),
            self.problem.clipped(estimate, shared),
            shared,
        )
        now = [found.estimate[i] for i in range(ORDER)]
        now[V] = moving_speed(now[V], x.estimated_speed, u, p)
        covariance = {"estimate_covariance": np.reshape(found.covariance, (ORDER, ORDER))}
        return filtered | estimates(now) | covariance | refusals | found.remembered

    def output(self, t: Array, x: Any, u: Any, p: Any) -> dict[str, Array]:
        shared = vector(*(getattr(p, name) for name in Shared._fields))
        inside = self.problem.clipped(estimate_of(x), shared)
        values = super().output(t, x, u, p) | {"speed": inside[V], "disturbance": inside[D]}
        if self.loss != "squares":
            values.pop("nis")
        return values | window_values(x.last_pass) | {_RESTARTS.name: x.restart_count}

    # -- internals --------------------------------------------------------------------------------------------------

    def _refusals(self, event: str, x: Any, u: Any, p: Any, filtered: Mapping[str, Array]) -> dict[str, Array]:
        """What is remembered of refused balises after an event, from the innovation of the filter's own step."""
        old = {s.name: getattr(x, s.name) for s in _REFUSALS}
        if event != BALISE.name or self.loss == "squares":
            return old
        error, nis, before = filtered["last_innovation"], filtered["last_nis"], x.last_innovation
        doubt = p.loss_scale * p.loss_scale
        refused = np.where(nis > doubt, 1.0, 0.0)
        agrees = np.where(np.square(error - before) * nis <= 2.0 * doubt * np.square(error), 1.0, 0.0)
        count = refused * (1.0 + agrees * x.balises_refused)
        anew = refused * np.where(count >= np.minimum(x.balises_believed + 1.0, p.gate_recover), 1.0, 0.0)
        now = {
            "balises_believed": np.where(anew > 0.0, 1.0, x.balises_believed + 1.0 - refused),
            "balises_refused": count * (1.0 - anew),
            "reported_place": u.balise_position,
            "restart_count": x.restart_count + anew,
        }
        any_before = x.balises_believed + x.balises_refused > 0.0
        near = np.abs(u.balise_position - x.reported_place) <= p.balise_deviation
        again = np.where(near, any_before, False)  # reported twice, it is one
        return {name: np.where(again, old[name], now[name]) for name in now}

    def _row(
        self, event: str, t: Array, x: Any, u: Any, p: Any, course: tuple[Array, Array], unknown: Array
    ) -> WindowRow:
        """The row that an event brings: what the flow added to the linear transition, and the measurement. The course
        is the estimate before and now, the unknown what is added to the variance of the position [m2].
        """
        before, estimate = course
        period, is_balise, speed = t - x.last_time, float(event == BALISE.name), x.estimated_speed
        offset = estimate - transition(period, speed, u.effort, p).F @ before
        measured = u.balise_position if event == BALISE.name else self.reading(t, x, u, p)
        accuracy = known_accuracy(u.balise_location_accuracy) if event == BALISE.name else 0.0
        inputs = vector(*(offset[i] for i in range(ORDER)), speed, u.effort, is_balise, unknown, accuracy)
        return WindowRow(1.0, period, t, inputs, vector(measured), np.ones(1))


def _shared(flat: Array) -> Shared:
    return Shared(*(flat[i] for i in range(len(Shared._fields))))


def _moved(x: Array, row: WindowRow, shared: Array) -> Moved:
    F, noise = transition(row.period, row.inputs[SPEED], row.inputs[EFFORT], _shared(shared))
    place, speed = row.inputs[_UNKNOWN], np.where(row.inputs[_IS_BALISE] > 0.5, 0.0, row.inputs[_UNKNOWN])
    anew = vector(place, *(np.where(speed > 0.0, d**2, 0.0) for d in FIRST_DEVIATIONS[V:]))
    return Moved(F @ x + row.inputs[OFFSETS], F, noise + np.eye(ORDER) * anew)


def _seen(x: Array, row: WindowRow, shared: Array) -> Seen:
    p, balise = _shared(shared), row.inputs[_IS_BALISE]
    H = balise * BALISE_ROW + (1.0 - balise) * ODOMETER_ROW
    place = place_deviation(row.inputs[ACCURACY], p.balise_deviation)
    deviation: Array = np.where(balise > 0.5, place, p.odometer_deviation)
    return Seen(H @ x, H, np.reshape(deviation * deviation, (1, 1)))


def _limits(shared: Array) -> Limits:
    p = _shared(shared)
    return Limits(vector(-p.speed_limit, -p.disturbance_limit), vector(p.speed_limit, p.disturbance_limit))
