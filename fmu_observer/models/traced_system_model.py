"""Any hybrid system as the model of a filter: its own flow over a period, or its own periodic jump. It knows no filter.

1. Continuous states are estimated. They move by the system's own method (dry friction and switches included) in equal
   steps, none longer than the system's own internal step unless `Steps` says how many; memory stays at its start,
   triggered events do not occur, and periodic ones must leave the continuous states alone.
2. A system without continuous states that jumps at one periodic event moves by this jump; all its memory is estimated,
   and the period of the event is that of the filter.
3. Its parameters become parameters of the filter. Vectors are taken apart, ``x[1]`` as ``x_1``.

What does not flow and does not jump at one period only has no transition that a filter could differentiate; it is
refused in words.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from math import ceil, inf

import casadi as ca
import numpy as np

from fmu_observer.models.filter_models import FilterModel, Known, Measured, Transition, filter_model
from fmu_observer.models.known_models import MODELS, find_model
from fmu_observer.models.observer_model import ObserverModel
from plant_models import PLANTS
from plant_models.hybrid import Array, HybridSystem, TracedSystem, vector
from plant_models.hybrid.exact_jacobian import is_affine
from plant_models.hybrid.integration import step
from plant_models.hybrid.option import is_number, require_whole
from plant_models.hybrid.scan import Arrays, enclosed, scan_table
from plant_models.hybrid.signal import Signal, input_signal, scalar_names, state, width
from plant_models.interop.continuous_part import known as known_name
from plant_models.user_file import Expected, load_class, names_code

_SUBSTEPS = 4
"""Internal steps of the system in the period of a filter for which no other is stated."""
UNROLLED = 8
"""Steps that are written out; more of them are a loop in the generated code."""
_MOST_STEPS = 100_000

_USERS = Expected("subclass of HybridSystem", lambda found: isinstance(found, type) and issubclass(found, HybridSystem))

_ROUNDING = 1e-9  # share by which a period may exceed its steps: rounding


@dataclass(frozen=True)
class Steps:
    """Integration steps of a system in a period of a filter.

    Args:
        period: of the filter [s]; None for `_SUBSTEPS` internal steps of the system.
        substeps: how many steps it has; None for as many as keep each within the internal step of the system.
    """

    period: float | None = None
    substeps: int | None = None

    def of(self, system: HybridSystem) -> int:
        """How many steps there are.

        Args:
            system: that moves.

        Raises:
            ValueError: the period is not positive, or a number of steps is not possible; the message says which.
        """
        where = f"Filter model of {system.name}"
        if self.period is not None and not (is_number(self.period) and self.period > 0.0):
            raise ValueError(f"{where}: period = {self.period!r}; expected a time above 0 [s].")
        if self.substeps is not None:
            require_whole(where, substeps=self.substeps)
            return self.substeps
        count = _SUBSTEPS if self.period is None else ceil(self.period / system.internal_step * (1.0 - _ROUNDING))
        if count > _MOST_STEPS:
            raise ValueError(
                f"{where}: a period of {self.period:g} s has {count} internal steps of {system.internal_step:g} s, "
                f"expected {_MOST_STEPS} at most; say by `substeps` how many are enough, which its condition judges."
            )
        return max(count, 1)


Source = str | ObserverModel | FilterModel | HybridSystem | type[HybridSystem]


def system_model(
    system: HybridSystem,
    outputs: Sequence[str],
    inputs: Sequence[str] | None = None,
    *,
    process_noises: Sequence[str] = (),
    measurement_noises: Sequence[str] = (),
    steps: Steps = Steps(),
    preset: str | None = None,
) -> FilterModel:
    """A hybrid system as the model of a filter; how it moves then stands at the head of this module.

    Args:
        system: traceable. outputs: scalar names of what is measured. inputs: names of the inputs that the filter knows,
            all by default; the others stay at their starts.
        process_noises: names of inputs, or of noises of the periodic event, through which the process noise enters,
            held over a period; none for additive noise on every state.
        measurement_noises: names of inputs through which noise enters the outputs; none for additive noise.
        steps: of the integration in a period. preset: of the start values; None for the default one.

    Raises:
        ValueError: a name is unknown, nothing is measured, or the system does not move so; the message says which.
    """
    _require_list(system, outputs)
    moving = _Moving(system, steps.of(system), preset, steps.period)
    noisy = (*process_noises, *measurement_noises)
    names = [n for n in scalar_names(system.inputs) if n not in noisy] if inputs is None else list(inputs)
    return _model(moving, steps, outputs, names, process_noises, measurement_noises)


def _model(
    moving: _Moving,
    steps: Steps,
    outputs: Sequence[str],
    names: Sequence[str],
    process_noises: Sequence[str],
    measurement_noises: Sequence[str],
) -> FilterModel:
    system = moving.system
    signals = {name: s for s in system.input_signals for name in s.scalar_names}
    for name in (*names, *process_noises, *measurement_noises):
        known_name(name, signals, f"{system.name}: input")
    every = {name: s for s in system.outputs for name in s.scalar_names}
    measured = [every[known_name(name, every, f"{system.name}: output")] for name in outputs]
    rows = [list(every).index(name) for name in outputs]
    moving.check_outputs(rows)
    return FilterModel(
        name=system.name,
        description=system.description,
        source=system.source,
        states=moving.states,
        inputs=tuple(_input(name, signals[name]) for name in names),
        measurements=tuple(_input(name, s) for name, s in zip(outputs, measured, strict=True)),
        parameters=moving.parameters,
        process_noises=tuple(_input(name, signals[name]) for name in process_noises),
        measurement_noises=tuple(_input(name, signals[name]) for name in measurement_noises),
        moved=moving.transition(names, process_noises),
        measured=moving.measured(names, measurement_noises, rows),
        sample_period=moving.sample_period,
        any_period=moving.event is None,
        longest_period=moving.longest_period(steps),
        deviates=moving.deviates(names, process_noises, measurement_noises, rows),
    )


def _require_list(system: HybridSystem, outputs: Sequence[str]) -> None:
    if isinstance(outputs, str) or not outputs:
        raise ValueError(
            f"{system.name}: outputs = {outputs!r}; expected a list of what is measured, some of: "
            f"{', '.join(scalar_names(system.outputs))}."
        )


def find_filter_model(
    model: Source,
    outputs: Sequence[str] = (),
    inputs: Sequence[str] | None = None,
    process_noises: Sequence[str] = (),
    measurement_noises: Sequence[str] = (),
    steps: Steps = Steps(),
) -> FilterModel:
    """The model of a filter, of whatever names or is one.

    Args:
        model: name of an observer model, or of a plant, or ``file.py:Class``; or a model or hybrid system itself. A
            name that both bear is the observer model's, unless `outputs` are given.
        outputs, inputs, process_noises, measurement_noises, steps: of a hybrid system, see `system_model`. An observer
            model keeps the period that it has.

    Raises:
        ValueError: the name is unknown, or something is asked for that the model has not.
    """
    if isinstance(model, FilterModel | ObserverModel) or (model in MODELS and not outputs):
        _require_nothing(
            outputs=outputs, inputs=inputs, process_noises=process_noises, measurement_noises=measurement_noises
        )
        return model if isinstance(model, FilterModel) else filter_model(find_model(model))
    plant = _found(model)
    return system_model(
        plant, outputs, inputs, process_noises=process_noises, measurement_noises=measurement_noises, steps=steps
    )


def _require_nothing(**options: Sequence[str] | None) -> None:
    asked = [name for name, value in options.items() if value]
    if asked:
        raise ValueError(
            f"{', '.join(asked)}: what an observer model measures and knows stands in the model; leave it out, or name "
            "a plant."
        )


def _found(model: object) -> HybridSystem:
    if isinstance(model, HybridSystem):
        return model
    if isinstance(model, type) and issubclass(model, HybridSystem):
        return model()
    if isinstance(model, str) and names_code(model):
        found: HybridSystem = load_class(model, _USERS)()
        return found
    if not isinstance(model, str) or model not in PLANTS:
        raise ValueError(
            f"Unknown model {model!r} of a filter; known are the observer models {', '.join(MODELS)}, and with "
            f"`outputs` the plants {', '.join(PLANTS)}."
        )
    return PLANTS[model]()


@dataclass(frozen=True)
class _Moving:
    """How a hybrid system moves, with all that a filter does not know at its start values."""

    system: HybridSystem
    substeps: int
    preset: str | None
    period: float | None = None

    def __post_init__(self) -> None:
        system = self.system
        if not system.traceable:
            raise ValueError(f"{system.name}: it cannot be traced, so it has no Jacobian and is no model of a filter.")
        if not system.state_count:
            raise ValueError(f"{system.name}: it has no states, so there is nothing to estimate.")
        own = [f"periodic {e.name!r}" for e in system.periodic_events]
        own += [f"communication {e.name!r}" for e in system.communication_events]
        if system.communication_events or (len(own) > 1 and not system.continuous_count) or self._meddling():
            raise ValueError(
                f"{system.name}: it moves by its own events ({', '.join(own)}), expected a system whose continuous "
                "states flow on whatever they do, or that has no continuous states and one periodic event; it is no "
                "model of a filter."
            )

    def _meddling(self) -> bool:
        """Whether periodic events, but for their noise, change what flows, at once or by way of memory."""
        system, n = self.system, self.system.continuous_count
        if not n or not system.periodic_events:
            return False
        if self._traced.dependencies("derivative", "x")[:, n:].any():
            return True
        x = ca.SX.sym("x", system.state_count)
        quiet = width(system.noises)  # which stand last
        u = ca.vertcat(ca.SX.sym("u", len(system.start_inputs()) - quiet), ca.SX(quiet, 1))
        p = ca.SX.sym("p", len(system.start_parameters()))
        jumped = [self._traced.jump(e.name)(ca.SX.sym("t"), x, u, p) for e in system.periodic_events]
        return not all(ca.is_equal(ca.simplify(after[i]), x[i]) for after in jumped for i in range(n))

    def check_outputs(self, rows: Sequence[int]) -> None:
        """No output is what periodic events made of a flowing state.

        Raises:
            ValueError: one is; the message names it.
        """
        system, n = self.system, self.system.continuous_count
        if not n or not system.periodic_events:
            return
        read = np.asarray(self._traced.dependencies("output", "x")[:, n:].any(axis=1))
        wrong = [scalar_names(system.outputs)[i] for i in rows if read[i]]
        if wrong:
            raise ValueError(
                f"{system.name}: output {wrong[0]!r} follows its own sampling, not the state now; measure an output "
                "that follows the state."
            )

    @property
    def event(self) -> str | None:
        """The periodic event by which the system moves; None where it flows."""
        events = self.system.periodic_events
        return events[0].name if events and not self.system.continuous_count else None

    @property
    def states(self) -> tuple[Signal, ...]:
        kept = "continuous" if self.event is None else "discrete"
        starts = dict(zip(scalar_names(self.system.states), self.system.start_state(self.preset), strict=True))
        return tuple(
            state(_identifier(name), s.unit, float(starts[name]), s.description)
            for s in self.system.states
            if s.variability == kept
            for name in s.scalar_names
        )

    @property
    def parameters(self) -> tuple[Signal, ...]:
        """Those of the system, at the values of the preset, without periods of its events."""
        values = dict(
            zip(scalar_names(self.system.parameters), self.system.start_parameters(self.preset), strict=False)
        )
        own = self._own_periods
        return tuple(
            replace(s, start=tuple(float(values[n]) for n in s.scalar_names) if s.size else float(values[s.name]))
            for s in self.system.parameters
            if s.name not in own
        )

    @property
    def _own_periods(self) -> list[str]:
        """Parameters that the period of the filter takes the place of."""
        return [e.period for e in self.system.periodic_events]

    @property
    def sample_period(self) -> float:
        if self.event is None:
            return float(self.substeps * self.system.internal_step if self.period is None else self.period)
        names = scalar_names(self.system.parameter_signals)
        return float(self.system.start_parameters(self.preset)[names.index(self.system.periodic_events[0].period)])

    def longest_period(self, steps: Steps) -> float:
        """The longest period in which no step is longer than the system's own [s]; none where the steps were given."""
        own = self.event is not None or steps.substeps is not None
        return inf if own else float(self.substeps * self.system.internal_step) * (1.0 + _ROUNDING)

    def deviates(
        self, names: Sequence[str], noises: Sequence[str], readings: Sequence[str], rows: Sequence[int]
    ) -> bool | None:
        """Whether one step or an output is not affine in the state; None where no loop hides it."""
        if self.substeps <= UNROLLED:
            return None
        one = replace(self, substeps=1)
        n, m, k = len(self.states), len(names), width(self.parameters)

        def known(flat: Array) -> Known:
            return Known(flat[0], flat[1 : 1 + m], flat[1 + m : 1 + m + k])

        def moved(xw: Array, flat: Array) -> Array:
            return one.transition(names, noises)(xw[:n], xw[n:], known(flat), flat[-1])

        def seen(xv: Array, flat: Array) -> Array:
            return self.measured(names, readings, rows)(xv[:n], xv[n:], known(flat))

        width_of_flat = 2 + m + k
        affine = is_affine(moved, n + len(noises), width_of_flat)
        return not (affine and is_affine(seen, n + len(readings), width_of_flat))

    def transition(self, names: Sequence[str], noises: Sequence[str]) -> Transition:
        """The state a period later."""
        return lambda x, w, known, period: self._moved(
            x, self._inputs((*names, *noises), np.hstack([known.u, w])), known, period
        )

    def measured(self, names: Sequence[str], noises: Sequence[str], rows: Sequence[int]) -> Measured:
        """Some outputs."""

        def outputs(x: Array, v: Array, known: Known) -> Array:
            u = self._inputs((*names, *noises), np.hstack([known.u, v]))
            y = self.system.output_vector(known.t, self._whole(x), u, self._parameters(known.p, self.sample_period))
            return vector(*(y[i] for i in rows))

        return outputs

    def _moved(self, x: Array, u: Array, known: Known, period: Array) -> Array:
        p = self._parameters(known.p, period)
        if self.event is not None:
            return self.system.jump_vector(self.event, known.t + period, x, u, p)
        n, h, whole = self.system.continuous_count, period / self.substeps, self._whole(x)
        if self.substeps > UNROLLED:
            return enclosed(self._rolled, whole, u, p, vector(known.t + 0.0 * h, h))[0][:n]
        for i in range(self.substeps):
            whole = self._step(known.t + i * h, h, whole, u, p)
        return whole[:n]

    def _step(self, t: Array, h: Array, whole: Array, u: Array, p: Array) -> Array:
        return step(self.system, t, h, whole, u, p, self._jacobian(whole, u, p))

    @cached_property
    def _rolled(self) -> Callable[..., tuple[Array, ...]]:
        """All steps of a period as a loop: of the state, inputs, parameters, and time and length of the first one."""

        def body(carry: Arrays, row: Arrays, shared: Arrays) -> tuple[Arrays, Arrays]:
            u, p, clock = shared
            return (self._step(clock[0] + row[0][0] * clock[1], clock[1], carry[0], u, p),), (row[0],)

        numbers = np.arange(float(self.substeps)).reshape(-1, 1)
        return lambda whole, u, p, clock: scan_table(body, (whole,), (numbers,), (u, p, clock))[0]

    def _jacobian(self, x: Array, u: Array, p: Array) -> Callable[[Array, Array], tuple[Array, Array]] | None:
        if self.system.method != "rosenbrock":
            return None

        def derivatives(t: Array, _continuous: Array) -> tuple[Array, Array]:
            by_x, by_t = self._traced.effective_jacobian(*(ca.SX(value) for value in (t, x, u, p)))
            symbolic = ca.ArrayInterface.SX
            count = self.system.continuous_count
            if isinstance(x, ca.ArrayInterface):
                return symbolic(by_x, shape=(count, count)), symbolic(by_t, shape=(count,))
            return np.asarray(ca.DM(by_x)), np.asarray(ca.DM(by_t)).ravel()

        return derivatives

    @cached_property
    def _traced(self) -> TracedSystem:
        return TracedSystem(self.system)

    def _whole(self, x: Array) -> Array:
        held = self.system.start_state(self.preset)[self.system.continuous_count :]
        return x if self.event is not None or not len(held) else np.hstack([x, held])

    def _inputs(self, names: Sequence[str], values: Array) -> Array:
        starts = self.system.start_inputs()
        places = scalar_names(self.system.input_signals)
        known = {name: values[i] for i, name in enumerate(names)}
        return vector(*(known.get(n, s) for n, s in zip(places, map(float, starts), strict=True))) if places else starts

    def _parameters(self, p: Array, period: Array) -> Array:
        """All parameters of the system: those of the filter, its period, and those of the runtime."""
        own, i, parts = self._own_periods, 0, []
        for s in self.system.parameters:
            if s.name in own:
                parts.append(period)
                continue
            parts.extend(p[i + j] for j in range(s.width))
            i += s.width
        runtime = self.system.start_parameters(self.preset)[len(parts) :]
        return vector(*parts, *map(float, runtime))


def _identifier(name: str) -> str:
    return name.replace("[", "_").replace("]", "")


def _input(name: str, signal: Signal) -> Signal:
    start = signal.start_values[signal.scalar_names.index(name)]
    return input_signal(_identifier(name), signal.unit, float(start), signal.description)
