"""Operating points: states and inputs at which chosen derivatives vanish and chosen outputs have wanted values."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import scipy

from plant_models.hybrid import HybridSystem
from plant_models.interop.continuous_part import ContinuousPart, Values, known
from plant_models.interop.to_control import jacobians

RESIDUAL = 1e-8
"""Largest residual of a point that counts as found, relative to what the unknowns contribute to the equation."""


class OperatingPointError(ValueError):
    """No operating point was found; the message says which equation is left open."""


@dataclass(frozen=True)
class OperatingPoint:
    """A point in which a system stands still but for what may drift.

    Attributes:
        states, inputs, outputs: values by name. derivatives: of the states there, by name.
    """

    states: Mapping[str, float]
    inputs: Mapping[str, float]
    outputs: Mapping[str, float]
    derivatives: Mapping[str, float]


def operating_point(
    system: HybridSystem,
    x0: Values | None = None,
    u0: Values | None = None,
    *,
    hold: Sequence[str] = (),
    drift: Sequence[str] = (),
    find: Sequence[str] = (),
    outputs: Mapping[str, float] | None = None,
    preset: str | None = None,
    parameters: Mapping[str, float] | None = None,
    memory: Mapping[str, float] | None = None,
    t: float = 0.0,
) -> OperatingPoint:
    """Find a point where the continuous part of a system is in equilibrium, from a first guess, by Newton's method.

    A train that runs steadily: ``hold=("train_position", "train_speed"), drift=("train_position",), find=("effort",)``.

    Args:
        system: a traceable hybrid system. x0, u0: first guess of states and inputs, and the values of what is not
            sought.
        hold: states that keep their value of `x0`. drift: states that may change with time. find: inputs that are
            sought; the others keep their value of `u0`. outputs: wanted values.
        preset, parameters, memory: see `to_nonlinear_io`.

    Raises:
        ValueError: a name is unknown, or there are not as many unknowns as equations.
        OperatingPointError: there is no such point near the guess.
    """
    part = ContinuousPart(system, preset, parameters, memory)
    problem = _problem(part, *part.point(x0, u0), t, hold, drift, find, dict(outputs or {}))
    _check_count(problem)
    return _point(part, *problem.place(_solved(problem)), t)


@dataclass(frozen=True)
class _Problem:
    """The equations of an operating point in the unknowns z: states `unknown_x`, then inputs `unknown_u`."""

    part: ContinuousPart
    x: np.ndarray
    u: np.ndarray
    t: float
    unknown_x: list[int]
    unknown_u: list[int]
    still: list[int]
    rows: list[int]
    targets: np.ndarray

    @property
    def guess(self) -> np.ndarray:
        return np.concatenate([self.x[self.unknown_x], self.u[self.unknown_u]])

    @property
    def labels(self) -> list[str]:
        return [f"d {self.part.states[i]}/dt" for i in self.still] + [self.part.outputs[i] for i in self.rows]

    def place(self, z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        state, inputs = self.x.copy(), self.u.copy()
        state[self.unknown_x], inputs[self.unknown_u] = z[: len(self.unknown_x)], z[len(self.unknown_x) :]
        return state, inputs

    def residual(self, z: np.ndarray) -> np.ndarray:
        state, inputs = self.place(z)
        flow = np.asarray(self.part.derivative(self.t, state, inputs, self.part.parameters), dtype=float)
        y = np.asarray(self.part.output(self.t, state, inputs, self.part.parameters), dtype=float)
        return np.concatenate([flow[self.still], y[self.rows] - self.targets])

    def slope(self, z: np.ndarray) -> np.ndarray:
        A, B, C, D = jacobians(self.part, *self.place(z), self.t)
        flow = np.hstack([A[:, self.unknown_x], B[:, self.unknown_u]])
        y = np.hstack([C[:, self.unknown_x], D[:, self.unknown_u]])
        return np.vstack([flow[self.still], y[self.rows]])


def _problem(
    part: ContinuousPart,
    x: np.ndarray,
    u: np.ndarray,
    t: float,
    hold: Sequence[str],
    drift: Sequence[str],
    find: Sequence[str],
    wanted: Mapping[str, float],
) -> _Problem:
    name = part.system.name
    held, drifting = (_indices(names, part.states, f"{name}: state") for names in (hold, drift))
    return _Problem(
        part,
        x,
        u,
        t,
        unknown_x=[i for i in range(len(x)) if i not in held],
        unknown_u=_indices(find, part.inputs, f"{name}: input"),
        still=[i for i in range(len(x)) if i not in drifting],
        rows=_indices(list(wanted), part.outputs, f"{name}: output"),
        targets=np.array(list(wanted.values()), dtype=float),
    )


def _check_count(problem: _Problem) -> None:
    unknowns, equations = len(problem.guess), len(problem.labels)
    if unknowns != equations:
        raise ValueError(
            f"{problem.part.system.name}: {unknowns} unknowns (states not in hold, inputs in find) but {equations} "
            f"equations "
            f"(states not in drift, outputs); expected as many of one as of the other."
        )


def _solved(problem: _Problem) -> np.ndarray:
    found = problem.guess
    if not found.size:
        return found
    found = np.asarray(scipy.optimize.root(problem.residual, found, jac=problem.slope, tol=1e-13).x)
    _check_found(problem, found)
    return found


def _check_found(problem: _Problem, found: np.ndarray) -> None:
    residual = problem.residual(found)
    size = np.maximum(np.abs(problem.slope(found)) @ np.maximum(np.abs(found), 1.0), 1.0)
    missed = [i for i, r in enumerate(residual) if not abs(r) <= RESIDUAL * size[i]]
    if missed:
        text = ", ".join(f"{problem.labels[i]} is off by {residual[i]:.4g}" for i in missed)
        raise OperatingPointError(
            f"{problem.part.system.name}: no operating point found from this guess: {text}. Give a nearer guess in x0 "
            f"and u0, or "
            f"let a state drift; dry friction holds what stands at exactly zero."
        )


def _indices(names: Sequence[str], all_names: Sequence[str], what: str) -> list[int]:
    return [list(all_names).index(known(name, all_names, what)) for name in names]


def _point(part: ContinuousPart, x: np.ndarray, u: np.ndarray, t: float) -> OperatingPoint:
    def named(names: Sequence[str], values: np.ndarray) -> dict[str, float]:
        return dict(zip(names, map(float, values), strict=True))

    y, flow = part.output(t, x, u, part.parameters), part.derivative(t, x, u, part.parameters)
    return OperatingPoint(
        named(part.states, x),
        named(part.inputs, u),
        named(part.outputs, np.asarray(y)),
        named(part.states, np.asarray(flow)),
    )
