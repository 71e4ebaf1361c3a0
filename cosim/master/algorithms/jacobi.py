"""Jacobi: all components at once, every signal held but known lines. Threads, if wanted."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Any

from cosim.coupling.instants import followed
from cosim.coupling.plan import Plan
from cosim.master.algorithms.algorithm import Algorithm


class Jacobi(Algorithm):
    """All components are moved with the values of the start of the step.

    With threads the sealed FMUs step at the same time, since their C code runs outside Python's lock; blocks, and
    components whose `move` somebody took over (a watched plant, a receiver of balises), are moved by the calling thread
    in the order of the plan once the others have arrived. Results do not depend on the number of threads. FMI allows
    calls of different instances at the same time; an FMU that does not stand it needs ``threads = 1``.

    Args:
        plan: prepared, components initialised.
        threads: number of threads, at least 1.
    """

    name = "jacobi"

    def __init__(self, plan: Plan, threads: int = 1) -> None:
        super().__init__(plan)
        components = {step.component.name: step.component for step in plan.steps}
        every = frozenset(c.source_variable for c in plan.connections)
        plan.hold(every - followed(components, plan.connections))
        self.threads = threads
        self._pool = ThreadPoolExecutor(threads, "jacobi") if threads > 1 else None

    def advance(self, t: float, until: float) -> None:  # noqa: D102 - see Algorithm
        for step in self.plan.steps:
            step.prepare(t, until)
        if self._pool is not None:
            self._move_together(self._pool, t, until)
            return
        for step in self.plan.steps:
            step.move(t, until)

    def summary(self) -> Mapping[str, Any]:  # noqa: D102 - see Algorithm
        return {**super().summary(), "threads": self.threads}

    def close(self) -> None:  # noqa: D102 - see Algorithm
        if self._pool is not None:
            self._pool.shutdown()

    def _move_together(self, pool: ThreadPoolExecutor, t: float, until: float) -> None:
        """Everybody arrives or fails before the first failure in the order of the plan is raised."""
        # apart runs only the plain step of a sealed library: it touches its own instance and its own part of the values
        apart = [step.component.kind != "block" and not step.taken_over for step in self.plan.steps]
        futures: dict[int, Future[None]] = {}
        for place, step in enumerate(self.plan.steps):
            if apart[place]:
                futures[place] = pool.submit(step.move, t, until)
        failures = {place: future.exception() for place, future in futures.items()}
        for place, step in enumerate(self.plan.steps):
            if not apart[place]:
                failures[place] = _failure(step.move, t, until)
        first = next((failures[place] for place in sorted(failures) if failures[place] is not None), None)
        if first is not None:
            raise first


def _failure(move: Callable[[float, float], None], t: float, until: float) -> Exception | None:
    try:
        move(t, until)
    except Exception as error:
        return error
    return None
