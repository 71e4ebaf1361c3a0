"""The bench: one instance under test, with inputs that make something happen, moved through patterns of steps."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from fmus.check.steppable import FAILURES, Steppable

WARM_UP_STEPS = 5
SLOW_STEPS = 25  # a quarter of a second at the usual step: what is sampled at 10 Hz moves in it
EXCITATIONS = (0.0, 1.0, 1e3, 1e5)
SPREADS = (0.0, 0.1)
END = 1e6
"""Stop time that is announced, seconds after the start [s]."""


class Bench:
    """One probe under way: an instance, its outputs and the inputs that excite it.

    Args:
        make: makes a fresh, not yet instantiated component; it is freed by `put_away`.
        starts: start values by name.
        start_time: [s].
        h: communication step [s].
        component: the first component to use, where it was made already.
    """

    def __init__(
        self, make: Callable[[], Steppable], starts: Mapping[str, Any], start_time: float, h: float,
        component: Steppable | None = None,
    ) -> None:  # fmt: skip
        self._make, self.starts, self.t0, self.h = make, starts, start_time, h
        self.component = make() if component is None else component
        self.amplitude, self.spread, self.now = 0.0, 0.0, start_time
        self.excited: bool | None = None
        self.reset_works = False
        self._started = False

    def fresh(self) -> Steppable:
        """A fresh component, not yet instantiated."""
        return self._make()

    def twin(self, make: Callable[[], Steppable] | None = None) -> Bench:
        """A second bench with an instance of its own and the same inputs."""
        other = Bench(make or self._make, self.starts, self.t0, self.h)
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

    @property
    def output_names(self) -> list[str]:
        """Names of the outputs that are read."""
        return self.component.names("output")

    @property
    def discrete(self) -> np.ndarray:
        """Whether each output is declared discrete, shape (q,)."""
        return np.array([self.component.variables[n].variability == "discrete" for n in self.output_names], dtype=bool)

    def excite(self) -> bool:
        """Find inputs under which the outputs move; an amplitude that breaks the FMU is none.

        First the same value for all inputs, then a different one for each (a difference of inputs is zero under equal ones), then
        a change of the inputs (what has no memory moves with them only), then more steps (a sensor may be sampled slowly).
        """
        if self.excited is None:
            tries = [(amplitude, spread) for spread in SPREADS for amplitude in EXCITATIONS]
            self.excited = any(
                self._moves(*one, change=change, steps=steps)
                for change, steps in ((False, WARM_UP_STEPS), (True, WARM_UP_STEPS), (False, SLOW_STEPS))
                for one in tries
            )
            if not self.excited:
                self.amplitude = self.spread = 0.0
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
        moving = np.count_nonzero(~np.isclose(before, after, rtol=1e-12, atol=0.0) & np.isfinite(after))
        return bool(moving >= max(1, len(before) // 3))

    def begin(self, *, excited: bool = True) -> np.ndarray:
        """An instance at the start, by a reset where resets are known to work, and its outputs there, shape (q,).

        Args:
            excited: whether the inputs are set; else they keep their start values.
        """
        if self._started and self.reset_works:
            self.component.reset()
        else:
            self._renew()
        for name, value in self.starts.items():
            self.component.set_start(name, value)
        self.now = self.t0
        self.component.enter_initialization(self.t0, self.t0 + END)
        if excited:
            self.set_inputs(self.amplitude)
        self.component.exit_initialization()
        return self.outputs()

    def outputs(self) -> np.ndarray:
        """The outputs where the instance stands, shape (q,)."""
        self._read()
        return self._outputs.copy()

    def set_inputs(self, amplitude: float) -> None:
        """All continuous inputs to one value, or to growing ones where a spread is set."""
        self._inputs[:] = amplitude * (1.0 + self.spread * np.arange(len(self._inputs)))
        self._write()

    def steps(self, pattern: Sequence[float]) -> list[np.ndarray]:
        """Outputs after each step of a pattern of lengths [s] from where the instance stands, each of shape (q,)."""
        rows = []
        for h in pattern:
            self._write()
            self.component.advance(self.now, self.now + h)
            if self.component.terminated:
                raise self.component.failure("asked to terminate under the probe")
            self.now += h
            rows.append(self.outputs())
        return rows

    def _renew(self) -> None:
        if self._started:
            self.put_away()
            self.component = self._make()
        self._started = True
        component = self.component
        component.instantiate()
        names = self.output_names
        self._outputs = np.zeros(len(names))
        self._read = component.reader(names, self._outputs)
        inputs = [n for n in component.names("input") if component.variables[n].variability in (None, "continuous")]
        self._write, self._inputs = component.writer(inputs)


def elsewhere(amplitude: float) -> float:
    """Another amplitude than this one."""
    return 0.5 * amplitude + 1.0
