"""Initialisation: all components exchange inputs and outputs in Initialization Mode until nothing changes.

First they exchange plainly, which settles whatever holds a state somewhere. What does not settle so (an algebraic loop)
is searched for by Newton's method on the values that are fed back; setting inputs needs no saved states here.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from cosim.coupling.plan import Plan
from cosim.coupling.planned import PlannedComponent
from cosim.diagnostics.messages import OF_THE_RUN
from cosim.errors import RunError
from cosim.master.algorithms.acceleration import Newton
from cosim.master.algorithms.history import shown
from cosim.master.algorithms.links import interface, plan_links
from cosim.master.exchange import ExchangeAtInstant, ExchangeInInitialization

MAX_ROUNDS = 100
_PLAIN_ROUNDS = (10, 30)
"""Plain exchanges before Newton's method: as many as a chain of values that are fed back can be long, within these
bounds.
"""

_EXPLOSION = 100.0
"""Growth of the changes from one plain exchange to the next that is not waited out."""

TOLERANCE = 1e-12
"""A value that moves by less than this share of itself has settled: a few roundings of a double."""

_REFUSED = (
    f"{OF_THE_RUN}it refuses to be read between a set and its next step (FMI 2.0.5, 4.2.4), so outputs that follow an "
    "input at once show the mean of the input over the step"
)

_JUMP = 1e-6
"""What changes by more than this share of itself when initialisation ends has jumped."""


def initialise(plan: Plan, start_time: float, stop_time: float, initialised: Callable[[], None] = lambda: None) -> int:
    """Bring all components from instantiated to step mode.

    What jumps when initialisation ends (a sample taken at the start time) is passed on once more, so that the first row
    is consistent. Until then the targets of held signals know what was before the jump, those of fresh ones what is
    after it.

    Args:
        plan: prepared, components instantiated and start values set.
        start_time, stop_time: [s].
        initialised: called when Initialization Mode is over, before an input is set again.

    Returns:
        Number of exchange rounds it took.

    Raises:
        RunError: a component failed, or the exchange does not settle; the signals that still change are named.
    """
    for step in plan.steps:
        step.component.enter_initialization(start_time, stop_time)
    settling = _Settling(plan, leaving := ExchangeInInitialization(plan, start_time, stop_time))
    changing = settling.run()
    if changing:
        raise _changes_when_read(plan, start_time) or _unsettled(plan, changing, settling.residuals, start_time)
    _leave_initialization(plan, leaving)
    initialised()
    rounds = settling.rounds
    settling.exchange = exchange = ExchangeAtInstant(plan, start_time, stop_time)
    if settling.exchange_changes_feedback():
        settling.run()
    plan.begin_step()
    for step in plan.steps:
        if step.interpolator is not None:
            _begin_lines(exchange, step, start_time)
    return rounds


def _begin_lines(exchange: ExchangeAtInstant, step: PlannedComponent, start_time: float) -> None:
    """Where the lines of its inputs begin, and whether it may be set and read where its steps end: of a component that
    refuses that outputs show the mean.
    """
    assert step.interpolator is not None
    step.interpolator.prepare(start_time)
    passes = getattr(step.interpolator, "passes", None)
    if passes is None or not passes.any():
        return
    step.inputs.send()
    if not exchange.read_after_set(step):
        step.component.note(_REFUSED, "warning")
        passes[:] = False


def _leave_initialization(plan: Plan, exchange: ExchangeInInitialization) -> None:
    """All components into step mode, each with what the ones before it gave, and what jumped on the way noted."""
    plan.begin_step()
    for step in plan.steps:
        step.inputs.gather()
        if not exchange.has_left(step):
            step.inputs.send()
            step.component.exit_initialization()
            step.read()
    plan.note_jumps()
    for relay in plan.relays:
        relay()


class _Settling:
    """Exchanges until nothing changes.

    Exchanges as `exchange` does, which is set anew when Initialization Mode ends. After `run`, `rounds` says how many
    it took and `residuals` by how much what is fed back changed in each, as a share of its first size.
    """

    def __init__(self, plan: Plan, exchange: Callable[[], None]) -> None:
        self.plan, self.rounds, self.exchange = plan, 0, exchange
        self.residuals: list[float] = []
        self._columns = interface(plan_links(plan))
        self._jumps = ~plan.continuous[self._columns]
        self._size = np.ones(len(self._columns))
        self._best: tuple[np.ndarray, np.ndarray] | None = None
        self._newton: Newton | None = None

    def run(self) -> list[int]:
        """Exchange; returns the columns of the values that still change, none where all is well."""
        values, columns = self.plan.values, self._columns
        plain = min(max(_PLAIN_ROUNDS[0], len(columns) + 2), _PLAIN_ROUNDS[1])
        changed = np.ones(len(values), dtype=bool)
        if self._newton is not None:
            self._newton.begin(self._size)
        for self.rounds in range(1, MAX_ROUNDS + 1):
            previous = values.copy()
            self.exchange()
            changed = self._changed(previous)
            if not changed.any() and self.rounds > 1:
                return []
            if len(columns):
                with np.errstate(all="ignore"):
                    self._note(previous[columns], values[columns])
                    if self.rounds >= plain or self._newton is not None or self._explodes():
                        values[columns] = self._guess(previous[columns], values[columns])
        return [int(column) for column in np.flatnonzero(changed)]

    def exchange_changes_feedback(self) -> bool:
        """Exchange once; whether anything that is fed back was still changed by it."""
        previous = self.plan.values.copy()
        self.exchange()
        return bool(self._changed(previous, _JUMP)[self._columns].any())

    def _changed(self, previous: np.ndarray, tolerance: float = TOLERANCE) -> np.ndarray:
        values = self.plan.values
        size = np.maximum(np.abs(values), np.abs(previous))
        equal = (values == previous) | (np.isnan(values) & np.isnan(previous))
        with np.errstate(invalid="ignore"):
            settled = np.abs(values - previous) <= tolerance * size
        moved: np.ndarray = ~(equal | (settled & np.isfinite(size)))
        return moved

    def _note(self, z: np.ndarray, g: np.ndarray) -> None:
        if self.rounds == 1:
            return  # what was there before the first exchange means nothing
        if self.rounds == 2:
            size = np.maximum(np.abs(z), np.abs(g))
            self._size = np.where((size > 0.0) & np.isfinite(size), size, 1.0)
        change = float(np.nan_to_num(np.max(np.abs(g - z) / self._size), nan=np.inf, posinf=np.inf))
        if self._best is None or change < min(self.residuals):
            self._best = z, g
        self.residuals.append(change)

    def _explodes(self) -> bool:
        """Twice in a row the changes grew so much that no component should be asked for more of it."""
        return (
            len(self.residuals) > 2
            and self.residuals[-1] > _EXPLOSION * self.residuals[-2] > _EXPLOSION**2 * self.residuals[-3] > 0.0
        )

    def _guess(self, z: np.ndarray, g: np.ndarray) -> np.ndarray:
        """The next values to feed back; the search begins with the best ones of the plain exchange."""
        if self._newton is None:
            assert self._best is not None
            self._newton = Newton(len(z))
            self._newton.begin(self._size)
            z, g = self._best
        return np.where(self._jumps, g, self._newton.next(z, g))


def _unsettled(plan: Plan, changing: list[int], residuals: list[float], start_time: float) -> RunError:
    names = [plan.signals[i].name for i in changing]
    more = f" and {len(names) - 5} more" if len(names) > 5 else ""
    reason = (
        f"Initialisation at t = {start_time:g} s does not settle after {MAX_ROUNDS} exchanges; still changing: "
        f"{', '.join(names[:5])}{more}. Relative changes of what is fed back: {shown(residuals)}. Check the start "
        f"values; if it "
        "is an algebraic loop, whether its equations have a solution."
    )
    return RunError(reason, names[0].partition(".")[0], start_time)


def _changes_when_read(plan: Plan, start_time: float) -> RunError | None:
    """What to say of an output that two reads give two values of, with nothing set in between; None where all agree."""
    for step in plan.steps:
        step.read()
        first = step.outputs.copy()
        step.read()
        changed = np.flatnonzero((first != step.outputs) & ~(np.isnan(first) & np.isnan(step.outputs)))
        if changed.size:
            place, component = int(changed[0]), step.component.name
            reason = (
                f"Component '{component}' at t = {start_time:g} s: output {plan.signals[step.columns][place].name} has "
                f"another value each time it is read: {first[place]:.9g}, then {step.outputs[place]:.9g}, at one "
                "instant and with nothing set in between. No order of exchange settles that. Ask whoever made the "
                "component for one whose outputs change only with its inputs and its steps."
            )
            return RunError(reason, component, start_time)
    return None
