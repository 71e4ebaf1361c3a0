"""How a hybrid system moves over the period of a filter: its flow in equal steps, or its periodic jump, traced."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from math import ceil, inf

import numpy as np

from fmu_observer.models.filter_models import Known, Measured, Transition
from plant_models.hybrid import Array, HybridSystem, TracedSystem, vector
from plant_models.hybrid.casadi_package import ca, demand_casadi
from plant_models.hybrid.exact_jacobian import is_affine
from plant_models.hybrid.integration import step
from plant_models.hybrid.option import is_number, require_whole
from plant_models.hybrid.scan import Arrays, enclosed, scan_table
from plant_models.hybrid.signal import Signal, scalar_names, state, width

_SUBSTEPS = 4
"""Internal steps of the system in the period of a filter for which no other is stated."""
UNROLLED = 8
"""Steps that are written out; more of them are a loop in the generated code."""
_MOST_STEPS = 100_000

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


USUAL_STEPS = Steps()


@dataclass(frozen=True)
class MovingSystem:
    """How a hybrid system moves, with all that a filter does not know at its start values.

    Args:
        system: that moves. substeps: in a period. preset: of its start values. period: of the filter [s]; None for its
            own.
    """

    system: HybridSystem
    substeps: int
    preset: str | None
    period: float | None = None

    def __post_init__(self) -> None:
        system = self.system
        demand_casadi()
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

        Args:
            rows: of the outputs that are measured.

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
        """What flows, or else what jumps, at the values of the preset."""
        kept = "continuous" if self.event is None else "discrete"
        starts = dict(zip(scalar_names(self.system.states), self.system.start_state(self.preset), strict=True))
        return tuple(
            state(identifier(name), s.unit, float(starts[name]), s.description)
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
        """Period of the filter, or of the event by which the system moves [s]."""
        if self.event is None:
            return float(self.substeps * self.system.internal_step if self.period is None else self.period)
        names = scalar_names(self.system.parameter_signals)
        return float(self.system.start_parameters(self.preset)[names.index(self.system.periodic_events[0].period)])

    def longest_period(self, steps: Steps) -> float:
        """The longest period in which no step is longer than the system's own [s]; none where the steps were given.

        Args:
            steps: as they were stated.
        """
        own = self.event is not None or steps.substeps is not None
        return inf if own else float(self.substeps * self.system.internal_step) * (1.0 + _ROUNDING)

    def deviates(
        self, names: Sequence[str], noises: Sequence[str], readings: Sequence[str], rows: Sequence[int]
    ) -> bool | None:
        """Whether one step or an output is not affine in the state; None where no loop hides it.

        Args:
            names: of the inputs that are known. noises, readings: of the inputs through which noise enters the
                transition and the outputs. rows: of the outputs that are measured.
        """
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
        """The state a period later.

        Args:
            names: of the inputs that are known. noises: of those through which noise enters.
        """
        return lambda x, w, known, period: self._moved(
            x, self._inputs((*names, *noises), np.hstack([known.u, w])), known, period
        )

    def measured(self, names: Sequence[str], noises: Sequence[str], rows: Sequence[int]) -> Measured:
        """Some outputs.

        Args:
            names: of the inputs that are known. noises: of those through which noise enters. rows: of the outputs.
        """

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


def identifier(name: str) -> str:
    """Name of a parameter of the filter: ``x[1]`` as ``x_1``.

    Args:
        name: scalar name of the system.
    """
    return name.replace("[", "_").replace("]", "")
