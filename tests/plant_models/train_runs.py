"""Runs of the multi-vehicle train that several tests share, in the runtime and as a reference solution by SciPy's
Radau.
"""

from __future__ import annotations

import casadi as ca
import numpy as np
from railway_runs import parameters, started
from scipy.integrate import solve_ivp

from plant_models.hybrid import Runtime, TracedSystem, scalar_names
from plant_models.railway.vehicle.train import Train

DELAY = 0.05  # [s], 5 readings of 10 ms
NO_DRAG = {
    "davis_a": 0.0,
    "davis_b": 0.0,
    "davis_c": 0.0,
    "wagon_davis_a": 0.0,
    "wagon_davis_b": 0.0,
    "wagon_davis_c": 0.0,
}
RIGID = {"wheel_inertia": 1e-3}  # wheels that turn with the locomotive: 0.01 kg of it


def start(train: Train, speed: float = 0.0, **changes: float) -> np.ndarray:
    """State of a train that rolls as one, with some values changed by name."""
    x = train.start_state()
    for name, value in {**train.rolling(speed), **changes}.items():
        x[scalar_names(train.states).index(name)] = value
    return x


def running(train: Train, speed: float = 0.0, effort: float = 0.0, brake: float = 0.0, **changes: float) -> Runtime:
    """A train in the runtime at time zero; changes of parameters by name."""
    return started(train, x0=start(train, speed), u0=[effort, brake], **changes)


def column(train: Train, name: str) -> int:
    """Place of an output in the vector of all."""
    return scalar_names(train.outputs).index(name)


def recorded(runtime: Runtime, times: np.ndarray) -> np.ndarray:
    """Outputs at the given times, shape (len(times), outputs)."""
    rows = np.empty((len(times), len(runtime.y)))
    for i, t in enumerate(times):
        runtime.advance(float(t))
        rows[i] = runtime.update_outputs()
    return rows


def followed(train: Train, x0: np.ndarray, phases: list, times: np.ndarray, **changes: float) -> np.ndarray:
    """States in the runtime at the times, inputs held over phases ``(end [s], (effort, brake))``, shape (len(times),
    n).
    """
    runtime = started(train, x0=x0, u0=phases[0][1], **changes)
    rows, remaining = [runtime.x.copy()], list(phases)
    for t in times[1:]:
        if t > remaining[0][0] + 1e-9:
            remaining.pop(0)
            runtime.u[:] = remaining[0][1]
        runtime.advance(float(t))
        rows.append(runtime.x.copy())
    return np.array(rows)


def reference(train: Train, x0: np.ndarray, phases: list, times: np.ndarray, **changes: float) -> np.ndarray:
    """The same by SciPy's Radau; the brake demand must be zero, or one and the same from the start on."""
    p, demand = parameters(train, **changes), phases[0][1][1]
    assert all(value[1] == demand for _, value in phases)
    arrivals = [(DELAY * i, phases[0][1]) for i in range(1, train.wagons + 1)] if demand else []
    rows, x, begin = [x0], np.array(x0), 0.0
    radau = _Radau(train, p)
    for i, (end, inputs) in enumerate([*arrivals, *phases]):
        x[train.continuous_count : train.continuous_count + 5 * i] = demand  # the wave has reached i vehicles more
        inside = times[(times > begin + 1e-9) & (times < end + 1e-9)]
        found = radau.solve(begin, end, x, np.array(inputs), np.append(inside, end))
        rows.extend(found[:-1])
        x, begin = found[-1].copy(), end
    return np.array(rows)


class _Radau:
    """Radau on the traced flow, cut where dry friction changes its mind (a state stops, or what is at rest is let go)
    and at the edges of zones."""

    def __init__(self, train: Train, p: np.ndarray) -> None:
        traced = TracedSystem(train)
        arguments = [ca.SX.sym(f"a{i}", *traced.derivative.size_in(i)) for i in range(5)]
        by_x = ca.densify(ca.jacobian(traced.derivative(*arguments), arguments[1][: train.continuous_count]))
        self._flow, self._by_x = traced.derivative, ca.Function("by_x", arguments, [by_x])
        self._balance, self._switching, self._p = traced.balance, train.switching_vector, p
        self._indices, self._count = train.friction_indices(), train.continuous_count

    def solve(self, t: float, end: float, x: np.ndarray, u: np.ndarray, at: np.ndarray) -> np.ndarray:
        rows = np.full((len(at), len(x)), np.nan)
        x, memory = x.copy(), x[self._count :]
        switches = np.where(self._switching(t, x, u, self._p) >= 0.0, 1.0, 0.0)
        while t < end:
            x = self._let_go(t, x, u, switches)
            sign = np.sign(x[self._indices])
            held = np.concatenate([sign, switches])

            def call(function: ca.Function, time: float, state: np.ndarray, *rest: np.ndarray) -> np.ndarray:
                whole = np.concatenate([state, memory])
                return np.asarray(function(time, whole, u, self._p, *rest))

            events = [self._event(call, j, held) for j in range(len(held))]
            found = solve_ivp(
                lambda time, state, s=held, c=call: c(self._flow, time, state, s).ravel(),
                (t, end),
                x[: self._count],
                jac=lambda time, state, s=held, c=call: c(self._by_x, time, state, s),
                method="Radau",
                rtol=1e-9,
                atol=1e-11,
                max_step=0.1,
                events=events,
                dense_output=True,
            )
            assert found.success, found.message
            inside = (at > t) & (at <= found.t[-1])
            if inside.any():
                rows[inside, : self._count] = found.sol(at[inside]).T
            t, x[: self._count] = float(found.t[-1]), found.y[:, -1]
            for j, hits in enumerate(found.t_events):
                if len(hits) and j >= len(sign):  # this edge, and those at the same place
                    switches = np.where(self._switching(t, x, u, self._p) >= -1e-9, 1.0, 0.0)
                elif len(hits) and sign[j] != 0.0:
                    x[self._indices[j]] = 0.0
        rows[:, self._count :] = memory
        return rows

    def _let_go(self, t: float, x: np.ndarray, u: np.ndarray, switches: np.ndarray) -> np.ndarray:
        """What is pushed by more than its friction gets a direction."""
        n, held = len(self._indices), np.concatenate([np.sign(x[self._indices]), switches])
        flows, frictions, _ = np.split(np.asarray(self._balance(t, x, u, self._p, held)).ravel(), [n, 2 * n])
        for i, flow, friction in zip(self._indices, flows, frictions, strict=True):
            if x[i] == 0.0 and abs(flow) >= friction * (1.0 - 1e-9) and flow != 0.0:
                x[i] = 1e-13 * np.sign(flow)
        return x

    def _event(self, call, j: int, held: np.ndarray):
        n = len(self._indices)

        def stops(_t, state):
            return state[self._indices[j]]

        def is_let_go(t, state):
            balance = call(self._balance, t, state, held).ravel()
            return abs(balance[j]) - balance[n + j]

        def passes(t, state):
            return call(self._balance, t, state, held).ravel()[n + j]

        event = passes if j >= n else is_let_go if held[j] == 0.0 else stops
        event.terminal = True  # type: ignore[attr-defined]
        event.direction = 1.0 - 2.0 * held[j] if j >= n else 1.0 if held[j] == 0.0 else -held[j]  # type: ignore[attr-defined]
        return event
