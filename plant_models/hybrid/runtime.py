"""Runtime: a hybrid system moving through time, events included.

This is the reference for the C runtime: the same grid, the same order of events, the same numbers. It knows no FMI; the
block (package `fmu_observer`) puts that interface on it.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import floor, inf, isfinite, ulp

import numpy as np

from plant_models.hybrid.event import USED
from plant_models.hybrid.integration import effective_flow
from plant_models.hybrid.kernel import Kernel, make_kernel
from plant_models.hybrid.noise import FROM_NAME, RUN_SEED, SEED_EXPECTED, is_seed, seed_of, standard_normal
from plant_models.hybrid.requirements import unfulfilled
from plant_models.hybrid.signal import scalar_names, width
from plant_models.hybrid.system import HybridSystem

GRID_TOLERANCE = 1e-9  # of an internal step: closer to a grid point than this is on it


@dataclass(frozen=True)
class Snapshot:
    """Everything that decides the future of a runtime; a value, never changed after it is taken."""

    memory: np.ndarray
    t: float
    t0: float
    ticks: tuple[int, ...]


class Runtime:
    """One instance of a hybrid system in time.

    1. `x`, `u`, `p`, `y` are flat arrays in the declared order; write inputs into `u` before `advance`.
    2. `advance(t_end)` integrates on the absolute grid ``t0 + k * internal_step``, so that splitting a step changes
       nothing, and hits every periodic instant in ``(t, t_end]`` exactly, in the declared order.
    3. `start(t0)` fires the periodic events that are due at ``t0``, then the communication events; `communicate()`
       fires these at the end of a communication step.
    4. `trigger(event)` jumps now, with the payload that stands in `u`.
    5. `compute_outputs(t)` brings `y` up to date with the rest at a time [s]; `update_outputs` does so now.
    6. `snapshot` / `restore` are exact: what follows a restore is bit-identical to what followed the snapshot.

    Args:
        system: the hybrid system.
        kernel: how it is evaluated; by default the fastest the system allows.
        name: of the instance, from which its noise follows where no seed is given; the system's name by default.
    """

    def __init__(self, system: HybridSystem, kernel: Kernel | None = None, name: str | None = None) -> None:
        self.system = system
        self.name = name or system.name
        self._kernel = kernel if kernel is not None else make_kernel(system)
        self.x, self.u, self.p, self.y = self._kernel.x, self._kernel.u, self._kernel.p, self._kernel.y
        self.memory, self.compute_outputs = self._kernel.memory, self._kernel.output
        self.t = self.t0 = 0.0
        self.ticks = [0] * len(system.periodic_events)
        self._places = {name: i for i, name in enumerate(scalar_names(system.parameter_signals))}
        self._verdicts = {event.name: system.verdict_index(event) for event in system.triggered_events}
        events = system.periodic_events
        self._step_place, self._period_places = self._places["internal_step"], [self._places[e.period] for e in events]
        self._offset_places = [(i, self._places[e.offset]) for i, e in enumerate(events) if e.offset is not None]
        self._noise_offset = len(self.u) - sum(s.width for s in system.noises)
        self._noise_counts = [width(event.noises) for event in events]
        self._read_timing()

    def reset(self) -> None:
        """Back to the start values of states, inputs and parameters, at time zero."""
        self.x[:] = self.system.start_state()
        self.u[:] = self.system.start_inputs()
        self.p[:] = self.system.start_parameters()
        self.t = self.t0 = 0.0
        self.ticks = [0] * len(self.ticks)
        self._read_timing()

    def start(self, t0: float) -> None:
        """Begin at `t0` [s] with the values that stand in `x`, `u`, `p`, and fire the events due there.

        Raises:
            ValueError: time cannot run with a parameter: the internal step, a period, an offset or the seed; or
                parameters or start values do not fulfil what the system requires.
        """
        self._choose_seed()
        self._check_timing()
        self._check_requirements()
        self.t = self.t0 = t0
        self.ticks = [0] * len(self.ticks)
        self._read_timing()
        self._fire_due()
        self.communicate()

    def advance(self, t_end: float) -> None:
        """Integrate to `t_end` [s] and fire the periodic events on the way and at the end.

        Raises:
            ChatteringError: a switch changes without end; states and time are those somewhere on the way.
        """
        tolerance = self._grid_tolerance + 4.0 * ulp(t_end)
        while self._due <= t_end + tolerance:
            self._integrate(self._due, self._grid_tolerance + 4.0 * ulp(self._due))
            self._fire_due()
        if t_end > self.t:
            self._integrate(t_end, tolerance)

    def next_instant_before(self, t_end: float) -> float | None:
        """The next periodic instant [s] that lies after now and before `t_end` [s], or None."""
        first = self.t + (self._grid_tolerance + 4.0 * ulp(self.t))
        return self._due if first < self._due < t_end - (self._grid_tolerance + 4.0 * ulp(t_end)) else None

    def communicate(self) -> None:
        """A communication step ends now: fire the communication events, in the declared order."""
        for event in self.system.communication_events:
            self._kernel.jump(event.name, self.t)

    def trigger(self, event: str) -> int:
        """Jump at a triggered event now, with the payload in `u`; returns what the system made of it
        (`hybrid.event`).
        """
        self._kernel.jump(event, self.t)
        place = self._verdicts.get(event, -1)
        return USED if place < 0 else round(float(self.x[place]))

    def update_outputs(self) -> np.ndarray:
        """Compute and return `y`, shape (q,)."""
        self.compute_outputs(self.t)
        return self.y

    def derivatives(self) -> np.ndarray:
        """Derivatives of the continuous states now, dry friction resolved, shape (nc,)."""
        signs = np.sign(self.x[self.system.friction_indices()]) if self.system.frictions else None
        return np.asarray(effective_flow(self.system, self.t, self.x, self.u, self.p, signs), dtype=float)

    def indicators(self) -> np.ndarray:
        """Event indicators, shape (len(frictions) + len(switchings),): how far each state with dry friction is from a
        change (its magnitude while it moves, the friction it has left at rest), then the switching functions."""
        system = self.system
        values = self.x[system.friction_indices()]
        now = (self.t, self.x, self.u, self.p)
        if len(values):
            flow = np.asarray(system.state_derivative(*now))[system.friction_indices()]
            left = np.asarray(system.friction_vector(*now)) - np.abs(flow)
            values = np.where(values == 0.0, left, np.abs(values))
        return np.concatenate([values, np.asarray(system.switching_vector(*now), dtype=float)])

    def snapshot(self) -> Snapshot:
        """A copy of everything that decides the future."""
        return Snapshot(self.memory.copy(), self.t, self.t0, tuple(self.ticks))

    def restore(self, snapshot: Snapshot) -> None:
        """Return to a snapshot, exactly."""
        self.memory[:] = snapshot.memory
        self.t, self.t0, self.ticks = snapshot.t, snapshot.t0, list(snapshot.ticks)
        self._read_timing()

    # -- internals --------------------------------------------------------------------------------------------------

    def _timing(self, name: str | None) -> float:
        return 0.0 if name is None else float(self.p[self._places[name]])

    def _choose_seed(self) -> None:
        """What is drawn follows from the parameter alone, which is saved and restored with the others."""
        if self.system.noises and self._timing("seed") == FROM_NAME:
            self.p[self._places["seed"]] = seed_of(RUN_SEED, self.name)

    def _check_timing(self) -> None:
        for name in ("internal_step", *(event.period for event in self.system.periodic_events)):
            if not 0.0 < self._timing(name) < inf:
                raise ValueError(self._illegal(name, "a positive number of seconds"))
        for event in self.system.periodic_events:
            if event.offset is not None and not isfinite(self._timing(event.offset)):
                raise ValueError(self._illegal(event.offset, "a finite number of seconds"))
        if self.system.noises and not is_seed(self._timing("seed")):
            raise ValueError(self._illegal("seed", f"{SEED_EXPECTED}, or {FROM_NAME} where it follows from the name"))

    def _check_requirements(self) -> None:
        broken = unfulfilled(self.system, self.p, self.x)
        if broken is not None:
            raise ValueError(f"{self.system.name}: time cannot run with these values: {broken}.")

    def _illegal(self, name: str, expected: str) -> str:
        return (
            f"{self.system.name}: time cannot run with parameter {name} = {self._timing(name)!r}; expected {expected}."
        )

    def _read_timing(self) -> None:
        """Fetch what stays fixed between events; parameters may have been set or restored."""
        parameter, ticks = self.p.item, self.ticks
        self._periods, self._offsets = list(map(parameter, self._period_places)), [0.0] * len(ticks)
        for i, place in self._offset_places:
            self._offsets[i] = parameter(place)
        self._instants = [0.0] * len(ticks)  # the next one of each periodic event
        for i in range(len(ticks)):
            self._instants[i] = self.t0 + self._offsets[i] + ticks[i] * self._periods[i]
        self._due = min(self._instants, default=inf)
        self._h = parameter(self._step_place)
        self._grid_tolerance = GRID_TOLERANCE * self._h

    def _fire_due(self) -> None:
        last, position = self.t + (self._grid_tolerance + 4.0 * ulp(self.t)), self._noise_offset
        for i, event in enumerate(self.system.periodic_events):
            if self._instants[i] <= last:
                for j in range(position, position + self._noise_counts[i]):
                    signal, seed = j - self._noise_offset, int(self._timing("seed"))
                    self.u[j] = standard_normal(seed, signal, self.ticks[i], self.system.purpose)
                self._kernel.jump(event.name, self.t)
                self.ticks[i] += 1
                self._instants[i] = self.t0 + self._offsets[i] + self.ticks[i] * self._periods[i]
            position += self._noise_counts[i]
        self._due = min(self._instants, default=inf)

    def _integrate(self, target: float, tolerance: float) -> None:
        """Move to `target` through whole cells of the grid, with a part of a cell at either end."""
        h = self._h
        self._kernel.divisions = 0
        if target - self.t <= tolerance:
            self.t = max(self.t, target)
            return
        cell = (self.t - self.t0) / h
        k = floor(cell + tolerance / h)
        if (cell - k) * h > tolerance:  # inside a cell: finish it, or stop within it
            boundary = self.t0 + (k + 1) * h
            if boundary >= target - tolerance:  # a target on the boundary but for rounding is the boundary
                self._kernel.grid_steps(self.t, 0, 1, (boundary if boundary <= target + tolerance else target) - self.t)
                self.t = target
                return
            self._kernel.grid_steps(self.t, 0, 1, boundary - self.t)
            k += 1
        whole = floor((target - self.t0) / h + tolerance / h) - k
        if whole > 0:
            self._kernel.grid_steps(self.t0, k, whole, h)
            k += whole
        rest = target - (self.t0 + k * h)
        if rest > tolerance:
            self._kernel.grid_steps(self.t0 + k * h, 0, 1, rest)
        self.t = target
