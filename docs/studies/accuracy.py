"""How accurate the shipped plants are at an internal step: each against its own equations by SciPy at 1e-10, through
events.

`python docs/studies/accuracy.py` prints the table of `docs/reference/accuracy.md`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import casadi as ca
import numpy as np
from scipy.integrate import solve_ivp

from plant_models import PLANTS
from plant_models.hybrid import HybridSystem, Runtime, TracedSystem, scalar_names
from plant_models.railway.vehicle.train import Train

RTOL, ATOL = 1e-10, 1e-12
EQUAL_PLACE = 1e-9  # [m] or [s]; a switching function closer to zero than this at an event has changed its sign


@dataclass(frozen=True)
class Journey:
    """What a plant does: inputs that are held, start values and parameters by name, and what is looked at."""

    plant: str
    what: str
    stop: float
    read: tuple[str, ...]
    values: Mapping[str, float] = field(default_factory=dict)
    factors: tuple[float, ...] = (4.0, 2.0, 1.0, 0.5)


ROLLING = {"train_speed": 5.0, "wheel_rate": 5.0 / 0.575, "effort": 60e3}
PULLING = {**Train().rolling(10.0), "effort": 60e3, "zone_from[1]": 20.0, "zone_to[1]": 60.0}
SEEN = ("position", "speed", "wheel_speed")
JOURNEYS = (
    Journey(
        "locomotive",
        "60 kN from 5 m/s, two zones",
        30.0,
        SEEN,
        {**ROLLING, "zone_from[3]": 0.0, "zone_to[3]": 0.0, "zone_from[2]": 25.0, "zone_to[2]": 28.0},
    ),
    Journey(
        "locomotive",
        "60 kN from rest",
        30.0,
        SEEN,
        {"effort": 60e3, **{f"zone_{e}[{i}]": 0.0 for e in ("from", "to") for i in (1, 2, 3)}},
    ),
    Journey(
        "locomotive",
        "braked by 60 kN to a stop",
        30.0,
        SEEN,
        {
            "train_speed": 10.0,
            "effort": -60e3,
            "wheel_rate": 10.0 / 0.575,
            **{f"zone_{e}[{i}]": 0.0 for e in ("from", "to") for i in (1, 2, 3)},
        },
    ),
    Journey("train", "60 kN from 10 m/s, one zone", 8.0, (*SEEN, "coupler_force[1]"), PULLING),
    Journey("pendulum", "swings from 1 rad", 10.0, (), {"state": 1.0}),
    Journey("triangularisable_plant", "as printed", 10.0, ()),
    Journey("non_triangularisable_plant", "as printed", 10.0, ()),
)


def errors(journey: Journey, factors: tuple[float, ...] | None = None) -> list[dict[str, float]]:
    """Largest error of what is looked at, for each internal step: the shipped one times the factors.

    Returns:
        One dictionary for each factor: ``internal_step`` [s], then by output in its unit.
    """
    system = PLANTS[journey.plant]()
    at = np.linspace(0.0, journey.stop, 101)[1:]
    runtime = _prepared(system, journey)
    truth = _outputs(runtime, at, _Solved(system, runtime).states(at))
    names = journey.read or scalar_names(system.outputs)
    columns = [scalar_names(system.outputs).index(name) for name in names]
    found = []
    for factor in factors or journey.factors:
        runtime = _prepared(system, journey)
        step = system.internal_step * factor
        runtime.p[scalar_names(system.parameter_signals).index("internal_step")] = step
        worst = np.abs(_outputs(runtime, at, None) - truth).max(axis=0)[columns]
        found.append({"internal_step": step, **dict(zip(names, map(float, worst), strict=True))})
    return found


def _prepared(system: HybridSystem, journey: Journey) -> Runtime:
    runtime = Runtime(system)
    places = [(runtime.x, system.states), (runtime.u, system.inputs), (runtime.p, system.parameter_signals)]
    for values, signals in places:
        for i, name in enumerate(scalar_names(signals)):
            values[i] = journey.values.get(name, values[i])
    return runtime


def _outputs(runtime: Runtime, at: np.ndarray, states: np.ndarray | None) -> np.ndarray:
    """Outputs at the times, of given states or of what the runtime computes."""
    runtime.start(0.0)
    rows = []
    for i, t in enumerate(at):
        if states is None:
            runtime.advance(float(t))
        else:
            runtime.t, runtime.x[: states.shape[1]] = float(t), states[i]
        rows.append(runtime.update_outputs().copy())
    return np.array(rows)


class _Solved:
    """A plant in model exchange: SciPy between events, signs of dry friction and switches held, as an importer does."""

    def __init__(self, system: HybridSystem, runtime: Runtime) -> None:
        self._system, self._runtime = system, runtime
        traced = TracedSystem(system)
        self._derivative, self._balance = traced.derivative, traced.balance
        arguments = [ca.SX.sym(f"a{i}", *traced.derivative.size_in(i)) for i in range(5)]
        by_x = ca.jacobian(traced.derivative(*arguments), arguments[1][: system.continuous_count])
        self._jacobian = ca.Function("by_x", arguments, [ca.densify(by_x)])

    def states(self, at: np.ndarray) -> np.ndarray:
        """Continuous states at the times, shape (len(at), nc)."""
        count, t, x = self._system.continuous_count, 0.0, self._runtime.x[: self._system.continuous_count].copy()
        held = self._resolved(t, x, self._system.held_vector(t, self._whole(x), self._runtime.u, self._runtime.p))
        rows = np.empty((len(at), count))
        while t < at[-1]:
            found = self._piece(t, float(at[-1]), x, held)
            inside = (at > t) & (at <= found.t[-1])
            if inside.any():
                rows[inside] = found.sol(at[inside]).T
            t, x = float(found.t[-1]), found.y[:, -1].copy()
            if found.status == 1:
                x = self._settled(x, held, found.t_events)
                held = self._resolved(t, x, held)
        return rows

    def _piece(self, t: float, end: float, x: np.ndarray, held: np.ndarray) -> Any:
        stiff = self._system.method == "rosenbrock"
        options: dict[str, Any] = (
            {"jac": lambda s, y: np.asarray(self._call(self._jacobian, s, y, held))} if stiff else {}
        )
        return solve_ivp(
            lambda s, y: self._call(self._derivative, s, y, held).ravel(),
            (t, end),
            x,
            method="Radau" if stiff else "DOP853",
            rtol=RTOL,
            atol=ATOL,
            events=[self._event(j, held) for j in range(len(held))] or None,
            dense_output=True,
            max_step=0.25,
            **options,
        )

    def _whole(self, x: np.ndarray) -> np.ndarray:
        return np.concatenate([x, self._runtime.x[len(x) :]])

    def _call(self, function: ca.Function, t: float, x: np.ndarray, held: np.ndarray) -> np.ndarray:
        return np.asarray(function(t, self._whole(x), self._runtime.u, self._runtime.p, held))

    def _event(self, j: int, held: np.ndarray) -> Any:
        n, indices = len(self._system.frictions), self._system.friction_indices()

        def indicator(t: float, x: np.ndarray) -> float:
            if j < n and held[j] != 0.0:
                return float(held[j] * x[indices[j]])
            balance = self._call(self._balance, t, x, held).ravel()
            return float(balance[n + j] if j >= n else balance[n + j] - abs(balance[j]))

        indicator.terminal = True  # type: ignore[attr-defined]
        indicator.direction = 1.0 - 2.0 * held[j] if j >= n else -1.0  # type: ignore[attr-defined]
        return indicator

    def _settled(self, x: np.ndarray, held: np.ndarray, hits: Any) -> np.ndarray:
        """What has come to rest is at exactly zero."""
        for j, i in enumerate(self._system.friction_indices()):
            if len(hits[j]) and held[j] != 0.0:
                x[i] = 0.0
        return x

    def _resolved(self, t: float, x: np.ndarray, held: np.ndarray) -> np.ndarray:
        """Signs and switches after an event."""
        n, held = len(self._system.frictions), held.copy()
        if not len(held):
            return held
        held[n:] = self._call(self._balance, t, x, held).ravel()[2 * n :] >= -EQUAL_PLACE
        flows, frictions, _ = np.split(self._call(self._balance, t, x, held).ravel(), [n, 2 * n])
        for j, i in enumerate(self._system.friction_indices()):
            pushed = abs(flows[j]) > frictions[j] * (1.0 - EQUAL_PLACE) and flows[j] != 0.0
            held[j] = np.sign(x[i]) if x[i] != 0.0 else np.sign(flows[j]) if pushed else 0.0
        return held


def table() -> str:
    """The table of the page, one row for each journey and internal step."""
    lines = ["| plant | run | internal step [ms] | largest errors |", "|---|---|---|---|"]
    for journey in JOURNEYS:
        found = errors(journey)
        units = {n: s.unit for s in PLANTS[journey.plant]().outputs for n in s.scalar_names}
        for row in found:
            step = row["internal_step"]
            mark = " (shipped)" if step == PLANTS[journey.plant]().internal_step else ""
            values = {n: v for n, v in row.items() if n != "internal_step"}
            if not journey.read:
                name = max(values, key=lambda n: values[n])
                values = {name: values[name]}
            said = ", ".join(f"{n} {v:.1e} {units[n]}" for n, v in values.items())
            lines.append(f"| `{journey.plant}` | {journey.what} | {1e3 * step:g}{mark} | {said} |")
    return "\n".join(lines)


if __name__ == "__main__":
    print(table())
