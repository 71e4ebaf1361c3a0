"""The probe: what an FMU really does with steps of any length, saved states and resets, whatever it says about itself.

It works on instances of its own, made and thrown away here, with inputs that make something happen.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from cosim.components.component import Component
from cosim.errors import CosimError, RunError

STEP_TOLERANCE = 0.01
"""A divided step may differ from a whole one by this share of the change: far above any integration error, far below a lie."""

UNEVEN = 0.3137
"""Where the whole step is divided: no simple fraction, so that it is no multiple of an internal step."""

MICRO = 1e-4
"""A step of this share of the whole one must move the outputs, and by about that share of the change."""

MICRO_EXCESS = 20.0
"""By how much more a tiny step may move an output than its share: an output may start to move faster than on average."""

ENOUGH = 0.5
"""Share of the moving outputs that must behave; a sampled one among them need not move in a tiny step."""

RESOLUTION = 1e-9
"""An output that changes by less than this share of itself over a step does not move."""

WARM_UP_STEPS = 5
EXCITATIONS = (0.0, 1.0, 1e3, 1e5)


@dataclass(frozen=True)
class ProbeReport:
    """What was declared and what was seen.

    Args:
        component: name.
        declares_variable_step, declares_state: capability flags.
        honest_step: steps of any length did what they say.
        exact_state: after save, steps elsewhere and restore, the same steps gave the identical outputs.
        repeatable: after a reset the same steps gave the identical outputs.
        excited: some input made the outputs move, so that the findings mean something.
        remarks: what failed, in words.
    """

    component: str
    declares_variable_step: bool
    declares_state: bool
    honest_step: bool
    exact_state: bool
    repeatable: bool
    excited: bool
    remarks: tuple[str, ...] = ()

    def to_dict(self) -> dict[str, Any]:
        """For the summary."""
        return asdict(self) | {"remarks": list(self.remarks)}


def probe(make: Callable[[], Component], starts: Mapping[str, float], start_time: float, h: float) -> ProbeReport:
    """Probe a component.

    Args:
        make: makes a fresh, not yet instantiated component; it is freed here.
        starts: start values as in the run.
        start_time: [s]. h: communication step of the run [s].

    Returns:
        What was seen; an FMU that fails under the probe is reported, not raised.
    """
    component = make()
    declares = {"declares_variable_step": component.can_vary_step, "declares_state": component.can_save}
    nothing_seen = {"honest_step": False, "exact_state": False, "repeatable": False, "excited": False}
    if component.description.coSimulation.canBeInstantiatedOnlyOncePerProcess:
        component.free()
        remark = "not probed: the FMU allows one instance per process only"
        return ProbeReport(component.name, **declares, **nothing_seen, remarks=(remark,))
    probing = _Probe(make, component, starts, start_time, h)
    try:
        return probing.report(declares)
    except CosimError as error:
        remarks = (*probing.remarks, f"the probe came to an end: {error}")
        return ProbeReport(component.name, **declares, **nothing_seen, remarks=remarks)
    finally:
        probing.put_away()


class _Probe:
    """One probe under way: an instance, its outputs and the inputs that excite it."""

    def __init__(
        self, make: Callable[[], Component], component: Component, starts: Mapping[str, float], start_time: float, h: float
    ) -> None:
        self._make, self.component, self.starts, self.t0, self.h = make, component, starts, start_time, h
        self.remarks: list[str] = []
        self.amplitude, self._now = 0.0, start_time
        self._started = False
        self._reset_works = False

    def report(self, declares: Mapping[str, bool]) -> ProbeReport:
        """Find an excitation, then check what is declared. Resets come first: the other checks rely on them where they work."""
        excited = self._excite()
        if not excited:
            self.remarks.append("no input made the outputs move; findings are weak")
        self._reset_works = self._attempt("reset and re-run", self._repeatable)
        honest = declares["declares_variable_step"] and self._attempt("steps of other lengths", self._honest_step)
        exact = declares["declares_state"] and self._attempt("saving and restoring", self._exact_state)
        return ProbeReport(self.component.name, **declares, honest_step=honest, exact_state=exact,
                           repeatable=self._reset_works, excited=excited, remarks=tuple(self.remarks))  # fmt: skip

    def put_away(self) -> None:
        """End and free the instance."""
        self.component.terminate()
        self.component.free()

    # -- checks -----------------------------------------------------------------------------------------------------

    def _attempt(self, what: str, check: Callable[[], bool]) -> bool:
        try:
            passed = check()
        except CosimError as error:
            self.remarks.append(f"{what}: {error}")
            self._reset_works = False  # whatever failed, go on with a fresh instance
            return False
        if not passed:
            self.remarks.append(f"{what}: the outputs differ")
        return passed

    def _excite(self) -> bool:
        """Find inputs under which the outputs move; an amplitude that breaks the FMU is none."""
        for amplitude in EXCITATIONS:
            self.amplitude = amplitude
            try:
                before = self._begin()
                after = self._steps((self.h,) * WARM_UP_STEPS)[-1]
            except RunError:
                continue
            moving = np.count_nonzero(~np.isclose(before, after, rtol=1e-12, atol=0.0))
            if moving >= max(1, len(before) // 3):
                return True
        self.amplitude = 0.0
        return False

    def _repeatable(self) -> bool:
        pattern = (self.h,) * (2 * WARM_UP_STEPS)
        self._begin()
        first = self._steps(pattern)
        self._reset_works = True
        self._begin()
        return bool(np.array_equal(first, self._steps(pattern), equal_nan=True))

    def _honest_step(self) -> bool:
        """A whole step against divided ones, and tiny steps against their share of the whole one."""
        h, warm_up = self.h, (self.h,) * WARM_UP_STEPS
        self._begin()
        start, whole = self._steps((*warm_up, h))[-2:]
        change = np.abs(whole - start)
        moving = change > RESOLUTION * np.abs(whole)
        for parts in ((0.5, 0.5), (UNEVEN, 1.0 - UNEVEN)):
            self._begin()
            divided = self._steps((*warm_up, *(h * part for part in parts)))[-1]
            same = np.abs(divided - whole) <= STEP_TOLERANCE * change + RESOLUTION * np.abs(whole)
            if not _enough(same, moving):
                return False
        self._begin()
        at = np.array(self._steps((*warm_up, h * UNEVEN, h * MICRO, h * MICRO))[-3:])
        moved = np.abs(np.diff(at, axis=0))
        small = np.all((moved > 0.0) & (moved <= MICRO_EXCESS * MICRO * change), axis=0)
        return _enough(small, moving) if moving.any() else True

    def _exact_state(self) -> bool:
        """Save, go on, go elsewhere under other inputs, restore twice: the same steps must give the same outputs.

        Several steps are compared, because a part of the state that was not restored may take time to show, and one of them is
        short where the FMU takes such steps.
        """
        h = self.h
        path = (h, UNEVEN * h, h, h) if self.component.can_vary_step else (h, h, h)
        self._begin()
        self._steps((h,) * WARM_UP_STEPS)
        state, saved_at = self.component.save(), self._now
        try:
            first = self._steps(path)
            for _ in range(2):
                self._set_inputs(0.5 * self.amplitude + 1.0)
                self._steps((h,) * WARM_UP_STEPS)
                self.component.restore(state)
                self._now = saved_at
                self._set_inputs(self.amplitude)
                if not np.array_equal(first, self._steps(path), equal_nan=True):
                    return False
            return True
        finally:
            self.component.release(state)

    # -- moving the instance ----------------------------------------------------------------------------------------

    def _begin(self) -> np.ndarray:
        """An instance at the start, by a reset where resets are known to work, and its outputs there, shape (q,)."""
        if self._started and self._reset_works:
            self.component.reset()
        else:
            self._renew()
        for name, value in self.starts.items():
            self.component.set_start(name, value)
        self._now = self.t0
        self.component.enter_initialization(self.t0, self.t0 + 1e6)
        self._set_inputs(self.amplitude)
        self.component.exit_initialization()
        self._read()
        return self._outputs.copy()

    def _renew(self) -> None:
        if self._started:
            self.put_away()
            self.component = self._make()
        self._started = True
        component = self.component
        component.instantiate()
        names = component.names("output")
        self._outputs = np.zeros(len(names))
        self._read = component.reader(names, self._outputs)
        inputs = [n for n in component.names("input") if component.variables[n].variability in (None, "continuous")]
        self._write, self._inputs = component.writer(inputs)

    def _set_inputs(self, amplitude: float) -> None:
        self._inputs[:] = amplitude
        self._write()

    def _steps(self, pattern: Sequence[float]) -> list[np.ndarray]:
        """Outputs after each step of a pattern of lengths [s] from where the instance stands, each of shape (q,)."""
        rows = []
        for h in pattern:
            self._write()
            self.component.advance(self._now, self._now + h)
            if self.component.terminated:
                raise self.component.failure("asked to terminate under the probe")
            self._now += h
            self._read()
            rows.append(self._outputs.copy())
        return rows


def _enough(good: np.ndarray, moving: np.ndarray) -> bool:
    """Whether most of the moving outputs are good; of outputs that do not move, all must be."""
    return bool(np.mean(good[moving]) >= ENOUGH) if moving.any() else bool(np.all(good))
