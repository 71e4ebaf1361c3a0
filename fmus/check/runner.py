"""The runner: one instance under test, with inputs that make something happen, moved through patterns of steps."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager
from time import perf_counter
from typing import Any

import numpy as np
from fmpy.model_description import ModelDescription

from fmus.fmi.instance import FAILURES
from fmus.fmi.slave import Slave
from fmus.fmi.types import FLOATING_TYPES

WARM_UP_STEPS = 5
SLOW_STEPS = 25  # a quarter of a second at the usual step: what is sampled at 10 Hz moves in it
_EXCITATIONS = (0.0, 1.0, 1e3, 1e5)
_SPREADS = (0.0, 0.1)
MOVING = (None, "continuous", "discrete")
END = 1e6
"""Stop time that is announced where the FMU has no default experiment, seconds after the start [s]."""

_ROUNDINGS = 4.0
"""So many last digits apart are one instant: of the sum, the quotient and the product, and one to spare."""

_READ_AT_MOST = 200
"""Local variables that are read where there is no output."""


class Runner(AbstractContextManager["Runner"]):
    """One probe under way: an instance, its outputs and the inputs that excite it.

    Args:
        make: makes a fresh, not yet instantiated component; it is freed by `put_away`.
        starts: start values by name.
        start_time: [s].
        h: communication step [s].
        component: the first component to use, where it was made already.
        until: end of the longest run [s]; what lies within the default experiment by default.
    """

    def __init__(
        self,
        make: Callable[[], Slave],
        starts: Mapping[str, Any],
        start_time: float,
        h: float,
        component: Slave | None = None,
        until: float | None = None,
    ) -> None:
        self._make, self.starts, self.t0, self.h = make, starts, start_time, h
        self.component = make() if component is None else component
        self.patience = np.inf  # how long steps whose number matters little may take together [s]
        self.end = max(end_of_experiment(self.component.description, start_time), until or start_time)
        self.amplitude, self.spread, self.now = 0.0, 0.0, start_time
        self.excited: bool | None = None
        self.reset_works = False
        self._best = 0, 0.0, 0.0  # outputs that moved, amplitude, spread
        self._started = False

    def fresh(self) -> Slave:
        """A fresh component, not yet instantiated."""
        return self._make()

    def twin(self, make: Callable[[], Slave] | None = None, starts: Mapping[str, Any] | None = None) -> Runner:
        """A second runner with an instance of its own and the same inputs.

        Args:
            make: makes its component; by default the same way as here. starts: start values beside those of this one.
        """
        other = Runner(make or self._make, {**self.starts, **(starts or {})}, self.t0, self.h, until=self.end)
        other.amplitude, other.spread, other.excited = self.amplitude, self.spread, self.excited
        return other

    def park(self) -> None:
        """Free the instance; the next `begin` makes a new one."""
        if self._started:
            self.put_away()
            self.component, self._started = self._make(), False

    def put_away(self) -> None:
        """End and free the instance."""
        self.component.terminate()
        self.component.free()

    def __exit__(self, *_: object) -> None:
        self.put_away()

    @property
    def output_names(self) -> list[str]:
        """Names of the outputs, elements of arrays included; where there are none, of the first local variables."""
        locals_ = self.component.names("local")[:_READ_AT_MOST]
        return self.component.names("output") or [
            n for n in locals_ if self.component.variables[n].variability in MOVING
        ]

    @property
    def discrete(self) -> np.ndarray:
        """Whether each output is declared discrete, shape (q,)."""
        return np.array([self.component.variables[n].variability == "discrete" for n in self.output_names], dtype=bool)

    def excite(self, limit: float = np.inf) -> bool:
        """Find inputs under which the outputs move; an amplitude that breaks the FMU is none.

        First the start values of the inputs, then the same value added to all, then a different one for each (a
        difference of inputs is zero under equal ones), then a change of the inputs (what has no memory moves with them
        only), then more steps (a sensor may be sampled slowly).

        Args:
            limit: time after which no more is tried [s].
        """
        if self.excited is None:
            since = perf_counter()
            tries = [(amplitude, spread) for spread in _SPREADS for amplitude in _EXCITATIONS]
            self.excited = any(
                self._moves(*one, change=change, steps=steps)
                for change, steps in ((False, WARM_UP_STEPS), (True, WARM_UP_STEPS), (False, SLOW_STEPS))
                for one in tries
                if perf_counter() - since < limit
            )
            if not self.excited:
                most, self.amplitude, self.spread = self._best
                self.excited = most > 0
        return self.excited

    def _moves(self, amplitude: float, spread: float, *, change: bool, steps: int) -> bool:
        self.amplitude, self.spread = amplitude, spread
        try:
            before = self.begin()
            if change:
                before = self.steps((self.h,))[-1]
                self.set_inputs(elsewhere(amplitude))
            after = self.steps((self.h,) * steps)[-1]
        except FAILURES:
            return False
        moving = int(np.count_nonzero(~np.isclose(before, after, rtol=1e-12, atol=0.0) & np.isfinite(after)))
        if moving > self._best[0]:
            self._best = moving, amplitude, spread
        return moving >= max(1, len(before) // 3)

    def begin(self, *, excited: bool = True, meanwhile: Callable[[], None] = lambda: None) -> np.ndarray:
        """An instance at the start, by a reset where resets are known to work, and its outputs there, shape (q,).

        Args:
            excited: whether the inputs are set; else they keep their start values.
            meanwhile: called at the end of initialisation.
        """
        if self._started and self.reset_works:
            self.component.reset()
        else:
            self._renew()
        for name, value in self.starts.items():
            self.component.set_start(name, value)
        self.now = self.t0
        self.component.enter_initialization(self.t0, self.end)
        if excited:
            self.set_inputs(self.amplitude)
        meanwhile()
        self.component.exit_initialization()
        return self.outputs()

    def outputs(self) -> np.ndarray:
        """The outputs where the instance stands, shape (q,)."""
        self._read()
        return self._outputs.copy()

    def set_inputs(self, amplitude: float) -> None:
        """All that are moved to this much above their start values, more from one to the next where a spread is set.

        Nothing goes beyond a declared range.

        Args:
            amplitude: how far above the start values.
        """
        aim = self._own + amplitude * (1.0 + self.spread * np.arange(len(self._inputs)))
        self._inputs[:] = np.clip(aim, self._lowest, self._highest)
        self._write()

    @property
    def inputs(self) -> dict[str, float]:
        """What the inputs that are moved were set to, by name."""
        return dict(zip(self._input_names, self._inputs.tolist(), strict=True))

    def steps(self, pattern: Sequence[float]) -> list[np.ndarray]:
        """Outputs after each step of a pattern of lengths [s] from where the instance stands, each of shape (q,)."""
        rows = []
        for h in pattern:
            rows += self.step(h)
            if self.component.terminated:
                raise self.component.failure("asked to terminate under the probe", self.now)
        return rows

    def steps_at_most(self, count: int) -> int:
        """Steps of the usual length from where the instance stands, as many as it does before it asks for the end, and
        as there is `patience` for.

        Args:
            count: the most to make.
        """
        done, since = 0, perf_counter()
        while done < count and not self.component.terminated and perf_counter() - since < self.patience:
            done += len(self.step(self.h))
        return done

    def step(self, h: float) -> list[np.ndarray]:
        """One step of length `h` [s]: the outputs after it in a list, which is empty where the FMU asks for the end."""
        self._write()
        self.component.advance(self.now, self.now + h)
        if self.component.terminated:
            return []
        self.now = self._instant(self.now + h)
        return [self.outputs()]

    def _instant(self, t: float) -> float:
        """Where a run stands that counts its steps from the start, where `t` [s] is that but for rounding.

        Added up, a thousand steps end some roundings behind the end of the experiment, where no run goes and some
        FMUs refuse to.
        """
        counted = self.t0 + round((t - self.t0) / self.h) * self.h
        return counted if abs(counted - t) <= _ROUNDINGS * math.ulp(max(abs(t), abs(self.t0), self.h)) else t

    def _renew(self) -> None:
        if self._started:
            self.put_away()
            self.component = self._make()
        self._started = True
        component = self.component
        component.instantiate()
        component.expect_steps(self.h, self.t0, self.end)
        names = self.output_names
        self._outputs = np.zeros(len(names))
        self._read = component.reader(names, self._outputs)
        inputs = self._moved_inputs()
        self._write, self._inputs = component.writer(inputs)
        self._input_names = inputs
        declared = [component.variables[n] for n in inputs]
        starts = (self.starts.get(n, v.start) for n, v in zip(inputs, declared, strict=True))
        self._own = np.array([_number(start, 0.0) for start in starts])
        self._inputs[:] = self._own
        self._lowest = np.array([_number(v.min, -np.inf) for v in declared])
        self._highest = np.array([_number(v.max, np.inf) for v in declared])

    def _moved_inputs(self) -> list[str]:
        """Names of the inputs that are moved: the continuous ones; sampled ones where there are none, and no events."""
        names, variables = self.component.names("input"), self.component.variables
        continuous = [n for n in names if variables[n].variability in (None, "continuous")]
        sampled = [n for n in names if variables[n].type in FLOATING_TYPES and not self.component.events]
        return continuous or sampled


def end_of_experiment(description: ModelDescription, start_time: float) -> float:
    """Where the default experiment ends [s]; long after the start where there is none.

    Some FMUs divide the time up to the announced end into steps of their own: a far end is a coarse step, or a run
    without end.

    Args:
        description: model description of the FMU. start_time: [s].
    """
    experiment = description.defaultExperiment
    stop = _number(experiment.stopTime if experiment else None, start_time)
    return stop if start_time < stop < np.inf else start_time + END


def _number(text: Any, otherwise: float) -> float:
    """A number from a model description; another one where it holds none, or those of an array."""
    try:
        return float(text)
    except (TypeError, ValueError):
        return otherwise


def elsewhere(amplitude: float) -> float:
    """Another amplitude than this one."""
    return 0.5 * amplitude + 1.0
